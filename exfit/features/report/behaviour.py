"""What the values do: whether a planner can use them, near rest, at the limits."""

from collections.abc import Iterator
from math import isfinite
from typing import NamedTuple

import numpy as np

from exfit.features.report.charts import HALF, LEVEL
from exfit.features.report.words import (
    DASH,
    NO_TWIN,
    has_no_equations,
    no_behaviour,
    number,
    values_of,
)
from exfit.output.blocks import (
    Block,
    Cell,
    Chart,
    Facts,
    Heading,
    Note,
    Panel,
    Rule,
    Series,
    Table,
    TableColumn,
    columns,
    row,
)
from exfit.results.description import SmallSignalView
from exfit.results.model import FitResult
from exfit.results.validation_result import Reported
from exfit.simulation.small_signal import Bode, Margins, Pole, SmallSignal

NOT_HELD = "not stated: the fit was interrupted"
RESTING = 1e-9  # 1/s: a pole within it is at zero but for rounding
CHECKS = ("Initialises without error", "No-disturbance run", "Positive damping")
HALF_TURN = Rule(-180.0, style="level")


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
    runs = behaviour.flat_runs
    tests = f"{len(runs)} test{'' if len(runs) == 1 else 's'}"
    without = [run.test for run in runs if not isfinite(run.drift)]
    rest = f"a steady state exists in {len(runs) - len(without)} of {tests}"
    rest += f"; not in {', '.join(without)}" if without else ""
    moving = [run.test for run in runs if not run.rests]
    drift = max((run.drift for run in runs if isfinite(run.drift)), default=None)
    most = "not known" if drift is None else f"{drift:.2g} pu"
    flat = f"without a step the signals drift by at most {most} in 60 s, in {tests}"
    flat += f"; no steady state in {', '.join(moving)}" if moving else ": the start is steady"
    return (
        UsabilityCheck("Initialises without error", not without, rest),
        UsabilityCheck("No-disturbance run (flat run)", not moving, flat),
        UsabilityCheck("Positive damping", *_damping(behaviour.small_signal)),
    )


def no_usability(why: str) -> tuple[UsabilityCheck, ...]:
    """Return the checks of usability where none was made."""
    return tuple(UsabilityCheck(name, None, why) for name in CHECKS)


def _damping(views: tuple[SmallSignalView, ...]) -> tuple[bool | None, str]:
    """Check that all modes of all tests decay, and find the least damped."""
    ratios, growing = [], []
    for each in views:
        poles = _moving_poles(each)
        if poles:
            ratios.append((min(pole.damping for pole in poles), ", ".join(each.tests)))
            if max(pole.value.real for pole in poles) >= 0.0:
                growing.append(", ".join(each.tests))
    if growing:
        return False, f"a mode does not decay in {', '.join(growing)}"
    if not ratios:
        why = "; ".join(dict.fromkeys(each.why for each in views if each.why))
        return None, f"not stated: {why or 'there is no loop'}"
    ratio, tests = min(ratios, key=lambda each: each[0])
    if ratio >= 1.0:
        return True, "all modes decay, none oscillates"
    return True, f"all modes decay; the least damping ratio is {ratio:.3f}, in {tests}"


def _moving_poles(of_tests: SmallSignalView) -> tuple[Pole, ...]:
    """Return the poles but for what integrates a recorded voltage, which stays where it is."""
    view = of_tests.view
    if view is None or view.path[1] == "vt":
        return () if view is None else view.poles
    return tuple(pole for pole in view.poles if abs(pole.value) > RESTING) or view.poles


def usability_table(result: Reported) -> Iterator[Block]:
    """Yield the checks of usability as a table, and what made them."""
    words = {True: Cell("yes", "ok"), False: Cell("NO", "bad"), None: Cell(DASH)}
    checks = usability(result)
    rows = tuple((Cell(each.name), words[each.passed], Cell(each.result)) for each in checks)
    title = "Usability of the model (cf. NERC MOD-026-1 R6)"
    yield Table(columns("check", "passed", "result"), rows, title)
    if not has_no_equations(result):
        by = "exfit" if result.other_program is None else "the twin in exfit"
        again = " Repeat it in the planner's program with the PSS/E dynamics records."
        only = again if isinstance(result, FitResult) else ""
        yield Note(f"By the simulation of {by}, with {values_of(result)}.{only}")


def small_signal(result: Reported) -> Iterator[Block]:
    """Yield poles, margins and Bode figures of each test, or why there are none."""
    if result.behaviour is None:
        yield Note(no_behaviour(result), mark="faint")
        return
    yield Note(f"From the exact linearisation at rest, with {values_of(result)}.")
    for k, of_tests in enumerate(result.behaviour.small_signal):
        if of_tests.view is None:
            yield Note(f"{', '.join(of_tests.tests)}: none, because {of_tests.why}.", mark="faint")
        else:
            yield from _near_rest(f"bode-{k}", of_tests)


