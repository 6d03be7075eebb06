"""Many searches in lock-step: each goes on as soon as what it asks for is answered.

What they ask for is answered together: the residuals at all their points in one call, their
Jacobians in another, factors of matrices as stacks. A search that ends leaves its place to the
next. Several threads each have some searches of their own, so that the Python of one runs beside
the machine code of another; a search goes the same way whatever others it is advanced with.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import islice
from math import ceil
from queue import Empty, SimpleQueue
from threading import Event, Lock, Thread
from typing import Any, Generic, TypeVar

import numpy as np

from exfit.estimate.problem import (
    Answer,
    Functions,
    JacobianAt,
    Request,
    ResidualsAt,
    SingularValuesOf,
    Steps,
    TriangleOf,
)
from exfit.util.arrays import Array
from exfit.util.processes import processors

Done = TypeVar("Done")

ABREAST = 128  # searches of a thread, so that most blocks of sets side by side are full
LISTENING = 0.1  # s: on Windows an interruption reaches only what returns from waiting


def finish(search: Steps[Done]) -> Done:
    """Run one search to its end.

    Raises KeyboardInterrupt where it was interrupted before it had anything to show.
    """
    ends: list[Done] = []
    Group(iter([(0, search)]), 1, lambda _, end: ends.append(end)).advance(Event())
    if not ends:
        raise KeyboardInterrupt
    return ends[0]


def finish_all(
    searches: Sequence[Steps[Done]],
    workers: int | None,
    receive: Callable[[int, Done], object],
) -> bool:
    """Advance all searches to their ends, in ``workers`` threads; return whether they got there.

    ``receive`` is called with the place of every search that has ended and what it came to, in the
    thread that waits here. KeyboardInterrupt, there or in a search, is thrown into those under way,
    whose ends are received as well; those not begun are dropped. Any other exception ends all and
    is raised. None takes as many threads as there are processors.
    """
    count = min(workers or processors(), len(searches))
    waiting, stop = Shared(enumerate(searches)), Event()
    if count <= 1:
        return Group(waiting, ABREAST, receive).advance(stop)
    ends: SimpleQueue[tuple[int, Done] | BaseException | None] = SimpleQueue()
    abreast = min(ABREAST, ceil(len(searches) / count))

    def work() -> None:
        group = Group(waiting, abreast, lambda place, end: ends.put((place, end)))
        try:
            ends.put(None if group.advance(stop) else KeyboardInterrupt())
        except BaseException as fault:  # raised again where the results are received
            ends.put(fault)

    threads = [Thread(target=work, daemon=True) for _ in range(count)]
    try:
        for thread in threads:
            thread.start()
    except KeyboardInterrupt:
        stop.set()
    working = sum(thread.ident is not None for thread in threads)
    fault: BaseException | None = None
    while working:
        try:
            end = next_of(ends)
            if isinstance(end, tuple):
                receive(*end)
                continue
            working -= 1
            if end is not None:
                raise end
        except KeyboardInterrupt:
            stop.set()
        except BaseException as error:
            fault = fault or error
            stop.set()
    if fault is not None:
        raise fault
    return not stop.is_set()


def next_of(ends: "SimpleQueue[Done]") -> Done:
    """Wait for the next end, open to interruptions."""
    while True:
        try:
            return ends.get(timeout=LISTENING)
        except Empty:
            continue


class Shared(Generic[Done]):
    """An iterator that several threads take from."""

    def __init__(self, items: Iterator[Done]) -> None:
        self._items, self._lock = items, Lock()

    def __iter__(self) -> Iterator[Done]:
        return self

    def __next__(self) -> Done:
        with self._lock:
            return next(self._items)


class Group(Generic[Done]):
    """Some searches advanced together, at most ``abreast`` at a time, in one thread."""

    def __init__(
        self,
        waiting: Iterator[tuple[int, Steps[Done]]],
        abreast: int,
        receive: Callable[[int, Done], object],
    ) -> None:
        self.waiting, self.abreast, self.receive = waiting, abreast, receive
        self.searches: dict[int, Steps[Done]] = {}
        self.requests: dict[int, Request] = {}

    def advance(self, stop: Event) -> bool:
        """Advance until all have ended; return whether they did so without interruption.

        What overflows on the way is not finite, and rejected: NumPy need not warn.
        """
        with np.errstate(all="ignore"):
            try:
                while True:
                    for place, search in islice(self.waiting, self.abreast - len(self.searches)):
                        self.searches[place] = search
                        self._send(place, None)
                    if not self.searches:
                        return True
                    for place, answer in answers(self.requests).items():
                        self._send(place, answer)
                    if stop.is_set():
                        raise KeyboardInterrupt
            except KeyboardInterrupt:
                for place, search in list(self.searches.items()):
                    with suppress(KeyboardInterrupt):  # one that has nothing to show
                        try:
                            search.throw(KeyboardInterrupt)
                        except StopIteration as end:
                            self._leave(place, end.value)
                return False

    def _send(self, place: int, answer: Answer | None) -> None:
        """Advance one search to its next request, or to its end."""
        search = self.searches[place]
        try:
            self.requests[place] = next(search) if answer is None else search.send(answer)
        except StopIteration as end:
            self._leave(place, end.value)

    def _leave(self, place: int, end: Done) -> None:
        """Hand over the end of a search, whose place is free then."""
        del self.searches[place]
        self.requests.pop(place, None)
        self.receive(place, end)


def answers(requests: Mapping[int, Request]) -> dict[int, Answer]:
    """Return the answers to all requests of one kind, in one call where they are for the same.

    Residuals come last: those of searches whose trial was rejected wait for those that first need a
    Jacobian, so that all trials go side by side.
    """
    for kind, answered in KINDS.items():
        some = {place: request for place, request in requests.items() if type(request) is kind}
        if some:
            return answered(some)
    raise TypeError(f"no request: {requests}")


def triangles(requests: Mapping[int, TriangleOf]) -> dict[int, Answer]:
    """Return R of each matrix."""
    answered: dict[int, Answer] = {}
    for places, matrices in stacks(requests):
        answered |= zip(places, np.linalg.qr(matrices, mode="r"), strict=True)
    return answered


def singular_values(requests: Mapping[int, SingularValuesOf]) -> dict[int, Answer]:
    """Return U, s and V' of each matrix."""
    answered: dict[int, Answer] = {}
    for places, matrices in stacks(requests):
        factors = np.linalg.svd(matrices, full_matrices=False)
        answered |= zip(places, zip(*factors, strict=True), strict=True)
    return answered


