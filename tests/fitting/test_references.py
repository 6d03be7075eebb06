"""A reference as it was given or recorded: steps, ramps, a table, a file, a channel."""

from copy import deepcopy

import numpy as np
import pytest
from cases import FIRST_ORDER
from places import CONFIGS
from ramp_record import FILE, STEP, ramp_record
from ramp_record import NOISE as NOISE_OF_SAMPLE
from ramp_record import UNIT as TRUE_UNIT
from records import case_of, config, found_in, one, synthetic, write

from exfit.case.case import Case
from exfit.case.peek import files_of
from exfit.errors import CaseError, RecordError
from exfit.features.design.experiment_design import identify
from exfit.fitting.build import build_experiments
from exfit.records.record import Record
from exfit.workflows import fit, simulate

K, A = 4.0, 2.0
TIME = np.arange(0.0, 4.0, 0.01)  # 100 Hz
AT, LONG = 1.0, 0.5
RAMP = [{"at": AT, "step": 1.0, "ramp": LONG}]
TABLE = {"table": [[0, 1], [AT, 1], [AT + LONG, 2], [4, 2]]}
WAY = 1.0 + np.clip((TIME - AT) / LONG, 0.0, 1.0)  # of the reference
NOISE = 1e-3  # of vt, whose way is 2


def to_step(time, at):
    """Return the response of k/(s + a) to a unit step."""
    return K / A * (1.0 - np.exp(-A * np.maximum(time - at, 0.0)))


def to_ramp(time, at=AT, length=LONG):
    """Return its response to a ramp of one unit: the mean of those to steps."""

    def integral(t):
        t = np.maximum(t, 0.0)
        return K / A * (t - (1.0 - np.exp(-A * t)) / A)

    return (integral(time - at) - integral(time - at - length)) / length


def case_with(vref, vt, reference=None, **channel):
    """Return the case of k/(s + a) with a record in arrays."""
    content = deepcopy(FIRST_ORDER)
    content["test"] = {"vt0": 0.0, "vref": vref}
    content["simulation"] = {"step": 0.001}
    signals = {"vt": vt} | ({} if reference is None else {"vref": reference})
    if channel:
        content["record"] = {"channels": {"vt": "vt", "vref": {"column": "vref", **channel}}}
    return Case.from_dict(content, Record.from_arrays(TIME, signals))


def noisy(samples, seed=0, noise=NOISE):
    return samples + noise * np.random.default_rng(seed).standard_normal(len(samples))


@pytest.mark.parametrize("given", [RAMP, TABLE, "recorded"])
def test_a_ramp_however_it_is_given_has_the_response_of_its_closed_form(given):
    case = case_with(given, to_ramp(TIME), WAY if given == "recorded" else None)
    signals = simulate(case, {"k": K, "a": A}).response.signals
    # a recorded level is a mean, and samples lie beside the grid by rounding
    assert np.abs(signals["vt"] - to_ramp(TIME)).max() < 1e-12
    assert np.abs(signals["vref"] - signals["vref"][0] + 1.0 - WAY).max() < 1e-12


def test_ramp_table_and_channel_have_one_result():
    """From one record of another computation: to a tenth of an interval.

    The last reference was recorded with a five-hundredth of its way as noise.
    """
    vt = noisy(to_ramp(TIME))
    given = [(RAMP, None), (TABLE, None), ("recorded", WAY), ("recorded", noisy(WAY, 1, 2e-4))]
    results = [fit(case_with(vref, vt, reference)) for vref, reference in given]
    for name, truth in (("k", K), ("a", A)):
        first = results[0].parameters[name]
        low, high = first.interval
        assert low < truth < high
        for result in results[1:]:
            assert abs(result.parameters[name].value - first.value) < 0.1 * (high - low)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_a_jump_between_two_samples_is_a_step_whose_instant_is_found(noise):
    at = 1.0037
    reference = noisy(np.where(at < TIME, 2.0, 1.0), 2, noise)
    case = case_with("recorded", noisy(to_step(TIME, at), 3), reference)
    (setup,) = build_experiments(case)
    (instant,) = setup.free
    assert (instant.name, instant.low, instant.high) == ("vref.at", 1.0, 1.01)
    result = fit(case)
    for name, truth in (("k", K), ("a", A), ("vref.at", at)):
        assert result.parameters[name].value == pytest.approx(truth, rel=2e-3)
    assert result.comparison.rmse < 1.1 * NOISE


