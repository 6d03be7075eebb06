"""Two fits side by side in a report: two revisions of a unit, or two units."""

import pytest
from click.testing import CliRunner
from pages import Page
from records import TEST, TIME, case_of, one, synthetic

from exfit import cli, workflows
from exfit.features.report.matches import against
from exfit.features.report.page import html
from exfit.output import run_folder
from exfit.output.blocks import Chart


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """The folders of two fits: the second has one parameter more, and says its revision."""
    places = []
    for revision, free in ((1, ["KA"]), (2, ["KA", "TE"])):
        folder = tmp_path_factory.mktemp(f"revision{revision}")
        synthetic(folder, TEST, TIME)
        content = {**one(TEST, free=free), "about": {"Plant": "Höllental", "Revision": revision}}
        run_folder.write_fit(workflows.fit(case_of(content, folder)), folder / "run")
        places.append(folder / "run")
    return places


@pytest.fixture(scope="module")
def fits(folders):
    from exfit.results.io import load_result

    return [load_result(folder) for folder in folders]


def charts(this, other):
    """Return the only chart of two fits beside each other."""
    (chart,) = [each for each in against(this, other) if isinstance(each, Chart)]
    return chart


def test_both_fits_are_named_with_their_facts_and_parameters(fits):
    older, newer = fits
    page = Page(html(newer, "run", older))
    facts = {
        row[0]: row[1:]
        for row in page.tables["Facts of Höllental, revision 2 and Höllental, revision 1"][1:]
    }
    assert facts["case"] == ["case.yaml", "case.yaml"]
    assert facts["model"] == ["AC1A", "AC1A"]
    assert facts["rmse of fit (pu)"][0].startswith(f"{newer.rmse:.3g} ")
    rows = {row[0]: row[1:] for row in page.tables["Fitted parameters of either fit"][1:]}
    assert rows.keys() == {"KA", "TE"}
    difference = newer.parameters["KA"].value - older.parameters["KA"].value
    assert rows["KA"][2] == f"{difference:.3g}"
    assert rows["TE"][1].endswith("(not fitted)")
    assert page.text.count("Comparison with another fit") == 2


def test_responses_to_one_record_are_drawn_over_it(fits):
    older, newer = fits
    chart = charts(newer, older)
    (panel,) = chart.panels
    assert [line.label for line in panel.series] == [
        "measured",
        "Höllental, revision 2",
        "Höllental, revision 1",
    ]


def test_responses_to_two_records_are_drawn_above_each_other(fits, tmp_path):
    synthetic(tmp_path, TEST, TIME, seed=7)
    unit = workflows.fit(case_of(one(TEST, free=["KA"]), tmp_path))
    chart = charts(fits[0], unit)
    assert [panel.title.rpartition(", ")[2] for panel in chart.panels] == ["revision 1", "case"]


def test_a_report_without_another_fit_has_no_such_section(fits):
    assert "Comparison with another fit" not in Page(html(fits[0], "run")).text


def test_the_command_takes_the_other_result(folders, tmp_path):
    place = tmp_path / "both.html"
    arguments = ["report", str(folders[1]), "--against", str(folders[0]), "-o", str(place)]
    done = CliRunner().invoke(cli.main, arguments)
    assert done.exit_code == 0, done.output
    assert "Comparison with another fit" in place.read_text(encoding="utf-8")
