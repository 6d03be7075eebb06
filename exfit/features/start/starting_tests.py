"""The tests of a new case: what was done, as far as it is given, and how each one counts."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import copysign
from types import MappingProxyType

import numpy as np

from exfit.case.schema import SINGLE
from exfit.case.suggestion import Base
from exfit.dsp.noise import NEIGHBOURS, noise
from exfit.errors import ExfitError, FileError
from exfit.records.contradictions import (
    LARGEST_STEP,
    direction_by_others,
    sign_disputed_by,
    size_in_words,
)
from exfit.records.inspection import Inspection
from exfit.records.phasors import in_radians
from exfit.records.recorded_tests import DetectedTest, is_whole_record, tests_of, unique_names
from exfit.records.rejection import REMEDY, BreakerOpening
from exfit.records.steps import RecordedStep

AT_REST = (0.9, 1.1)  # pu: a voltage at rest is within the limits of a machine
ALL_TESTS = "all"  # in place of the name of a test
LIKE = (0.9, 1.25)  # of what vt changes by: the step of a reference, as the regulator's gain is


@dataclass(frozen=True)
class StartingTest:
    """A test of a recorder's file, with the sizes (pu) of its steps, None where they are unknown.

    ``window`` (s) is None where the whole record is used. ``bases`` are given by signal.
    """

    name: str
    inspection: Inspection
    steps: tuple[RecordedStep, ...]
    window: tuple[float, float] | None = None
    sizes: tuple[float | None, ...] = ()
    bases: Mapping[str, Base] = field(default_factory=dict)
    validates: bool = False


def starting_tests(
    inspections: Sequence[Inspection],
    sizes: Mapping[str, float] = MappingProxyType({}),
    bases: Mapping[str, Base] | None = None,
    validating: Sequence[Inspection] = (),
) -> tuple[StartingTest, ...]:
    """Return the tests of records: every other one, from the second on, validates.

    Of grid events it is the half that shows least. All tests of the ``validating`` records do.
    ``sizes`` (pu) are by a word in the names of their tests, such as up, or all; they are amounts,
    or have the sign of the step. Of a single record without steps, or of a load rejection, it is
    one test.

    Raises ExfitError for a size that is none, fits no test, or contradicts what the record shows,
    for a record in which the breaker opens beside other tests, for one of several that shows no
    step, and for a play-in file.
    """
    every = [*inspections, *validating]
    given = bases or {}
    for inspection in every:
        if inspection.plays_in:  # it has nothing that a fit could be compared with
            raise ExfitError(
                f"{inspection.path}: a play-in file has no P and Q to fit; exfit inspect shows the "
                "sections of a case that exfit simulate takes"
            )
    if any(map(_drives, every)):
        return _events(every, len(inspections), sizes, given)
    _refuse_rejections(every)
    if len(every) == 1 and (every[0].opening or not tests_of(inspections[0])):
        _refuse_sizes(sizes, inspections[0])
        return (StartingTest("fit", inspections[0], (), bases=given),)
    without = [inspection.path for inspection in every if not tests_of(inspection)]
    if without:
        text = "shows no step; a table of tests can say where it is"
        raise FileError(f"{path}: {text}" for path in without)
    return _bump_tests(inspections, validating, sizes, given)


def _bump_tests(
    inspections: Sequence[Inspection],
    validating: Sequence[Inspection],
    sizes: Mapping[str, float],
    given: Mapping[str, Base],
) -> tuple[StartingTest, ...]:
    """Return the tests of records that all show steps."""
    recorded = [
        (inspection, test)
        for inspection in (*inspections, *validating)
        for test in tests_of(inspection)
    ]
    fitted = sum(len(tests_of(inspection)) for inspection in inspections)
    amounts = zip(recorded, _amounts(recorded, sizes), strict=True)
    made = [
        started(inspection, test, amount, given, k % 2 == 1)
        if k < fitted
        else started(inspection, test, amount, _bases_for(inspection, given), validates=True)
        for k, ((inspection, test), amount) in enumerate(amounts)
    ]
    named = renamed(made, [test for _, test in recorded])
    return (replace(named[0], name=SINGLE), *named[1:]) if validating and fitted == 1 else named


def _bases_for(inspection: Inspection, bases: Mapping[str, Base]) -> dict[str, Base]:
    """Return the bases that a further record needs: its signals may be per unit already."""
    channels = {signal: inspection.channel_of(signal) for signal in bases}
    per_unit = {s for s, channel in channels.items() if channel and channel.seems_per_unit}
    return {s: base for s, base in bases.items() if s not in per_unit or base.unit == "pu"}


def _drives(inspection: Inspection) -> bool:
    return inspection.is_event or inspection.of_governor


def _events(
    inspections: Sequence[Inspection],
    alternate: int,
    sizes: Mapping[str, float],
    bases: Mapping[str, Base],
) -> tuple[StartingTest, ...]:
    """Return the grid events that measurement units recorded, or tests of a governor, one a record.

    Of the first ``alternate`` events the half whose Q moves least above its noise validates: an
    event that shows little determines little of what a larger one needs. Of tests of a governor it
    is each second one. All others validate.

    Raises ExfitError for sizes of steps, and for a record of another kind beside them.
    """
    first = next(inspection for inspection in inspections if _drives(inspection))
    _refuse_sizes(sizes, first)
    for inspection in inspections:
        if inspection.is_event != first.is_event or not _drives(inspection):
            raise ExfitError(
                f"{inspection.path}: a {inspection.kind.name}, {first.path.name} a "
                f"{first.kind.name}: give each kind a case of its own"
            )
    single = len(inspections) == 1
    name = "event" if first.is_event else "governor"
    shown = [_shown(each) if each.is_event else 0.0 for each in inspections[:alternate]]
    weakest = sorted(range(alternate), key=lambda k: (shown[k], k % 2 == 0))[: alternate // 2]
    return tuple(
        StartingTest(
            "fit" if single else f"{name}{k + 1}",
            inspection,
            (),
            bases=bases,
            validates=k in weakest or k >= alternate,
        )
        for k, inspection in enumerate(inspections)
    )


def _shown(inspection: Inspection) -> float:
    """Return by how many times its noise the reactive power of a grid event moves, 0 if unknown."""
    channel, pmu, samples = inspection.channel_of("q"), inspection.pmu, inspection.samples
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        if channel is not None:
            q = samples[channel.name]
        elif pmu is not None and pmu.current is not None:
            phasors = [
                samples[each.magnitudes[0]]
                * np.exp(1j * in_radians(samples[each.angles[0]], each.angle_unit or "deg"))
                for each in (pmu.voltage, pmu.current)
            ]
            q = (phasors[0] * np.conj(phasors[1])).imag
        else:
            return 0.0
        q = q[np.isfinite(q)]
        shown = np.std(q) / noise(q) if len(q) > NEIGHBOURS else 0.0
    return float(shown) if np.isfinite(shown) else 0.0


def _amounts(
    recorded: Sequence[tuple[Inspection, DetectedTest]], sizes: Mapping[str, float]
) -> list[float | None]:
    """Return the size (pu) of each test, None where it is not given; raises ExfitError."""
    tests = [test for _, test in recorded]
    names = unique_names([test.name() for test in tests], tests)
    of_all, own = sizes.get(ALL_TESTS), dict[str, float]()
    for word, amount in sizes.items():
        if word != ALL_TESTS:
            own |= dict.fromkeys(_named(word, names), amount)
    _refuse_unused({k: v for k, v in sizes.items() if not _named(k, names)}, names)
    for (inspection, test), name in zip(recorded, names, strict=True):
        if len(recorded) > 1 and of_all is not None and name not in own:
            refuse_other_size(inspection, test, of_all)
    return [own.get(name, of_all) for name in names]


def sizes_of(texts: Sequence[str]) -> dict[str, float]:
    """Return the sizes of steps by the words of their tests; raises ExfitError."""
    sizes = {}
    for text in texts:
        words, _, number = text.rpartition("=")
        try:
            sizes[words or ALL_TESTS] = float(number)
        except ValueError:
            raise ExfitError(f"--step {text}: not of the form 0.05 or up=0.05") from None
    return sizes


def sizes_in_use(sizes: Mapping[str, float], inspections: Sequence[Inspection]) -> dict[str, float]:
    """Return the sizes that are of a test of some records."""
    tests = [test for inspection in inspections for test in tests_of(inspection)]
    names = unique_names([test.name() for test in tests], tests)
    return {word: amount for word, amount in sizes.items() if _named(word, names)}


def doubtful_bases(tests: Sequence[StartingTest]) -> list[str]:
    """List doubts about the bases of tests: a voltage that rests far from them."""
    low, high = AT_REST
    doubts = []
    for test in tests:
        channel, base = test.inspection.channel_of("vt"), test.bases.get("vt")
        if channel is None or base is None:
            continue
        level = channel.level / base.in_unit(channel.unit, channel.name)
        if not low <= level <= high:
            doubts.append(
                f"{test.inspection.path}: {channel.name} rests at {level:.3g} times its base: is "
                f"{base.value:g} the rated voltage of this unit?"
            )
    return list(dict.fromkeys(doubts))


def renamed(
    tests: Sequence[StartingTest], recorded: Sequence[DetectedTest]
) -> tuple[StartingTest, ...]:
    """Return tests under names by their sizes as given, of which no two are the same."""
    names = [
        own.name(test.sizes[0] if test.sizes else None)
        for test, own in zip(tests, recorded, strict=True)
    ]
    return tuple(
        replace(test, name=name)
        for test, name in zip(tests, unique_names(names, recorded), strict=True)
    )


def started(
    inspection: Inspection,
    test: DetectedTest,
    amount: float | None,
    bases: Mapping[str, Base],
    validates: bool,
) -> StartingTest:
    """Return a recorded test whose steps all have an amount (pu) with the signs that vt shows.

    Raises ExfitError where the record shows another one, or that the breaker opens.
    """
    if inspection.opening and any(inspection.opening.causes(step.at) for step in test.steps):
        raise _rejection(inspection, inspection.opening)
    return StartingTest(
        test.name(),
        inspection,
        test.steps,
        None if is_whole_record(test, inspection) else test.window,
        tuple(_sized(inspection, test, k, amount) for k in range(len(test.steps))),
        bases,
        validates,
    )


def _refuse_rejections(inspections: Sequence[Inspection]) -> None:
    """Raise ExfitError for a breaker that opens beside other tests or in one of several records."""
    for inspection in inspections:
        opening = inspection.opening
        alone = len(inspections) == 1
        if opening and not (alone and all(opening.causes(step.at) for step in inspection.steps)):
            raise _rejection(inspection, opening)


def _rejection(inspection: Inspection, opening: BreakerOpening) -> ExfitError:
    return ExfitError(
        f"{inspection.path}: {opening.in_words}; beside other tests or records new makes no case "
        f"of it: {REMEDY}; --tests gives a table of the bump tests of a file"
    )


def _sized(
    inspection: Inspection, test: DetectedTest, index: int, amount: float | None
) -> float | None:
    """Return the size (pu) of a step, None where it, or the way it went, is open.

    Raises ExfitError where the record contradicts it.
    """
    if amount is None:
        return None
    change = test.changes[index]
    place = f"{inspection.path}: step {amount:g} at {test.steps[index].at:.4g} s"
    _refuse_impossible(place, amount)
    if change is None:
        if index == 0 and amount < 0.0:
            return amount
        step = test.steps[index]
        if sign_disputed_by(inspection.channels, inspection.steps, step):
            return None
        way = direction_by_others(inspection.channels, step)
        return copysign(amount, way) if way else amount if index == 0 else None
    if index == 0 and amount < 0.0 < change:
        raise ExfitError(f"{place}: vt rises there, by {100.0 * change:.2g} %")
    return copysign(amount, change)


def _refuse_impossible(place: str, amount: float) -> None:
    """Raise ExfitError for a size (pu) that no test has."""
    if amount == 0.0 or abs(amount) > LARGEST_STEP:
        text = "0 is no step" if amount == 0.0 else size_in_words(amount)
        raise ExfitError(f"{place}: {text}")


def refuse_other_size(inspection: Inspection, test: DetectedTest, amount: float) -> None:
    """Raise ExfitError where a size (pu) that all tests share is not that of this one."""
    _refuse_impossible(f"{inspection.path}: --step", amount)
    change = test.changes[0]
    if change is None or len(test.steps) > 1:
        return
    low, high = (share * abs(change) for share in LIKE)
    if not low <= abs(amount) <= high:
        raise ExfitError(
            f"{inspection.path}: --step {amount:g}: vt changes by {100.0 * change:+.2g} % at "
            f"{test.at:.4g} s; give the size of that test, as --step at-{test.at:.0f}s=..."
        )


def _named(word: str, names: Sequence[str]) -> list[str]:
    """Return the names of the tests that a size is of."""
    return [name for name in names if f"-{word}-" in f"-{name}-" or word == ALL_TESTS]


def _refuse_unused(sizes: Mapping[str, float], names: Sequence[str]) -> None:
    """Raise ExfitError for sizes that belong to no test."""
    for word, amount in sizes.items():
        text = f"--step {word}={amount!r}: no test of that name; the record's tests: "
        raise ExfitError(text + ", ".join(names))


def _refuse_sizes(sizes: Mapping[str, float], inspection: Inspection) -> None:
    """Raise ExfitError for sizes of steps that are given to a record without any."""
    if not sizes:
        return
    if _drives(inspection) or inspection.opening:
        why = f"it is taken for a {inspection.kind.name}, which has no step"
    else:
        why = "it shows no step; --tests gives a table that says where it is"
    if inspection.channel_of("vt") is None:
        why += "; no column is recognised as vt: vt in --answers names it"
    raise ExfitError(f"{inspection.path}: --step: {why}")