@pytest.mark.long
def test_the_noise_of_a_recorded_reference_is_reported():
    """Its standard error, 1e-4 over the root of a hundred samples at rest, of a way of 1."""
    text = "vref was recorded with noise of"
    quiet, loud = (fit(case_with("recorded", to_ramp(TIME), noisy(WAY, 1, n))) for n in (0, 1e-4))
    assert not any(note.startswith(text) for note in quiet.notes)
    (note,) = (note for note in loud.notes if note.startswith(text))
    assert "uncertain by 0.001 %" in note


def test_several_jumps_and_a_ramp_are_found_in_one_recorded_reference():
    instants, sizes = (0.6004, 2.3069), (0.5, -0.8)
    way = 1.0 + 0.4 * np.clip((TIME - 1.2) / 0.7, 0.0, 1.0)
    vt = 0.4 * to_ramp(TIME, 1.2, 0.7)
    for at, size in zip(instants, sizes, strict=True):
        way, vt = way + size * (at < TIME), vt + size * to_step(TIME, at)
    result = fit(case_with("recorded", noisy(vt, 4), noisy(way, 5, 2e-4)))
    found = [result.parameters[name].value for name in ("k", "a", "vref.at", "vref2.at")]
    assert found == pytest.approx([K, A, *instants], rel=3e-3)


def test_the_features_are_those_of_the_first_move():
    """Of a ramp by itself, as recorded, and up to the jump that follows."""
    back = 0.5 * to_step(TIME, 3.0037)
    cases = (
        case_with(RAMP, to_ramp(TIME)),
        case_with("recorded", to_ramp(TIME), WAY),
        case_with("recorded", to_ramp(TIME) - back, WAY - 0.5 * (TIME > 3.0037)),
    )
    given, recorded, before_jump = (
        simulate(case, {"k": K, "a": A}).comparison.features.simulated for case in cases
    )
    assert given.initial_value == pytest.approx(0.0, abs=1e-9)
    assert given.final_value == pytest.approx(K / A, rel=1e-2)
    assert recorded.rise_time == pytest.approx(given.rise_time, rel=0.02)
    last = (TIME > 2.9) & (TIME < 3.0)
    assert before_jump.final_value == pytest.approx(np.mean(to_ramp(TIME[last])), rel=1e-3)


def test_a_reference_that_is_more_than_steps_is_shown_beside_vt():
    steps = case_with([{"at": AT, "step": 1.0}], to_step(TIME, AT))
    recorded = case_with("recorded", to_ramp(TIME), WAY)
    for case, shown in ((steps, None), (recorded, WAY - 1.0), (case_with(RAMP, WAY), WAY - 1.0)):
        reference = simulate(case, {"k": K, "a": A}).comparison.overlays["vt"].reference
        assert (reference is None) == (shown is None)
        if shown is not None:
            assert reference == pytest.approx(shown, abs=1e-9)


def test_a_recorded_reference_is_scaled_as_a_ramp_is(tmp_path):
    """In a plan with a step of 5 %, of a record whose reference moved by 2 %."""
    clock = np.arange(0.0, 6.0, 0.01)
    ramp = {"at": 1.0, "step": 0.02, "ramp": 0.5}
    shown = synthetic(tmp_path, {"vt0": 1.0, "vref": [ramp]}, clock, noise=0.0)
    way = 1.0 + 0.02 * np.clip((clock - 1.0) / 0.5, 0.0, 1.0)
    write(tmp_path / "record.csv", t=clock, vt=shown["vt"], vref=way)
    errors = []
    for vref, channels in (([ramp], {"vt": "vt"}), ("recorded", {"vt": "vt", "vref": "vref"})):
        content = one({"vt0": 1.0, "vref": vref}, channels, ["KA", "TE"])
        plans = identify(case_of(content, tmp_path), {"vt": 1e-4}).plans
        errors.append(errors_of(next(plan for plan in plans if plan.label == "5 %")))
    assert errors[1] == pytest.approx(errors[0], rel=1e-6)


def test_the_instant_and_the_size_of_a_ramp_can_be_found():
    ramp = {"at": found_in(1.1, 0.8, 1.3), "step": found_in(0.8, 0.5, 1.5), "ramp": LONG}
    content = deepcopy(FIRST_ORDER)
    del content["parameters"]["free"]["k"]  # which the size stands for
    content["parameters"]["fixed"] = {"k": K}
    content["test"] = {"vt0": 0.0, "vref": [ramp]}
    result = fit(Case.from_dict(content, Record.from_arrays(TIME, {"vt": noisy(to_ramp(TIME))})))
    for name, truth in (("a", A), ("vref.at", AT), ("vref.step", 1.0)):
        assert result.parameters[name].value == pytest.approx(truth, rel=2e-3)