def stacks(
    requests: Mapping[int, TriangleOf] | Mapping[int, SingularValuesOf],
) -> Iterator[tuple[list[int], Array]]:
    """Yield the matrices of each shape as one stack, and whose they are."""
    shapes = defaultdict[tuple[int, ...], list[int]](list)
    for place, request in requests.items():
        shapes[request.matrix.shape].append(place)
    for places in shapes.values():
        yield places, np.stack([requests[place].matrix for place in places])


def jacobians(requests: Mapping[int, JacobianAt]) -> dict[int, Answer]:
    """Return the Jacobian at each point."""
    answered: dict[int, Answer] = {}
    for functions, places in by_functions(requests).items():
        points = [requests[place].point for place in places]
        answered |= zip(places, functions.jacobians(points), strict=True)
    return answered


def residuals(requests: Mapping[int, ResidualsAt]) -> dict[int, Answer]:
    """Return the residuals at the points of each request."""
    answered: dict[int, Answer] = {}
    for functions, places in by_functions(requests).items():
        points = [x for place in places for x in requests[place].points]
        each = iter(functions.residuals(points))
        answered |= {place: list(islice(each, len(requests[place].points))) for place in places}
    return answered


def by_functions(
    requests: Mapping[int, JacobianAt] | Mapping[int, ResidualsAt],
) -> dict[Functions, list[int]]:
    """Return whose requests are for the same functions."""
    groups = defaultdict[Functions, list[int]](list)
    for place, request in requests.items():
        groups[request.functions].append(place)
    return groups


KINDS: Mapping[type[Request], Callable[[Any], dict[int, Answer]]] = {
    TriangleOf: triangles,
    SingularValuesOf: singular_values,
    JacobianAt: jacobians,
    ResidualsAt: residuals,
}
