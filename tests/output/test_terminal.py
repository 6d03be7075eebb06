"""What is shown on a terminal."""

import io
import re
from dataclasses import replace

import pytest
from cases import local_case
from rich.console import Console

from exfit import workflows
from exfit.output import terminal
from exfit.output.notebook import fit_html
from exfit.output.terminal.terminal import interval
from exfit.results.verdict import MISSES, Cause, Verdict

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


REASON = "ifd of the second record is off by 12 % of its range (rmse 3.4 x noise)"
CAUSES = tuple(
    Cause(f"cause number {k} with a figure of {k}.5 pu", "look at `exfit inspect record.csv`")
    for k in range(5)
)


@pytest.fixture(scope="module")
def missed():
    """A fit that misses its record, with as many causes as there may be."""
    result = workflows.fit(local_case("first_order"))
    return replace(result, verdict=Verdict(MISSES, REASON, CAUSES))


@pytest.mark.parametrize("width", [60, 80])
def test_the_verdict_and_its_causes_come_first_whole_and_once(missed, width):
    stream = io.StringIO()
    terminal.fit(Console(file=stream, width=width), missed)
    lines = stream.getvalue().splitlines()
    assert lines[1].startswith("verdict: misses the record: ifd of the second record")
    table = next(k for k, line in enumerate(lines) if line.startswith("parameter"))
    above, below = (" ".join(" ".join(part).split()) for part in (lines[:table], lines[table:]))
    for text in (REASON, *(cause.sentence for cause in CAUSES)):
        assert above.count(text) == 1
        assert text not in below
    assert max(map(len, lines[:table])) <= width


def test_what_does_not_match_is_nowhere_called_good_or_converged(missed):
    result = replace(missed, verdict=Verdict("no match", "the response goes the other way"))
    stream = io.StringIO()
    terminal.fit(Console(file=stream, width=80), result)
    for text in (stream.getvalue(), fit_html(result), repr(result)):
        assert "no match" in text
        assert "converged" not in text
        assert "good" not in text
    assert not result.holds
