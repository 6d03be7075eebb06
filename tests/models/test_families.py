"""The types of the exciters of the catalogue."""

import pytest

from exfit.case.starting.starting_case import ALONE
from exfit.models import MODELS
from exfit.models.families import family_of, relatives


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
