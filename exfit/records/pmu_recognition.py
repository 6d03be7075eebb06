"""Which columns of a file are those of a phasor measurement unit: phasors, frequency, flags."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, takewhile
from typing import NamedTuple

import numpy as np

from exfit.records.channel_names import KINDS, OF_SHUNT, folded, triples, words_of
from exfit.records.phasors import unit_by_range, wraps
from exfit.records.units import WORDS, bare, quantity_of, usual
from exfit.util.arrays import Array

# openPDC numbers its phasors: PM1, PA1; other programs say mag and ang, or M and A
MAGNITUDE = re.compile(
    r"(?<![a-z])pm(?=\d*$)|magnitude|mag(?![a-z])|amplitude|betrag|(?<=[^a-z])m$"
)
ANGLE = re.compile(
    r"(?<![a-z])pa(?=\d*$)|(?:phase[ _.-]?)?angle|winkel|ang(?![a-z])|phase$|(?<=[^a-z])a$"
    r"|(?<=[^a-z])(?:deg(?:rees)?|rad)$"
)
UNIT_IN_NAME = re.compile(r"(?<=[^a-z])(deg|rad)(?:rees|ians?)?$")
VOLTAGE = re.compile(r"(?:^|[^a-z])[vu](?:[abc1lp]{0,2}n?)(?![a-z])")
CURRENT = re.compile(r"(?:^|[^a-z])i(?:[abc1lp]{0,2}n?)(?![a-z])")
POSITIVE = re.compile(r"(?:^|[^a-z])(?:pos|positive|posseq|ps|[vui]1|[vui]p)(?![a-z0-9])")
FREQUENCY = re.compile(r"(?:^|[^a-z])(?:freq\w*|fq|f)(?![a-z])")
RATE = re.compile(r"rocof|d_?f(?:req)?_?/?_?dt|(?:^|[^a-z])d_?f(?:req)?(?![a-z])")
STATUS = re.compile(r"(?:^|[^a-z])(?:sf|stat(?:us)?\w*|flags?|quality)(?![a-z])")
ANGLE_UNITS = ("deg", "rad")
QUANTITIES = ("voltage", "current")
PAIR_OF_UNIT = 2  # phasors, its voltage and its current


@dataclass(frozen=True)
class InspectedPhasor:
    """A phasor in a file: of the positive sequence, or of three phases.

    ``unit`` and ``angle_unit`` are None where neither the file nor its numbers show them;
    ``angle_unit_from`` is the source: file, name or range. ``level`` is the median magnitude,
    ``wraps`` how often the angle jumps by a turn. ``rivals`` are phasors that may be meant as well.
    """

    quantity: str
    magnitudes: tuple[str, ...]
    angles: tuple[str, ...]
    unit: str | None
    angle_unit: str | None
    angle_unit_from: str
    level: float
    wraps: int
    rivals: tuple[str, ...] = ()


@dataclass(frozen=True)
class PmuContent:
    """What a file holds of a phasor measurement unit; ``frequency`` and others are columns."""

    voltage: InspectedPhasor
    current: InspectedPhasor | None
    frequency: str | None
    frequency_level: float | None
    rate: str | None
    status: str | None

    @property
    def columns(self) -> frozenset[str]:
        """The columns that are none of a bump test."""
        phasors = [phasor for phasor in (self.voltage, self.current) if phasor is not None]
        named = [name for phasor in phasors for name in (*phasor.magnitudes, *phasor.angles)]
        others = (self.frequency, self.rate, self.status)
        return frozenset((*named, *(name for name in others if name is not None)))


class _Pair(NamedTuple):
    """A magnitude and its angle, with what their names have in common."""

    key: str
    magnitude: str
    angle: str
    numbered: bool
    quantity: str | None


def pmu_content(
    samples: Mapping[str, Array], units: Mapping[str, str], names: Sequence[str]
) -> PmuContent | None:
    """Find the columns (M,) of a phasor measurement unit, None where there is no phasor.

    ``units`` are those of columns that have one, ``names`` all columns of the file.
    """
    pairs = _pairs([*samples], units)
    taken = {name for pair in pairs for name in (pair.magnitude, pair.angle)}
    if len(pairs) == PAIR_OF_UNIT and not any(pair.quantity for pair in pairs):
        # of two without names the steadier is the voltage
        steadier, other = sorted(pairs, key=lambda pair: _swing(samples[pair.magnitude]))
        pairs = [steadier._replace(quantity="voltage"), other._replace(quantity="current")]
    voltage = _phasor("voltage", pairs, samples, units, "")
    if voltage is None:
        return None
    current = _phasor("current", pairs, samples, units, voltage.magnitudes[0])
    others = [name for name in samples if name not in taken]
    frequency = _first([name for name in others if not RATE.search(folded(name))], FREQUENCY)
    return PmuContent(
        voltage,
        current,
        frequency,
        None if frequency is None else _level(samples[frequency]),
        _first(others, RATE),
        _first([name for name in names if name not in taken], STATUS),
    )


def _pairs(names: Sequence[str], units: Mapping[str, str]) -> list[_Pair]:
    """Find the magnitudes with their angles, each column in one pair."""
    pairs, paired = list[_Pair](), set[str]()
    for key, magnitude, angle, by_name in _found(names, units):
        if magnitude != angle and not paired & {magnitude, angle}:
            paired |= {magnitude, angle}
            numbered = by_name and "pm" in folded(magnitude)
            quantity = _quantity(magnitude, units.get(magnitude), numbered)
            pairs.append(_Pair(key, magnitude, angle, numbered, quantity))
    return pairs


def _found(names: Sequence[str], units: Mapping[str, str]) -> Iterator[tuple[str, str, str, bool]]:
    """Yield what names have in common that differ in the word for magnitude or angle alone.

    After these an angle, by its unit, right behind a voltage or a current.
    """
    electric = _electric(names, units)
    plain = {folded(bare(name)).strip(): name for name in electric}
    magnitudes = {key: name for name in names if (key := _key(name, MAGNITUDE, units))}
    angles = {key: name for name in names if (key := _key(name, ANGLE, units))}
    for key, angle in angles.items():
        if key in magnitudes or key in plain:
            yield key, magnitudes.get(key) or plain[key], angle, True
    for before, name in pairwise(names):
        if usual(units.get(name, "")) in ANGLE_UNITS and before in electric:
            yield folded(bare(before)), before, name, False


def _electric(names: Sequence[str], units: Mapping[str, str]) -> list[str]:
    """Return the columns of a voltage or a current by their units; mV are those of a shunt."""
    return [
        n for n in names if units.get(n) != OF_SHUNT and quantity_of(units.get(n)) in QUANTITIES
    ]


def _quantity(name: str, unit: str | None, numbered: bool) -> str | None:
    """Tell a voltage from a current by the unit or the name of a magnitude."""
    quantity = quantity_of(unit)
    if quantity in QUANTITIES or numbered:  # a number says nothing, the unit's name no more
        return quantity
    kinds = {KINDS.get(word) for word in words_of(bare(name))} & {*QUANTITIES}
    text = folded(bare(name))
    kinds |= {"voltage"} if VOLTAGE.search(text) else set()
    kinds |= {"current"} if CURRENT.search(text) else set()
    return str(*kinds) if len(kinds) == 1 else None


def _swing(samples: Array) -> float:
    level = _level(samples)
    return float(np.ptp(samples[np.isfinite(samples)])) / level if level > 0.0 else np.inf


def _key(name: str, part: re.Pattern[str], units: Mapping[str, str]) -> str | None:
    """Return a name without the word for its part of a phasor; None where it has none."""
    unit, text = units.get(name), folded(bare(name)).strip()
    fits = usual(unit or "deg") in ANGLE_UNITS
    if part is MAGNITUDE:
        fits = quantity_of(unit) in (*QUANTITIES, None)
    match = part.search(text)
    if not fits or match is None:
        return text if fits and part is ANGLE and unit is not None else None
    return re.sub(r"[^a-z0-9]+", " ", text[: match.start()] + " " + text[match.end() :]).strip()


def _phasor(
    quantity: str,
    pairs: Sequence[_Pair],
    samples: Mapping[str, Array],
    units: Mapping[str, str],
    beside: str,
) -> InspectedPhasor | None:
    """Return the phasor of a quantity: the positive sequence, else three phases, else the first.

    Of several the one whose name is most like ``beside`` comes first.
    """
    own = [pair for pair in pairs if pair.quantity == quantity]
    if not own:
        return None
    candidates = _candidates(own)
    chosen = max(candidates, key=lambda group: _alike(group[0].magnitude, beside))
    angles = [samples[pair.angle] for pair in chosen]
    unit, source = _angle_unit(chosen[0].angle, angles[0], units)
    stated = units.get(chosen[0].magnitude)
    return InspectedPhasor(
        quantity,
        tuple(pair.magnitude for pair in chosen),
        tuple(pair.angle for pair in chosen),
        None if stated is None else usual(stated),
        unit,
        source,
        _level(samples[chosen[0].magnitude]),
        0 if unit is None else wraps(angles[0], unit),
        tuple(group[0].magnitude for group in candidates if group is not chosen),
    )


def _candidates(pairs: Sequence[_Pair]) -> list[tuple[_Pair, ...]]:
    """Return the phasors of the positive sequence, else those of three phases, else all."""
    alone: list[tuple[_Pair, ...]] = [(pair,) for pair in pairs]
    positive = [group for group in alone if POSITIVE.search(folded(group[0].magnitude))]
    return positive or [*_groups(pairs)] or alone


def _alike(name: str, other: str) -> int:
    """Return with how many letters two names begin alike."""
    both = takewhile(lambda letters: letters[0] == letters[1], zip(name, other, strict=False))
    return len([*both])


def _groups(pairs: Sequence[_Pair]) -> Iterator[tuple[_Pair, ...]]:
    """Yield the three phases of one phasor; phasors that are only numbered are none."""
    by_key = {pair.key: pair for pair in pairs if not pair.numbered}
    used = set[str]()
    for key in by_key:
        for triple in triples(f" {key}", {f" {other}": other for other in by_key}):
            if not used & {*triple}:
                used |= {*triple}
                yield tuple(by_key[name] for name in triple)


def _angle_unit(name: str, angle: Array, units: Mapping[str, str]) -> tuple[str | None, str]:
    stated = units.get(name)
    if stated is not None and (usual(stated) in ANGLE_UNITS or stated in WORDS):
        return usual(stated), "file"
    named = UNIT_IN_NAME.search(folded(name).rstrip(")] "))
    if named is not None:
        return named[1], "name"
    unit = unit_by_range(angle)
    return unit, "" if unit is None else "range"


def _first(names: Sequence[str], words: re.Pattern[str]) -> str | None:
    return next((name for name in names if words.search(folded(bare(name)))), None)


def _level(samples: Array) -> float:
    present = samples[np.isfinite(samples)]
    return float(np.median(present)) if present.size else 0.0
