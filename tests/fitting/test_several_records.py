"""Several records fitted as one, and what stands beside them: ties, priors, losses, masks."""

from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest
from records import (
    SAMPLES,
    TEST,
    TIME,
    case_of,
    config,
    found_in,
    one,
    recording,
    several,
    synthetic,
    write,
)
from tables import read_columns
from tiers import few_of

from exfit.errors import CaseError, RecordError
from exfit.fitting.build import build_experiments
from exfit.fitting.problem import residuals_of
from exfit.fitting.system import values_of
from exfit.output.run_folder import write_fit
from exfit.workflows import fit, simulate, validate
from exfit.workflows.given_values import changed_values, read_parameters
from exfit.workflows.model_check import check

NEAR = 1.56  # s: TF where the records do not speak against it
SAME = 1e-5  # relative: how near two ways to one minimum end
THREE = {
    "KA": found_in(300.0, 76.6, 7660.0),
    "TE": found_in(1.3, 0.13, 13.0),
    "TF": found_in(1.2, 0.1, 10.0),
}
KNOWN = {"KF": 0.0444, "TA": 0.0545, "KC": 0.5111, "KD": 0.2477}


def three_free(content):
    """Return a case of the AC1A with three free parameters, the others as the fit found them."""
    content = deepcopy(content)
    content["parameters"]["free"] = deepcopy(THREE)
    content["parameters"]["fixed"] |= KNOWN
    return content


def unit(found):
    """Return what a fit found of the unit."""
    return {name: one.value for name, one in found.parameters.items() if not one.of_record}


def errors(found):
    return {
        name: one.std_error
        for name, one in found.knowledge.confidence.parameters.items()
        if not found.parameters[name].of_record
    }


def single(**record):
    content = three_free(config("ac1a_typical"))
    content["record"] |= record
    return {**content, "validate": []}


def both(tmp_path, names=("up", "down"), **record):
    entries = [recording(name, **record) for name in names]
    for entry in entries:
        entry["test"]["vt0"] = 1.0 if entry["name"] == "up" else 1.0495
    return case_of(three_free(several(*entries)), tmp_path)


@pytest.mark.long
def test_the_order_of_the_records_does_not_matter(tmp_path):
    ends = [fit(both(tmp_path, order)) for order in (("up", "down"), ("down", "up"))]
    assert unit(ends[0]) == pytest.approx(unit(ends[1]), rel=SAME)
    assert ends[0].cost == pytest.approx(ends[1].cost, rel=1e-9)
    assert errors(ends[0]) == pytest.approx(errors(ends[1]), rel=1e-3)
    assert [one.name for one in ends[0].comparisons] == ["up", "down"]


@pytest.mark.long
def test_two_records_are_the_sum_of_their_costs(tmp_path):
    found = fit(both(tmp_path))
    assert found.cost == pytest.approx(sum(one.cost for one in found.comparisons), rel=1e-12)


def test_one_of_several_records_is_a_record_alone(tmp_path):
    alone = fit(case_of(single(), tmp_path))
    entry = recording("up")
    entry["test"]["vt0"] = 1.0
    found = fit(case_of(three_free(several(entry)), tmp_path))
    assert found.values == alone.values
    assert found.cost == alone.cost
    assert errors(found) == errors(alone)


@pytest.mark.long
def test_a_record_given_twice_halves_the_variance(tmp_path):
    content = several(recording("up"), recording("up"))
    for entry, name in zip(content["records"], ("one", "two"), strict=True):
        entry["name"], entry["test"]["vt0"] = name, 1.0
    once, twice = fit(case_of(single(), tmp_path)), fit(case_of(three_free(content), tmp_path))
    assert unit(twice) == pytest.approx(unit(once), rel=SAME)
    # the noise is told from twice the samples, but as many parameters
    halved = {name: error / np.sqrt(2.0) for name, error in errors(once).items()}
    assert errors(twice) == pytest.approx(halved, rel=2e-3)


@pytest.mark.long
def test_noise_is_one_over_the_weight(tmp_path):
    noise = {"vt": 1e-4, "efd": 5e-3}
    weighted = {name: {"column": name, "weight": 1e-4 / sigma} for name, sigma in noise.items()}
    told = {name: {"column": name, "noise": sigma} for name, sigma in noise.items()}
    by_weight = fit(case_of(single(channels=weighted), tmp_path))
    by_noise = fit(case_of(single(channels=told), tmp_path))
    assert unit(by_noise) == pytest.approx(unit(by_weight), rel=1e-9)
    assert by_noise.cost == pytest.approx(by_weight.cost, rel=1e-9)


