"""What a fit finds about a record itself: instants, sizes, levels, delay, base of a signal."""

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from records import (
    NOISE,
    SAMPLES,
    STEP,
    TEST,
    TIME,
    case_of,
    found_in,
    one,
    recording,
    several,
    synthetic,
    write,
)
from tables import read_columns
from tiers import few_of

from exfit.fitting.build import build_experiments
from exfit.fitting.further_starts import linear_form
from exfit.fitting.nuisances import names_of
from exfit.fitting.problem import residuals_of
from exfit.results.compare_with_record import compare_with_record
from exfit.workflows import fit, simulate, validate

FREE = {
    "KA": found_in(330.0, 76.6, 7660.0),
    "KD": {**found_in(0.25, 0.0, 3.5), "scale": "linear", "prior": {"mean": 0.3, "std": "50 %"}},
    "TE0": found_in(1.7, 0.13, 13.0),
}


@pytest.fixture
def everything_open(tmp_path):
    """Return residuals of two records with all that can be found about them."""
    rng = np.random.default_rng(4)
    up = read_columns(SAMPLES / "ac1a_up.csv", ["t", "vt", "efd"])
    spikes = rng.choice(len(up["t"]), 12, replace=False)
    up["vt"] = up["vt"].copy()
    up["vt"][spikes] += 0.01 * rng.choice([-1.0, 1.0], 12)
    up["vt"][300:308] = np.nan
    file = write(tmp_path / "up.csv", **up)
    level = {"scale": found_in(1.003, 0.9, 1.1), "offset": found_in(-0.002, -0.1, 0.1)}
    vt = {"column": "vt", **level, "filter": {"lowpass": 8.0}}
    vt["sine"] = {"frequency": found_in(1.03, 0.9, 1.1)}
    efd = {"column": "efd", **level, "filter": {"median": 5}, "weight": 0.02}
    swaying = {"vt": {"column": "vt", "sine": {"frequency": 2.0}}}
    records = [
        recording(
            "up",
            file,
            # no instant falls on the grid of 1 ms, where derivatives have kinks
            found_in(1.0037, 0.8, 1.2),
            found_in(0.049, 0.02, 0.08),
            {"vt": vt, "efd": efd},
            delay=found_in(0.0123, -0.1, 0.1),
            gaps="skip",
            mask=[[2.105, 2.305]],
            window=[0.2, 4.0],
        ),
        recording("down", at=found_in(0.9967, 0.8, 1.2), channels=swaying, window=[0.2, 4.0]),
    ]
    records[0]["test"]["vt0"] = found_in(1.001, 0.9, 1.1)
    records[1]["test"]["vs"] = [
        {"at": found_in(2.5003, 2.0, 3.0), "step": found_in(0.01, 0.001, 0.1)}
    ]
    content = several(*records, free=FREE, estimate={"loss": "huber"})
    content["parameters"]["fixed"] |= {"TE": "=0.9*TE0", "VAMIN": "=-VAMAX", "KF": 0.0444}
    content["parameters"]["fixed"] |= {"TF": 1.5754, "TA": 0.0545, "KC": 0.5111}
    case = case_of(content, tmp_path)
    setups = build_experiments(case)
    return residuals_of(case, [setup.with_enough_substeps(case.values()) for setup in setups])


def test_the_exact_jacobian_is_that_of_differences_with_all_that_can_be_found(everything_open):
    residuals = everything_open
    assert [one.name for one in residuals.free] == [
        *FREE,
        "up.vref.at",
        "up.vref.step",
        "up.vt0",
        "up.delay",
        "up.vt.scale",
        "up.vt.offset",
        "up.efd.scale",
        "up.efd.offset",
        "up.vt.sine.frequency",
        "up.vt.sine.cosine",
        "up.vt.sine.sine",
        "down.vref.at",
        "down.vs.at",
        "down.vs.step",
        "down.vt.sine.cosine",
        "down.vt.sine.sine",
    ]
    exact = residuals.exact(residuals.start)
    assert exact.shape == (residuals.count + 1, len(residuals.free))
    differences = residuals.differences(residuals.start, -1e-6, 1e-6)
    size = np.abs(exact).max(axis=0)
    # a sample that passes a kink of the loss or of the median within the step: 1e-6 of a column
    assert (np.abs(differences - exact).max(axis=0) <= 1e-5 * size).all()


def test_the_exact_jacobian_of_the_linear_form_is_that_of_differences(everything_open):
    residuals = linear_form(replace(everything_open, robust=None))
    exact = residuals.exact(residuals.start)
    differences = residuals.differences(residuals.start, -1e-4, 1e-4)
    size = np.abs(exact).max(axis=0)
    # samples of the median that change places, and the curvature of an instant: 1e-3 of a column
    assert (np.abs(differences - exact).max(axis=0) <= 0.02 * size).all()
    assert (
        np.linalg.norm(differences - exact, axis=0) <= 1e-3 * np.linalg.norm(exact, axis=0)
    ).all()


