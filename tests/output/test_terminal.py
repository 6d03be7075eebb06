"""What is shown on a terminal."""

import io
import re
from dataclasses import replace
from pathlib import Path

import pytest
from cases import local_case
from fleets import row
from pages import Page
from rich.console import Console

from exfit import workflows
from exfit.features.fleet.folder import Fleet, summary_of
from exfit.features.fleet.page import fleet_page
from exfit.features.fleet.sisters import sisters
from exfit.features.report.page import html as report_html
from exfit.output import fits, terminal
from exfit.output.blocks import interval, notes
from exfit.output.notebook import fit_html
from exfit.output.series import side_by_side
from exfit.results.cause import Cause
from exfit.results.verdict import MATCHES, MISSES, Verdict

SENTENCE = (
    "KD, TE and KA can move together (KD +51 %, TE +10 %, KA +9.7 %): vt changes by 3.2e-6 pu rms, "
    "at 1.25 s and at 10 Hz; see `exfit profile case.yaml KD`"
)


@pytest.mark.parametrize("width", range(40, 161))
def test_a_note_breaks_between_words_but_in_no_figure_and_in_no_command(width):
    stream = io.StringIO()
    terminal.show(Console(file=stream, width=width), notes([SENTENCE, "short"]))
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
def test_the_verdict_comes_last_below_its_causes_whole_and_once(missed, width):
    stream = io.StringIO()
    terminal.show(Console(file=stream, width=width), fits.whole(missed, Path("runs/missed")))
    lines = stream.getvalue().splitlines()
    assert lines[0].startswith("parameter")
    last = max(k for k, line in enumerate(lines) if line.startswith("verdict: misses the record:"))
    causes = min(k for k, line in enumerate(lines) if line.startswith("cause:"))
    parts = (lines[:causes], lines[causes:last], lines[last:])
    above, between, end = (" ".join(" ".join(part).split()) for part in parts)
    assert end == f"verdict: misses the record: {REASON}"
    assert REASON not in above + between
    for cause in CAUSES:
        assert between.count(cause.sentence) == 1
        assert cause.sentence not in above
    assert between.endswith("written to runs/missed")
    assert max(map(len, lines[causes:])) <= width


@pytest.mark.parametrize("width", range(40, 121, 8))
def test_a_folder_stays_in_one_line_whatever_blanks_its_name_has(missed, width):
    folder = Path("runs of the second unit", "as it was")
    for blocks in (fits.whole(missed, folder), next(fits.briefs(missed, folder))):
        stream = io.StringIO()
        terminal.show(Console(file=stream, width=width, force_terminal=True), blocks)
        assert str(folder) in stream.getvalue()


@pytest.mark.parametrize("width", [40, 80])
@pytest.mark.parametrize("count", [1, 9, 40])
def test_in_brief_a_fit_has_thirty_lines_at_most_and_the_verdict_last(missed, width, count):
    (validated,) = missed.comparisons
    validations = [replace(validated, name=f"v{k}", reason="") for k in range(count)]
    levels = {
        f"record{k}.level": replace(each, of_record=True)
        for k in range(count)
        for each in [*missed.parameters.values()][:1]
    }
    result = replace(
        missed,
        parameters={**missed.parameters, **levels},
        knowledge=None,
        validation=tuple(validations),
        notes=tuple(f"note {k} of the fit" for k in range(count)),
    )
    stream = io.StringIO()
    versions = fits.briefs(result, Path("runs/missed"))
    terminal.show_shortest(Console(file=stream, width=width), versions)
    lines = stream.getvalue().splitlines()
    assert len(lines) < 30
    text = " ".join(" ".join(lines).split())
    assert text.endswith(f"verdict: misses the record: {REASON}")
    assert "`exfit show --all runs/missed` verdict:" in text
    assert all(any(line.startswith(name) for line in lines) for name in missed.parameters)
    assert CAUSES[0].sentence in text
    written = text.count("of the fit")
    assert written == count or f"further notes: {count - written}" in text


def shown(result, width):
    """Return what the terminal shows of a fit, line by line."""
    stream = io.StringIO()
    terminal.show(Console(file=stream, width=width), fits.whole(result))
    return stream.getvalue().splitlines()


def with_interval(result, method, interval):
    """Return a fit that matches, whose parameters all have this interval, found so."""
    parameters = {
        name: replace(parameter, interval=interval, interval_method=method)
        for name, parameter in result.parameters.items()
    }
    verdict = result.verdict._replace(verdict=MATCHES)
    return replace(result, parameters=parameters, verdict=verdict)


