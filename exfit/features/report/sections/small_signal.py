"""The system near its state of rest: poles, margins, Bode figures."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from exfit.features.report.layout import HALF, LEVEL
from exfit.results.description import SmallSignalView
from exfit.results.validation_result import Reported
from exfit.show.blocks import Chart, Panel, Rule, Series
from exfit.simulation.small_signal import Bode, Margins, SmallSignal

Rules = tuple[Rule, ...]

HALF_TURN = Rule(-180.0, style="level")


@dataclass(frozen=True)
class BodeFigures:
    """The small-signal view of some tests with its Bode figures."""

    tests: str
    view: SmallSignal | None
    why: str
    charts: tuple[Chart, ...]

    @property
    def response(self) -> str:
        """What the response of the view is called: of a record that is played in no closed loop."""
        return "" if self.view is None else _name_of_response(self.view)


def _name_of_response(view: SmallSignal) -> str:
    source, output = view.path
    return "closed loop" if output == "vt" else f"response from {source} to {output}"


def small_signal(result: Reported) -> tuple[BodeFigures, ...] | None:
    """Return the small-signal views of a fit; None where the result does not hold them."""
    if result.behaviour is None:
        return None
    return tuple(
        BodeFigures(
            ", ".join(of_tests.tests),
            of_tests.view,
            of_tests.why,
            tuple(_bodes(f"bode-{k}", of_tests)),
        )
        for k, of_tests in enumerate(result.behaviour.small_signal)
    )


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
    """Return where the gain margin and the phase margin are, nothing where there is none."""
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