def test_differences_of_what_moves_are_those_of_runs_one_by_one(everything_open):
    """An experiment with moving steps cannot be run side by side; the residuals are the same."""
    residuals = everything_open
    points = residuals.start + np.array([[0.0], [1e-3]])
    costs = [0.5 * float(errors @ errors) for errors in residuals.residuals(points)]
    one_by_one = [0.5 * float(np.sum(residuals(point) ** 2)) for point in points]
    assert costs == pytest.approx(one_by_one, rel=1e-12)


@pytest.mark.long
def test_up_and_down_find_their_instants_and_sizes(tmp_path):
    content = several(
        *(
            recording(name, at=found_in(1.05, 0.75, 1.25), step=found_in(0.9 * step, *bounds))
            for name, step, bounds in (("up", 0.05, (0.02, 0.08)), ("down", -0.05, (-0.08, -0.02)))
        ),
        estimate={"iterations": 150},
    )
    # where the instant may lie at its lower bound, little of the record is left to tell vt0
    for entry in content["records"]:
        entry["test"]["vt0"] = 1.0 if entry["name"] == "up" else found_in(1.05, 1.0, 1.1)
    found = fit(case_of(content, tmp_path))
    assert found.success
    for name, step in STEP.items():
        assert found.values[f"{name}.vref.at"] == pytest.approx(1.0, abs=1e-3)
        assert found.values[f"{name}.vref.step"] == pytest.approx(step, rel=2e-3)


@pytest.mark.parametrize("delay", few_of([0.0, found_in(0.0, -0.05, 0.05)], 1))
def test_what_is_shown_of_a_record_has_the_cost_that_the_fit_found(tmp_path, delay):
    """The instant, 40 ms off its start, moves the response once, also when it is read back."""
    synthetic(tmp_path, TEST, TIME)
    test = {"vt0": 1.0, "vref": [{"at": found_in(1.04, 0.9, 1.1), "step": 0.05}]}
    content = one(test, delay=delay)
    record = {**content["record"], "delay": 0.0}
    content["validate"] = [{"name": "again", "test": TEST, "record": record}]
    case = case_of(content, tmp_path)
    found = fit(case)
    assert found.comparisons[0].cost == pytest.approx(found.cost, rel=1e-9)
    for again in (validate(case, found.values)[0], simulate(case, found.values).comparison):
        assert again.cost == pytest.approx(found.cost, rel=1e-9)


def test_a_late_recorder_is_found(tmp_path):
    shown = synthetic(tmp_path, TEST, TIME)["vt"]
    # what the recorder shows at t happened 37 ms before: simulated there, not interpolated
    synthetic(tmp_path, TEST, TIME)
    case = case_of(one(TEST, delay=0.037), tmp_path)
    setup = build_experiments(case)[0]
    late = setup.with_enough_substeps(case.values()).response(case.values()).signals["vt"]
    assert np.interp(TIME - 0.037, TIME, shown) == pytest.approx(late, abs=6 * NOISE)
    rng = np.random.default_rng(1)
    write(tmp_path / "record.csv", t=TIME, vt=late + 2e-5 * rng.standard_normal(len(TIME)))
    content = one(TEST, free=["KA"], delay=found_in(0.0, -0.1, 0.1))
    found = fit(case_of(content, tmp_path))
    assert found.values["delay"] == pytest.approx(0.037, abs=1e-4)
    assert found.values["KA"] == pytest.approx(332.83, rel=1e-2)


def test_a_delay_moves_the_features_of_both_signals_alike(tmp_path):
    """They are read off where the record shows the step, not where it was made."""
    synthetic(tmp_path, TEST, TIME, noise=0.0)
    prompt = build_experiments(case_of(one(TEST), tmp_path))[0]
    late = build_experiments(case_of(one(TEST, delay=0.5), tmp_path))[0]
    values = case_of(one(TEST), tmp_path).values()
    peak = compare_with_record(prompt, values).features.simulated.peak_time
    assert compare_with_record(late, values).features.simulated.peak_time == pytest.approx(
        peak, abs=1e-3
    )


def test_an_early_recorder_sees_beyond_the_end_of_its_own_clock(tmp_path):
    """At a delay of -0.4 s a record until 1.5 s shows what happens until 1.9 s, still in motion."""
    values = case_of(one(TEST), tmp_path).values()
    synthetic(tmp_path, TEST, TIME, noise=0.0)
    whole = read_columns(tmp_path / "record.csv", ["t", "vt"])
    write(tmp_path / "record.csv", t=TIME[:151], vt=whole["vt"][:151])
    for delay in (-0.4, found_in(-0.4, -0.5, 0.1)):
        setup = build_experiments(case_of(one(TEST, delay=delay), tmp_path))[0]
        early = setup.response(values).signals["vt"]
        # grids of 1 ms that end elsewhere, and a cubic between the samples
        assert early == pytest.approx(whole["vt"][40:191], abs=1e-6)


