"""What kind of test a record holds, and by what it shows: bump test, event, governor test, rest."""

from collections.abc import Mapping
from math import isfinite
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from exfit.dsp.quality import moves, present_median
from exfit.signals import COMPARED, FIELDS, OF_BUMP_TEST
from exfit.util.arrays import Array, median, median_step

if TYPE_CHECKING:
    from exfit.records.channel_inspection import InspectedChannel
    from exfit.records.inspection import Inspection
    from exfit.records.steps import RecordedStep

BUMP, EVENT, REJECTION, STEADY = "bump test", "grid event", "load rejection", "steady point"
REFERENCE = "step of the governor's reference"
INJECTION = "signal injected into the governor"
ISOLATED_LOAD = "step of load on an isolated unit"
FOLLOWING = "governor that follows the grid"
OF_GOVERNOR = (REFERENCE, INJECTION, ISOLATED_LOAD, FOLLOWING)
BETWEEN_CHANGES = 0.2  # s: so long a change is above the noise, and no drift
ABOVE_NOISE = 5.0  # times the noise of p: then it moves
CERTAINLY = 0.3  # correlation of the changes of q and vt: whose sign counts
CLOSELY = 0.8  # and what it is by a reference, while the frequency moves, too
OF_GRID = 5e-4  # pu: what the frequency of a grid event moves by; less is a unit's swing
OF_ISOLATED = 5e-3  # pu: so far the speed of a unit in a grid hardly moves
AT_ONCE = 0.5  # s: so soon p follows a load, and no gate yet
SMALL = 2e-3  # of its level: what moves less is at rest
AT_REST = (*COMPARED, "frequency")  # what a steady point holds
BY_REFERENCE = "a step of the reference raises both"


class KindOfTest(NamedTuple):
    """The kind of a test and why it is this one; with a "?" it is to be confirmed."""

    name: str
    why: str

    @property
    def sure(self) -> bool:
        """Whether nothing speaks for another kind."""
        return "?" not in self.why


def kind_of(record: "Inspection") -> KindOfTest:
    """Find the kind of test that a record holds by what moves in it, and what moves first."""
    if record.plays_in:
        return KindOfTest(EVENT, "a play-in file holds what drives a unit")
    if record.pmu is not None:
        return KindOfTest(EVENT, "phasors of a measurement unit")
    if record.opening is not None:
        doubt = "" if record.opening.jump is None else "; or is it a grid event?"
        return KindOfTest(REJECTION, record.opening.shown + doubt)
    signals = {
        str(each.signal): record.samples[each.name]
        for each in record.channels
        if each.signal is not None and not each.frequency
    }
    of_governor = _of_governor(record, signals)
    if of_governor is not None:
        return of_governor
    if record.reference is not None:
        return KindOfTest(BUMP, f"{record.reference.name}, the reference, moves")
    if not record.steps and not record.phases and _at_rest(record, signals):
        return KindOfTest(STEADY, "nothing moves beyond its noise")
    return _by_what_moves(record, signals)


def _of_governor(record: "Inspection", signals: Mapping[str, Array]) -> KindOfTest | None:
    """Tell a test of the governor: by its recorded input, or by a gate that moves for good."""
    names = {str(each.signal): each.name for each in record.channels if each.signal}
    for signal, kind in (("pref", REFERENCE), ("fs", INJECTION)):
        if any(names.get(signal) in step.sizes for step in record.steps):
            return KindOfTest(kind, f"{names[signal]} moves")
    step = next((each for each in record.steps if names.get("gate") in each.sizes), None)
    turning = next((each for each in ("speed", "frequency") if each in signals), None)
    if step is None or turning is None or "p" not in signals:
        return None
    return _by_gate(record, signals, names, step, turning)


def _by_gate(
    record: "Inspection",
    signals: Mapping[str, Array],
    names: Mapping[str, str],
    step: "RecordedStep",
    turning: str,
) -> KindOfTest:
    """Tell what moves a gate: its reference, a load that steps, or the speed of a grid."""
    gate, speed, power = names["gate"], names[turning], names["p"]
    moved = _range_pu(signals[turning])
    if moved < OF_GRID:
        doubt = "or was a signal added to the speed that the governor measures?"
        return KindOfTest(REFERENCE, f"{gate} and {power} move, {speed} rests; {doubt}")
    early, lasting = _soon_after(record, step, "p"), step.sizes.get(power, 0.0)
    of_gate = _soon_after(record, step, "gate") / step.sizes[gate]
    leads = early * lasting > 0.5 * lasting**2 and of_gate < 0.5
    if leads and _together(record.time, signals[turning], signals["gate"]) < CERTAINLY:
        doubt = "" if moved > OF_ISOLATED else "; or is it a grid event?"
        return KindOfTest(ISOLATED_LOAD, f"{power} steps, {speed} and {gate} follow{doubt}")
    if {"vt", "angle"} <= signals.keys() or {"vt", "frequency"} <= signals.keys():
        return KindOfTest(EVENT, f"{gate} follows {speed}, which moves with the grid")
    return KindOfTest(FOLLOWING, f"{gate} follows {speed}, which moves with the grid")


def _soon_after(record: "Inspection", step: "RecordedStep", signal: str) -> float:
    """Change of a signal from before a step to just after it, in the unit of its channel."""
    channel = record.channel_of(signal)
    if channel is None:
        return 0.0
    time, samples = record.time, record.samples[channel.name]
    begin, end = step.at - step.error, step.at + step.error
    before = samples[(time < begin) & (time >= begin - 4.0 * AT_ONCE)]
    after = samples[(time > end) & (time <= end + AT_ONCE)]
    change = present_median(after) - present_median(before)
    return change if isfinite(change) else 0.0


