"""A fitted exciter as another model: exact where it can be, and else what is lost is said."""

import hashlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from translations import NETWORK, NO_LIMITS, any_fit, fit_of

import exfit
from exfit.errors import ExfitError, ModelError
from exfit.features.planner.export import export
from exfit.features.translate.result import EXACT, POOR
from exfit.features.translate.steps import step_plants
from exfit.features.translate.translate import NOTICEABLE, unnoticed_shares
from exfit.models import MODELS, STABILISERS
from exfit.models.exciters import sexs
from exfit.models.sheet import typical
from exfit.results.model import FittedParameter

FIT = any_fit()
# the second is the first with further blocks, which can be left out
CONTAINED = [
    ("EXAC1", "AC1A"),
    ("IEEET1", "IEEEX1"),
    ("ESAC8B", "AC8B"),
    ("AC1A", "AC2A"),
    ("EXAC4", "AC4A"),
    ("DC1A", "DC1A"),
]
SAME_BUT_FOR_LIMITS = [("IEEET1", "DC1A"), ("IEEEX1", "EXDC2"), ("DC2A", "DC1A"), ("AC2A", "EXAC2")]
FAR = {"VAMAX": 90.0, "VAMIN": -90.0, "VRMAX": 90.0, "VRMIN": -90.0}


def translated(model, target, steps=(), network=None, **values):
    return exfit.translate(fit_of(FIT, model, network=network, **values), target, steps)


def long(*pairs):
    """Leave to --models=all what needs the machine code of two models."""
    return [pytest.param(*pair, marks=pytest.mark.long) for pair in pairs]


@pytest.mark.parametrize(("source", "target"), [*CONTAINED[:2], *long(*CONTAINED[2:])])
def test_a_model_within_another_is_found_exactly_and_without_a_search(source, target):
    """The steps of 5 and 10 % meet limits: they are the same there, too."""
    translation = translated(source, target)
    assert translation.exact
    assert not translation.searched
    assert not translation.poor
    assert translation.verdict.startswith(f"exact: {target} responds like {source}")
    assert translation.lost == {}
    assert {entry.origin for entry in translation.parameters.values()} <= {
        "copied", "computed", "without effect",
    }  # fmt: skip


@pytest.mark.long
def test_a_model_without_a_supply_gets_one_that_does_not_depend_on_the_terminals():
    """AC8B has no supply: that of AC8C is constant then, and has no rectifier that loads it."""
    translation = translated("AC8B", "AC8C")
    assert translation.exact
    supply = {name: translation.parameters[name].value for name in ("SW1", "KP", "KC1")}
    assert supply == {"SW1": 2.0, "KP": 1.0, "KC1": 0.0}


@pytest.mark.long
def test_every_exciter_is_itself_exactly(exciter):
    values = fit_of(FIT, exciter).fixed
    translation = translated(exciter, exciter)
    assert translation.exact
    assert not translation.searched
    # a limit may be given as the tighter one of two that cut the same signal
    assert translation.values == pytest.approx(values, rel=1e-12)


@pytest.mark.parametrize(("source", "target"), long(*SAME_BUT_FOR_LIMITS))
def test_models_that_differ_at_limits_alone_are_the_same_without_them(source, target):
    own = {row.symbol for row in MODELS[source].sheet}
    limits = {name: value for name, value in FAR.items() if name in own}
    translation = translated(source, target, steps=(0.01,), **limits)
    assert translation.exact
    assert not translation.searched


def test_ac1a_is_exac1_as_long_as_it_meets_no_limit():
    """The lag of AC1A may stand beyond the clamp behind it, that of EXAC1 has only the clamp."""
    translation = translated("AC1A", "EXAC1")
    assert not translation.exact
    assert translation.exact_within_limits
    assert not translation.searched
    assert translation.verdict.startswith("exact where no limit is met; else EXAC1 differs")
    small = [step for step in translation.steps if abs(step.step) == 0.01]
    assert all(step.percent <= EXACT for step in small)
    assert translation.worst.source_limits
    assert translation.values["VRMAX"] == 6.03
    assert translation.lost == {"VAMAX": 14.5, "VAMIN": -14.5}


@pytest.mark.long
def test_what_cannot_be_translated_is_poor_and_says_why():
    """SEXS has neither an exciter with feedback nor a rectifier."""
    translation = translated("AC1A", "SEXS", **NO_LIMITS)
    assert translation.searched
    assert translation.poor
    assert translation.worst.percent > POOR
    assert translation.verdict.startswith(f"poor, beyond {POOR:g} %: SEXS differs from AC1A")
    assert translation.worst.label in translation.verdict
    assert {"KF", "TF", "KC", "KD"} <= translation.lost.keys()
    assert {"VRMAX", "VRMIN", "TR", "TB"}.isdisjoint(translation.lost)
    assert translation.parameters["K"].provenance == (
        "translated from AC1A: fitted to its responses"
    )


