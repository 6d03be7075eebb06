"""A case with another exciter: what it takes from the case, and what from the data sheet."""

from dataclasses import replace

import pytest
from places import CONFIGS

from exfit.case.load import load_case, parse_case
from exfit.case.other_model import ALONE, bounds_of, free_of, with_exciter
from exfit.errors import CaseError
from exfit.models import MODELS

CASE = CONFIGS / "ac8b_unit1.yaml"
EXCITERS = [name for name in MODELS if name != ALONE]


@pytest.mark.parametrize("name", EXCITERS)
def test_free_parameters_and_bounds_are_those_of_a_new_case(name):
    case = with_exciter(load_case(CASE), name, MODELS[name])
    sheet = free_of(MODELS[name])
    assert {*case.free(), *case.held()} == {row.symbol for row in sheet}
    for row in sheet:
        section = case.parameters.free[row.symbol]
        assert (section.start, section.min, section.max) == (row.typical, *bounds_of(row))
    fixed = {row.symbol for row in MODELS[name].sheet} - {row.symbol for row in sheet}
    assert fixed <= {*case.typical()}


def test_plant_tests_and_records_stay():
    own = load_case(CASE)
    case = with_exciter(own, "SEXS", MODELS["SEXS"])
    assert (case.plant, case.test, case.record) == (own.plant, own.test, own.record)
    assert case.validations == own.validations
    machine = {name: value for name, value in own.values().items() if name.startswith("machine.")}
    assert machine.items() <= case.values().items()
    assert (case.subject, case.path.name, case.from_file) == ("SEXS", "ac8b_unit1-SEXS", False)


def test_values_given_for_the_exciter_are_left_behind_those_of_the_machine_are_not():
    values = {"KPR": 50.0, "TE": 0.9, "machine.Tpd0": 7.0}
    own = load_case(CASE).with_values(values, "file", dict.fromkeys(values, "fitted"))
    other = with_exciter(own, "SEXS", MODELS["SEXS"])
    assert [*other.given_values] == ["machine.Tpd0"]
    sources = other.sources()  # SEXS has a TE of its own
    assert (sources["TE"], sources["machine.Tpd0"]) == ("not stated", "fitted")


def test_ties_of_the_machine_stay_unless_they_follow_the_exciter():
    text = CASE.read_text()

    def tied(formula):
        first, second = text.split("Xpd: 0.3,")
        return parse_case(f'{first}Xpd: "{formula}",{second}', CASE)

    case = with_exciter(tied("=machine.Xd/6"), "SEXS", MODELS["SEXS"])
    assert case.values()["machine.Xpd"] == pytest.approx(case.values()["machine.Xd"] / 6)
    with pytest.raises(CaseError, match=r"machine\.Xpd =KPR/300: KPR belongs to AC8B"):
        with_exciter(tied("=KPR/300"), "SEXS", MODELS["SEXS"])


def test_a_case_without_an_exciter_is_refused():
    case = load_case(CONFIGS / "machine_playback.yaml")
    with pytest.raises(CaseError, match="plant machine-playback has no exciter"):
        with_exciter(replace(case), "SEXS", MODELS["SEXS"])
