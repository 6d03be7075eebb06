"""What of a fit's samples a file holds: of long ones their extremes, in nine digits."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.sampling import kept_rows
from exfit.fitting.uncertainty import Sensitivity
from exfit.results.comparisons import (
    AsFound,
    Comparison,
    IterationResponses,
    LeftOut,
    Overlay,
)
from exfit.results.description import Behaviour
from exfit.results.model import FitResult
from exfit.results.tables import DIGITS, clock_digits
from exfit.simulation.small_signal import Bode
from exfit.util.arrays import Array, distinct

if TYPE_CHECKING:
    from exfit.results.validation_result import ValidationResult

Rows = NDArray[np.intp]
Lines = TypeVar("Lines", Overlay, LeftOut)

MOST_ROWS = 20_000  # of the samples of a comparison
MOST_NUMBERS = 100_000  # of the iterations' responses, and of the sensitivities of a signal
MOST_PLACES = 22  # a larger power of ten is no double
MOST_WHOLE = 2.0**53  # beyond it not every whole number is a double
POWERS = np.array([float(f"1e{k}") for k in range(MOST_PLACES + 1)])
MIDDLE = 1e-5  # of the last digit: what scaling by a power of ten may lose
MOST_RESPONSES = 12  # of iterations in one figure that can be distinguished


def thinned(result: FitResult) -> FitResult:
    """Return a fit with its samples as a file holds them."""
    count, known = len(result.history), result.knowledge
    return replace(
        result,
        comparisons=_each(result.comparisons, count),
        validation=_each(result.validation, count),
        phase_ends=tuple(
            replace(end, comparisons=_each(end.comparisons, count)) for end in result.phase_ends
        ),
        as_found=_as_found(result.as_found, count),
        knowledge=known and replace(known, sensitivity=tuple(map(_sensitivity, known.sensitivity))),
        behaviour=_behaviour(result.behaviour),
    )


def thinned_validation(result: "ValidationResult") -> "ValidationResult":
    """Return a validation with its samples as a file holds them."""
    return replace(
        result,
        matches=_each(result.matches),
        as_found=_as_found(result.as_found),
        behaviour=_behaviour(result.behaviour),
    )


def _each(comparisons: Iterable[Comparison], iterations: int = 0) -> tuple[Comparison, ...]:
    return tuple(_comparison(match, iterations) for match in comparisons)


def _as_found(found: AsFound | None, iterations: int = 0) -> AsFound | None:
    return found and replace(found, comparisons=_each(found.comparisons, iterations))


def drawn_responses(responses: IterationResponses, iterations: int) -> IterationResponses:
    """Return the responses that one figure can show, of a history of so many lines.

    They lie denser at the start, where most of the way is made; the first and last are among them.
    """
    wanted = np.geomspace(1, max(iterations, 1), MOST_RESPONSES).round() - 1
    numbers = np.array(responses.numbers)
    nearest = np.argmin(np.abs(numbers[:, None] - wanted), axis=0)
    rows = distinct(nearest)
    return responses._replace(
        numbers=tuple(int(number) for number in numbers[rows]),
        samples=responses.samples[rows],
    )


def _comparison(comparison: Comparison, iterations: int) -> Comparison:
    """Thin the samples of a comparison, those of a played record with them."""
    signals = [
        samples
        for overlay in comparison.overlays.values()
        for samples in (*vars(overlay).values(), overlay.error)
        if samples is not None
    ]
    played, responses = comparison.played, comparison.iteration_responses
    if played is not None and signals:
        signals += [driving.samples for driving in played.driving.values()]
        signals += [signal.measured for signal in played.left_out.values()]
    rows = _rows(signals, MOST_ROWS) if signals else np.arange(0)
    if played is not None:
        driving = {
            name: signal._replace(samples=rounded(signal.samples[rows]))
            for name, signal in played.driving.items()
        }
        left_out = {name: _at(rows, signal) for name, signal in played.left_out.items()}
        played = replace(played, driving=driving, left_out=left_out)
    if responses is not None:
        responses = drawn_responses(responses, iterations)
        lines = [responses.measured, *responses.samples]
        at = _rows(lines, MOST_NUMBERS // len(lines))
        responses = responses._replace(
            time=_instants(responses.time, at),
            measured=rounded(responses.measured[at]),
            samples=np.stack([rounded(samples[at]) for samples in responses.samples]),
        )
    return replace(
        comparison,
        time=_instants(comparison.time, rows),
        overlays={signal: _at(rows, overlay) for signal, overlay in comparison.overlays.items()},
        iteration_responses=responses,
        played=played,
    )


def _at(rows: Rows, lines: Lines) -> Lines:
    """Return the samples of some rows of each line, as far as it has that line."""
    kept: dict[str, Any] = {
        k: line if line is None else rounded(line[rows]) for k, line in vars(lines).items()
    }
    return replace(lines, **kept)


def _sensitivity(channel: Sensitivity) -> Sensitivity:
    signals = list(channel.moved.values())
    if not signals:
        return channel
    rows = _rows(signals, MOST_NUMBERS // len(signals))
    moved: Mapping[str, Array] = {name: rounded(line[rows]) for name, line in channel.moved.items()}
    return Sensitivity(channel.label, _instants(channel.time, rows), moved)


def _behaviour(behaviour: Behaviour | None) -> Behaviour | None:
    """Round the responses over frequency."""
    if behaviour is None:
        return None
    views = []
    for of_tests in behaviour.small_signal:
        view = of_tests.view
        if view is not None:
            view = view._replace(closed=_bode(view.closed), open=view.open and _bode(view.open))
        views.append(of_tests._replace(view=view))
    return behaviour._replace(small_signal=tuple(views))


def _bode(bode: Bode) -> Bode:
    response = rounded(bode.response.real) + 1j * rounded(bode.response.imag)
    return Bode(rounded(bode.frequency), np.asarray(response, dtype=np.complex128))


def _rows(signals: Sequence[Array], most: int) -> Rows:
    """Return the rows that are kept of signals (M,): of more than ``most`` the extremes."""
    return kept_rows(signals, max(1, most // (2 * len(signals))))


def _instants(time: Array, rows: Rows) -> Array:
    return rounded(time[rows], clock_digits(time, DIGITS)) if len(rows) else time[rows]


def rounded(samples: Array, digits: int = DIGITS) -> Array:
    """Return samples (M,) as their text with so many significant digits reads back.

    A whole number over a power of ten is the double nearest to that text as long as both are exact;
    the others, and those next to the middle between two texts, go by way of the text.
    """
    size = np.abs(samples)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        places = np.nan_to_num(digits - 1.0 - np.floor(np.log10(size)), posinf=0.0, neginf=0.0)
        power = POWERS[np.minimum(np.abs(places), MOST_PLACES).astype(np.intp)]
        scaled = np.where(places < 0.0, samples / power, samples * power)
        whole = np.rint(scaled)
        rounded = np.where(places < 0.0, whole * power, whole / power)
        exact = (np.abs(places) <= MOST_PLACES) & (np.abs(whole) <= min(10.0**digits, MOST_WHOLE))
        doubtful = ~exact | (np.abs(np.abs(scaled - whole) - 0.5) < MIDDLE)
    for row in np.flatnonzero(doubtful & np.isfinite(samples)):
        rounded[row] = float(f"{samples[row]:.{digits}g}")
    return np.asarray(rounded)
