"""What is shown on a terminal."""

import io
import re

import pytest
from rich.console import Console

from exfit.output import terminal
from exfit.output.terminal.terminal import interval

SENTENCE = (
    "KD, TE and KA can move together (KD +51 %, TE +10 %, KA +9.7 %): vt changes by 3.2e-6 pu rms, "
    "at 1.25 s and at 10 Hz; see `exfit profile case.yaml KD`"
)


@pytest.mark.parametrize("width", range(40, 161))
def test_a_note_breaks_between_words_but_in_no_figure_and_in_no_command(width):
    stream = io.StringIO()
    terminal.notes(Console(file=stream, width=width), [SENTENCE, "short"])
    first, *others = stream.getvalue().removesuffix("note: short\n").splitlines()
    assert all(line == line.rstrip() and len(line) <= width for line in [first, *others])
    assert all(line.startswith("      ") for line in others)
    assert " ".join([first, *map(str.strip, others)]) == f"note: {SENTENCE}"
    assert not any(re.match(r"%|(pu|s|Hz)\b", line.strip()) for line in others)
    assert sum("`exfit profile case.yaml KD`" in line for line in [first, *others]) == 1


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        ((0.1, 2.0), "0.1 ... 2"),
        ((None, 2.0), "below 2"),
        ((0.1, None), "above 0.1"),
        (None, "-"),
    ],
)
def test_an_interval_with_an_open_side_is_shown_by_its_other_limit(limits, text):
    assert interval(limits) == text
