"""The form of a report: every row is filled, or says that the case is silent."""

import pytest
from pages import Page
from places import ROOT
from programmes import programme_content, written
from records import TEST, TIME, case_of, config, one, synthetic

import exfit
from exfit import workflows
from exfit.features.programme.programme_page import programme_page
from exfit.features.report.behaviour import usability
from exfit.features.report.form import form, form_table, form_without_bumps, rated, signatures
from exfit.features.report.matches import as_found
from exfit.features.report.page import html, result_page
from exfit.output.blocks import Chart, Note, Table
from exfit.results import facts

EVENTS = ("grid_event", "two_units")  # their form has disturbances and their size
QUICK = ("first_order", "machine_playback")  # the others are fitted in the long run
SAMPLES = [
    pytest.param(path.stem, marks=() if path.stem in QUICK else pytest.mark.long)
    for path in sorted((ROOT / "configs").glob("*.yaml"))
]
STATED = {
    "plant": "Höllental",
    "Unit": 2,
    "Exciter maker": "Maker AG",
    "excitation-model": "X-100",
    "AVR": "digital, firmware 3.2",
    "Stabiliser": "none",
    "Test date": "2026-05-03",
    "Tested by": "N. N.",
    "Machine state": "hot, 68 °C",
    "Revision": 3,
    "Written by": "M. M.",
}


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    """A fit of a unit whose case states a few facts, and what was in the planner's base."""
    folder = tmp_path_factory.mktemp("unit")
    synthetic(folder, TEST, TIME)
    content = {
        **one(TEST, free=["KA"]),
        "about": STATED,
        "as_found": {"source": "unit.dyr, bus 101", "parameters": {"KA": 200.0}},
    }
    content["plant"]["sources"] = {"Xd": "nameplate", "H": "typical"}
    content["plant"]["parameters"]["H"] = 3.25
    return workflows.fit(case_of(content, folder))


def answers(result):
    return {row.asked: row for row in form(result)}


@pytest.mark.parametrize("name", SAMPLES)
def test_every_row_of_the_form_is_filled_or_not_stated(name, tmp_path):
    result = workflows.fit(case_of(config(name), tmp_path))
    rows = form(result)
    governed = any(part.kind == "governor" for part in result.parts)
    assert len(rows) == 32 + (2 if name in EVENTS else 0) + (4 if governed else 0)
    assert all(row.answer.strip() and "nan" not in row.answer for row in rows)
    sections = {section.key for section in result_page(result, tmp_path).sections}
    assert all(row.section in sections for row in rows if row.section)
    assert {"R2.1.1", "R2.1.2", "R2.1.3", "R2.1.4", "R2.1.5", "R2.1.6", "R6"} <= {
        row.cf for row in rows
    }
    page = Page(html(result, tmp_path))
    table = page.tables["What a verification report states (cf.: clauses of NERC MOD-026-1)"]
    shown = [row for row in rows if row.is_stated]
    assert [row[1] for row in table[1:]] == [row.asked for row in shown]
    assert [" ".join(row[2].split()) for row in table[1:]] == [
        " ".join(row.answer.split()) for row in shown
    ]
    listed = page.text.partition("Not stated:")[2]
    assert all(row.asked in listed for row in rows if row.answer == "not stated")


def test_facts_of_a_case_answer_by_name_in_any_spelling(unit):
    rows = answers(unit)
    for asked, answer in {
        "Plant": "Höllental",
        "Unit": "2",
        "Excitation maker": "Maker AG",
        "Excitation model": "X-100",
        "Regulator": "digital, firmware 3.2",
        "Stabiliser": "none",
        "Machine state (cold or hot machine)": "hot, 68 °C",
        "Revision": "3",
    }.items():
        assert rows[asked].answer == answer
        assert rows[asked].is_stated


def test_what_a_case_does_not_state_is_not_made_up(unit):
    rows = answers(unit)
    for asked in ("Instruments", "Recorder", "Tap (of the transformer)", "Speed", "Approved by"):
        assert rows[asked].answer == "not stated"
        assert not rows[asked].is_stated
    assert rows["Compensation (droop, line drop)"].answer == "not stated; none in the model"


def test_the_data_of_the_generator_are_reported_with_their_sources(unit):
    rows = answers(unit)
    assert "Xd 1.8 (nameplate)" in rows["Reactances of the generator"].answer
    assert rows["Inertia of the generator"].answer == "H 3.25 (typical)"
    assert "source not stated" in rows["Time constants of the generator"].answer