@pytest.mark.long
def test_noise_ten_times_as_large_makes_the_errors_so(tmp_path):
    found = [
        fit(case_of(single(channels={"vt": {"column": "vt", "noise": noise}}), tmp_path))
        for noise in (1e-4, 1e-3)
    ]
    assert unit(found[0]) == pytest.approx(unit(found[1]), rel=1e-9)
    tenfold = {name: 10.0 * error for name, error in errors(found[0]).items()}
    assert errors(found[1]) == pytest.approx(tenfold, rel=1e-9)


@pytest.mark.long
def test_noise_may_be_given_for_a_validation_alone(tmp_path):
    content = three_free(config("ac1a_typical"))
    content["validate"][0]["record"]["channels"] = {"vt": {"column": "vt", "noise": 1e-4}}
    (tried,) = fit(case_of(content, tmp_path)).validation
    plain = fit(case_of(three_free(config("ac1a_typical")), tmp_path)).validation[0]
    assert tried.rmse == plain.rmse


def on_and_off_line(tmp_path):
    """Return a case with a test on line and one off line, its free parameters, and the truth."""
    truth = {"KPR": 80.0, "KIR": 6.0, "KDR": 12.0, "TDR": 0.1, "TE": 1.1, "KC": 0.5}
    content = config("ac8b_on_line")
    network, free = content["plant"].pop("network"), content["parameters"].pop("free")
    content["plant"]["type"] = "open-circuit"
    test, record = content.pop("test"), content.pop("record")
    content["records"] = [
        {
            "name": "off",
            "test": {**test, "vt0": 1.0},
            "record": {**record, "file": "off.csv", "channels": {"vt": "vt"}},
        },
        {
            "name": "on",
            "plant": {"type": "infinite-bus", "network": network},
            "test": {**test, "vt0": 1.01},
            "record": {**record, "file": "on.csv", "channels": {"vt": "vt", "p": "p"}},
        },
    ]
    for name in ("off", "on"):
        write(tmp_path / f"{name}.csv", t=TIME, vt=TIME, p=TIME)
    fixed = content["parameters"]["fixed"]
    case = case_of({**content, "parameters": {"fixed": {**fixed, **truth}}}, tmp_path)
    rng = np.random.default_rng(2)
    for setup in build_experiments(case):
        response = setup.with_enough_substeps(case.values()).response(case.values())
        shown = {
            signal: response.signals[signal] + 1e-5 * rng.standard_normal(len(TIME))
            for signal in setup.experiment.signals
        }
        write(tmp_path / f"{setup.name}.csv", t=TIME, **shown)
    return content, free, truth


@pytest.mark.long
def test_tests_on_line_and_off_line_find_the_same_exciter(tmp_path):
    content, free, truth = on_and_off_line(tmp_path)
    content["parameters"]["free"] = free
    found = fit(case_of(content, tmp_path))
    known = found.knowledge.confidence.parameters
    for name, value in truth.items():
        # four standard errors: one in ten thousand
        assert abs(found.values[name] - value) < 4.0 * known[name].std_error, name
        assert known[name].std_error < 0.01 * value, name


@pytest.mark.long
def test_a_case_on_line_may_hold_a_record_off_line(tmp_path):
    """Which of the two plants is the case's own does not matter."""
    content, free, _ = on_and_off_line(tmp_path)
    content["parameters"]["free"] = free
    off_line = fit(case_of(content, tmp_path))
    content["plant"] |= content["records"][1].pop("plant")
    content["records"][0]["plant"] = {"type": "open-circuit"}
    on_line = fit(case_of(content, tmp_path))
    assert unit(on_line) == pytest.approx(unit(off_line), rel=1e-9)


def test_a_switching_starts_from_the_network_of_its_own_record(tmp_path):
    content, _, _ = on_and_off_line(tmp_path)
    content["parameters"]["fixed"] |= {"KPR": 80.0, "KIR": 6.0}
    on = content["records"][1]
    on["plant"]["network"] = {**on["plant"]["network"], "X": 0.25}
    on["test"]["network"] = [{"at": 2.0, "X": 0.4}]
    setup = build_experiments(case_of(content, tmp_path))[1]
    (switch,) = [step for step in setup.experiment.simulator.inputs.steps if step.signal == "X"]
    assert (switch.at, switch.step) == (2.0, pytest.approx(0.15))
    content["plant"] |= {"type": "infinite-bus", "network": {**on["plant"]["network"], "X": 0.1}}
    setup = build_experiments(case_of(content, tmp_path))[1]
    (switch,) = [step for step in setup.experiment.simulator.inputs.steps if step.signal == "X"]
    assert switch.step == pytest.approx(0.15)


