"""Many searches in lock-step: what all of them ask for is answered side by side.

Each round answers one request of every search: the residuals of all in one call, the Jacobians of
all in another. A search that ends leaves its place to the next. Several threads each have some
searches of their own, so that the Python of one runs beside the machine code of another; a search
goes the same way whatever others it is advanced with.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import islice
from math import ceil
from queue import Empty, SimpleQueue
from threading import Event, Lock, Thread
from typing import Generic, TypeVar

from exfit.estimate.arrays import Array
from exfit.estimate.requests import Answer, Functions, JacobianAt, Request, ResidualsAt, Steps

Done = TypeVar("Done")

ABREAST = 32  # searches of a thread: two blocks of sets side by side
LISTENING = 0.1  # s: on Windows an interruption reaches only what returns from waiting


def finish(search: Steps[Done]) -> Done:
    """Return what one search comes to.

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
    count = min(workers or os.cpu_count() or 1, len(searches))
    waiting, stop = Shared(enumerate(searches)), Event()
    if count <= 1:
        return Group(waiting, ABREAST, receive).advance(stop)
    ends: SimpleQueue[tuple[int, Done] | BaseException | None] = SimpleQueue()

    def work() -> None:
        group = Group(waiting, abreast, lambda place, end: ends.put((place, end)))
        try:
            ends.put(None if group.advance(stop) else KeyboardInterrupt())
        except BaseException as fault:  # raised again where the results are received
            ends.put(fault)

    abreast = min(ABREAST, ceil(len(searches) / count))
    threads = [Thread(target=work, daemon=True) for _ in range(count)]
    try:
        for thread in threads:
            thread.start()
    except KeyboardInterrupt:
        stop.set()
    begun = sum(thread.ident is not None for thread in threads)
    return collect(ends, begun, receive, stop)


def collect(
    ends: "SimpleQueue[tuple[int, Done] | BaseException | None]",
    working: int,
    receive: Callable[[int, Done], object],
    stop: Event,
) -> bool:
    """Receive the ends of all threads; return whether none was interrupted."""
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
        """Advance until all have ended; return whether they did so without interruption."""
        try:
            while self.begin():
                for place, answer in answers(self.requests).items():
                    self.send(place, answer)
                if stop.is_set():
                    raise KeyboardInterrupt
        except KeyboardInterrupt:
            self.interrupt()
            return False
        return True

    def begin(self) -> bool:
        """Fill the places that are free; return whether there is anything to do."""
        for place, search in islice(self.waiting, self.abreast - len(self.searches)):
            self.searches[place] = search
            self.send(place, None)
        return bool(self.searches)

    def send(self, place: int, answer: Answer | None) -> None:
        """Advance one search to its next request, or to its end."""
        search = self.searches[place]
        try:
            self.requests[place] = next(search) if answer is None else search.send(answer)
        except StopIteration as end:
            self.leave(place, end.value)

    def leave(self, place: int, end: Done) -> None:
        """Hand over the end of a search, whose place is free then."""
        del self.searches[place]
        self.requests.pop(place, None)
        self.receive(place, end)

    def interrupt(self) -> None:
        """End all searches where they are; one that has nothing to show ends without a result."""
        for place, search in list(self.searches.items()):
            with suppress(KeyboardInterrupt):
                try:
                    search.throw(KeyboardInterrupt)
                except StopIteration as end:
                    self.leave(place, end.value)


def answers(requests: dict[int, Request]) -> dict[int, Answer]:
    """Return the answer to every request, those for the same functions in one call."""
    answered: dict[int, Answer] = {}
    residuals: dict[Functions, list[tuple[int, Sequence[Array]]]] = {}
    jacobians: dict[Functions, list[tuple[int, Array]]] = {}
    for place, request in requests.items():
        if isinstance(request, ResidualsAt):
            residuals.setdefault(request.functions, []).append((place, request.points))
        elif isinstance(request, JacobianAt):
            jacobians.setdefault(request.functions, []).append((place, request.point))
    for functions, wanted in residuals.items():
        each = iter(functions.residuals([x for _, points in wanted for x in points]))
        answered |= {place: list(islice(each, len(points))) for place, points in wanted}
    for functions, at in jacobians.items():
        each = iter(functions.jacobians([x for _, x in at]))
        answered |= {place: next(each) for place, _ in at}
    return answered
