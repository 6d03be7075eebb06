"""The system of a case: its exciter in its plant, and the values of its parameters."""

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from traceback import extract_tb

from exfit.case.case import Case
from exfit.case.schema import SINGLE, BumpTest, RecordFile, Recording
from exfit.case.ties import Ties
from exfit.engine.system import System, parameters_used, trace
from exfit.errors import CaseError, ModelError
from exfit.models.sheet import Model
from exfit.plants import (
    BREAKER,
    FAULT,
    REFERENCES,
    SATURATION,
    SPEED,
    SWITCHED,
    Dialect,
    Equipment,
    SaturationForm,
    Stabilised,
    inputs_at,
)
from exfit.plants.limiting import inputs_for_limiters

Values = Mapping[str, float]


def system_of(case: Case, recording: Recording | None = None, more: tuple[str, ...] = ()) -> System:
    """Return the exciter of a case in its plant, or the machine alone.

    Given the ``recording``, the breaker opens only if it does in its own test; ``more`` are inputs
    beside those of the tests. Raises ModelError where the equations of a user's own model cannot be
    traced, CaseError where a record lacks a signal that drives it.
    """
    kind, parts = case.kind, case.parts
    dialect: Dialect = getattr(case.plant, "dialect", "standard")
    if kind.has_exciter and parts.exciter is None:
        raise CaseError(f"{case.path}: model: missing")
    if parts.exciter is not None:
        _refuse_missing_gates(case, parts.exciter)
    stabiliser = None
    if parts.stabiliser is not None and case.stabiliser is not None:
        listens_to = case.stabiliser.inputs or parts.stabiliser.inputs
        stabiliser = Stabilised(parts.stabiliser, listens_to).in_dialect(dialect)
    records = [{*file.channels} for file in _record_files(case).values()]
    equipment = Equipment(
        exciter=None if parts.exciter is None else parts.exciter.in_dialect(dialect),
        machine=parts.machine,
        saturation=SATURATION[case.saturation],
        inputs=(*inputs_of(case, recording), *more),
        recorded=frozenset(set.intersection(*records) if records else ()),
        given=frozenset(case.plant.given),
        stabiliser=stabiliser,
        dialect=dialect,
        power_at=getattr(case.plant, "power_at", "recorded-voltage"),
        governor=parts.governor,
        limiters=parts.limiters,
        further=parts.further,
    )
    if kind.plays_back and parts.exciter is not None:
        _refuse_missing_drivers(case, parts.exciter, equipment.saturation)
    system = kind.build(equipment)
    if case.model is not None and case.model.endswith(".py"):
        _refuse_untraceable(system, case.folder / case.model)
    return system


def inputs_of(case: Case, recording: Recording | None = None) -> tuple[str, ...]:
    """Inputs that the tests and records of a case change; the reference always is one.

    The breaker is one where it opens: in the test of the ``recording``, or else in any; then so is
    what drives the machine after that.
    """
    changed = {"vref"}
    for test in case.tests:
        changed |= {name for name in (*REFERENCES, "E", "angle") if getattr(test, name)}
        changed |= _changed_around(test)
    if case.kind.plays_back:
        records = _record_files(case).values()
        changed |= {*REFERENCES} & {signal for file in records for signal in file.channels}
    tests = case.tests if recording is None else (recording.test,)
    if any(test.breaker for test in tests):
        changed.add(BREAKER)
    if recording is not None:
        changed |= {*driving_after_opening(case, recording)}
    inputs = (*REFERENCES, "angle", *SWITCHED, *FAULT, BREAKER, "efd", SPEED)
    return tuple(name for name in inputs if name in changed)


def _changed_around(test: BumpTest) -> set[str]:
    changed = {n for each in test.network for n in SWITCHED if getattr(each, n) is not None}
    turning = set() if test.speed is test.speed_change is None else {SPEED}
    return changed | turning | ({*FAULT} if test.fault else set())


def driving_after_opening(case: Case, recording: Recording) -> tuple[str, ...]:
    """Return the channels of a record that drive the machine once its breaker is open.

    These are efd where there is no exciter, and the speed unless it is to be simulated.
    """
    breaker, channels = recording.test.breaker, recording.record.channels
    if breaker is None:
        return ()
    driving = () if case.kind.has_exciter else case.kind.driving
    speed = () if breaker.speed == "simulated" else (SPEED,)
    return tuple(signal for signal in (*driving, *speed) if signal in channels)


def _refuse_missing_drivers(case: Case, exciter: Model, saturation: SaturationForm) -> None:
    """Raise CaseError where a record lacks a signal that the exciter uses."""
    from exfit.plants.playback import PLAYBACK

    used = driven_by(exciter, saturation)
    required = {signal: exciter for signal in case.kind.required_if_used if signal in used}
    if case.kind is PLAYBACK:
        for limiter in case.parts.limiters:
            required |= dict.fromkeys(limiter.model.inputs, limiter.model)
    for place, file in _record_files(case).items():
        for signal, model in required.items():
            if signal not in file.channels:
                text = f"channels.{signal}: missing; it drives {model.name}"
                raise CaseError(f"{case.path}: {place}: {text}")


def _refuse_missing_gates(case: Case, exciter: Model) -> None:
    """Raise CaseError where an exciter that replaces the case's has no input for a limiter."""
    missing = [
        f"{case.path}: limiters: {exciter.name} has no input {name} for {limiter.model.name}"
        for limiter in case.parts.limiters
        for name in inputs_at(limiter).values()
        if name not in inputs_for_limiters(exciter)
    ]
    if missing:
        raise CaseError(missing)


def _record_files(case: Case) -> dict[str, RecordFile]:
    """Return the records of a case by their place in its file."""
    fitted = {
        "record" if recording.name == SINGLE else recording.name: recording.record
        for recording in case.recordings
    }
    return fitted | {f"validate.{unseen.name}": unseen.record for unseen in case.validations}


@cache
def driven_by(exciter: Model, saturation: SaturationForm) -> frozenset[str]:
    """Return the signals of its plant that reach an exciter."""
    from exfit.plants.parts import initial
    from exfit.plants.playback import DRIVING, playback

    used = parameters_used(playback(exciter, saturation, DRIVING), ("efd",))
    return frozenset(signal for signal in DRIVING if initial(signal) in used)


def _refuse_untraceable(system: System, path: Path) -> None:
    """Raise ModelError, naming file and line, where a model's equations fail."""
    try:
        trace(system, system.outputs)
    except Exception as fault:  # whatever a user's Python may raise
        frames, absolute = extract_tb(fault.__traceback__), path.absolute()
        lines = [f":{frame.lineno}" for frame in frames if Path(frame.filename) == absolute]
        kind = "" if isinstance(fault, ModelError) else f"{type(fault).__name__}: "
        raise ModelError(f"{path}{lines[-1] if lines else ''}: {kind}{fault}") from fault


def values_of(case: Case, changed: Values) -> dict[str, float]:
    """Return every value of a case: as it has them, with changes upon them, and what follows."""
    following = {name: tie for name, tie in case.ties.by_name.items() if name not in changed}
    return Ties(following).apply({**case.values(), **changed})


def parameters_of(case: Case) -> set[str]:
    """Return the parameters that a response of any of the records depends on."""
    own = [system_of(case.seen_from(recording), recording) for recording in case.recordings]
    return {name for system in own or [system_of(case)] for name in parameters_used(system)}


def typical_values_used(case: Case) -> dict[str, float]:
    """Return the typical values that a response of any of the records depends on."""
    used, values = parameters_of(case), case.values()
    return {name: values[name] for name in case.typical() if name in used}
