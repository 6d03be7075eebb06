"""What a planned test would tell: laws of its standard errors, over several exciters."""

import json

import numpy as np
import pytest
import yaml
from places import CONFIGS
from records import UNIT, case_of, found_in, recording, several

from exfit.case.load import load_case
from exfit.errors import CaseError
from exfit.features.design.designed_test import design_test
from exfit.features.design.experiment_design import identify
from exfit.signals import NOISE
from exfit.workflows import fit

# exciters of several kinds, and two parameters of each that a small step distinguishes
EXCITERS = {
    "ac1a": {"KA": 400.0, "TE": 0.8},
    "ac8b": {"KPR": 80.0, "TE": 1.2},
    "dc1a": {"KA": 46.0, "TE": 0.46},
    "st1a": {"KA": 190.0, "TC": 1.0},
}
BY_DEFAULT = ("ac1a",)
EACH = [
    pytest.param(name, marks=[] if name in BY_DEFAULT else [pytest.mark.long]) for name in EXCITERS
]
VT = {"vt": 1e-4}
OFF_LINE = {signal: NOISE[signal] for signal in ("vt", "efd", "ifd")}
SMALL = 1e-4  # pu, of the reference: no limit is met, and what is quadratic is 1e-4 of it
EXACT = 1e-9  # rounding


@pytest.fixture
def changed(tmp_path):
    """Return a function that loads a case of configs/ with other sections."""

    def loaded(name, **sections):
        content = {**yaml.safe_load((CONFIGS / f"{name}.yaml").read_text()), **sections}
        if "record" in content:
            content["record"]["file"] = str(CONFIGS / content["record"]["file"])
        content.pop("validate", None)
        path = tmp_path / "case.yaml"
        path.write_text(yaml.safe_dump(content, sort_keys=False))
        return load_case(path)

    return loaded


@pytest.fixture
def plain(changed):
    """Return a function that loads an exciter with its typical data, without a record."""

    def loaded(name, step=0.05, duration=10.0):
        content = yaml.safe_load((CONFIGS / "models" / f"{name}.yaml").read_text())
        free = {
            key: {"start": value, "min": 0.1 * value, "max": 10.0 * value}
            for key, value in EXCITERS[name].items()
        }
        fixed = {k: v for k, v in content["parameters"]["fixed"].items() if k not in free}
        return changed(
            f"models/{name}",
            test={"vt0": 1.0, "duration": duration, "vref": [{"at": 1.0, "step": step}]},
            parameters={"fixed": fixed, "free": free},
        )

    return loaded


def errors(known):
    """Return the standard errors of all parameters, infinite for none."""
    found = [one.std_error for one in known.parameters.values()]
    return np.array([np.inf if one is None else one for one in found])


def plans(design):
    return {one.label: one.confidence for one in design.plans}


@pytest.mark.parametrize("name", EACH)
def test_where_the_response_is_linear_twice_the_step_halves_the_errors(plain, name):
    small, twice = (
        errors(identify(plain(name, step), VT).own.confidence) for step in (SMALL, 2.0 * SMALL)
    )
    assert np.isfinite(small).all()
    assert small / twice == pytest.approx(2.0, rel=2e-3)


@pytest.mark.parametrize("name", EACH)
def test_a_step_down_determines_as_much_as_one_up_where_the_response_is_linear(plain, name):
    up, down = (errors(identify(plain(name, step), VT).own.confidence) for step in (SMALL, -SMALL))
    assert up == pytest.approx(down, rel=2e-3)


@pytest.mark.parametrize("name", EACH)
def test_errors_grow_with_the_noise(plain, name):
    case = plain(name)
    quiet, noisy = (identify(case, {"vt": level}) for level in (1e-4, 3e-4))
    for one, other in zip(
        (quiet.own.confidence, plans(quiet)["10 %"], plans(quiet)["longer"]),
        (noisy.own.confidence, plans(noisy)["10 %"], plans(noisy)["longer"]),
        strict=True,
    ):
        assert errors(other) == pytest.approx(3.0 * errors(one), rel=EXACT)