def test_a_tie_is_the_number_that_it_gives(tmp_path):
    content = single()
    by_hand = fit(case_of(content, tmp_path))
    content["parameters"]["fixed"]["VAMIN"] = "=-VAMAX"
    tied = fit(case_of(content, tmp_path))
    assert tied.values == by_hand.values
    assert tied.cost == by_hand.cost


def test_a_tied_parameter_is_as_well_known_as_what_it_follows(tmp_path):
    content = single()
    plain = fit(case_of(content, tmp_path))
    free = content["parameters"]["free"]
    free["TE0"] = {key: value / 0.9 for key, value in free.pop("TE").items()}
    content["parameters"]["fixed"]["TE"] = "=0.9*TE0"
    tied = fit(case_of(content, tmp_path))
    assert tied.values["TE"] == pytest.approx(plain.values["TE"], rel=SAME)
    assert tied.values["TE0"] == pytest.approx(plain.values["TE"] / 0.9, rel=SAME)
    intervals = [one.knowledge.confidence.parameters for one in (plain, tied)]
    ends = np.array([intervals[0]["TE"].interval, intervals[1]["TE0"].interval])
    assert ends[0] == pytest.approx(0.9 * ends[1], rel=1e-4)


def test_a_tie_follows_what_is_set(tmp_path):
    content = single()
    content["parameters"]["fixed"] |= {"VAMIN": "=-VAMAX", "VRMIN": "=VAMIN", "VRMAX": "=-VRMIN"}
    case = case_of(content, tmp_path)
    assert case.values()["VRMIN"] == -14.5
    values = values_of(case, changed_values(case, {"VAMAX": 9.0}, "--set"))
    assert (values["VAMIN"], values["VRMIN"], values["VRMAX"]) == (-9.0, -9.0, 9.0)
    # what is set itself no longer follows, and leads what follows it
    values = values_of(case, {"VAMIN": -5.0})
    assert (values["VAMAX"], values["VRMIN"], values["VRMAX"]) == (14.5, -5.0, 5.0)


def test_a_tie_across_the_parts_follows(tmp_path):
    content = single()
    content["plant"]["parameters"]["Tppd0"] = "=machine.Tpd0/200"
    content["parameters"]["fixed"]["TF"] = "=machine.Tpd0/4"
    del content["parameters"]["free"]["TF"]
    values = values_of(case_of(content, tmp_path), {"machine.Tpd0": 5.0})
    assert (values["machine.Tppd0"], values["TF"]) == (0.025, 1.25)


def test_a_tie_without_a_value_is_reported(tmp_path):
    content = single()
    content["parameters"]["fixed"]["SE1"] = "=0.1*KE/(KE+KF-0.0444)"
    case = case_of(content, tmp_path)
    with pytest.raises(CaseError, match=r"--set: =0\.1\*KE/\(KE\+KF-0\.0444\): division by zero"):
        changed_values(case, {"KE": 0.0}, "--set")
    with pytest.raises(CaseError, match="--set: TE0: not a parameter"):
        changed_values(case, {"TE0": 1.0}, "--set")


def test_what_follows_a_value_that_is_set_keeps_to_its_data_sheet(tmp_path):
    content = single()
    free = content["parameters"]["free"]
    free["TE0"] = free.pop("TE")
    content["parameters"]["fixed"] |= {"TE": "=0.9*TE0", "VRMIN": "=-VAMAX"}
    case = case_of(content, tmp_path)
    with pytest.raises(CaseError, match=r"--set: TE: -1\.8 is below 0\.01 s"):
        changed_values(case, {"TE0": -2.0}, "--set")
    with pytest.raises(CaseError, match="--set: TE0: nan is not a finite number"):
        changed_values(case, {"TE0": np.nan}, "--set")
    with pytest.raises(CaseError, match=r"--set: .*VRM"):
        changed_values(case, {"VAMAX": -15.0, "VAMIN": -20.0}, "--set")