def test_the_search_finds_the_best_there_is():
    """Around its result no parameter can be moved so that the responses come closer."""
    translation = translated("AC1A", "SEXS", steps=(0.01,), **NO_LIMITS)
    vt = sum(step.errors["vt"].rmse_percent ** 2 for step in translation.steps)
    back = fit_of(FIT, "SEXS", **translation.values)
    for name in ("K", "TE", "TB"):
        for factor in (0.9, 1.1):
            moved = replace(back, fixed={**back.fixed, name: factor * back.fixed[name]})
            again = exfit.translate(moved, "SEXS", (0.01,))
            errors = [
                100.0 * np.sqrt(np.mean((own.source["vt"] - step.source["vt"]) ** 2)) / 0.01
                for own, step in zip(again.steps, translation.steps, strict=True)
            ]
            assert sum(np.square(errors)) > vt


def test_a_gain_in_two_factors_is_their_product():
    translation = translated("AC2A", "AC1A", KA=20.0, KB=15.0, KH=0.0, VFEMAX=99.0, **FAR)
    assert translation.values["KA"] == 300.0
    assert translation.parameters["KA"].of == {"KA": "not stated", "KB": "not stated"}


def test_a_lead_as_a_share_of_its_lag_is_the_lead():
    translation = translated("SEXS", "EXAC4", steps=(0.01,), EMIN=-9.0, EMAX=9.0)
    assert translation.exact
    assert translation.values["TC"] == pytest.approx(1.0)  # 0.1 of 10 s
    assert translation.values["VRMAX"] == 9.0


def test_a_value_that_the_record_did_not_determine_stays_marked():
    fit = fit_of(FIT, "IEEET1")
    known = FittedParameter(50.0, 50.0, 5.0, 500.0, interval=(49.0, 51.0))
    unknown = replace(known, value=1.0, interval=None, why="its standard error is too large")
    fit = replace(
        fit,
        parameters={"KA": known, "TF": unknown},
        fixed={name: value for name, value in fit.fixed.items() if name not in ("KA", "TF")},
    )
    translation = exfit.translate(fit, "IEEEX1")
    said = {name: entry.provenance for name, entry in translation.parameters.items()}
    assert said["KA"] == "translated from IEEET1: KA (fitted)"
    assert said["TF1"] == "translated from IEEET1: TF (fitted, not determined)"
    assert said["TE"] == "translated from IEEET1: TE (typical)"
    assert "the record of the fit did not determine TF of IEEET1" in translation.notes


def test_a_value_that_is_not_physical_is_copied_and_said():
    fit = fit_of(FIT, "AC1A", **FAR)
    found = FittedParameter(-0.1, 0.3, -1.0, 1.0, interval=(-0.2, -0.05), physical=False)
    own = {name: value for name, value in fit.fixed.items() if name != "KD"}
    translation = exfit.translate(
        replace(fit, parameters={"KD": found}, fixed=own), "EXAC1", (0.01,)
    )
    assert translation.exact
    assert translation.values["KD"] == -0.1
    assert "not physical, outside the range of the data sheet: KD -0.1" in translation.notes


def test_a_stabiliser_listens_to_what_the_case_says():
    fit = replace(
        fit_of(FIT, "AC1A", network=NETWORK),
        stabiliser_model="STAB1",
        stabiliser=typical(STABILISERS["STAB1"].sheet),
    )
    text = "stabiliser: {model: STAB1, inputs: [p]}"
    inputs = [
        step_plants(replace(fit, case_text=case_text))[1].equipment.stabiliser.inputs
        for case_text in (text, "")
    ]
    assert inputs == [("p",), STABILISERS["STAB1"].inputs]


def test_an_exported_stabiliser_has_the_codes_of_what_it_listens_to():
    """With inputs of the case, and without; a record without codes says that they are lost."""
    text = "stabiliser: {model: NAME, inputs: [p]}"
    records = []
    for name, case_text in (("IEEEST", text), ("IEEEST", ""), ("STAB1", text)):
        stabiliser = typical(STABILISERS[name].sheet)
        of_stabiliser = {"stabiliser_model": name, "stabiliser": stabiliser}
        fit = replace(fit_of(FIT, "AC1A"), case_text=case_text, **of_stabiliser)
        exported = export(fit, 1, "1")
        records.append((exported.text.split(f"'{name}'")[1].split()[1], exported.warnings))
    (power, _), (speed, _), (_, warnings) = records
    assert (power, speed) == ("3", "1")
    assert "STAB1 has no codes of its inputs: p is lost" in warnings


