"""Records of three phases and slower clocks, from the case file to the fit."""

import numpy as np
import pytest
import yaml
from records import UNIT, case_of, one, synthetic, write
from tiers import few_of

from exfit.case.load import load_case
from exfit.errors import CaseError, RecordError
from exfit.fitting.build import build_experiments
from exfit.workflows import fit

TEST = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}]}
RATED = 15.75  # kV, line to line
RATE = 2000.0  # Hz
FREQUENCY = 49.8  # Hz
TIME = np.arange(0.0, 4.0, 1.0 / RATE)
TURNS = np.array([0.0, -2.0 * np.pi / 3.0, 2.0 * np.pi / 3.0])
PHASES = {
    "phases": ["UL1", "UL2", "UL3"],
    "kind": "waveform",
    "unit": "kV",
    "base": RATED,
    "connection": "phase-to-ground",
}
NEAR = 2e-6  # pu: the line between samples cuts the kink of the response


def waves(vt):
    """Return three phases to ground, kV, with some unbalance, harmonics and offset."""
    angle = 2.0 * np.pi * FREQUENCY * TIME[:, None] + TURNS
    ripple = 0.01 * np.cos(angle[:, :1] - TURNS) + 0.02 * np.cos(5.0 * angle) + 0.003
    return np.sqrt(2.0 / 3.0) * RATED * (vt[:, None] * np.cos(angle) + ripple)


def case_with(folder, channels, columns=None, free=(), **record):
    """Return the AC1A's case with the record that was written, or one of these columns."""
    if columns is not None:
        write(folder / "record.csv", **columns)
    return case_of(one(TEST, channels, free, **record), folder)


def setup_of(case):
    return build_experiments(case)[0].with_enough_substeps(case.values())


@pytest.mark.parametrize("kind", few_of(["waveform", "rms"], 1))
def test_a_voltage_that_is_not_there_outside_the_window_does_not_matter(tmp_path, kind):
    vt = synthetic(tmp_path, TEST, TIME, noise=0.0)["vt"]
    whole = waves(vt) if kind == "waveform" else np.outer(vt, np.full(3, RATED / np.sqrt(3.0)))
    dead = np.where((TIME > 0.5)[:, None], whole, [0.0, 0.001, 0.01])
    records = []
    for phases in (whole, dead):
        columns = {"t": TIME, **dict(zip(PHASES["phases"], phases.T, strict=True))}
        case = case_with(tmp_path, {"vt": {**PHASES, "kind": kind}}, columns, window=[0.6, 3.9])
        records.append(setup_of(case).record)
    np.testing.assert_array_equal(records[0].time, records[1].time)
    np.testing.assert_array_equal(records[0].signals["vt"], records[1].signals["vt"])
    assert records[0].time[0] == pytest.approx(0.6, abs=1.0 / FREQUENCY)


def test_waveforms_become_the_voltage_that_the_simulation_shows_averaged(tmp_path):
    vt = synthetic(tmp_path, TEST, TIME, noise=0.0)["vt"]
    columns = {"t": TIME, **dict(zip(PHASES["phases"], waves(vt).T, strict=True))}
    setup = setup_of(case_with(tmp_path, {"vt": PHASES}, columns))
    errors, _ = setup.experiment.errors(
        setup.with_start_values(UNIT | load_case(tmp_path / "case.yaml").values())
    )
    assert setup.record.averaged["vt"] == pytest.approx(1.0 / FREQUENCY, rel=1e-6)
    assert np.max(np.abs(errors)) < NEAR
    # half a window is lost at either end
    lost = (len(TIME) - len(setup.record.time)) / RATE
    assert lost == pytest.approx(setup.record.averaged["vt"], abs=2.0 / RATE)


def test_other_channels_lose_the_same_ends(tmp_path):
    simulated = synthetic(tmp_path, TEST, TIME, noise=0.0, signals=("vt", "efd"))
    columns = {"t": TIME, "efd": simulated["efd"]}
    columns |= dict(zip(PHASES["phases"], waves(simulated["vt"]).T, strict=True))
    record = setup_of(case_with(tmp_path, {"vt": PHASES, "efd": "efd"}, columns)).record
    assert np.allclose(record.signals["efd"], np.interp(record.time, TIME, simulated["efd"]))