def _at_rest(record: "Inspection", signals: Mapping[str, Array]) -> bool:
    watched = [signals[name] for name in AT_REST if name in signals]
    return not any(
        map(_leaves_rest, watched or (record.samples[each.name] for each in record.channels))
    )


def _leaves_rest(samples: Array) -> bool:
    """Check whether a signal (M,) moves beyond its noise and beyond what any unit does at rest."""
    y = samples[np.isfinite(samples)]
    if len(y) < 4:
        return False
    return moves(y) and float(np.ptp(y)) > SMALL * abs(float(median(y)))


def _by_what_moves(record: "Inspection", signals: Mapping[str, Array]) -> KindOfTest:
    """Tell a step of the reference from a grid that moves, by vt beside q and the frequency."""
    names = {str(each.signal): each.name for each in record.channels if each.signal}
    together = _together(record.time, signals.get("vt"), signals.get("q"))
    if together < -CERTAINLY:
        why = f"{names['q']} falls where {names['vt']} rises: the grid moves, not the reference"
        return KindOfTest(EVENT, why)
    if _swings(record, signals):
        return KindOfTest(EVENT, f"{names['p']} moves more than {names['q']}, as behind a loss")
    lasts = any(names.get("vt") in step.sizes for step in record.steps)
    if together > _least_together(signals, lasts) and (lasts or "angle" not in signals):
        return KindOfTest(BUMP, f"{names['q']} moves with {names['vt']}: {BY_REFERENCE}")
    on_load = bool({"p", "q"} & signals.keys())
    if record.steps and "vt" in signals and not on_load:
        seen = " and ".join(filter(None, map(names.get, OF_BUMP_TEST)))
        return KindOfTest(BUMP, f"{seen} move, and no channel is known for power")
    return _by_frequency(names, signals, on_load) or KindOfTest(
        BUMP,
        f"{'a step' if record.steps else 'no step in any channel'}; or is it a grid event, or a "
        f"steady point? {_lacking(names)}".strip(),
    )


def _swings(record: "Inspection", signals: Mapping[str, Array]) -> bool:
    """Check whether p moves more than q, which a step of the reference does not do."""
    active, reactive = record.channel_of("p"), record.channel_of("q")
    if not {"vt", "frequency"} <= signals.keys():
        return False
    if active is None or reactive is None or _scale(active) != _scale(reactive):
        return False
    of_p, of_q = (_changes(record.time, record.samples[each.name]) for each in (active, reactive))
    least = max(np.nansum(of_q**2), len(of_p) * (ABOVE_NOISE * active.noise) ** 2)
    return float(np.nansum(of_p**2)) > least


def _scale(power: "InspectedChannel") -> str:
    """The prefix of the unit of a power: M of MW and of Mvar; pu."""
    return (power.unit or "").removesuffix("W").removesuffix("var")


def _by_frequency(
    names: Mapping[str, str], signals: Mapping[str, Array], on_load: bool
) -> KindOfTest | None:
    """Suppose a grid event where a frequency or an angle moves and nothing else is known."""
    moved = _range_of_frequency(signals)
    if on_load and "vt" in signals and ("angle" in signals or moved > OF_GRID):
        why = f"{names.get('angle') or names['frequency']} moves with the power"
        return KindOfTest(EVENT, f"{why}; or is it a bump test? {_lacking(names)}".strip())
    if moved > OF_GRID and not on_load and not {*FIELDS} & signals.keys():
        why = f"{names['frequency']} moves by {moved:.2g} pu"
        return KindOfTest(EVENT, f"{why}; or is it a bump test?")
    return None


def _least_together(signals: Mapping[str, Array], lasts: bool) -> float:
    """Return by how much q follows vt where a reference moves both; ``lasts`` of a step of vt."""
    return CLOSELY if _range_of_frequency(signals) > OF_GRID and not lasts else CERTAINLY


def _range_of_frequency(signals: Mapping[str, Array]) -> float:
    return _range_pu(signals["frequency"]) if "frequency" in signals else 0.0


def _lacking(names: Mapping[str, str]) -> str:
    lacking = [signal for signal in ("vt", "q") if signal not in names]
    return f"No channel is known for {' and '.join(lacking)}" if lacking else ""


def _range_pu(frequency: Array) -> float:
    """Range of a frequency (M,), pu of its median; 0 within its noise."""
    y = frequency[np.isfinite(frequency)]
    level = abs(float(median(y))) or 1.0
    return float(np.ptp(y)) / level if moves(y) else 0.0


def _changes(time: Array, samples: Array) -> Array:
    """Changes of a signal (M,) over BETWEEN_CHANGES."""
    apart = max(round(BETWEEN_CHANGES / median_step(time)), 1)
    return np.asarray(samples[apart:] - samples[:-apart])


def _together(time: Array, vt: Array | None, q: Array | None) -> float:
    """Correlation of the changes of vt and q (M,); 0 without both, or where they rest."""
    if vt is None or q is None:
        return 0.0
    of_vt, of_q = (_changes(time, samples) for samples in (vt, q))
    both = np.isfinite(of_vt) & np.isfinite(of_q)
    power = float(of_vt[both] @ of_vt[both]) * float(of_q[both] @ of_q[both])
    return float(of_vt[both] @ of_q[both]) / power**0.5 if power > 0.0 else 0.0