@pytest.mark.long
def test_a_parameters_file_gives_the_fit_back(tmp_path):
    """Helpers, tied parameters and what was found about the records take part."""
    content = three_free(
        several(
            recording("up", delay=found_in(0.0, -0.1, 0.1)),
            recording("down", step=found_in(-0.045, -0.08, -0.02)),
            validate=[{**recording("up"), "name": "again"}],
        )
    )
    content["records"][0]["test"]["vt0"] = 1.0
    free = content["parameters"]["free"]
    free["TE0"] = {key: value / 0.9 for key, value in free.pop("TE").items()}
    content["parameters"]["fixed"] |= {"TE": "=0.9*TE0", "VAMIN": "=-VAMAX"}
    case = case_of(content, tmp_path)
    found = fit(case)
    write_fit(found, tmp_path / "run")
    back = read_parameters(case, tmp_path / "run" / "parameters.yaml")
    assert {"TE0", "up.delay", "down.vref.step"} <= back.keys()
    assert not {"TE", "VAMIN"} & back.keys()
    assert values_of(case, back) == pytest.approx(found.values, rel=1e-12)
    again = validate(case, back)
    for one_, other in zip(again[:2], found.comparisons, strict=True):
        assert one_.cost == pytest.approx(other.cost, rel=1e-9)
    compared = simulate(case, back).comparison
    assert compared.cost == pytest.approx(found.comparison.cost, rel=1e-9)
    # set beside the file, VAMAX still leads
    assert values_of(case, {**back, "VAMAX": 9.0})["VAMIN"] == -9.0
    # a case with other records takes the unit from it
    del free["TE0"]
    del content["parameters"]["fixed"]["TE"]
    other = read_parameters(case_of(single(), tmp_path), _without_helper(tmp_path))
    assert other["KA"] == found.values["KA"]
    assert "up.delay" not in other


def _without_helper(folder):
    text = (folder / "run" / "parameters.yaml").read_text()
    lines = [line for line in text.splitlines() if "TE0" not in line]
    path = folder / "unit.yaml"
    path.write_text("\n".join(lines))
    return path


def with_prior(name, mean, std):
    content = single()
    content["parameters"]["free"][name]["prior"] = {"mean": mean, "std": std}
    return content


@pytest.mark.long
def test_a_sharp_prior_holds_a_parameter_and_a_dull_one_does_nothing(tmp_path):
    free = fit(case_of(single(), tmp_path))
    held = fit(case_of(with_prior("TF", NEAR, 1e-7), tmp_path))
    assert held.values["TF"] == pytest.approx(NEAR, abs=1e-6)
    by_hand = single()
    del by_hand["parameters"]["free"]["TF"]
    by_hand["parameters"]["fixed"]["TF"] = NEAR
    assert held.values == pytest.approx(fit(case_of(by_hand, tmp_path)).values, rel=1e-4)
    dull = fit(case_of(with_prior("TF", NEAR, 1e7), tmp_path))
    assert dull.values == pytest.approx(free.values, rel=SAME)


@pytest.mark.long
def test_a_share_is_the_number_that_it_stands_for(tmp_path):
    shares = [with_prior("TF", 1.3, std) for std in ("20 %", "20%", "20.0 %", 0.2 * 1.3)]
    found = [fit(case_of(content, tmp_path)) for content in shares]
    for one_ in found[1:]:
        assert unit(one_) == pytest.approx(unit(found[0]), rel=1e-9)
        assert errors(one_) == pytest.approx(errors(found[0]), rel=1e-9)


def test_a_prior_adds_its_information(tmp_path):
    """One over the variances add up, where the prior says what the record says."""
    content = {**config("ac1a_typical"), "validate": []}
    plain = fit(case_of(content, tmp_path))
    mean, error = plain.values["KD"], errors(plain)["KD"]
    content["parameters"]["free"]["KD"]["prior"] = {"mean": mean, "std": "20 %"}
    prior = fit(case_of(content, tmp_path))
    assert prior.values["KD"] == pytest.approx(mean, rel=1e-3)
    expected = 1.0 / np.sqrt(1.0 / error**2 + 1.0 / (0.2 * mean) ** 2)
    # that of the record is widened where its errors are not white, the prior's is not
    assert errors(prior)["KD"] == pytest.approx(expected, rel=0.05)
    assert expected < 0.9 * error