@pytest.mark.parametrize("width", [60, 80])
def test_all_that_is_shown_of_a_fit_keeps_within_the_terminal_without_blanks_at_the_ends(
    missed, width
):
    for method in ("linear", "profile", "hull"):
        lines = shown(with_interval(missed, method, (1.0, 9.0)), width)
        assert [line for line in lines if line != line.rstrip() or len(line) > width] == []


@pytest.mark.parametrize("width", [50, 60, 80])
def test_a_narrow_terminal_has_the_values_and_their_intervals_in_one_table(missed, width):
    """The start is left out where it has no room: the case has it."""
    for method, remark in (("linear", ""), ("profile", "profile")):
        result = with_interval(missed, method, (1.0, 9.0))
        lines = shown(result, width)
        heads = [line.split() for line in lines if line.startswith("parameter ")]
        rows = [line for line in lines if line.startswith("a ")]
        assert len(heads) == len(rows) == 1
        assert {"fitted", "interval", "unit"} <= {*heads[0]}
        assert width == 60 or ("start" in heads[0]) == (width == 80)
        assert re.search(r"1\.0+ \.\.\. 9\.0+ ", rows[0])
        assert rows[0].endswith(remark)


@pytest.mark.parametrize(
    ("method", "interval"),
    [("profile", (1.0, 9.0)), ("hull", (1.0, None)), ("profile", None), (None, None)],
)
def test_a_standard_error_is_shown_beside_an_interval_of_linear_theory_alone(
    missed, method, interval
):
    distrusted = with_interval(missed, method, interval)
    for name, parameter in missed.parameters.items():
        error = f"{100.0 * parameter.std_error / abs(parameter.value):.2g} %"
        texts = [
            "\n".join(line for line in shown(result, 80) if line.startswith(f"{name} "))
            for result in (missed, distrusted)
        ]
        assert [error in text for text in texts] == [True, False]
        assert distrusted.parameters[name].std_error == parameter.std_error
        cell = f">{parameter.std_error:.2g}</td>"
        cells = [cell in fit_html(result) for result in (missed, distrusted)]
        assert cells == [True, False]


def test_a_value_has_the_digits_of_the_interval_that_stands_beside_it(missed):
    low, high = 1.0, 1.4
    wide = with_interval(missed, "profile", (low, high))
    for parameter in wide.parameters.values():
        assert parameter.rounding_error == pytest.approx((high - low) / 4.0, rel=0.05)
    for parameter in with_interval(missed, "linear", (low, high)).parameters.values():
        assert parameter.rounding_error == parameter.std_error


def printed(text):
    """Return the numbers of a text that are near the upper bound."""
    return [float(number) for number in re.findall(r"\b0\.(?:29\d+|30*)\b", text)]


def test_every_table_has_three_digits_of_a_value_and_none_beyond_its_bounds(missed, tmp_path):
    bound, error = 0.29967, 2278.0
    limited = {"min": 0.1, "max": bound, "std_error": error, "start": 0.15}
    for interval_of, method in (((0.11, bound), "profile"), (None, None)):
        known = {"interval": interval_of, "interval_method": method, **limited}
        result = replace(
            missed,
            seconds=1.0,
            parameters={
                name: replace(parameter, value=0.29966, **known)
                for name, parameter in missed.parameters.items()
            },
        )
        stream = io.StringIO()
        both = {"one": result, "other": result}
        terminal.show(Console(file=stream, width=80), side_by_side(both))
        cases = [row(name, parameters=summary_of(result, "", 1.0).parameters) for name in "abcd"]
        batch = fleet_page(Fleet(tmp_path, tuple(cases)), sisters(cases))
        page = Page(report_html(result, tmp_path))
        tables = {
            "terminal": "\n".join(shown(result, 80)),
            "side by side": stream.getvalue(),
            "notebook": fit_html(result),
            "line": repr(result),
            "batch": Page(batch).text.rpartition("mean")[0],  # which is of several units
            "report": str(page.tables["Fitted parameters"]),
            "as found": str(page.tables["Start and verified: the parameters that differ"]),
        }
        for name, text in tables.items():
            values = printed(text)
            assert len(values) >= len(result.parameters), name
            assert max(values) <= bound, name


def test_what_does_not_match_is_nowhere_called_good_or_converged(missed):
    result = replace(missed, verdict=Verdict("no match", "the response goes the other way"))
    stream = io.StringIO()
    terminal.show(Console(file=stream, width=80), fits.whole(result))
    for text in (stream.getvalue(), fit_html(result), repr(result)):
        assert "no match" in text
        assert "converged" not in text
        assert "good" not in text
    assert not result.holds
