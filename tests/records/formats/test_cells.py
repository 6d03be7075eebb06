"""The head of a table says what its columns are called, and in which units they are."""

import pytest

from exfit.records.formats.cells import is_units, names_of, units_of


def test_names_stay_as_they_are_and_a_column_without_one_is_called_by_its_number():
    assert names_of(["", " Ut [kV] ", "  ", "vt", "vt"]) == ("1", "Ut [kV]", "3", "vt", "vt")


@pytest.mark.parametrize("row", [["s", "kV"], ["[s]", "[1]"], ["s", ""], ["s", "-", "%"]])
def test_a_row_of_units_is_known(row):
    assert is_units(row)


@pytest.mark.parametrize("row", [["t", "kV"], ["S", "T"], ["s", "vt"]])
def test_a_row_with_anything_else_is_none(row):
    assert not is_units(row)


def test_a_unit_in_its_own_row_counts_before_that_in_the_name():
    names = ("t [ms]", "U", "P [MW]", "q", "r")
    assert units_of(names, ("s", "[kV]", "", "-", "[1]")) == {
        "t [ms]": "s", "U": "kV", "P [MW]": "MW"
    }  # fmt: skip
    assert units_of(names) == {"t [ms]": "ms", "P [MW]": "MW"}