def spiked(folder, size=0.05, share=0.01):
    """Write the step up with spikes; return the place of the file."""
    record = read_columns(SAMPLES / "ac1a_up.csv", ["t", "vt"])
    rng, vt = np.random.default_rng(7), record["vt"].copy()
    at = rng.choice(len(vt), round(share * len(vt)), replace=False)
    vt[at] += size * rng.choice([-1.0, 1.0], len(at))
    return str(write(folder / "spiked.csv", t=record["t"], vt=vt))


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    content = {**config("ac1a_typical"), "validate": []}
    return fit(case_of(content, tmp_path_factory.mktemp("clean")))


def away(found, clean):
    """Return how far each parameter is from the clean fit, in half widths of its interval."""
    result = {}
    for name, known in clean.knowledge.confidence.parameters.items():
        half = 1.96 * known.std_error
        if known.interval is not None:
            half = 0.5 * (known.interval[1] - known.interval[0])
        result[name] = abs(found.values[name] - clean.values[name]) / half
    return result


@pytest.mark.long
@pytest.mark.parametrize("loss", few_of(["huber", "soft-l1"], 1))
def test_a_robust_loss_bears_spikes(tmp_path, clean, loss):
    content = {**config("ac1a_typical"), "validate": []}
    content["record"]["file"] = spiked(tmp_path)
    content["estimate"]["loss"] = loss
    found = fit(case_of(content, tmp_path))
    assert found.success
    assert max(away(found, clean).values()) < 2.0


@pytest.mark.long
def test_least_squares_do_not_bear_spikes_unless_they_are_left_out(tmp_path, clean):
    content = {**config("ac1a_typical"), "validate": []}
    content["record"]["file"] = spiked(tmp_path)
    assert max(away(fit(case_of(content, tmp_path)), clean).values()) > 3.0
    content["record"]["channels"] = {"vt": {"column": "vt", "outliers": 6}}
    assert max(away(fit(case_of(content, tmp_path)), clean).values()) < 1.0


@pytest.mark.long
def test_what_is_masked_can_be_anything(tmp_path):
    """Before the step too, where the level at the start is taken from."""
    record = read_columns(SAMPLES / "ac1a_up.csv", ["t", "vt"])
    mask, ends = [[0.2, 0.5], [3.0, 3.5]], []
    hidden = np.zeros(len(record["t"]), dtype=bool)
    for first, last in mask:
        hidden |= (record["t"] >= first) & (record["t"] <= last)
    for spoilt in (record["vt"], 1e3, np.nan):
        write(tmp_path / "record.csv", t=record["t"], vt=np.where(hidden, spoilt, record["vt"]))
        content = single(file="record.csv", mask=mask, gaps="skip")
        del content["test"]["vt0"]
        ends.append(fit(case_of(content, tmp_path)))
    for found in ends[1:]:
        assert found.values == ends[0].values
        assert found.cost == ends[0].cost
        assert found.notes == ends[0].notes
        assert found.comparison.features.measured == ends[0].comparison.features.measured
    (overlay,) = ends[0].comparison.overlays.values()
    assert np.array_equal(np.isnan(overlay.error), hidden)


def test_a_gap_is_refused_or_skipped(tmp_path):
    record = read_columns(SAMPLES / "ac1a_up.csv", ["t", "vt"])
    vt = record["vt"].copy()
    vt[[20, 300, 301]] = np.nan
    write(tmp_path / "record.csv", t=record["t"], vt=vt)
    with pytest.raises(RecordError, match=r"record\.csv"):
        fit(case_of(single(file="record.csv"), tmp_path))
    case = case_of(single(file="record.csv", gaps="skip"), tmp_path)
    assert residuals_of(case, build_experiments(case)).count == len(vt) - 3
    found, whole = fit(case), fit(case_of(single(), tmp_path))
    # three samples of a thousand
    assert unit(found) == pytest.approx(unit(whole), rel=5e-3)


@pytest.mark.long
def test_a_filter_of_both_signals_leaves_the_truth_in_place(tmp_path):
    synthetic(tmp_path, TEST, TIME, noise=2e-5)
    for chosen in ({"lowpass": 5.0}, {"median": 5}):
        channel = {"vt": {"column": "vt", "filter": chosen}}
        found = fit(case_of(one(TEST, channel, ["KA", "TE"]), tmp_path))
        assert found.values["KA"] == pytest.approx(332.83, rel=1e-2)
        assert found.values["TE"] == pytest.approx(1.5238, rel=1e-2)