@pytest.mark.long
def test_a_fit_with_a_network_is_compared_on_load_too():
    translation = translated("AC1A", "EXAC1", network=NETWORK, **FAR)
    assert {step.plant for step in translation.steps} == {"open circuit", "on load"}
    assert [loop.plant for loop in translation.loops] == ["open circuit", "on load"]
    assert all(loop.source == loop.target for loop in translation.loops)
    assert translation.exact


@pytest.mark.parametrize("network", [{"R": 0.0, "X": 0.1}, {**NETWORK, "X": 0.0}])
def test_a_network_without_a_start_or_a_source_leaves_open_circuit(network):
    plants = step_plants(fit_of(FIT, "AC1A", network=network))
    assert [plant.label for plant in plants] == ["open circuit"]


def test_the_file_holds_the_figures_and_no_samples():
    content = translated("IEEET1", "IEEEX1", steps=(0.02,)).to_dict()
    assert content["exact"] is True
    assert [step["step"] for step in content["steps"]] == [0.02, -0.02]
    assert {"source", "target", "time"} & {*content["steps"][0]} == set()
    assert content["parameters"]["KA"]["provenance"] == "translated from IEEET1: KA (typical)"


def test_a_name_of_psse_stands_for_its_model():
    assert translated("IEEET1", "ESDC1A", steps=(0.01,)).target == "DC1A"


@pytest.mark.parametrize(
    ("fit", "model", "text"),
    [
        (replace(fit_of(FIT, "AC1A"), model="GENROU"), "EXAC1", "without an exciter"),
        (FIT, "EXAC1", "FIRST_ORDER is not an exciter"),
        (fit_of(FIT, "AC1A"), "FIRST_ORDER", "FIRST_ORDER is not an exciter"),
        (fit_of(FIT, "AC1A"), "EXAC9", "EXAC9 is not in the catalogue"),
        (replace(fit_of(FIT, "AC1A"), fixed={"KA": 1.0}), "EXAC1", "no value of TR, TB"),
    ],
)
def test_what_is_no_exciter_is_refused(fit, model, text):
    with pytest.raises(ExfitError, match=text):
        exfit.translate(fit, model)


@pytest.mark.parametrize("size", [0.0, 5e-324, 0.6, float("nan")])
def test_steps_that_are_none_are_refused(size):
    with pytest.raises(ExfitError, match=r"step: .* pu: lies outside 1e-06 [.]{3} 0.5"):
        translated("AC1A", "EXAC1", steps=(size,))


def test_a_users_own_model_is_run_only_from_the_file_that_was_fitted(tmp_path):
    code = Path(sexs.__file__).read_text(encoding="utf-8")
    (tmp_path / "own.py").write_text(code)
    sha256 = hashlib.sha256(code.encode()).hexdigest()
    fit = replace(
        fit_of(FIT, "SEXS"),
        model="OWN",
        case=tmp_path / "case.yaml",
        inputs={"model": sha256},
        files={"model": "own.py"},
    )
    assert exfit.translate(fit, "SEXS", (0.01,)).exact
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "same.py").write_text(code)
    moved = replace(fit, case_text="model: sub/same.py\n", files={"model": "same.py"})
    assert exfit.translate(moved, "SEXS", (0.01,)).exact
    (tmp_path / "own.py").write_text("raise SystemExit('run')\n")
    with pytest.raises(ModelError, match="not run: the file has changed since the fit"):
        exfit.translate(fit, "SEXS")
    (tmp_path / "own.py").unlink()
    with pytest.raises(ModelError, match="cannot be read: No such file"):
        exfit.translate(fit, "SEXS")


def test_a_change_of_the_share_that_is_unnoticed_moves_the_responses_by_a_thousandth():
    """The others follow as least squares have it; half of the rows are those of vt."""
    rng = np.random.default_rng(3)
    jacobian, values = rng.standard_normal((400, 3)), np.array([2.0, 0.5, 40.0])
    names = ("a", "b", "c")
    residuals = SimpleNamespace(
        free=[SimpleNamespace(name=name, slope=lambda _: 1.0) for name in names],
        values=lambda x: dict(zip(names, x, strict=True)),
    )
    unnoticed = unnoticed_shares(residuals, SimpleNamespace(x=values, jac=jacobian))
    for k, name in enumerate(names):
        change = jacobian[:, k] * unnoticed[name] * values[k]
        others = np.delete(jacobian, k, axis=1)
        left = change - others @ np.linalg.lstsq(others, change, rcond=None)[0]
        assert np.sqrt(np.sum(left**2) / 200) == pytest.approx(NOTICEABLE)
