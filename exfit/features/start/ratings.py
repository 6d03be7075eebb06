"""What is known of a unit beside its record: ratings, and how a phasor was recorded."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from math import sqrt
from typing import NamedTuple

from exfit.case.case_draft import CaseDraft, Noted, OpenValue
from exfit.case.suggestion import Base, rated_bases
from exfit.plants import KINDS
from exfit.records.inspection import Inspection
from exfit.records.units import scale_between

CONNECTIONS = ("phase-to-ground", "phase-to-phase")
ANGLE_UNITS = ("deg", "rad")
LIKE_RATED = (0.85, 1.15)  # of the rated voltage: where a unit rests on load


class StepUp(NamedTuple):
    """A step-up transformer: its impedance, pu of the machine, and the kV of its other side.

    The kV is None where the bus of the machine is that side.
    """

    r: float
    x: float
    kv: float | None


@dataclass(frozen=True)
class Ratings:
    """What is known of a unit; None is not known.

    ``ra`` is the resistance of its stator, ``compensation`` Rc and Xc of its load compensation, pu.
    """

    kv: float | None = None
    mva: float | None = None
    connection: str | None = None
    angle_unit: str | None = None
    f0: float | None = None
    step_up: StepUp | None = None
    ra: float | None = None
    compensation: tuple[float, float] | None = None

    def over(self, other: "Ratings") -> "Ratings":
        """Return these ratings, and those of another source where there is none."""
        own = {field.name: getattr(self, field.name) for field in fields(self)}
        return replace(other, **{name: value for name, value in own.items() if value is not None})

    def of_record(self, inspections: Sequence[Inspection]) -> "Ratings":
        """Return the ratings at the side of the step-up transformer where a voltage was recorded.

        Without a transformer in between, that is the machine's, and there is no ``step_up``.
        """
        level = _level_in_kv(inspections)
        behind = None if self.step_up is None else self.step_up.kv or self.kv
        at_machine = self.kv is not None and behind != self.kv and _rests_at(level, self.kv)
        if behind is None or at_machine or not _rests_at(level, behind):
            return replace(self, step_up=None)
        return replace(self, kv=behind)

    def bases(
        self, given: Mapping[str, Base], inspections: Sequence[Inspection]
    ) -> dict[str, Base]:
        """Return bases with those that the ratings give to signals that are not per unit."""
        bases = dict(given)
        for signal, base in rated_bases({}, self.kv, self.mva).items():
            channels = [own for each in inspections if (own := each.channel_of(signal)) is not None]
            units = [channel.unit for channel in channels if not channel.system_base]
            in_units = all(unit and scale_between(str(base.unit), unit) for unit in units)
            if in_units and len(units) == len(channels):
                bases.setdefault(signal, base)
        return bases


NO_RATINGS = Ratings()


def _level_in_kv(inspections: Sequence[Inspection]) -> float | None:
    """The voltage at rest of a record, kV; None where its unit is none of a voltage."""
    for inspection in inspections:
        channel = inspection.channel_of("vt")
        source = channel if inspection.pmu is None else inspection.pmu.voltage
        if source is not None and source.unit is not None:
            scale = scale_between(source.unit, "kV")
            if scale is not None:
                return source.level * scale
    return None


def _rests_at(level: float | None, kv: float) -> bool:
    low, high = LIKE_RATED
    if level is None:
        return False
    return low <= level / kv <= high or low <= level * sqrt(3.0) / kv <= high


def answered(
    draft: CaseDraft, ratings: Ratings, bases: Mapping[str, Base], inspections: Sequence[Inspection]
) -> CaseDraft:
    """Fill in the open values of a case that the ratings of its unit answer."""
    given: dict[OpenValue, str | float] = {}
    for value in draft.open_values():
        *_, section, key = ("", *map(str, value.place))
        answer: str | float | None = None
        if key == "connection":
            answer = ratings.connection
        elif key in ("kV", "MVA"):
            answer = ratings.kv if key == "kV" else ratings.mva
        elif key == "angle_unit" or (section, key) == ("angle", "unit"):
            answer = ratings.angle_unit
        elif (section, key) == ("network", "f0"):
            answer = ratings.f0
        elif section == "network" and key in ("P", "Q"):
            answer = _power(key.lower(), bases, inspections[0])
        if answer is not None:
            given[value] = answer
    return _with_network(draft.filled(given), ratings)


def _with_network(draft: CaseDraft, ratings: Ratings) -> CaseDraft:
    """Fill in what ratings tell of the network of a machine on load."""
    kind = KINDS.get(draft.kind_of_plant)
    if kind is None or not kind.on_load:
        return draft
    plant, known = draft.sections["plant"], dict[str, Noted]()
    if ratings.step_up is not None and kind.finds_rest:  # only events are behind one
        r, x, _ = ratings.step_up
        known["R"] = Noted(r, "pu, the step-up transformer's")
        known["X"] = Noted(x, "pu, the step-up transformer's: recorded behind it")
    if ratings.ra:
        known["Ra"] = Noted(ratings.ra, "pu, the stator's")
    for name, value in zip(("Rc", "Xc"), ratings.compensation or (), strict=False):
        known[name] = Noted(value, "pu, load compensation")
    plant = {**plant, "network": {**plant["network"], **known}}
    return replace(draft, sections={**draft.sections, "plant": plant})


def _power(signal: str, bases: Mapping[str, Base], inspection: Inspection) -> float | None:
    """The power at rest of a record, pu of a base in MVA."""
    channel, base = inspection.channel_of(signal), bases.get(signal)
    if channel is None or base is None or channel.unit is None:
        return None
    return float(f"{channel.level / base.in_unit(channel.unit, channel.name):.4g}")
