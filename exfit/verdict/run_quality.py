"""Whether a simulated run can be believed: rest that does not hold, voltages that no unit has.

And what its reader must know: typical values, the levels and the drift of its record.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from exfit.case.case import Case
from exfit.dsp.noise import drift_at_rest
from exfit.fitting.experiment import MASKED, Channel, ExperimentSetup
from exfit.fitting.system import typical_values_used
from exfit.plants import BREAKER, GOVERNOR, NETWORK, SPEED, acts_without_load
from exfit.records.record import Record
from exfit.results.cause import Cause
from exfit.results.comparisons import Comparison, Overlay
from exfit.signals import unit_of_signal
from exfit.simulation.inputs import Inputs
from exfit.simulation.limit_hits import limiter_actions
from exfit.simulation.simulator import Response, Simulator
from exfit.util.arrays import Array

Values = Mapping[str, float]

LEAST_GROWTH = 1e-3  # 1/s: what grows slower doubles in more than ten minutes
ROUNDING_OF_RATES = 1e-6  # of the fastest rate: by what rounding parts a double eigenvalue of zero
HIGHEST_VOLTAGE = 2.0  # pu: beyond it protection has tripped, and no curve of saturation holds
SWITCHINGS_LISTED = 5  # the first ones
GOVERNOR_ACTS = 0.2  # s after a load rejection: until then the mechanical power stays
FAR_FROM_BASE = 0.05  # of another signal: its base or the machine's data are others
LEAST_LEVEL = 0.1  # pu: below it a deviation is not relative to the level
INVISIBLE = 1e-7  # pu: no recorder shows it
TURNING = ("angle",)  # at rest, too, evenly
LARGEST_STEP_ERROR = 1e-4  # pu, or of the largest value of a signal that passes 1 pu


def state_of_rest_notes(simulator: Simulator, values: Values) -> Iterator[str]:
    """Note a governor that starts beyond a limit, and a rest that is unstable."""
    if any(name.startswith(GOVERNOR) for name in simulator.system.setpoints):
        from exfit.simulation.limits import governor_limits_passed  # only with a governor

        for name, limit, start, side in governor_limits_passed(simulator.system, values):
            yield (
                f"the unit starts at {start:.6g}, {side} {name} = {limit:.6g}, and is taken to be "
                "at rest on that limit"
            )
    rates = simulator.rates_at_rest(values)
    fastest = max(rates, key=lambda rate: float(rate.real), default=0.0)
    noise = ROUNDING_OF_RATES * max(map(abs, rates), default=0.0)
    growth = float(fastest.real)
    if growth <= max(LEAST_GROWTH, noise):
        return
    oscillation = abs(float(fastest.imag))
    value = f"{growth:.3g} ± {oscillation:.3g}j 1/s" if oscillation > 0.0 else f"{growth:.3g} 1/s"
    what = f"an oscillation of {oscillation / (2.0 * np.pi):.3g} Hz" if oscillation else "it"
    yield (
        f"unstable at rest: eigenvalue {value}: {what} grows e-fold in {1.0 / growth:.3g} s, also "
        "before the first step"
    )


def voltage_notes(case: Case, time: Array, vt: Array | None) -> Iterator[str]:
    """Note instants at which a simulated terminal voltage (M,) leaves the range of the models."""
    if vt is None or case.plant.type == "none":
        return
    beyond = np.abs(vt) > HIGHEST_VOLTAGE
    if np.any(beyond):
        first = int(np.argmax(beyond))
        worst = vt[int(np.nanargmax(np.abs(vt)))]
        yield (
            f"vt is beyond {HIGHEST_VOLTAGE:g} pu from "
            f"{time[first]:.4g} s on, {worst:.4g} pu at most: no unit stays in service there"
        )


def step_error_notes(
    case: Case, simulator: Simulator, values: Values, simulated: Mapping[str, Array]
) -> Iterator[str]:
    """Note the change of simulated signals (M,) by halving the step, where that is too much."""
    signals = [name for name in simulated if name in case.kind.signals]
    errors = simulator.step_errors(values, simulator.system.outputs)
    for signal in signals:
        size = max(1.0, float(np.max(np.abs(simulated[signal]))))
        if errors[signal] > LARGEST_STEP_ERROR * size:
            yield (
                f"halving the step of {simulator.step:g} s changes {signal} by "
                f"{errors[signal]:.1e} pu: {step_remedy(simulator)}"
            )


def step_remedy(simulator: Simulator) -> str:
    """What to do about a step that is too long; with located crossings it is the shortest one."""
    accuracy = simulator.accuracy
    if accuracy is None:
        return "reduce simulation.step"
    return f"no step reaches simulation.accuracy, {accuracy:g} pu"


def switching_notes(setup: ExperimentSetup) -> Iterator[str]:
    """Yield about which switchings in the grid a record is not compared."""
    if not setup.switchings:
        return
    jumps = ", ".join(
        f"{switching.signal} {switching.change:+.3g} {unit_of_signal(switching.signal)} at "
        f"{switching.at:.4g} s"
        for switching in setup.switchings[:SWITCHINGS_LISTED]
    )
    more = len(setup.switchings) - SWITCHINGS_LISTED
    others = f" and {more} more" if more > 0 else ""
    yield (
        f"{setup.record.source.name}: not compared {MASKED:g} s before and after switchings in the "
        f"grid: {jumps}{others}; record.switchings: compare keeps these samples"
    )


def unphysical_notes(case: Case, values: Mapping[str, float]) -> Iterator[str]:
    """Note values outside the range of their data sheet."""
    for name, row in case.rows().items():
        if not row.is_physical(values[name]):
            text = f"{name} = {values[name]:.4g} is not physical"
            yield f"{text}: its data sheet's range is {row.physical_range}"


def typical_notes(case: Case, values: Mapping[str, float]) -> Iterator[str]:
    """Note which of the values that act are typical: marked as such, or left out of the case."""
    used = typical_values_used(case)
    typical = {name: value for name, value in used.items() if values[name] == value}
    for part in case.parts.all:
        names = [symbol for symbol in part.symbols if part.prefix + symbol in typical]
        if names and part.values != "network":
            listed = ", ".join(f"{symbol} {typical[part.prefix + symbol]:g}" for symbol in names)
            yield f"typical values taken for {part.name}: {listed}"
    if not (case.on_load or case.kind.plays_back):
        added = [case.parts.stabiliser, case.parts.governor]
        added += [at.model for at in case.parts.limiters if not acts_without_load(at)]
        for model in added:
            if model is not None:
                yield f"{model.name} does not act: the breaker is open"


def speed_notes(inputs: Inputs, parameters: Mapping[str, float]) -> Iterator[str]:
    """Note for how long a simulated speed holds after a breaker has opened under power."""
    opened = [step.at for step in inputs.steps if step.signal == BREAKER]
    power = parameters.get(f"{NETWORK}P", 0.0)
    governed = any(name.startswith(GOVERNOR) for name in parameters)
    if not opened or power == 0.0 or SPEED in inputs.recorded or governed:
        return
    until = opened[0] + GOVERNOR_ACTS
    if inputs.end > until:
        yield (
            f"from {opened[0]:.6g} s on, speed and vt are those at constant mechanical power, "
            f"{power:g} pu, which is valid for some {GOVERNOR_ACTS:g} s: record the speed, or end "
            f"the window at {until:.4g} s"
        )


def simulation_notes(
    case: Case, simulator: Simulator, values: Mapping[str, float], response: Response
) -> Iterator[str]:
    """Note all that bears on a simulated response, by ``values`` of the case and of its test."""
    yield from typical_notes(case, values)
    yield from unphysical_notes(case, values)
    yield from speed_notes(simulator.inputs, values)
    yield from (action.sentence for action in limiter_actions(simulator, values))
    yield from state_of_rest_notes(simulator, values)
    yield from step_error_notes(case, simulator, values, response.signals)
    yield from voltage_notes(case, response.time, response.signals.get("vt"))
    delta = response.signals.get("delta")
    if delta is not None and np.max(np.abs(delta)) > np.pi:
        at = float(response.time[np.argmax(np.abs(delta) > np.pi)])
        yield f"the machine loses synchronism at {at:.3g} s: delta exceeds 180 degrees"


def rest_notes(setup: ExperimentSetup, comparison: Comparison) -> Iterator[str]:
    """Note contradictions of the steady part of a record with the case, and what is left out."""
    yield from switching_notes(setup)
    test = setup.test
    if test.steady is not None and test.begin is None:
        causes = unsteady_signals(setup.record, test.steady, setup.channels)
        yield from (cause.sentence for cause in causes)
        levels = other_levels(comparison.time, comparison.overlays, test.steady)
        yield from (cause.sentence for cause in levels)


def other_levels(
    time: Array, overlays: Mapping[str, Overlay], steady: float, far: float = FAR_FROM_BASE
) -> Iterator[Cause]:
    """Yield the signals that start elsewhere than their record over ``time`` (M,), ``far`` off."""
    for signal, overlay in overlays.items():
        levels = None if signal == "vt" else levels_at_rest(time, overlay, steady)
        if levels is None:
            continue
        measured, simulated = levels
        if abs(measured - simulated) > far * max(abs(simulated), LEAST_LEVEL):
            yield Cause(
                f"{signal} starts from {simulated:.4g} pu, its record from {measured:.4g} pu",
                "check its base, and the data and power of the machine in the case",
                signal,
            )


def levels_at_rest(
    time: Array, overlay: Overlay | None, until: float | None
) -> tuple[float, float] | None:
    """Levels of a signal before an instant (s), measured and simulated; None if unseen."""
    if overlay is None or until is None:
        return None
    before = (time < until) & np.isfinite(overlay.error)
    if not before.any():
        return None
    return float(np.mean(overlay.measured[before])), float(np.mean(overlay.simulated[before]))


def unsteady_signals(record: Record, steady: float, channels: Sequence[Channel]) -> Iterator[Cause]:
    """Yield the signals of a record that drift before the instant ``steady`` (s)."""
    smooth = {
        channel.signal: channel.filtering.smooth_over for channel in channels if channel.filtering
    }
    before = record.time < steady
    for signal, samples in record.signals.items():
        if signal in TURNING:
            continue
        at_rest = samples[before & np.isfinite(samples)]
        # averages over a window scatter little from each to the next: one of each window counts
        at_rest = at_rest[:: smooth.get(signal, 1)]
        drift = abs(drift_at_rest(at_rest))
        if drift > INVISIBLE:
            yield Cause(
                f"{signal} moves by {drift:.2g} {unit_of_signal(signal)} before {steady:g} s, "
                "where the record should be at rest",
                "the values that the fit starts from are uncertain",
                signal,
            )
