"""A saturation test on the terminal, and as a figure."""

import numpy as np
from rich.console import Console

from exfit.features.programme import programme_figures
from exfit.features.programme.programme_blocks import saturation
from exfit.features.programme.saturation import saturation_curve
from exfit.output import figures as plots
from exfit.output import terminal


def test_the_numbers_of_a_saturation_test_fit_a_narrow_terminal(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    vt = np.concatenate([np.linspace(0.2, 1.1, 9), np.linspace(1.0, 0.2, 7), [0.01]])
    ifd = 800.0 * (vt + np.maximum(vt - 0.8, 0.0) ** 2) * (vt > 0.1)
    ifd += 1.5 * np.cos(np.arange(17.0)) * (vt > 0.1)
    console = Console(width=80, record=True)
    terminal.show(console, saturation(saturation_curve(vt, ifd, efd=0.2 * ifd)))
    lines = console.export_text().splitlines()
    assert max(map(len, lines)) <= 80
    first_words = {line.split("  ")[0] for line in lines}
    assert {
        "base of ifd, 1 pu on the air-gap line",
        "base of efd",
        "S(1.0)",
        "S(1.2)",
    } <= first_words
    assert {"quadratic", "exponential", "exponential-se"} <= first_words


def test_a_saturation_test_shows_both_branches_the_air_gap_line_and_the_curve():
    random = np.random.default_rng(1)
    vt = np.concatenate([np.linspace(0.2, 1.1, 9), np.linspace(1.0, 0.2, 7)])
    ifd = 800.0 * (vt + np.maximum(vt - 0.8, 0.0) ** 2) + random.normal(size=16)
    result = saturation_curve(vt, ifd)
    figure = programme_figures.saturation(result, "unit 3")
    curve, beside = figure.axes
    labels = [text.get_text() for text in curve.get_legend().get_texts()]
    assert labels[0].startswith("air-gap line, ")
    assert labels[1:] == ["95 % band", "curve", "extrapolated", "rising", "falling"]
    assert "field current ifd (A)" in curve.get_xlabel()
    assert {text.get_text()[:6] for text in curve.texts} == {"S(1.0)", "S(1.2)"}
    assert "hysteresis" in beside.get_title(loc="right")
    assert plots.png(figure).startswith(b"\x89PNG\r\n\x1a\n")
