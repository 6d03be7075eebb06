"""Every given value has a standard error, or a reason why it is exact."""

import pytest
from places import CONFIGS
from records import config

from exfit.case.case import Case
from exfit.case.given_errors import SWITCHES, given_std_errors, kind_of
from exfit.case.load import load_case

MODELS = sorted((CONFIGS / "models").glob("*.yaml"))


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_every_value_that_is_no_switch_has_an_error_of_its_kind(path):
    case = load_case(path)
    for part in case.parts.all:
        for row in part.sheet:
            kind = kind_of(part, row)
            if kind is None:
                fixed = part.kind.endswith("network")
                assert row.unit == SWITCHES or row.symbol in ("E1", "E2", "THETAP") or fixed
            else:
                assert 0.0 < kind.maker <= kind.other <= kind.typical < 1.0


def errors(sources=None, given="uncertain", std_errors=None, **fixed):
    content = config("ac1a_typical")
    content["given"] = given
    content["parameters"]["fixed"] |= fixed
    content["parameters"]["sources"] = sources or {}
    content["parameters"]["std_errors"] = std_errors or {}
    return given_std_errors(Case.from_dict(content))


def test_what_is_free_zero_or_measured_is_exact():
    found = errors(sources={"SE1": "measured", "SE2": "test report"})
    assert not {"KA", "TR", "TB", "KE", "E1", "E2", "SE1", "SE2"} & {*found}
    assert {"VAMAX", "machine.Tpd0", "machine.S10"} <= {*found}


def test_a_typical_value_is_less_certain_than_one_of_the_maker():
    of = [errors(sources={"SE1": source})["SE1"] for source in ("maker", "typical")]
    assert of[0] < errors()["SE1"] < of[1]


def test_the_error_of_the_case_comes_first_and_exact_leaves_no_other():
    assert errors(std_errors={"SE1": 0.001})["SE1"] == 0.001
    assert errors(given="exact", std_errors={"SE1": 0.001}) == {"SE1": 0.001}
    assert errors(given="exact") == {}
