"""The types and editions of the exciters of the catalogue."""

from itertools import groupby

import pytest

from exfit.case.other_model import ALONE
from exfit.models import MODELS
from exfit.models.families import edition_of, family_of, relatives, without_doubles


def test_every_exciter_of_the_catalogue_has_a_type():
    assert {name for name in MODELS if family_of(name) is None} == {ALONE}


@pytest.mark.parametrize(
    ("name", "family"),
    [("AC8B", "AC"), ("ESAC8B", "AC"), ("EXDC2", "DC"), ("IEEET1", "DC"), ("SEXS", "ST")],
)
def test_the_type_is_that_of_the_name(name, family):
    assert family_of(name) == family
    own, *others = relatives(name, MODELS)
    assert own == name
    assert name not in others
    assert {family_of(other) for other in others} == {family}


def test_a_model_of_a_users_own_has_no_relatives():
    assert relatives("MINE", MODELS) == ("MINE",)


# --- editions -------------------------------------------------------------------------------------


def test_a_model_of_2016_is_one_by_its_name_and_by_its_source(model):
    assert (edition_of(model) == 2016) == ("IEEE Std 421.5-2016" in MODELS[model].title)


# a catalogue in small: AC1 and AC8 in both editions, AC9 and DC3 in one, and another model
SMALL = ("AC1A", "AC1C", "AC8B", "AC8C", "AC9C", "DC1A", "DC1C", "DC3A", "EXAC1")


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("AC8B", ["AC8B", "AC1A", "EXAC1"]),
        ("EXAC1", ["EXAC1", "AC1A", "AC8B"]),
        ("AC8C", ["AC8C", "AC1C", "AC9C", "EXAC1"]),
        ("DC1A", ["DC1A", "DC3A"]),
        ("DC1C", ["DC1C", "DC3A"]),  # the edition of 2016 has DC3A as it was
        ("DC3A", ["DC3A", "DC1A"]),
    ],
)
def test_relatives_are_of_the_edition_of_the_model(name, expected):
    assert [*relatives(name, SMALL)] == expected


@pytest.mark.parametrize("name", ["AC8B", "AC8C", "DC3A", "EXAC1", "MINE"])
def test_a_catalogue_without_doubles_has_each_type_once_and_lacks_none(name):
    single = without_doubles(name, SMALL)
    types = [other.rstrip("ABC") for other in single]
    assert len(set(types)) == len(types)
    assert {*types} == {other.rstrip("ABC") for other in SMALL}
    editions = {edition_of(other) for other in single if other[:3] in ("AC1", "AC8", "DC1")}
    assert editions == {2016 if name == "AC8C" else 2005}


def test_no_two_relatives_of_a_model_of_the_catalogue_are_forms_of_one_type():
    for name in MODELS:
        of_standard = sorted(other for other in relatives(name, MODELS) if edition_of(other))
        for _, forms in groupby(of_standard, lambda other: other[:-1]):
            assert len([*forms]) == 1, name
