"""Whether the model with the fitted values can be used in a planner's simulation."""

from collections.abc import Iterator
from math import isfinite
from typing import NamedTuple

from exfit.features.report.sections.other_program import NO_TWIN, has_no_equations
from exfit.features.report.sections.texts import DASH, values_of
from exfit.results.description import Behaviour
from exfit.results.model import FitResult
from exfit.results.validation_result import Reported
from exfit.show.blocks import Block, Cell, Note, Table, columns

NOT_HELD = "not stated: the fit was interrupted"

RESTING = 1e-9  # 1/s: a pole within it is at zero but for rounding
CHECKS = ("Initialises without error", "No-disturbance run", "Positive damping")


class UsabilityCheck(NamedTuple):
    """A check with its result; ``passed`` is None where it could not be made."""

    name: str
    passed: bool | None
    result: str


def usability(result: Reported) -> tuple[UsabilityCheck, ...]:
    """Return the checks of usability (cf. NERC MOD-026-1 R6), each with its result."""
    behaviour = result.behaviour
    if behaviour is None:
        return no_usability(NO_TWIN if has_no_equations(result) else NOT_HELD)
    return (_initialises(behaviour), _no_disturbance(behaviour), _damping(behaviour))


def usability_table(result: Reported) -> Iterator[Block]:
    """Yield the checks of usability as a table, and what made them."""
    words = {True: Cell("yes", "ok"), False: Cell("NO", "bad"), None: Cell(DASH)}
    checks = usability(result)
    rows = tuple((Cell(each.name), words[each.passed], Cell(each.result)) for each in checks)
    title = "Usability of the model (cf. NERC MOD-026-1 R6)"
    yield Table(columns("check", "passed", "result"), rows, title)
    if not has_no_equations(result):
        by = "exfit" if result.other_program is None else "the twin in exfit"
        again = " The planner's program is to repeat it with the records that follow."
        only = again if isinstance(result, FitResult) else ""
        yield Note(f"By the simulation of {by}, with {values_of(result)}.{only}")


def no_usability(why: str) -> tuple[UsabilityCheck, ...]:
    """Return the checks of usability where none was made."""
    return tuple(UsabilityCheck(name, None, why) for name in CHECKS)


def _initialises(behaviour: Behaviour) -> UsabilityCheck:
    without = [run.test for run in behaviour.flat_runs if not isfinite(run.drift)]
    count = len(behaviour.flat_runs)
    text = f"a state of rest is found in {count - len(without)} of {_tests(count)}"
    if without:
        text += f"; not in {', '.join(without)}"
    return UsabilityCheck("Initialises without error", not without, text)


def _no_disturbance(behaviour: Behaviour) -> UsabilityCheck:
    runs = behaviour.flat_runs
    moving = [run.test for run in runs if not run.rests]
    drifts = [run.drift for run in runs if isfinite(run.drift)]
    drift = f"{max(drifts):.2g} pu" if drifts else "not known"
    text = f"without a step the signals drift by at most {drift} in 60 s, in {_tests(len(runs))}"
    text += f"; no rest in {', '.join(moving)}" if moving else ": the start is a state of rest"
    return UsabilityCheck("No-disturbance run (flat run)", not moving, text)


def _damping(behaviour: Behaviour) -> UsabilityCheck:
    name = "Positive damping"
    ratios = list(_least_damping(behaviour))
    if not ratios:
        why = "; ".join(dict.fromkeys(each.why for each in behaviour.small_signal if each.why))
        return UsabilityCheck(name, None, f"not stated: {why or 'there is no loop'}")
    grows = [tests for tests, ratio, decays in ratios if not decays]
    tests, ratio, _ = min(ratios, key=lambda each: each[1])
    if grows:
        return UsabilityCheck(name, False, f"a mode does not decay in {', '.join(grows)}")
    text = (
        "all modes decay, none oscillates"
        if ratio >= 1.0
        else (f"all modes decay; the least damping ratio is {ratio:.3f}, in {tests}")
    )
    return UsabilityCheck(name, True, text)


def _least_damping(behaviour: Behaviour) -> Iterator[tuple[str, float, bool]]:
    """Yield tests with the least damping ratio of their modes, and whether all modes decay."""
    for each in behaviour.small_signal:
        if each.view is not None and each.view.poles:
            poles = each.view.poles
            if each.view.path[1] != "vt":  # what integrates a recorded voltage stays where it is
                poles = tuple(pole for pole in poles if abs(pole.value) > RESTING) or poles
            decays = all(pole.value.real < 0.0 for pole in poles)
            yield ", ".join(each.tests), min(pole.damping for pole in poles), decays


def _tests(count: int) -> str:
    return f"{count} test{'' if count == 1 else 's'}"
