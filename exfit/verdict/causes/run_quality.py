"""Whether a simulated run can be believed: rest that does not hold, voltages that no unit has."""

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.fitting.recorded.switchings import MASKED
from exfit.fitting.setup import ExperimentSetup
from exfit.signals import unit_of_signal
from exfit.simulation.simulator import Simulator

Array = NDArray[np.float64]
Values = Mapping[str, float]

LEAST_GROWTH = 1e-3  # 1/s: what grows slower doubles in more than ten minutes
ROUNDING_OF_RATES = 1e-6  # of the fastest rate: by what rounding parts a double eigenvalue of zero
HIGHEST_VOLTAGE = 2.0  # pu: beyond it protection has tripped, and no curve of saturation holds
SWITCHINGS_LISTED = 5  # the first ones
LARGEST_STEP_ERROR = 1e-4  # pu, or of the largest value of a signal that passes 1 pu


def unstable_rest_notes(simulator: Simulator, values: Values) -> Iterator[str]:
    """Yield that what is at rest before the step does not stay there, by its fastest growth."""
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
        f"unstable at rest: eigenvalue {value}: {what} grows by e in {1.0 / growth:.3g} s, also "
        "before the first step"
    )


def voltage_notes(case: Case, time: Array, vt: Array | None, name: str = "") -> Iterator[str]:
    """Yield where a simulated terminal voltage (M,) passes what the models hold for.

    ``name`` is that of its record.
    """
    if vt is None or case.plant.type == "none":
        return
    beyond = np.abs(vt) > HIGHEST_VOLTAGE
    if np.any(beyond):
        first = int(np.argmax(beyond))
        worst = vt[int(np.nanargmax(np.abs(vt)))]
        yield (
            f"{f'{name}: ' if name else ''}vt is beyond {HIGHEST_VOLTAGE:g} pu from "
            f"{time[first]:.4g} s on, {worst:.4g} pu at most: no unit stays in service there"
        )


def step_error_notes(
    case: Case, simulator: Simulator, values: Values, simulated: Mapping[str, Array]
) -> Iterator[str]:
    """Yield by how much halving the step moves simulated signals (M,), where that is too much."""
    signals = [name for name in simulated if name in case.kind.signals]
    errors = simulator.step_errors(values, simulator.system.outputs)
    for signal in signals:
        size = max(1.0, float(np.max(np.abs(simulated[signal]))))
        if errors[signal] > LARGEST_STEP_ERROR * size:
            yield (
                f"halving the step of {case.simulation.step:g} s moves {signal} by "
                f"{errors[signal]:.1e} pu: reduce simulation.step"
            )


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