@pytest.mark.parametrize("name", EACH)
def test_more_signals_and_more_time_are_never_worse(plain, name):
    design = identify(plain(name), {})
    own, others = errors(design.own.confidence), {k: errors(v) for k, v in plans(design).items()}
    for label in ("longer", "+ efd", "+ ifd", "+ all"):
        assert (others[label] <= own * (1.0 + EXACT)).all(), label
    for label in ("+ efd", "+ ifd"):
        assert (others["+ all"] <= others[label] * (1.0 + EXACT)).all(), label
    assert (others["+ all"] < own).any()


@pytest.mark.long
@pytest.mark.parametrize("name", EACH)
def test_a_step_as_large_as_the_own_one_determines_the_same(plain, name):
    design = identify(plain(name, 0.05), {})
    assert errors(plans(design)["5 %"]) == pytest.approx(errors(design.own.confidence), rel=EXACT)
    other = identify(plain(name, -0.02), {})
    larger = identify(plain(name, -0.1), {})
    assert errors(plans(other)["10 %"]) == pytest.approx(errors(larger.own.confidence), rel=EXACT)


@pytest.mark.long
def test_a_longer_test_determines_what_one_of_twice_the_duration_does(plain):
    planned = plans(identify(plain("ac1a"), VT))["longer"]
    own = identify(plain("ac1a", duration=20.0), VT).own.confidence
    assert errors(planned) == pytest.approx(errors(own), rel=EXACT)
    assert planned.noise[0].samples == own.noise[0].samples


def test_a_signal_without_noise_to_speak_of_decides_alone(plain):
    """The noise of the others no longer matters."""
    case = plain("ac1a")
    one, other = (identify(case, {"vt": level, "efd": 1e-9}) for level in (1e-4, 1e-2))
    with_efd = [errors(plans(design)["+ efd"]) for design in (one, other)]
    assert with_efd[0] == pytest.approx(with_efd[1], rel=1e-6)


def test_a_case_without_a_record_is_planned_on_its_own_clock(plain):
    design = identify(plain("ac1a"), {})
    times = design.own.sensitivity[0].time
    assert (times[0], times[-1]) == (0.0, 10.0)
    assert list(plans(design)) == ["2 %", "5 %", "10 %", "longer", "+ efd", "+ ifd", "+ all"]
    assert design.noise == OFF_LINE


def test_a_unit_without_a_governor_shows_no_gate(changed):
    """On load, with what a governor moves among the signals that a plant may show."""
    case = changed("ac8b_on_line", estimate={"search": "local"})
    assert "gate" in case.kind.compared
    shown = plans(identify(case, {}))
    assert "+ speed" in shown
    assert "+ gate" not in shown
    with pytest.raises(CaseError, match="channels: gate: not of this plant"):
        design_test(case, channels=["gate"])


def test_a_plant_without_a_network_has_no_other_tests():
    design = identify(load_case(CONFIGS / "first_order.yaml"), {})
    assert design.plans == ()
    assert np.isfinite(errors(design.own.confidence)).all()


@pytest.mark.long
def test_the_noise_given_beats_that_of_the_case_and_that_of_the_record(changed):
    content = yaml.safe_load((CONFIGS / "ac1a_typical.yaml").read_text())["record"]
    recorded = identify(load_case(CONFIGS / "ac1a_typical.yaml"), {}).noise["vt"]
    # the noise of the record is 1e-4 pu; a thousand samples tell it to some percent
    assert recorded == pytest.approx(1e-4, rel=0.1)
    noisy = {**content, "channels": {"vt": {"column": "vt", "noise": 3e-4}}}
    case = changed("ac1a_typical", record=noisy)
    assert identify(case, {}).noise["vt"] == 3e-4
    given = identify(case, {"vt": 7e-4, "ifd": 0.1})
    assert (given.noise["vt"], given.noise["ifd"], given.noise["efd"]) == (7e-4, 0.1, NOISE["efd"])
    assert [one.std for one in given.own.confidence.noise] == pytest.approx([7e-4])