def _near_rest(key: str, of_tests: SmallSignalView) -> Iterator[Block]:
    view, tests = of_tests.view, ", ".join(of_tests.tests)
    if view is None:
        return
    source, output = view.path
    closed = output == "vt"  # of a record that is played in there is no closed loop
    gains, phases = _margins(view.margins)
    gain = phase = "no voltage loop"
    if closed and view.margins is not None:
        gain = _margin(view.margins.gain, view.margins.gain_at, " dB")
        phase = _margin(view.margins.phase, view.margins.phase_at, "°")
    width = "none" if view.bandwidth is None else f"{number(view.bandwidth, 4)} Hz"
    response = "closed loop" if closed else f"response from {source} to {output}"
    yield Heading(tests, 2)
    yield Facts(
        (
            ("gain margin", gain),
            ("phase margin", phase),
            ("bandwidth (-3 dB)", width),
            (f"peak of the {response}", f"{view.peak:.2f} dB"),
        )
    )
    yield _poles(view, f"Poles{' of the closed loop' if closed else ''}, {tests}")
    if view.open is not None and np.any(view.open.response):  # nothing passes: no gain to draw
        crossovers = " and ".join(rule.label for rule in (*gains, *phases))
        text = (
            "Gain and phase of the open voltage loop over the frequency: "
            f"{crossovers or 'there is no crossover'}."
        )
        rules = ((LEVEL, *phases), (HALF_TURN, *gains))
        yield _bode(f"{key}-open", f"Open voltage loop, {tests}", text, view.open, rules)
    title = f"Closed loop from {source} to {output}, {tests}"
    if not closed:
        title = f"Response from {source} to {output}, vt as recorded, {tests}"
    width = "none" if view.bandwidth is None else f"{view.bandwidth:.3g} Hz"
    text = (
        f"Gain and phase from {source} to {output} over the frequency: peak {view.peak:.2f} dB, "
        f"bandwidth {width}."
    )
    if np.any(view.closed.response):
        yield _bode(f"{key}-closed", title, text, view.closed, ((LEVEL,), ()))


def _poles(view: SmallSignal, title: str) -> Table:
    numbers = ("real part (1/s)", "imaginary part (1/s)", "damping ratio", "frequency (Hz)")
    rows = (
        row(
            number(pole.value.real),
            f"± {number(abs(pole.value.imag))}" if pole.value.imag else "0",
            f"{pole.damping:.3f}",
            number(pole.frequency, 4) if pole.frequency else DASH,
            ", ".join(pole.states),
        )
        for pole in view.poles
    )
    heads = (*columns(*numbers, numbers=numbers), TableColumn("participating states", folds=True))
    return Table(heads, tuple(rows), title, leading=0)


def _margin(margin: float | None, at: float | None, unit: str) -> str:
    return "no crossover" if margin is None else f"{margin:.2f}{unit} at {number(at, 4)} Hz"


def _margins(margins: Margins | None) -> tuple[tuple[Rule, ...], tuple[Rule, ...]]:
    """Mark the gain margin and the phase margin, each at its frequency, where there is one."""
    gains: tuple[Rule, ...] = ()
    phases: tuple[Rule, ...] = ()
    if margins is not None and margins.gain is not None and margins.gain_at is not None:
        text = f"gain margin {margins.gain:.1f} dB at {margins.gain_at:.3g} Hz"
        gains = (Rule(margins.gain_at, text, upright=True),)
    if margins is not None and margins.phase is not None and margins.phase_at is not None:
        text = f"phase margin {margins.phase:.1f}° at {margins.phase_at:.3g} Hz"
        phases = (Rule(margins.phase_at, text, upright=True),)
    return gains, phases


def _bode(
    key: str, title: str, text: str, bode: Bode, rules: tuple[tuple[Rule, ...], tuple[Rule, ...]]
) -> Chart:
    """Draw gain and phase over the frequency, each with its rules."""
    gain = 20.0 * np.log10(np.abs(bode.response))
    phase = np.degrees(np.unwrap(np.angle(bode.response)))
    panels = tuple(
        Panel(name, (Series("", bode.frequency, values, "p0"),), HALF, rules=marked)
        for name, values, marked in zip(
            ("gain (dB)", "phase (degrees)"), (gain, phase), rules, strict=True
        )
    )
    return Chart(key, title, text, "frequency (Hz)", panels, logarithmic=True)


def limits(result: Reported) -> Iterator[Block]:
    """Yield the limits that each test was on, and the tests that were on none."""
    if result.behaviour is None:
        yield Note(no_behaviour(result), mark="faint")
        return
    rows = [
        row(
            *(run.test, hit.limit, hit.signal or DASH, number(hit.value), number(hit.first, 4)),
            *(number(hit.seconds, 3), f"{100.0 * hit.share:.1f} %"),
        )
        for run in result.behaviour.limits
        for hit in run.hits
    ]
    fitted = "with the fitted values " if isinstance(result, FitResult) else ""
    if rows:
        numbers = ("value (pu)", "first at (s)", "for (s)", "share of the test")
        heads = columns("test", "limit", "signal", *numbers, numbers=numbers)
        yield Table(heads, tuple(rows), f"Limits that the response {fitted}reached")
    free = [run.test for run in result.behaviour.limits if not run.hits]
    if free:
        records = "its record shows" if len(free) == 1 else "their records show"
        yield Note(
            f"No limit was reached in {', '.join(free)}: {records} nothing about the limits."
        )