@pytest.mark.parametrize(
    ("time", "record", "named"),
    [
        (TIME, {"filter": {"lowpass": 60.0}}, ["vt: filter: cutoff of 60 Hz"]),
        (
            np.sort(np.append(TIME, 3.001)),
            {"filter": {"lowpass": 5.0}},
            ["filter", "even sampling"],
        ),
        (TIME[::100], {"outliers": 3.0}, ["vt: outliers: 6 samples"]),
    ],
)
def test_a_filter_that_does_not_go_with_the_record_is_refused(tmp_path, time, record, named):
    write(tmp_path / "record.csv", t=time, vt=1.0 + 0.01 * time)
    case = case_of(one(TEST, {"vt": {"column": "vt", **record}}), tmp_path)
    with pytest.raises(RecordError) as caught:
        build_experiments(case)
    for part in ("record.csv", *named):
        assert part in str(caught.value)


@pytest.mark.parametrize(
    ("mask", "vt0", "named"),
    [
        ([[0.0, 9.0]], 1.0, "vt: fewer than 3 samples"),
        ([[0.0, 1.0]], None, "vt: no sample before 1 s: its start is unknown"),
    ],
)
def test_a_mask_that_leaves_nothing_is_refused(tmp_path, mask, vt0, named):
    write(tmp_path / "record.csv", t=TIME, vt=1.0 + 0.01 * TIME)
    test = {"vref": TEST["vref"]} if vt0 is None else TEST
    with pytest.raises(RecordError, match=named):
        build_experiments(case_of(one(test, mask=mask), tmp_path))


def test_a_stretch_masked_from_the_beginning_is_no_fault_where_the_level_is_given(tmp_path):
    content = single(mask=[[0.0, 1.2]])
    found, whole = fit(case_of(content, tmp_path)), fit(case_of(single(), tmp_path))
    assert unit(found) == pytest.approx(unit(whole), rel=2e-2)
    assert found.comparison.features.measured is None


def test_a_signal_that_drives_must_have_no_gap(tmp_path):
    content = config("exciter_playback")
    names = [content["record"]["time"], *content["record"]["channels"].values()]
    columns = {**read_columns(Path(content["record"]["file"]), names)}
    columns["vt"] = np.where(columns["t"] == 0.5, np.nan, columns["vt"])
    write(tmp_path / "record.csv", **columns)
    content["record"] |= {"file": "record.csv", "gaps": "skip"}
    with pytest.raises(RecordError, match="drives the simulation, but has a gap at"):
        build_experiments(case_of({**content, "validate": []}, tmp_path))


def test_a_check_covers_all_records_and_what_is_found_about_them(tmp_path):
    up = recording("up", at=found_in(1.0, 0.8, 1.2), delay=found_in(0.0123, -0.1, 0.1))
    down = recording("down", step=found_in(-0.05, -0.08, -0.02))
    up["test"]["vt0"] = found_in(1.0, 0.9, 1.1)
    content = three_free(several(up, down))
    content["parameters"]["fixed"]["VAMIN"] = "=-VAMAX"
    found = check(case_of(content, tmp_path))
    assert list(found.deviations)[-4:] == ["up.vref.at", "up.vt0", "up.delay", "down.vref.step"]
    assert len(found.deviations) == 7
    assert found.agrees
    assert found.flat


def test_a_fit_distinguishes_what_is_of_the_unit_from_what_is_of_the_records(tmp_path):
    content = three_free(several(recording("up", delay=found_in(0.0, -0.1, 0.1))))
    content["records"][0]["test"]["vt0"] = 1.0
    found = fit(case_of(content, tmp_path))
    assert unit(found).keys() == THREE.keys()
    assert found.parameters["up.delay"].unit == "s"
    assert found.inputs.keys() == {"case", "records.up"}
    assert [one.name for one in found.comparisons] == ["up"]


@pytest.mark.long
def test_many_starts_end_at_one_minimum_with_nuisances_too(tmp_path):
    content = three_free(several(recording("up", step=found_in(0.045, 0.02, 0.08))))
    content["records"][0]["test"]["vt0"] = 1.0
    content["parameters"]["free"] = {"KA": found_in(300.0, 100.0, 1000.0)}
    content["parameters"]["fixed"] |= {"TE": 1.5238, "TF": 1.5754}
    plain = fit(case_of(content, tmp_path))
    content["estimate"] = {"search": "global", "starts": 6}
    found = fit(case_of(content, tmp_path))
    assert found.minima is not None
    assert found.values == pytest.approx(plain.values, rel=1e-4)
    assert found.minima.minima[0].values.keys() == {"KA", "up.vref.step"}
