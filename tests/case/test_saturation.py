"""The exciter's saturation as AEX exp(BEX E): against formulas typed a second time."""

from math import exp

import numpy as np
import pytest
import yaml
from oracle import SATURATED
from places import CONFIGS
from records import case_of, config
from scipy.integrate import solve_ivp

from exfit.case.case import Case
from exfit.case.parts import has_saturation
from exfit.errors import CaseError
from exfit.features.planner.export import export
from exfit.features.planner.fields import Field
from exfit.features.planner.records import alternatives, read_values, record_fields
from exfit.features.report.model import saturation
from exfit.models import MODELS
from exfit.models.sheet import typical
from exfit.workflows import check, fit, simulate

A, B = 1.05e-3, 1.433  # of AC1A's sample data, about
KA, TA, TE, KF, TF, KE, KD, TPD0 = 400.0, 0.02, 0.8, 0.03, 1.0, 1.0, 0.38, 6.0
STEP = 0.02  # pu, so small that no limit is met
SAME = 1e-8  # pu: both integrations are more exact
FORMS = {
    "exponential": lambda e: A * np.exp(B * e),
    "exponential-se": lambda e: e * A * np.exp(B * e),
}


def content(form, curve):
    """Return AC1A without rectifier loading on a machine of one axis, its curve as given."""
    return {
        "model": "AC1A",
        "saturation": form,
        "given": "exact",
        "plant": {
            "type": "open-circuit",
            "machine": "ONE_AXIS",
            "parameters": {"Tpd0": TPD0, "Xd": 1.8, "Xpd": 0.3, "S10": 0.0, "S12": 0.0},
        },
        "test": {"vt0": 1.0, "duration": 4.0, "vref": [{"at": 0.0, "step": STEP}]},
        "simulation": {"step": 0.001},
        "parameters": {
            "fixed": {
                "KA": KA, "TA": TA, "TE": TE, "KF": KF, "TF": TF, "KC": 0.0, "KD": KD, "KE": KE,
                "E1": 4.18, "E2": 3.14, "VRMAX": 99.0, "VRMIN": -99.0, **curve,
            }
        },
    }  # fmt: skip


def independent(vx, times):
    """Return vt by SciPy from the equations of AC1A without limits, E'q as the voltage.

    The states are E'q, VE, VA and that of the rate feedback.
    """

    def demand(ve, ifd):
        return KE * ve + vx(ve) + KD * ifd

    start = demand(1.0, 1.0)
    vref = 1.0 + start / KA + STEP

    def slopes(_, x):
        vt, ve, va, xf = x
        vfe = demand(ve, vt)
        vf = KF * (vfe - xf) / TF
        return [
            (ve - vt) / TPD0,
            (va - vfe) / TE,
            (KA * (vref - vt - vf) - va) / TA,
            (vfe - xf) / TF,
        ]

    solution = solve_ivp(
        slopes, (0.0, times[-1]), [1.0, 1.0, start, start], "DOP853", times, rtol=1e-11, atol=1e-12
    )
    return solution.y[0]


@pytest.mark.parametrize("form", FORMS)
def test_the_response_is_that_of_the_formula(form):
    case = Case.from_dict(content(form, {"AEX": A, "BEX": B}))
    response = simulate(case).response
    expected = independent(FORMS[form], response.time)
    assert np.max(np.abs(response.signals["vt"] - expected)) < SAME


@pytest.mark.parametrize("form", FORMS)
def test_the_points_that_follow_lie_on_the_curve_and_give_it_back(form):
    case = Case.from_dict(content(form, {"AEX": A, "BEX": B}))
    values = case.values()
    for e, se in (("E1", "SE1"), ("E2", "SE2")):
        assert values[se] == pytest.approx(FORMS[form](values[e]) / values[e], rel=1e-13)
        assert se not in case.typical()
    points = {symbol: values[symbol] for symbol in ("SE1", "SE2")}
    others = Case.from_dict(content(form, points))
    signals = [simulate(each).response.signals["vt"] for each in (case, others)]
    assert np.array_equal(*signals)


def test_its_constants_may_be_free_with_exact_derivatives():
    described = content("exponential", {})
    described["parameters"]["free"] = {
        "AEX": {"start": A, "min": A / 10, "max": 10 * A},
        "BEX": {"start": B, "scale": "linear"},
    }
    case = Case.from_dict(described)
    assert list(case.free()) == ["AEX", "BEX"]
    assert check(case).agrees