def test_the_base_of_a_signal_is_found(tmp_path):
    """A record in kV on a base of 13.8 kV, which the case takes for 1 % more, and shifted."""
    shown = synthetic(tmp_path, TEST, TIME, noise=2e-5)["vt"]
    write(tmp_path / "record.csv", t=TIME, U=13.8 * (shown - 0.004))
    channel = {
        "column": "U",
        "scale": found_in(1 / (1.01 * 13.8), 0.06, 0.09),
        "offset": found_in(0.0, -0.05, 0.05),
    }
    found = fit(case_of(one(TEST, {"vt": channel}), tmp_path))
    assert found.values["vt.scale"] == pytest.approx(1 / 13.8, rel=1e-3)
    assert found.values["vt.offset"] == pytest.approx(0.004, abs=1e-3)


def test_a_scale_or_an_offset_alone_is_found(tmp_path):
    shown = synthetic(tmp_path, TEST, TIME, noise=2e-5)["vt"]
    write(tmp_path / "record.csv", t=TIME, vt=1.01 * shown)
    found = fit(
        case_of(one(TEST, {"vt": {"column": "vt", "scale": found_in(1, 0.9, 1.1)}}), tmp_path)
    )
    assert found.values["vt.scale"] == pytest.approx(1 / 1.01, abs=1e-5)
    write(tmp_path / "record.csv", t=TIME, vt=shown + 0.01)
    found = fit(
        case_of(one(TEST, {"vt": {"column": "vt", "offset": found_in(0, -0.1, 0.1)}}), tmp_path)
    )
    assert found.values["vt.offset"] == pytest.approx(-0.01, abs=1e-5)


def test_the_voltage_at_the_start_is_found(tmp_path):
    synthetic(tmp_path, {**TEST, "vt0": 0.987}, TIME, noise=2e-5)
    found = fit(case_of(one({**TEST, "vt0": found_in(1.0, 0.9, 1.1)}), tmp_path))
    assert found.values["vt0"] == pytest.approx(0.987, abs=1e-5)


def test_a_step_of_the_stabilisers_signal_and_a_second_one_of_the_reference_are_found(tmp_path):
    test = {
        "vt0": 1.0,
        "vref": [{"at": 1.0, "step": 0.05}, {"at": 4.0, "step": -0.02}],
        "vs": [{"at": 2.5, "step": 0.01}],
    }
    synthetic(tmp_path, test, TIME, noise=2e-5)
    asked = deepcopy(test)
    asked["vref"][1] = {"at": found_in(4.05, 3.5, 4.5), "step": found_in(-0.025, -0.05, -0.005)}
    asked["vs"][0] = {"at": found_in(2.45, 2.0, 3.0), "step": found_in(0.02, 0.005, 0.05)}
    case = case_of(one(asked), tmp_path)
    assert tuple(names_of(case.recordings[0])) == ("vref2.at", "vref2.step", "vs.at", "vs.step")
    found = fit(case).values
    assert found["vref2.at"] == pytest.approx(4.0, abs=2e-3)
    assert found["vref2.step"] == pytest.approx(-0.02, rel=1e-2)
    assert found["vs.at"] == pytest.approx(2.5, abs=2e-3)
    assert found["vs.step"] == pytest.approx(0.01, rel=1e-2)


@pytest.mark.parametrize(
    "order",
    [
        ("vref.at", "vref2.at", "vs.at"),
        ("vref.at", "vs.at", "vref2.at"),
        ("vs.at", "vref.at", "vref2.at"),
    ],
)
def test_each_name_moves_its_own_step(tmp_path, order):
    write(tmp_path / "record.csv", t=TIME, vt=TIME)
    instants = dict(zip(order, (1.0, 2.0, 3.0), strict=True))
    test = {"vt0": 1.0}
    for signal, names in (("vref", ("vref.at", "vref2.at")), ("vs", ("vs.at",))):
        test[signal] = [
            {"at": found_in(instants[name], 0.5, 5.0), "step": 0.01 * instants[name]}
            for name in names
        ]
    setup = build_experiments(case_of(one(test), tmp_path))[0]
    moved = setup.experiment.with_inputs({name: at + 0.25 for name, at in instants.items()})
    assert {(step.at, round(step.step, 9)) for step in moved.inputs.steps} == {
        (at + 0.25, round(0.01 * at, 9)) for at in instants.values()
    }


def test_a_step_that_may_be_earlier_asks_for_a_simulation_beyond_the_record(tmp_path):
    """Shifted to its lower bound, the response is read behind the end of the record."""
    content = several(recording("up", at=found_in(1.0, 0.8, 1.2)), recording("down"))
    first, second = build_experiments(case_of(content, tmp_path))
    assert first.experiment.simulator.inputs.end == pytest.approx(first.record.time[-1] + 0.2)
    assert second.experiment.simulator.inputs.end == second.record.time[-1]