# --- files ----------------------------------------------------------------------------------------


def with_file(folder, step=0.001, **given):
    """Return a case whose reference is a file beside its record."""
    write(folder / "record.csv", t=TIME, vt=noisy(to_ramp(TIME)))
    content = deepcopy(FIRST_ORDER)
    content["simulation"] = {"step": step}
    content["test"] = {"vt0": 0.0, "vref": {"file": "ref.csv", "time": "t", "column": "v", **given}}
    content["record"] = {"file": "record.csv", "time": "t", "channels": {"vt": "vt"}}
    return case_of(content, folder)


def response_of(case):
    return simulate(case, {"k": K, "a": A}).response.signals["vt"]


def test_a_file_of_samples_or_of_few_rows_is_the_reference(tmp_path):
    """In per cent, every 4 ms and beyond the record; or a row at each corner."""
    clock = np.arange(0.0, 5.0, 0.004)
    way = 100.0 * (1.0 + np.clip((clock - AT) / LONG, 0.0, 1.0))
    write(tmp_path / "ref.csv", t=clock, v=way)
    got = response_of(with_file(tmp_path, unit="%", base=100.0))
    assert np.abs(got - to_ramp(TIME)).max() < 1e-9
    write(tmp_path / "ref.csv", t=np.array([0.0, AT, AT + LONG, 9.0]), v=np.array([1.0, 1, 2, 2]))
    assert np.abs(response_of(with_file(tmp_path)) - to_ramp(TIME)).max() < 1e-12


def test_a_fast_file_is_averaged_over_the_grid(tmp_path):
    """What happens between two points of a grid of 10 ms is not lost: its area acts."""
    clock = np.arange(0.0, 5.0, 5e-4)
    pulse = np.interp(clock, [AT, AT + 2e-3, AT + 7e-3, AT + 9e-3], [0.0, 1.0, 1.0, 0.0])
    write(tmp_path / "ref.csv", t=clock, v=1.0 + pulse)
    late = TIME > AT + 0.1
    area, middle = 7e-3, AT + 4.5e-3
    expected = K * area * np.exp(-A * (TIME - middle))
    assert response_of(with_file(tmp_path, step=0.01))[late] == pytest.approx(
        expected[late], rel=1e-3
    )


def test_the_file_of_a_reference_is_hashed_and_watched(tmp_path):
    write(tmp_path / "ref.csv", t=np.array([0.0, AT, AT + LONG, 9.0]), v=np.array([1.0, 1, 2, 2]))
    case = with_file(tmp_path)
    result = fit(case)
    assert result.files["record.vref"] == "ref.csv"
    assert len(result.inputs["record.vref"]) == 64
    assert tmp_path / "ref.csv" in files_of(case.path)


# --- what cannot be used --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        (([0.0, 1.0, 1.5, 3.0], [1.0, 1.0, 2.0, 2.0]), r"covers 0 \.\.\. 3 s, not the whole test"),
        ((TIME, np.ones(len(TIME))), "never leaves its noise"),
        ((TIME, 1.0 + TIME), "moves within its first 10 samples"),
    ],
)
def test_a_file_that_cannot_drive_a_test_is_refused(tmp_path, rows, message):
    write(tmp_path / "ref.csv", t=np.array(rows[0]), v=np.array(rows[1]))
    with pytest.raises(RecordError, match=message):
        simulate(with_file(tmp_path))


def test_a_table_that_ends_before_the_record_is_refused():
    with pytest.raises(CaseError, match=r"vref\.table: 0 \.\.\. 3 s does not cover the test"):
        simulate(case_with({"table": [[0, 1], [1, 1], [3, 2]]}, to_ramp(TIME)))


def test_a_gap_in_a_recorded_reference_is_refused():
    reference = np.where(np.abs(TIME - 2.0) < 0.005, np.nan, WAY)
    content = deepcopy(FIRST_ORDER)
    content["test"] = {"vt0": 0.0, "vref": "recorded"}
    record = Record.from_arrays(TIME, {"vt": to_ramp(TIME), "vref": reference}, missing=True)
    with pytest.raises(RecordError, match="vref: drives the simulation, but has a gap at 2 s"):
        simulate(Case.from_dict(content, record))


# --- a unit ---------------------------------------------------------------------------------------

UP = [{"at": 1.0, "step": 0.05, "ramp": 0.5}]