def test_a_fit_shows_it_and_the_file_for_psse_has_its_points(tmp_path):
    described = config("ac1a_good")
    del described["validate"]
    described["saturation"] = "exponential"
    described["parameters"]["fixed"] |= {"AEX": A, "BEX": B}
    for symbol in ("SE1", "SE2"):
        del described["parameters"]["fixed"][symbol]
    result = fit(case_of(described, tmp_path))
    assert result.ties == {"SE1": "=AEX*exp(BEX*E1)/E1", "SE2": "=AEX*exp(BEX*E2)/E2"}
    assert (result.fixed["AEX"], result.fixed["BEX"]) == (A, B)
    assert f"AEX = {A:g}, BEX = {B:g} 1/pu" in saturation(result)
    exported = export(result, 1, "1")
    for voltage in (3.14, 4.18):
        se = A * exp(B * voltage) / voltage
        numbers = exported.text.partition("'ESAC1A'")[2].split("/")[0].split()
        place = numbers.index(str(voltage))
        assert float(numbers[place + 1]) == pytest.approx(se, rel=1e-13)
    assert any("PSS/E takes E1 SE1 E2 SE2 as quadratic" in text for text in exported.warnings)


@pytest.mark.parametrize(
    ("form", "curve", "text"),
    [
        ("quadratic", {"AEX": A, "BEX": B}, r"fixed\.AEX: of an exponential curve; .*quadratic"),
        ("exponential", {"AEX": A}, r"fixed\.BEX: is missing: AEX is given"),
        ("exponential-se", {"BEX": B}, r"fixed\.AEX: is missing: BEX is given"),
        ("exponential", {"AEX": A, "BEX": B, "SE2": 0.1}, r"fixed\.SE2: not allowed with AEX"),
        ("exponential", {"AEX": -A, "BEX": B}, r"fixed\.AEX: -0\.00105 is below 0"),
        ("exponential", {"AEX": A, "BEX": 0.01}, r"fixed\.AEX: .* at 4\.18 pu is not above"),
        ("exponential", {"AEX": A, "BEX": 1e3}, r"AEX\*exp\(BEX\*E1\)/E1: too large a number"),
    ],
)
def test_what_contradicts_it_is_refused(form, curve, text):
    with pytest.raises(CaseError, match=text):
        Case.from_dict(content(form, curve))


def test_a_model_without_saturation_has_no_such_constants():
    described = config("models/sexs")
    described["saturation"] = "exponential"
    described["parameters"].setdefault("fixed", {})["AEX"] = A
    with pytest.raises(CaseError, match="AEX: not a parameter of SEXS"):
        Case.from_dict(described)


WITH_POINTS = [(name, form) for name, form in SATURATED if has_saturation(MODELS[name].sheet)]
ANYWHERE = ((0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (3.0, 3.0), (4.0, 2.0))  # E1, E2


def unsaturated(E1, E2):
    return {"E1": E1, "SE1": 0.0, "E2": E2, "SE2": 0.0}


@pytest.mark.parametrize("case", WITH_POINTS, ids="-".join)
def test_two_points_of_zero_are_no_saturation_wherever_they_lie(case):
    name, form = case
    content = yaml.safe_load((CONFIGS / "models" / f"{name.lower()}.yaml").read_text())
    content |= {"saturation": form, "test": {**content["test"], "duration": 2.0}}
    content["simulation"] = {"step": 0.001}
    fixed = content["parameters"].setdefault("fixed", {})

    def response(E1, E2):
        fixed.update(unsaturated(E1, E2))
        return simulate(Case.from_dict(content)).response.signals["vt"]

    expected = response(1.0, 2.0)
    assert np.ptp(expected) > 1e-3
    for points in ANYWHERE:
        np.testing.assert_array_equal(response(*points), expected)


@pytest.mark.parametrize("name", list(dict.fromkeys(name for name, _ in WITH_POINTS)))
def test_a_record_without_saturation_is_read_and_written_wherever_its_points_lie(name):
    for definition in alternatives(MODELS[name]):
        for E1, E2 in ANYWHERE:
            values = typical(MODELS[name].sheet) | unsaturated(E1, E2)
            fields = [Field(text, 1) for text in record_fields(definition, values)]
            read = read_values(definition, 1, tuple(fields))
            assert read.faults == []
            assert unsaturated(*sorted((E1, E2))).items() <= read.values.items()


@pytest.mark.parametrize(("symbol", "points"), [("E1", (0.0, 4.0)), ("E2", (4.0, 0.0))])
def test_a_point_at_zero_voltage_beside_a_saturation_is_refused(symbol, points):
    curve = {"E1": points[0], "E2": points[1], "SE1": 0.1, "SE2": 0.1}
    with pytest.raises(CaseError, match=rf"{symbol}: 0 is no point of a saturation curve"):
        Case.from_dict(content("quadratic", curve))
