"""The system near its state of rest: poles, margins, Bode figures."""

from collections.abc import Iterator
from typing import Literal

import numpy as np

from exfit.features.report.layout import HALF, LEVEL
from exfit.features.report.sections.texts import DASH, no_behaviour, number, values_of
from exfit.results.description import SmallSignalView
from exfit.results.validation_result import Reported
from exfit.show.blocks import (
    Block,
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
from exfit.simulation.small_signal import Bode, Margins

Rules = tuple[Rule, ...]

HALF_TURN = Rule(-180.0, style="level")


def small_signal(result: Reported) -> Iterator[Block]:
    """Yield poles, margins and Bode figures of each test, or why there are none."""
    if result.behaviour is None:
        yield Note(no_behaviour(result), mark="faint")
        return
    yield Note(f"From the exact linearisation at rest, with {values_of(result)}.")
    for k, of_tests in enumerate(result.behaviour.small_signal):
        tests, view = ", ".join(of_tests.tests), of_tests.view
        if view is None:
            yield Note(f"{tests}: none, because {of_tests.why}.", mark="faint")
            continue
        source, output = view.path
        # of a record that is played in there is no closed loop
        closed = output == "vt"
        response = "closed loop" if closed else f"response from {source} to {output}"
        margins = view.margins if closed else None
        width = "none" if view.bandwidth is None else f"{number(view.bandwidth, 4)} Hz"
        yield Heading(tests, 2)
        yield Facts(
            (
                ("gain margin", _margin(margins, "gain", " dB")),
                ("phase margin", _margin(margins, "phase", "°")),
                ("bandwidth (-3 dB)", width),
                (f"peak of the {response}", f"{view.peak:.2f} dB"),
            )
        )
        numbers = ("real part (1/s)", "imaginary part (1/s)", "damping ratio", "frequency (Hz)")
        yield Table(
            (*columns(*numbers, numbers=numbers), TableColumn("states that take part", folds=True)),
            tuple(
                row(
                    number(pole.value.real),
                    f"± {number(abs(pole.value.imag))}" if pole.value.imag else "0",
                    f"{pole.damping:.3f}",
                    number(pole.frequency, 4) if pole.frequency else DASH,
                    ", ".join(pole.states),
                )
                for pole in view.poles
            ),
            f"Poles{' of the closed loop' if closed else ''}, {tests}",
            leading=0,
        )
        yield from _bodes(f"bode-{k}", of_tests)


def _margin(margins: Margins | None, of: Literal["gain", "phase"], unit: str) -> str:
    if margins is None:
        return "no voltage loop"
    margin, at = (
        (margins.gain, margins.gain_at) if of == "gain" else (margins.phase, margins.phase_at)
    )
    return "no crossover" if margin is None else f"{margin:.2f}{unit} at {number(at, 4)} Hz"


def _bodes(key: str, of_tests: SmallSignalView) -> Iterator[Chart]:
    """Yield the Bode figures of the voltage loop, where there is one, and of the closed loop."""
    view, names = of_tests.view, ", ".join(of_tests.tests)
    if view is None:
        return
    if view.open is not None and np.any(view.open.response):  # nothing passes: no gain to draw
        gain, phase = _margins(view.margins)
        crossovers = [rule.label for rule in (*gain, *phase)]
        yield _bode(
            f"{key}-open",
            f"Open voltage loop, {names}",
            "Gain and phase of the open voltage loop over the frequency: "
            f"{' and '.join(crossovers) or 'there is no crossover'}.",
            view.open,
            ((LEVEL, *phase), (HALF_TURN, *gain)),
        )
    source, output = view.path
    width = "none" if view.bandwidth is None else f"{view.bandwidth:.3g} Hz"
    yield _bode(
        f"{key}-closed",
        f"Closed loop from {source} to {output}, {names}"
        if output == "vt"
        else f"Response from {source} to {output}, vt as recorded, {names}",
        f"Gain and phase from {source} to {output} over the frequency: peak {view.peak:.2f} dB, "
        f"bandwidth {width}.",
        view.closed,
        ((LEVEL,), ()),
    )


def _margins(margins: Margins | None) -> tuple[Rules, Rules]:
    """Mark the gain margin and the phase margin, each at its frequency, where there is one."""
    gain: Rules = ()
    phase: Rules = ()
    if margins is not None and margins.gain is not None and margins.gain_at is not None:
        text = f"gain margin {margins.gain:.1f} dB at {margins.gain_at:.3g} Hz"
        gain = (Rule(margins.gain_at, text, upright=True),)
    if margins is not None and margins.phase is not None and margins.phase_at is not None:
        text = f"phase margin {margins.phase:.1f}° at {margins.phase_at:.3g} Hz"
        phase = (Rule(margins.phase_at, text, upright=True),)
    return gain, phase


def _bode(key: str, title: str, text: str, bode: Bode, rules: tuple[Rules, Rules]) -> Chart:
    """Return gain and phase over the frequency, each with its rules."""
    gain = 20.0 * np.log10(np.abs(bode.response))
    phase = np.degrees(np.unwrap(np.angle(bode.response)))
    panels = tuple(
        Panel(name, (Series("", bode.frequency, values, "p0"),), HALF, rules=marked)
        for name, values, marked in zip(
            ("gain (dB)", "phase (degrees)"), (gain, phase), rules, strict=True
        )
    )
    return Chart(key, title, text, "frequency (Hz)", panels, logarithmic=True)
