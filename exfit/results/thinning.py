"""What of a fit's samples a file holds: of long ones their extremes, in nine digits."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.decimation import kept_rows
from exfit.fitting.uncertainty import Sensitivity, UncertaintyAnalysis
from exfit.results.comparisons import Comparison, IterationResponses, Overlay
from exfit.results.description import Behaviour, SmallSignalView
from exfit.results.model import FitResult
from exfit.results.other_values import AsFound
from exfit.results.played_records import LeftOut, PlayedRecord
from exfit.results.tables import DIGITS, clock_digits
from exfit.simulation.small_signal import Bode, SmallSignal
from exfit.util.sorting import distinct

if TYPE_CHECKING:
    from exfit.results.validation_result import ValidationResult

Array = NDArray[np.float64]

MOST_ROWS = 20_000  # of the samples of a comparison
MOST_NUMBERS = 100_000  # of the iterations' responses, and of the sensitivities of a signal
MOST_PLACES = 22  # a larger power of ten is no double
MOST_WHOLE = 2.0**53  # beyond it not every whole number is a double
POWERS = np.array([float(f"1e{k}") for k in range(MOST_PLACES + 1)])
MIDDLE = 1e-5  # of the last digit: what scaling by a power of ten may lose
MOST_RESPONSES = 12  # of iterations in one figure that can be distinguished


def thinned(result: FitResult) -> FitResult:
    """Return a fit with its samples as a file holds them."""
    count = len(result.history)
    return replace(
        result,
        comparisons=tuple(_comparison(match, count) for match in result.comparisons),
        validation=tuple(_comparison(match, count) for match in result.validation),
        phase_ends=tuple(
            replace(end, comparisons=tuple(_comparison(match, count) for match in end.comparisons))
            for end in result.phase_ends
        ),
        as_found=None if result.as_found is None else _as_found(result.as_found, count),
        knowledge=None if result.knowledge is None else _knowledge(result.knowledge),
        behaviour=None if result.behaviour is None else _behaviour(result.behaviour),
    )


def thinned_validation(result: "ValidationResult") -> "ValidationResult":
    """Return a validation with its samples as a file holds them."""
    return replace(
        result,
        matches=tuple(_comparison(match, 0) for match in result.matches),
        as_found=None if result.as_found is None else _as_found(result.as_found, 0),
        behaviour=None if result.behaviour is None else _behaviour(result.behaviour),
    )


def _as_found(unit: AsFound, count: int) -> AsFound:
    return replace(unit, comparisons=tuple(_comparison(match, count) for match in unit.comparisons))


def drawn_responses(responses: IterationResponses, iterations: int) -> IterationResponses:
    """Return the responses that one figure can show, of a history of so many lines.

    They lie denser at the start, where most of the way is made; the first and last are among them.
    """
    wanted = np.geomspace(1, max(iterations, 1), MOST_RESPONSES).round() - 1
    numbers = np.array(responses.numbers)
    nearest = np.argmin(np.abs(numbers[:, None] - wanted), axis=0)
    rows = distinct(nearest)
    return replace(
        responses,
        numbers=tuple(int(number) for number in numbers[rows]),
        samples=responses.samples[rows],
    )


def _comparison(comparison: Comparison, iterations: int) -> Comparison:
    signals = [
        samples
        for overlay in comparison.overlays.values()
        for samples in (
            overlay.measured,
            overlay.simulated,
            overlay.start,
            overlay.reference,
            overlay.error,
        )
        if samples is not None
    ]
    played = comparison.played
    if played is not None and signals:
        signals += [driving.samples for driving in played.driving.values()]
        signals += [signal.measured for signal in played.left_out.values()]
    rows = _rows(signals, MOST_ROWS) if signals else np.arange(0)
    responses = comparison.iteration_responses
    return replace(
        comparison,
        time=_instants(comparison.time, rows),
        overlays={
            signal: _overlay(overlay, rows) for signal, overlay in comparison.overlays.items()
        },
        iteration_responses=None if responses is None else _responses(responses, iterations),
        played=None if played is None else _played(played, rows),
    )


def _played(played: PlayedRecord, rows: NDArray[np.intp]) -> PlayedRecord:
    driving = {
        name: replace(signal, samples=rounded(signal.samples[rows]))
        for name, signal in played.driving.items()
    }
    left_out = {
        name: LeftOut(rounded(signal.measured[rows]), rounded(signal.simulated[rows]))
        for name, signal in played.left_out.items()
    }
    return replace(played, driving=driving, left_out=left_out)


def _overlay(overlay: Overlay, rows: NDArray[np.intp]) -> Overlay:
    return Overlay(
        rounded(overlay.measured[rows]),
        rounded(overlay.simulated[rows]),
        None if overlay.start is None else rounded(overlay.start[rows]),
        None if overlay.reference is None else rounded(overlay.reference[rows]),
    )


def _responses(responses: IterationResponses, iterations: int) -> IterationResponses:
    drawn = drawn_responses(responses, iterations)
    signals = [drawn.measured, *drawn.samples]
    rows = _rows(signals, MOST_NUMBERS // len(signals))
    return replace(
        drawn,
        time=_instants(drawn.time, rows),
        measured=rounded(drawn.measured[rows]),
        samples=np.stack([rounded(samples[rows]) for samples in drawn.samples]),
    )


def _knowledge(uncertainty: UncertaintyAnalysis) -> UncertaintyAnalysis:
    return replace(
        uncertainty, sensitivity=tuple(_sensitivity(channel) for channel in uncertainty.sensitivity)
    )


def _sensitivity(channel: Sensitivity) -> Sensitivity:
    signals = list(channel.moved.values())
    if not signals:
        return channel
    rows = _rows(signals, MOST_NUMBERS // len(signals))
    moved: Mapping[str, Array] = {name: rounded(line[rows]) for name, line in channel.moved.items()}
    return Sensitivity(channel.label, _instants(channel.time, rows), moved)


def _behaviour(behaviour: Behaviour) -> Behaviour:
    return replace(behaviour, small_signal=tuple(map(_small_signal, behaviour.small_signal)))


def _small_signal(of_tests: SmallSignalView) -> SmallSignalView:
    view = of_tests.view
    if view is None:
        return of_tests
    opened = None if view.open is None else _bode(view.open)
    rounded: SmallSignal = replace(view, closed=_bode(view.closed), open=opened)
    return replace(of_tests, view=rounded)


def _bode(bode: Bode) -> Bode:
    response = rounded(bode.response.real) + 1j * rounded(bode.response.imag)
    return Bode(rounded(bode.frequency), np.asarray(response, dtype=np.complex128))


def _rows(signals: Sequence[Array], most: int) -> NDArray[np.intp]:
    """Return the rows that are kept of signals (M,): of more than ``most`` the extremes."""
    return kept_rows(signals, max(1, most // (2 * len(signals))))


def _instants(time: Array, rows: NDArray[np.intp]) -> Array:
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