@pytest.mark.long
def test_a_unit_is_found_alike_from_ramp_table_and_channel(tmp_path):
    """AC1A, five parameters; 100 Hz, vt with noise of 1e-4 pu, vref of five decimals.

    Noise of 1e-4 pu on vref would leave the size of the ramp uncertain by 0.02 %, and move KA,
    which follows from the last 0.3 % of vt, by up to its whole interval.
    """
    clock = np.arange(0.0, 10.0, 0.01)
    shown = synthetic(tmp_path, {"vt0": 1.0, "vref": UP}, clock)
    way = np.round(1.00385 + 0.05 * np.clip((clock - 1.0) / 0.5, 0.0, 1.0), 5)
    write(tmp_path / "record.csv", t=clock, vt=shown["vt"], vref=way)
    rows = [[0, 1], [1.0, 1], [1.5, 1.05], [10, 1.05]]
    results = []
    for vref in (UP, {"table": rows}, "recorded"):
        content = one({"vt0": 1.0, "vref": vref}, free=["KA", "TE", "KF", "TF", "TA"])
        if vref == "recorded":
            content["record"]["channels"] = {"vt": "vt", "vref": "vref"}
        results.append(fit(case_of(content, tmp_path)))
    for name, parameter in results[0].parameters.items():
        low, high = parameter.interval
        for other in results[1:]:
            assert abs(other.parameters[name].value - parameter.value) < 0.1 * (high - low), name


@pytest.mark.long
def test_the_sample_record_of_a_ramp_and_a_jump_leads_to_the_unit_that_made_it():
    """Another integrator computed it; seven parameters and the instant of the jump."""
    result = fit(CONFIGS / "ac1a_ramp.yaml")
    for name in ("KA", "TA", "TE", "KF", "TF", "KC", "KD"):
        low, high = result.parameters[name].interval
        assert low < TRUE_UNIT[name] < high
    low, high = result.parameters["vref.at"].interval
    assert low < STEP.at < high
    assert high - low < 0.002
    assert result.comparison.rmse == pytest.approx(NOISE_OF_SAMPLE["vt"], rel=0.05)


def test_that_record_is_what_its_script_makes():
    made = np.loadtxt(ramp_record().splitlines(), delimiter=",", skiprows=1)
    kept = np.loadtxt(FILE, delimiter=",", skiprows=1)
    assert np.abs(made - kept).max() < 1.1e-5  # a digit may round the other way


@pytest.mark.parametrize("signal", ["vref", "vs"])
def test_both_inputs_of_a_unit_are_taken_from_a_record(tmp_path, signal):
    """A ramp and a jump; vs is beside a reference that steps."""
    clock = np.arange(0.0, 4.0, 0.01)
    events = [{"at": 1.0, "step": 0.02, "ramp": 0.3}, {"at": 2.5037, "step": -0.01}]
    other = {"vs": [{"at": 3.0, "step": 0.01}]} if signal == "vref" else {"vref": UP}
    test = {"vt0": 1.0, signal: events, **other}
    shown = synthetic(tmp_path, test, clock, noise=0.0, signals=("vt", "efd"))
    way = 0.02 * np.clip((clock - 1.0) / 0.3, 0.0, 1.0) - 0.01 * (clock > 2.5037)
    write(tmp_path / "record.csv", t=clock, vt=shown["vt"], level=15.75 * (1.0 + way))
    channel = {"column": "level", "unit": "kV", "base": 15.75}
    content = one({**test, signal: "recorded"}, {"vt": "vt", signal: channel}, ["KA"])
    case = case_of(content, tmp_path)
    got = simulate(case, {f"{signal}.at": 2.5037}).response.signals
    assert np.abs(got["vt"] - shown["vt"]).max() < 1e-7  # a smooth jump, lines on the grid
    assert np.abs(got["efd"] - shown["efd"]).max() < 2e-3 * np.ptp(shown["efd"])


def errors_of(plan):
    return [found.std_error for found in plan.confidence.parameters.values()]


def test_a_plan_can_have_ramps_and_is_scaled_with_its_reference(tmp_path):
    content = config("ac1a_typical")
    del content["record"], content["validate"]
    content["test"] = {"vt0": 1.0, "duration": 6.0, "vref": UP}
    content["parameters"]["free"] = {"KA": found_in(400, 40, 4000), "TE": found_in(1, 0.1, 10)}
    design = identify(case_of(content, tmp_path))
    own = errors_of(design.own)
    plans = {plan.label: plan for plan in design.plans}
    assert errors_of(plans["5 %"]) == pytest.approx(own, rel=1e-6)
    rows = {"table": [[0, 1.0], [1.0, 1.0], [1.5, 1.05], [6, 1.05]]}
    content["test"]["vref"] = rows
    table = identify(case_of(content, tmp_path)).own
    assert errors_of(table) == pytest.approx(own, rel=1e-6)
