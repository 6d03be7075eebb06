"""Similar units side by side: which are similar, what is compared, what stands out."""

import numpy as np
import pytest
from fleets import parameter, row

from exfit.features.fleet.sisters import OUTLIER, UNDETERMINED, WITHOUT_INTERVAL, sisters

MAKE = {"Excitation maker": "Maker AG", "Rated": "120 MVA"}


def unit(number, gain=400.0, error=4.0, **content):
    """Return a good fit of a unit whose KA is known to within an error."""
    name = f"unit{number}"
    values = {"KA": parameter(gain, error)}
    return row(name, **{"bus": number, "machine_id": "1", "parameters": values, **content})


def remarks(group, name="KA"):
    """Return the remarks on a parameter by case."""
    (column,) = [column for column in group.parameters if column.name == name]
    return {value.case: value.remark for value in column.values}


def test_sisters_share_model_machine_make_and_rating():
    """Capitals and blanks make no difference, and a fact that one alone states parts them."""
    cases = [
        unit(1, about=MAKE),
        unit(2, about={"exciter-maker": "maker  ag", "Rating": "120 MVA", "Unit": "2"}),
        unit(3, about={**MAKE, "Rated": "60 MVA"}),
        unit(4),
        unit(5),
        unit(6, model="AC7B"),
        unit(7, machine_model="GENSAL"),
        unit(8, status="failed"),
    ]
    groups = sisters(cases)
    assert [[case.name for case in group.cases] for group in groups] == [
        ["unit4", "unit5"],
        ["unit1", "unit2"],
    ]
    assert groups[1].title == "AC1A on GENROU, Maker AG, 120 MVA"


def test_an_outlier_among_sisters_is_marked_and_nothing_else():
    rng = np.random.default_rng(2)
    cases = [unit(k, 400.0 + 4.0 * rng.standard_normal()) for k in range(8)]
    cases[3] = unit(3, 520.0)
    (group,) = sisters(cases)
    assert [case for case, remark in remarks(group).items() if remark] == ["unit3"]
    assert remarks(group)["unit3"] == OUTLIER
    (column,) = group.parameters
    assert column.centre == pytest.approx(400.0, abs=10.0)
    assert column.values[3].deviation > 5.0
    assert column.values[3].probability < 0.05
    assert group.outliers == 1
    assert [value.case for value in column.remarkable] == ["unit3"]


def test_of_three_sisters_none_is_an_outlier_but_intervals_that_do_not_meet_are_named():
    (group,) = sisters([unit(1), unit(2, 410.0), unit(3, 520.0)])
    assert remarks(group) == {
        "unit1": "beyond the interval of unit3",
        "unit2": "beyond the interval of unit3",
        "unit3": "beyond the interval of unit1, unit2",
    }
    assert group.outliers == 0
    assert group.parameters[0].centre is None
    assert all(value.deviation is None for value in group.parameters[0].values)


def test_what_is_not_determined_is_shown_and_not_compared():
    vague = {"KA": parameter(9000.0)}
    cases = [unit(4, parameters=vague, unresolved=("KA",)), unit(5, parameters=vague)]
    (group,) = sisters([*(unit(k) for k in range(4)), *cases])
    assert remarks(group) == {
        **{f"unit{k}": "" for k in range(4)},
        "unit4": UNDETERMINED,
        "unit5": WITHOUT_INTERVAL,
    }
    assert group.parameters[0].remarkable == ()
    half_open = {"KA": parameter(9000.0, 1.0)._replace(high=None)}
    (group,) = sisters([unit(1), unit(2, parameters=half_open)])
    assert remarks(group)["unit2"] == "beyond the interval of unit1"


def test_only_what_was_fitted_is_compared():
    values = {"KA": parameter(400.0, 4.0), "TA": parameter(0.02, source="typical")}
    (group,) = sisters([unit(k, parameters=values) for k in range(3)])
    assert [column.name for column in group.parameters] == ["KA"]


def test_fits_that_miss_their_records_and_further_cases_of_a_unit_are_left_out():
    plants = ({"Plant": "A", "Unit": 1}, {"Plant": "A", "Unit": 1}, {"Plant": "B", "Unit": 1})
    cases = [
        unit(1),
        unit(2, verdict="misses the record", holds=False),
        row("unit1-again", bus=1, machine_id="1", parameters={"KA": parameter(900.0, 4.0)}),
        *(row(f"plant{k}", about=about) for k, about in enumerate(plants)),
        row("copy", key="a" * 32),
        row("copy-2", key="a" * 32),
    ]
    (group,) = sisters(cases)
    assert [case.name for case in group.cases] == ["unit1", "plant0", "plant2", "copy"]
    assert group.left_out == {
        "unit2": "misses the record",
        "unit1-again": "the unit of unit1",
        "plant1": "the unit of plant0",
        "copy-2": "the unit of copy",
    }


def test_a_group_without_two_good_units_is_none():
    assert sisters([unit(1), unit(2, holds=False)]) == ()
    assert sisters([]) == ()