@pytest.mark.long
def test_the_own_test_is_as_telling_as_the_fit_to_its_record(changed):
    """At the values that the fit finds, with the noise that it finds."""
    content = yaml.safe_load((CONFIGS / "ac1a_typical.yaml").read_text())
    found = fit(CONFIGS / "ac1a_typical.yaml", search="local")
    for name, one in content["parameters"]["free"].items():
        one["start"] = found.values[name]
    known = found.knowledge.confidence
    case = changed("ac1a_typical", parameters=content["parameters"])
    design = identify(case, {"vt": known.noise[0].std})
    assert errors(design.own.confidence) == pytest.approx(errors(known), rel=1e-6)
    fitted = found.knowledge.identifiability.unseen[0].moves
    planned = design.own.identifiability.unseen[0].moves
    assert dict(planned) == pytest.approx(dict(fitted), rel=1e-6)
    # nothing given: the noise is taken from the record, which tells it to some percent
    told = identify(case, {}).own.confidence
    assert errors(told) == pytest.approx(errors(known), rel=0.1)


@pytest.mark.long
def test_records_of_different_noise_add_what_each_determines(tmp_path):
    """The inverses of the covariances add up: each record counts by its own noise."""
    levels = {"up": 1e-4, "down": 1e-3}
    entries = {}
    for name, noise in levels.items():
        entries[name] = recording(name, channels={"vt": {"column": "vt", "noise": noise}})
        entries[name]["test"]["vt0"] = 1.0
    free = {name: found_in(UNIT[name], UNIT[name] / 10, UNIT[name] * 10) for name in ("KA", "TE")}

    def planned(*names):
        content = several(*(entries[name] for name in names), free=free)
        content["parameters"]["fixed"] |= {k: v for k, v in UNIT.items() if k not in free}
        return identify(case_of(content, tmp_path), {})

    apart = [np.linalg.inv(planned(name).own.confidence.covariance) for name in levels]
    both = planned(*levels)
    assert np.linalg.inv(both.own.confidence.covariance) == pytest.approx(sum(apart), rel=1e-6)
    assert {name: both.noise[f"{name} vt"] for name in levels} == levels


def test_a_planned_test_says_nothing_of_residuals_that_there_are_not(plain):
    known = identify(plain("ac1a"), {}).own.confidence
    assert known.sentences == ()
    assert all(one.accepted for one in known.noise)
    assert np.isinf(known.dof)


def test_a_start_on_its_bound_is_planned_with_the_others(changed):
    free = {
        "KA": {"start": 364.0, "min": 364.0, "max": 4000.0},
        "TE": {"start": 1.7, "min": 0.1, "max": 1.7},
    }
    content = yaml.safe_load((CONFIGS / "ac1a_typical.yaml").read_text())["parameters"]
    fixed = {**content["fixed"], "KF": 0.04, "TF": 1.5, "TA": 0.05, "KC": 0.5, "KD": 0.4}
    case = changed("ac1a_typical", parameters={"fixed": fixed, "free": free})
    assert np.isfinite(errors(identify(case, {}).own.confidence)).all()


def test_a_step_whose_size_is_unknown_is_made_larger_too(changed):
    sizes = {"start": 0.05, "min": 0.025, "max": 0.075}
    test = {"vt0": 1.0, "vref": [{"at": 1.0, "step": sizes}]}
    known = plans(identify(changed("ac1a_typical", test=test), VT))
    of_ka = {label: one.parameters["KA"].relative_error for label, one in known.items()}
    assert of_ka["10 %"] < of_ka["5 %"] < of_ka["2 %"]


def test_what_cannot_be_identified_is_refused(changed, plain):
    case = plain("ac1a")
    with pytest.raises(CaseError, match=r"noise: EFD: not a signal; did you mean efd\?"):
        identify(case, {"EFD": 1e-3})
    for level in (0.0, -1e-4, float("nan"), float("inf")):
        with pytest.raises(CaseError, match=r"noise: vt: .*: must be finite and above 0"):
            identify(case, {"vt": level})
    with pytest.raises(CaseError, match=r"parameters\.free: empty: there is nothing to identify"):
        identify(load_case(CONFIGS / "models" / "ac1a.yaml"), {})


def test_the_figures_survive_json(plain):
    design = identify(plain("ac1a"), {})
    content = json.loads(json.dumps(design.as_json(), allow_nan=False))
    assert content["plans"].keys() == plans(design).keys()
    assert content["noise"] == OFF_LINE
    errors_of = content["confidence"]["parameters"]["KA"]
    assert errors_of["std_error"] == design.own.confidence.parameters["KA"].std_error
