"""Intervals beside a misfit: there are none, and every table says why."""

import csv
import io

import pytest
from fleets import row
from pages import Page
from records import case_of, config
from rich.console import Console
from tiers import few_of

from exfit import workflows
from exfit.features.fleet.folder import Fleet, summary_of
from exfit.features.fleet.page import fleet_page
from exfit.features.fleet.sisters import sisters
from exfit.features.fleet.table import fleet_table, parameter_table
from exfit.features.report.page import html as report_html
from exfit.output import fits, terminal
from exfit.output.figures import profiles as profile_figure
from exfit.output.notebook import fit_html
from exfit.results.verdict import MISSES, NO_MATCH

IN_PLACE = {MISSES: "none: misses", NO_MATCH: "none: no match"}


def faulty_case(verdict, folder):
    """Return a case whose response misses its record by a limit, or goes the other way."""
    content = config("ac1a_good")
    del content["validate"]
    content["estimate"] = content.get("estimate", {}) | {"causes": 0}  # another test's subject
    if verdict == NO_MATCH:
        content["test"]["vref"][0]["step"] = -0.05
    else:
        content["parameters"]["fixed"] |= {"VAMAX": 6.0, "VRMAX": 6.0}
    return case_of(content, folder)


@pytest.fixture(scope="module", params=few_of([MISSES, NO_MATCH], 1, whole=True))
def case(request, tmp_path_factory):
    return faulty_case(request.param, tmp_path_factory.mktemp("misfit"))


@pytest.fixture(scope="module")
def result(case):
    fitted = workflows.fit(case)
    assert fitted.verdict.verdict in IN_PLACE
    return fitted


def test_no_parameter_has_an_interval_and_each_says_why(result):
    for parameter in result.parameters.values():
        assert parameter.interval is None
        assert parameter.interval_method is None
        assert parameter.linear_error is None
        assert parameter.why == result.verdict.no_interval
    known = result.knowledge.confidence.parameters.values()
    assert {(each.interval, each.why) for each in known} == {(None, result.verdict.no_interval)}
    (sentence,) = result.knowledge.sentences
    assert all(name in sentence for name in result.parameters)
    assert "have no interval: the response" in sentence
    assert not any("+-" in test.done for test in result.tests)


def test_no_table_shows_one(result, tmp_path):
    word = IN_PLACE[result.verdict.verdict]
    stream = io.StringIO()
    terminal.show(Console(file=stream, width=80), fits.whole(result))
    table = stream.getvalue().partition("parameter")[2].partition("\n\n")[0]
    assert table.count(word) == fit_html(result).count(word) == len(result.parameters)
    assert " ... " not in table
    assert " ... " not in fit_html(result)
    page = Page(report_html(result, tmp_path))
    cells = {line[3] for line in page.tables["Fitted parameters"][1:]}
    assert cells == {result.verdict.no_interval}


def test_no_table_of_a_batch_shows_one(result, tmp_path):
    summary = summary_of(result, "", 1.0)
    cases = [
        row(name, verdict=summary.verdict, parameters=summary.parameters, holds=False)
        for name in "ab"
    ]
    (line, _) = csv.DictReader(io.StringIO(fleet_table(cases)))
    groups = sisters(cases)
    lines = [*csv.DictReader(io.StringIO(parameter_table(cases, groups)))]
    assert len(lines) == 2 * len(result.parameters)
    for name in result.parameters:
        assert (line[f"{name} low"], line[f"{name} high"]) == ("", "")
    for each in lines:
        assert (each["low"], each["high"]) == ("", "")
        assert each["remark"] == f"no interval: {result.verdict.verdict}"
    text = Page(fleet_page(Fleet(tmp_path, tuple(cases)), groups)).text
    assert text.count(f"no interval: {result.verdict.verdict}") == len(lines)
    assert summary.unresolved == ()


def test_no_profile_has_one(case, result):
    profiled = workflows.profile(case, ["KA"])
    (profile,) = profiled.profiles
    assert profiled.verdict.verdict == result.verdict.verdict
    assert (profile.low, profile.high, profile.linear) == (None, None, None)
    assert profile.ends == (result.verdict.no_interval,) * 2
    stream = io.StringIO()
    terminal.show(Console(file=stream, width=80), fits.profiles(profiled))
    assert IN_PLACE[profiled.verdict.verdict] in stream.getvalue()
    assert " ".join(stream.getvalue().split()).count("no parameter has an interval") == 1
    figure = profile_figure(profiled)
    assert f"no interval: {result.verdict.misfit}" in figure.get_suptitle()