@pytest.mark.parametrize(
    ("connection", "over"), few_of([("phase-to-ground", np.sqrt(3.0)), ("phase-to-phase", 1.0)], 1)
)
def test_rms_values_of_phases_become_one_voltage(tmp_path, connection, over):
    vt = synthetic(tmp_path, TEST, TIME, noise=0.0)["vt"]
    columns = {"t": TIME, **dict.fromkeys(PHASES["phases"], RATED / over * vt)}
    entry = {**PHASES, "kind": "rms", "connection": connection}
    record = setup_of(case_with(tmp_path, {"vt": entry}, columns)).record
    assert record.signals["vt"] == pytest.approx(vt, rel=1e-8)
    assert not record.averaged


@pytest.mark.long
def test_a_slower_clock_leads_to_the_same_unit(tmp_path):
    """Its filter leaves a twentieth of the samples, and as little of the noise."""
    synthetic(tmp_path, TEST, TIME)
    every = fit(case_with(tmp_path, {"vt": "vt"}, free=("KA", "TA")))
    few = fit(case_with(tmp_path, {"vt": "vt"}, free=("KA", "TA"), resample=100.0))
    assert len(few.comparison.time) == pytest.approx(len(TIME) / 20, abs=1)
    assert few.comparison.rmse < 0.3 * every.comparison.rmse
    for name in ("KA", "TA"):
        error = every.knowledge.confidence.parameters[name].std_error
        assert abs(few.values[name] - every.values[name]) < 2.0 * error


def test_a_recorder_that_averages_is_simulated_so(tmp_path):
    window = 0.1
    vt = synthetic(tmp_path, TEST, TIME, noise=0.0)["vt"]
    half = round(0.5 * window * RATE)
    kernel = np.r_[0.5, np.ones(2 * half - 1), 0.5] / (2 * half)
    averages = np.convolve(vt, kernel, "valid")
    columns = {"t": TIME[half:-half], "vt": averages}
    setup, plain = (
        setup_of(case_with(tmp_path, {"vt": entry}, columns))
        for entry in ({"column": "vt", "averaged": window}, "vt")
    )
    values = setup.with_start_values(load_case(tmp_path / "case.yaml").values())
    inner = slice(half, -half)
    assert np.max(np.abs(setup.experiment.errors(values)[0][inner])) < NEAR
    assert np.max(np.abs(plain.experiment.errors(values)[0][inner])) > 100 * NEAR


REFUSED = {
    "of another signal": (
        {"efd": PHASES, "vt": "vt"},
        {},
        "channels.efd.phases: only allowed for vt",
    ),
    "cycles of rms": (
        {"vt": {**PHASES, "kind": "rms", "cycles": 2}},
        {},
        "channels.vt.cycles: only with kind: waveform",
    ),
    "average of waves": (
        {"vt": {**PHASES, "averaged": 0.1}},
        {},
        "channels.vt.averaged: waveforms have a window of their own",
    ),
    "no connection": (
        {"vt": {key: value for key, value in PHASES.items() if key != "connection"}},
        {},
        "channels.vt.connection: is missing",
    ),
    "two phases": ({"vt": {**PHASES, "phases": ["UL1", "UL2"]}}, {}, "channels.vt.phases"),
    "gaps": (
        {"vt": "vt"},
        {"gaps": "skip", "resample": 50.0},
        "resample: not allowed with gaps: skip",
    ),
}


@pytest.mark.parametrize(("channels", "record", "text"), REFUSED.values(), ids=REFUSED)
def test_a_case_that_contradicts_itself_is_refused(tmp_path, channels, record, text):
    path = tmp_path / "case.yaml"
    path.write_text(yaml.safe_dump(one(TEST, channels, **record)))
    with pytest.raises(CaseError) as caught:
        load_case(path)
    assert text in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


def test_what_are_no_waveforms_is_refused_with_their_columns(tmp_path):
    vt = np.ones(len(TIME))
    swapped = [PHASES["phases"][k] for k in (0, 2, 1)]
    columns = {"t": TIME, **dict(zip(swapped, waves(vt).T, strict=True))}
    with pytest.raises(RecordError, match=r"record\.csv: columns 'UL1', 'UL2', 'UL3': .*swapped"):
        setup_of(case_with(tmp_path, {"vt": PHASES}, columns))
    columns = {"t": TIME, **dict.fromkeys(swapped, vt)}
    with pytest.raises(RecordError, match=r"record\.csv: columns 'UL1', 'UL2', 'UL3': "):
        setup_of(case_with(tmp_path, {"vt": PHASES}, columns))


