"""The signal of a column by what its numbers do, where its name does not say it.

A grid has 50 or 60 Hz, an angle integrates a frequency, three waveforms a third of a cycle apart
are the phases of a voltage, and the field winding ties its voltage and current to the terminal
voltage: T'd0 dE'q/dt = efd - ifd (IEEE 1110, the equation of the field circuit).
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import combinations, islice, permutations, product
from math import pi

import numpy as np

from exfit.dsp.quality import MOVES, mains_frequency, moves, noise_of
from exfit.records.channel_names import OF_SHUNT, Clarity, NameReading
from exfit.records.contradictions import LARGEST_STEP
from exfit.records.phasors import TURNS, unit_by_range
from exfit.records.steps import MOST_LEVELS
from exfit.records.units import quantity_of
from exfit.signals import OF_BUMP_TEST, SIGNALS
from exfit.util.arrays import Array, median

RATED_HZ = (50.0, 60.0)
LIKE_RATED = 0.005  # of the rated frequency: how near to it a grid rests
WITHIN_HZ = (40.0, 110.0)  # to overspeed after a load rejection
STEADIER = 1e-3  # of its level: the noise of a frequency is less
SAME_TURN = 0.03  # how far an angle may be from the integral of a frequency, in its slope
EXPLAINED = 0.99  # of what moves: a law that holds explains more
CERTAINLY_EXPLAINED = 0.999  # where no unit says that it is an angle
FEWEST = 40  # samples that show a law
MOST_SAMPLES = 2000  # that are enough for one
AT_REST = 0.05  # of a record, its first samples: a test begins at rest
MOST_COLUMNS = 7  # of which three are tried as those of the field
FIELD_RATE = (0.03, 1.5)  # 1/s: efd/efd0 - ifd/ifd0 moves vt/vt0 by this; 1/T'd0, more on load
APART = 5.0  # times the noise: relative changes of vt and ifd that are certainly not the same
JUMP = 0.5  # of all that it moves, between two samples: inertia allows no such move
MOST_PAIRS = 2000  # of an angle and a frequency that are tried
ALIKE = 4.0  # times what the best choice leaves unexplained: others that leave less may be meant
BALANCED = 0.1  # of their amplitude: how far phases may be from a balanced system
PHASES = 3


def readings_by_physics(
    time: Array,
    samples: Mapping[str, Array],
    units: Mapping[str, str],
    named: Mapping[str, NameReading],
) -> dict[str, NameReading]:
    """Read columns (M,) for the signals that they are by their numbers, beside their names.

    ``named`` has what the names show; a column that is by its name something else is left alone.
    """
    open_ones = [
        name
        for name, reading in named.items()
        if reading.clarity >= Clarity.QUANTITY and not reading.elsewhere
    ]
    shown = _of_field(time, samples, units, open_ones, named)
    rest = [name for name in open_ones if named[name].signal is None and name not in shown]
    shown |= dict(_turning(time, samples, units, rest, named))
    if any(reading.signal == "vref" for reading in named.values()):
        return shown
    jumping = [name for name in open_ones if name not in shown and _is_reference(samples[name])]
    for name in jumping if len(jumping) == 1 else ():
        what = "it jumps between levels without noise"
        question = f"is it the reference? {what[0].upper()}{what[1:]}"
        why = f"its shape: {what}"
        shown[name] = NameReading("vref", Clarity.UNIT, why, question=question)
    return shown


def _is_reference(samples: Array) -> bool:
    """Check for few levels near each other, as those of a number that is keyed in."""
    y = _present(samples)
    jumps = int(np.count_nonzero(np.diff(y)))
    small = float(np.ptp(y)) <= LARGEST_STEP * abs(float(median(y))) if len(y) else False
    return 0 < jumps < MOST_LEVELS and len(y) >= FEWEST and small


# ---- frequency and angle


def _turning(
    time: Array,
    samples: Mapping[str, Array],
    units: Mapping[str, str],
    names: Sequence[str],
    named: Mapping[str, NameReading],
) -> Iterator[tuple[str, NameReading]]:
    """Yield the frequency and the angle of a file among some names, where numbers show them."""
    near = _named_as(named, "frequency") or [
        name for name in names if _like_frequency(samples[name], units.get(name))
    ]
    angles = _named_as(named, "angle") or [
        name for name in names if quantity_of(units.get(name, "deg")) == "angle"
    ]
    for angle, other in _pairs(time, samples, angles, near):
        least = EXPLAINED if angle in units else CERTAINLY_EXPLAINED
        if unit := _integrates(time, samples[angle], samples[other], least):
            yield from _tied_pair(angle, other, unit, _hertz(samples[other]), names)
            return
    if near and near[0] in names:
        yield near[0], _frequency(samples[near[0]], units.get(near[0]), near[1:])
    yield from _angle_alone(samples, units, [name for name in angles if name in names])


def _pairs(
    time: Array, samples: Mapping[str, Array], angles: Sequence[str], near: Sequence[str]
) -> Iterator[tuple[str, str]]:
    """Yield so many pairs of an angle that moves beside a line, and what may be its frequency."""
    moving = [name for name in angles if near and _moves_beside_line(time, samples[name])]
    return islice(product(moving, near), MOST_PAIRS)


def _angle_alone(
    samples: Mapping[str, Array], units: Mapping[str, str], names: Sequence[str]
) -> Iterator[tuple[str, NameReading]]:
    """Yield the first column that is an angle by its unit, or by its turns."""
    for name in names:
        wrapped = _wrapped(samples[name])
        if wrapped or name in units:
            question = "" if name in units else "is it the angle? It jumps by a turn"
            why = "its unit" if name in units else "its turns"
            yield name, NameReading("angle", Clarity.UNIT, why, unit=wrapped, question=question)
            return


def _named_as(named: Mapping[str, NameReading], signal: str) -> list[str]:
    """Return the columns that are a signal by their names."""
    return [name for name, reading in named.items() if reading.signal == signal]


def _tied_pair(
    angle: str, frequency: str, unit: str, hertz: str, names: Collection[str]
) -> Iterator[tuple[str, NameReading]]:
    """Yield an angle and the frequency that it integrates, those of some names."""
    why = f"its physics: it integrates {frequency}"
    if angle in names:
        yield angle, NameReading("angle", Clarity.WORDS, why, unit=unit)
    why = f"its physics: {angle} integrates it"
    if frequency in names:
        yield frequency, NameReading("frequency", Clarity.WORDS, why, unit=hertz)


def _frequency(samples: Array, stated: str | None, rivals: Sequence[str]) -> NameReading:
    """Read a frequency by its level; it is asked for where no unit says so, or with rivals."""
    unit, level = _hertz(samples), f"{_at_start(samples):.5g}"
    others = "".join(f", or is {other}" for other in rivals)
    question = f"is it the frequency{others}? It rests at {level}, and its name does not say"
    if quantity_of(stated) == "frequency" and not rivals:
        question = ""
    why = f"its level: {level} {unit} at rest"
    return NameReading("frequency", Clarity.UNIT, why, unit=unit, question=question)


def _like_frequency(samples: Array, unit: str | None) -> bool:
    """Check for a level near 50 or 60 Hz, or 1 pu of them, held more steadily than all else."""
    y = _present(samples)
    if len(y) < FEWEST or quantity_of(unit) not in (None, "frequency") or unit == "%":
        return False
    level, rated = float(median(y)), 1.0 if unit == "pu" else _rated(float(median(y)))
    start = _at_start(y)
    low, high = WITHIN_HZ
    if quantity_of(unit) == "frequency":
        return low <= level <= high
    near = abs(start / rated - 1.0) < LIKE_RATED
    within = low / RATED_HZ[0] <= float(np.min(y)) / rated and float(np.max(y)) / rated <= 2.0
    return near and within and noise_of(y) < STEADIER * level and not _has_jumps(y)


def _at_start(samples: Array) -> float:
    """Level of the first samples (M,): a test begins at rest."""
    y = _present(samples)
    return float(median(y[: max(int(AT_REST * len(y)), FEWEST // 4)]))


def _has_jumps(samples: Array) -> bool:
    """Check for moves between two samples that inertia does not allow."""
    changes = np.abs(np.diff(samples))
    return float(np.max(changes)) > JUMP * float(np.ptp(samples)) > MOVES * noise_of(samples)


def _rated(level: float) -> float:
    return min((*RATED_HZ, 1.0), key=lambda rated: abs(level / rated - 1.0))


def _hertz(samples: Array) -> str:
    """Unit of a frequency by its level."""
    return "Hz" if _at_start(samples) > RATED_HZ[0] / 2.0 else "pu"


def _wrapped(samples: Array) -> str | None:
    """Return the unit of an angle (M,) that jumps by a turn and goes on, None for others."""
    y = _present(samples)
    unit = unit_by_range(y)
    if unit is None:
        return None
    jumps = np.abs(np.diff(y)) > 0.5 * TURNS[unit]
    changes = np.abs(np.diff(np.unwrap(y, period=TURNS[unit])))
    beside = float(np.max(changes[~jumps], initial=0.0))
    return unit if float(np.max(changes[jumps], initial=0.0)) <= 2.0 * beside else None


def _integrates(time: Array, angle: Array, frequency: Array, least: float) -> str | None:
    """Return the unit in which an angle (M,) integrates a frequency (M,), None where it does not.

    A straight line beside it is the rated frequency, which is not known so well.
    """
    whole = np.isfinite(angle) & np.isfinite(frequency)
    t, a, f = time[whole], _unwrapped(angle[whole]), frequency[whole]
    if len(t) < FEWEST:
        return None
    hertz = f if _hertz(f) == "Hz" else f * 60.0
    turns = np.concatenate([[0.0], np.cumsum(0.5 * (hertz[1:] + hertz[:-1]) * np.diff(t))])
    slope, explained, spread = _law(t, a, turns)
    if explained < least or spread < MOVES * noise_of(a):
        return None
    for name, turn in TURNS.items():
        for scale in (1.0, RATED_HZ[0] / RATED_HZ[1]) if hertz is not f else (1.0,):
            if abs(slope / (scale * turn) - 1.0) < SAME_TURN:
                return name
    return None


def _unwrapped(angle: Array) -> Array:
    """Unwrap an angle (M,) that its range shows to jump by turns."""
    unit = unit_by_range(angle)
    return np.unwrap(angle, period=TURNS[unit]) if unit else angle


def _moves_beside_line(time: Array, angle: Array) -> bool:
    """Check that an angle (M,) moves beside a straight line by more than its noise."""
    whole = np.isfinite(angle)
    a = _unwrapped(angle[whole])
    return len(a) >= FEWEST and _law(time[whole], a, a)[2] >= MOVES * noise_of(a)


def _law(time: Array, y: Array, x: Array) -> tuple[float, float, float]:
    """Fit y = a + b t + slope x, (M,) each.

    Returns the slope, the share of what the line leaves of y that x explains, and its spread.
    """
    along = time - np.mean(time)
    along /= np.linalg.norm(along)
    centred = (v - np.mean(v) for v in (y, x))
    beside_y, beside_x = (v - (along @ v) * along for v in centred)
    power = float(beside_x @ beside_x)
    total = float(beside_y @ beside_y)
    if power <= 0.0 or total <= 0.0:
        return 0.0, 0.0, 0.0
    slope = float(beside_x @ beside_y) / power
    left = beside_y - slope * beside_x
    return slope, 1.0 - float(left @ left) / total, float(np.ptp(beside_y))


# ---- the field


def _of_field(
    time: Array,
    samples: Mapping[str, Array],
    units: Mapping[str, str],
    names: Sequence[str],
    named: Mapping[str, NameReading],
) -> dict[str, NameReading]:
    """Read the columns that the field circuit ties as vt, efd and ifd; those named keep theirs."""
    own = {str(reading.signal): name for name, reading in named.items() if name not in names}
    free = [name for name in names if _moves(samples[name])][:MOST_COLUMNS]
    shares = {
        columns: _tied(time, *(samples[name] for name in columns))
        for columns in _choices(own, free)
        if _may_be(columns, units, named)
    }
    best = max(shares, key=lambda columns: shares[columns], default=None)
    if best is None or shares[best] < EXPLAINED:
        return {}
    left = ALIKE * (1.0 - shares[best])
    alike = [columns for columns, share in shares.items() if 1.0 - share < left]
    readings = (_tied_reading(k, best, alike) for k in range(len(OF_BUMP_TEST)))
    return {name: own for name, own in zip(best, readings, strict=True) if name in free}


def _tied_reading(k: int, best: Sequence[str], alike: Sequence[Sequence[str]]) -> NameReading:
    """Read a column of those that the field circuit ties, with others that may be meant."""
    signal, others = OF_BUMP_TEST[k], sorted({columns[k] for columns in alike} - {best[k]})
    why = "its physics: the field circuit ties vt, efd and ifd"
    if not others:
        return NameReading(signal, Clarity.WORDS, why)
    question = f"is it {signal}, or is {' or '.join(others)}? The field circuit fits either"
    return NameReading(signal, Clarity.UNIT, why, question=question)


def _choices(own: Mapping[str, str], free: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    """Yield columns for vt, efd and ifd: those named, and others in any order."""
    lacking = [signal for signal in OF_BUMP_TEST if signal not in own]
    for chosen in permutations(free, len(lacking)):
        columns = {**own, **dict(zip(lacking, chosen, strict=True))}
        vt, efd, ifd = (columns[signal] for signal in OF_BUMP_TEST)
        yield vt, efd, ifd


def _may_be(
    columns: tuple[str, str, str], units: Mapping[str, str], named: Mapping[str, NameReading]
) -> bool:
    """Check columns for the units of vt, efd and ifd, and for names that do not speak against."""
    for name, signal in zip(columns, OF_BUMP_TEST, strict=True):
        unit, reading = units.get(name), named[name]
        fits = quantity_of(unit) in (None, SIGNALS[signal].quantity) or unit == OF_SHUNT
        hints = reading.others or ((reading.signal,) if reading.signal else ())
        if not fits or (unit == OF_SHUNT and signal != "ifd") or (hints and signal not in hints):
            return False
    return True


def _tied(time: Array, vt: Array, efd: Array, ifd: Array) -> float:
    """Return the share of vt (M,) that the field circuit explains; 0 where it cannot be one.

    Beside it vt moves less than ifd for good: iron saturates, and on load more.
    """
    block = max(len(time) // MOST_SAMPLES, 1)
    whole = np.isfinite(vt) & np.isfinite(efd) & np.isfinite(ifd)
    t, *signals = (_block_means(values[whole], block) for values in (time, vt, efd, ifd))
    if len(t) < FEWEST:  # one column has hardly a sample, or has them where another has none
        return 0.0
    count = max(int(AT_REST * len(t)), FEWEST // 4)
    levels = [float(median(y[:count])) for y in signals]
    if any(abs(level) < 1e-12 for level in levels):
        return 0.0
    u, e, i = (y / level - 1.0 for y, level in zip(signals, levels, strict=True))
    drive = np.concatenate([[0.0], np.cumsum(0.5 * ((e - i)[1:] + (e - i)[:-1]) * np.diff(t))])
    slope, explained, _ = _law(t, u, drive)
    low, high = FIELD_RATE
    ends = [float(median(y[-count:])) for y in (u, i)]
    scatter = APART * (noise_of(u) + noise_of(i)) / np.sqrt(count)
    if not low <= slope <= high or abs(ends[0]) > abs(ends[1]) + scatter:
        return 0.0
    return explained


def _moves(samples: Array) -> bool:
    y = _present(samples)
    return len(y) >= FEWEST and moves(y)


def _present(samples: Array) -> Array:
    return np.asarray(samples[np.isfinite(samples)])


def _block_means(samples: Array, block: int) -> Array:
    whole = len(samples) // block * block
    return np.asarray(np.mean(samples[:whole].reshape(-1, block), axis=1))


# ---- three phases


def waveforms_apart(
    time: Array, samples: Mapping[str, Array], names: Collection[str]
) -> Iterator[tuple[str, ...]]:
    """Yield three waveforms (M,) of one amplitude that are a third of a cycle apart, in turn."""
    waves = {name: mains_frequency(time, samples[name]) for name in names}
    vectors = {}
    for name, frequency in waves.items():
        if frequency is not None:
            shift = np.exp(-2j * pi * np.median([f for f in waves.values() if f]) * time)
            vectors[name] = complex(2.0 * np.nanmean(samples[name] * shift))
    used = set[str]()
    turn = np.exp(-2j * pi / PHASES)
    for triple in combinations(vectors, PHASES):
        for order in (triple, (triple[0], triple[2], triple[1])):
            first, second, third = (vectors[name] for name in order)
            off = abs(second - first * turn) + abs(third - first * turn**2)
            if not used & {*triple} and off < 2.0 * BALANCED * abs(first):
                used |= {*triple}
                yield order