def test_no_two_facts_answer_to_one_name():
    words = [word for fact in facts.ASKED for word in (fact.key, *fact.others)]
    spelled = [word.lower().replace(" ", "") for word in words]
    assert len(spelled) == len(set(spelled))


def test_every_fact_that_a_report_asks_for_is_in_the_documentation():
    page = (ROOT / "docs" / "reports.md").read_text(encoding="utf-8")
    assert [fact.key for fact in facts.ASKED if f"`{fact.key}`" not in page] == []


def test_a_role_without_a_name_has_an_empty_cell_to_be_signed(unit):
    facts, block = signatures(unit)
    assert facts.pairs == (("Plant", "Höllental"), ("Unit", "2"), ("Revision", "3"))
    rows = [[cell.text for cell in row] for row in block.rows]
    assert [row[1] for row in rows] == ["N. N.", "M. M.", "", ""]
    assert rows[0] == ["Tested by", "N. N.", "2026-05-03", ""]


def test_what_is_not_stated_is_one_list_at_the_end(unit):
    table, *notes = form_table(form(unit))
    assert not any(cell.text == "not stated" for row in table.rows for cell in row)
    plain, of_model = (note for note in notes if note.label.startswith("Not stated"))
    assert plain.label == "Not stated:"
    assert {"Rated", "Instruments", "Report date"} <= set(plain.text.rstrip(".").split(", "))
    assert of_model.text == "Compensation (droop, line drop) (R2.1.5)."


def test_a_stable_unit_passes_the_checks_of_usability(unit):
    checks = usability(unit)
    assert [check.passed for check in checks] == [True, True, True]
    assert "least damping ratio" in checks[2].result


def test_what_was_found_and_what_was_verified_stand_beside_each_other(unit):
    blocks = [*as_found(unit)]
    changed, errors = (block for block in blocks if isinstance(block, Table))
    ((name, *cells),) = [[cell.text for cell in row] for row in changed.rows]
    fitted = unit.parameters["KA"]
    share = 100.0 * (fitted.value / 200.0 - 1.0)
    assert (name, *cells[:2]) == ("KA", "200", fitted.rounded(fitted.value))
    assert cells[2] == f"{fitted.value - 200.0:+.3g} ({share:+.3g} %)"
    (same,) = [
        block.text for block in blocks
        if isinstance(block, Note) and block.text.startswith("Unchanged: ")
    ]  # fmt: skip
    assert {"TE", "machine.Xd"} <= set(same.removeprefix("Unchanged: ").rstrip(".").split(", "))
    ((_, _, before, verified),) = [[cell.text for cell in row] for row in errors.rows]
    assert verified == f"{unit.rmse:.3g}"
    assert unit.rmse < float(before)
    assert sum(isinstance(block, Chart) for block in blocks) == 1
    assert answers(unit)["Model in the planner's base"].answer == "AC1A, unit.dyr, bus 101"


def test_a_rating_may_be_several_facts():
    assert rated({"Rated MVA": 120.0, "Plant": "A", "Rated voltage": "13.8 kV"}) == (
        "MVA 120, voltage 13.8 kV"
    )
    assert rated({"Rating": "120 MVA", "Rated voltage": "13.8 kV"}) == "120 MVA"
    assert rated({"Plant": "A"}) == "not stated"


def test_the_form_of_a_programme_without_bump_tests_says_so_and_has_what_it_measured(tmp_path):
    content = programme_content()
    content["tests"] = content["tests"][:1]
    result = exfit.run(written(content, tmp_path))
    page = programme_page(result, tmp_path)
    keys = [section.key for section in page.sections]
    assert keys == ["programme", "signatures", "test-1", "test", "form"]
    rows = {row.asked: row for row in form_without_bumps(result)}
    shown = [row[2].text for row in page.sections[-1].blocks[0].rows]
    assert shown == [row.answer for row in rows.values() if row.is_stated]
    assert rows["Model response beside a recorded response"].answer == (
        "not stated: no bump test in this programme"
    )
    assert rows["Unit"].answer == "1"
    assert "(measured)" in rows["Saturation of the generator"].answer
    assert not rows["No-disturbance run"].is_stated