@pytest.mark.parametrize("rate", [RATE, 0.1])
def test_a_clock_that_is_not_slower_or_has_no_samples_is_refused(tmp_path, rate):
    synthetic(tmp_path, TEST, TIME)
    with pytest.raises(RecordError, match=r"record\.csv: resample: "):
        setup_of(case_with(tmp_path, {"vt": "vt"}, resample=rate))


@pytest.mark.parametrize(("base", "rests"), [(15750.0, "0.001"), (1.575, "10")])
def test_a_voltage_that_no_machine_has_is_refused_with_its_value_and_limits(tmp_path, base, rests):
    vt = synthetic(tmp_path, TEST, TIME)["vt"]
    channels = {"vt": {"column": "u", "unit": "kV", "base": base}}
    content = one({"vref": TEST["vref"]}, channels, ["KA"])
    write(tmp_path / "record.csv", t=TIME, u=15.75 * vt)
    with pytest.raises(
        RecordError, match=rf"vt rests at {rests} pu, outside 0\.1 \.\.\. 2: .*base"
    ):
        build_experiments(case_of(content, tmp_path))


def test_a_voltage_in_kv_that_the_test_states_is_refused_as_such(tmp_path):
    synthetic(tmp_path, TEST, TIME)
    content = one({**TEST, "vt0": 15.75}, {"vt": "vt"}, ["KA"])
    with pytest.raises(RecordError, match=r"vt0, which its test states, is 15\.75 pu, outside 0"):
        build_experiments(case_of(content, tmp_path))


@pytest.mark.long
@pytest.mark.parametrize("connection", ["phase-to-ground", "phase-to-phase"])
def test_a_voltage_off_by_the_connection_is_noted(tmp_path, connection):
    vt = synthetic(tmp_path, TEST, TIME)["vt"]
    columns = {"t": TIME, **dict.fromkeys(PHASES["phases"], RATED / np.sqrt(3.0) * vt)}
    entry = {**PHASES, "kind": "rms", "connection": connection}
    write(tmp_path / "record.csv", **columns)
    result = fit(case_of(one({"vref": TEST["vref"]}, {"vt": entry}, ["KA"]), tmp_path))
    causes = [cause for cause in result.verdict.causes if "vt starts from 0.577" in cause.cause]
    noted = any("connection" in cause.remedy for cause in causes)
    assert noted == (connection == "phase-to-phase")


@pytest.mark.long
def test_noise_that_waveforms_smooth_is_neither_a_drift_nor_a_misfit(tmp_path):
    vt = synthetic(tmp_path, TEST, TIME, noise=0.0)["vt"]
    noise = 5e-3 * np.random.default_rng(3).standard_normal((len(TIME), 3))
    columns = {"t": TIME, **dict(zip(PHASES["phases"], (waves(vt) + noise).T, strict=True))}
    result = fit(case_with(tmp_path, {"vt": PHASES}, columns, ["KA", "TE", "TF"]))
    assert result.success
    assert not [note for note in result.notes if "at rest" in note]
    assert result.verdict.matches


def test_a_start_that_is_not_filled_in_and_a_missing_connection_say_what_is_wanted(tmp_path):
    entry = {key: value for key, value in PHASES.items() if key != "connection"}
    for channel, wanted in (
        ({"column": "u", "unit": "kV", "base": "?"}, "vt.base: '?' is to be filled in"),
        (entry, "vt.connection: is missing: phase-to-ground or phase-to-phase?"),
    ):
        with pytest.raises(CaseError) as noted:
            case_of(one(TEST, {"vt": channel}), tmp_path)
        assert wanted in str(noted.value)


def test_a_coarse_step_is_held_against_the_error_of_the_signal_that_it_moves(tmp_path):
    """At 20 ms it moves efd by 3e-5 pu: a third of the noise of vt, nothing beside that of efd."""
    clock = np.arange(0.0, 6.0, 0.01)
    simulated = synthetic(tmp_path, TEST, clock, signals=("vt", "efd"))
    for noise, noted in ((5e-3, False), (1e-4, True)):
        efd = simulated["efd"] + noise * np.random.default_rng(1).standard_normal(len(clock))
        write(tmp_path / "record.csv", t=clock, vt=simulated["vt"], efd=efd)
        channels = {
            "vt": {"column": "vt", "noise": 1e-4},
            "efd": {"column": "efd", "noise": noise},
        }
        content = {**one(TEST, channels, ["KA"]), "simulation": {"step": 0.02}}
        notes = [one for one in fit(case_of(content, tmp_path)).notes if "halving" in one]
        assert any("changes efd by" in one for one in notes) == noted
        assert not any("changes vt by" in one for one in notes)
