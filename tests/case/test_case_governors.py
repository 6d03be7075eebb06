"""Cases with a governor: what the file may say, what it must, and what a fit finds of it."""

import numpy as np
import pytest
from places import REFERENCE

from exfit.case.load import load_case
from exfit.case.peek import free_of
from exfit.errors import CaseError, SimulationError
from exfit.fitting.system import system_of
from exfit.output.run_folder import write_fit
from exfit.plants import BREAKER
from exfit.results.io import load_result
from exfit.simulation.inputs import Inputs, InputStep
from exfit.verdict.run_quality import speed_notes, typical_notes
from exfit.workflows import check, fit, simulate
from exfit.workflows.given_values import changed_values

TRUTH = {"governor.R": 0.05, "governor.T1": 0.5, "governor.T3": 8.0}
CASE = """\
model: SEXS
plant:
  type: infinite-bus
  machine: GENROU
  parameters: {Tppd0: 0.035, H: 4.0, D: 2.0}
  network: {f0: 50, R: 0.01, X: 0.3, P: 0.7, Q: 0.1}
governor: {model: TGOV1, parameters: {R: 0.05, T1: 0.5, T2: 2.5, T3: 8.0}}
test:
  vt0: 1.0
  duration: 30.0
  pref: [{at: 1.0, step: 0.002}]
parameters: {fixed: {K: 50, EMAX: 9, EMIN: -9}}
"""
FREE = (
    "parameters: {R: 0.05, T1: 0.5, T2: 2.5, T3: 8.0}}",
    "parameters: {T2: 2.5}, free: {R: {start: 0.07, min: 0.01, max: 0.2}, "
    "T1: {start: 0.3, min: 0.05, max: 3}, T3: {start: 12, min: 3, max: 30}}}",
)
RECORD = "record: {file: record.csv, time: t, channels: {p: p, speed: speed}}\n"


def written(folder, *changes):
    text = CASE
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "case.yaml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fitted")
    response, rng = simulate(load_case(written(folder)), {}).response, np.random.default_rng(5)
    every = slice(None, None, 10)
    columns = [response.time[every]]
    for signal, noise in (("p", 2e-4), ("speed", 1e-6)):
        own = response.signals[signal][every]
        columns.append(own + noise * rng.standard_normal(own.size))
    np.savetxt(
        folder / "record.csv",
        np.column_stack(columns),
        delimiter=",",
        header="t,p,speed",
        comments="",
        fmt="%.8f",
    )
    changes = (
        FREE,
        ("  duration: 30.0\n", ""),
        ("parameters: {fixed", RECORD + "parameters: {fixed"),
    )
    case = load_case(written(folder, *changes))
    return case, fit(case, search="local")


def test_data_of_a_governor_are_found_within_their_intervals(found):
    _, result = found
    assert result.parameters.keys() == TRUTH.keys()
    for name, value in TRUTH.items():
        parameter = result.parameters[name]
        assert parameter.value == pytest.approx(value, rel=0.05), name
        # within three times the half of a 95 % interval: six standard errors
        low, high = parameter.interval
        assert abs(parameter.value - value) < 1.5 * (high - low), name


EVENT = """\
model: AC8B
plant:
  type: grid-playback
  machine: GENROU
  dialect: andes
  parameters: {Tpd0: 6.27, Tppd0: 0.059, Tpq0: 0.7, Tppq0: 0.096, D: 0, Xd: 2.014, Xq: 1.96,
    Xpd: 0.331, Xpq: 0.466, Xppd: 0.2059, Xl: 0.129, S10: 0.14, S12: 0.56}
  free: {H: {start: 4, min: 2, max: 9}}
  network: {f0: 60}
governor:
  model: TGOV1
  parameters: {VMAX: 1.2, VMIN: 0, T3: 7}
  free: {R: {start: 0.08, min: 0.01, max: 0.2}, T1: {start: 0.7, min: 0.05, max: 3},
    T2: {start: 1.5, min: 0.1, max: 5}}
record:
  file: record.csv
  time: t
  channels: {vt: vt, angle: {column: angle, unit: rad}, p: p, q: q}
parameters: {fixed: {TR: 0, KPR: 80, KIR: 5, KDR: 10, TDR: 0.1, KA: 1, TA: 0.01, VPIDMAX: 999,
  VPIDMIN: -999, VRMAX: 35, VRMIN: 0, TE: 1.2, VFEMAX: 999, VEMIN: 0, KC: 0.55, KD: 1.1, KE: 1,
  E1: 6.5, SE1: 0.3, E2: 9, SE2: 3}}
"""


@pytest.mark.long
def test_a_governor_is_found_from_a_grid_event_of_another_simulator(tmp_path):
    columns = np.genfromtxt(REFERENCE / "playback_ac8b_tgov1.csv", delimiter=",", names=True)
    rng = np.random.default_rng(1)
    noisy = [columns[name] + 2e-4 * rng.standard_normal(columns.size) for name in ("p", "q")]
    table = np.column_stack([columns["t"], columns["vt"], columns["angle"], *noisy])
    path, header = tmp_path / "record.csv", "t,vt,angle,p,q"
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.9g")
    (tmp_path / "case.yaml").write_text(EVENT)
    result = fit(tmp_path / "case.yaml", search="local", given="exact")
    truth = {"machine.H": 4.471, "governor.R": 0.05, "governor.T1": 0.4, "governor.T2": 2.1}
    for name, value in truth.items():
        parameter = result.parameters[name]
        low, high = parameter.interval
        assert abs(parameter.value - value) < 1.5 * (high - low), name
        # that of T1 is 0.6 % wide: recorded voltage and angle have no noise to widen it
        assert high - low < 0.01 * value, name
        assert abs(parameter.value - value) < 0.005 * value, name


def test_a_result_keeps_the_governor_and_is_read_back(found, tmp_path):
    case, result = found
    assert result.governor_model == "TGOV1"
    assert result.governor["T2"] == 2.5
    assert result.governor["R"] == result.parameters["governor.R"].value
    assert "governor.R" in result.values
    assert "R" not in result.fixed
    write_fit(result, tmp_path / "run")
    back = load_result(tmp_path / "run")
    assert back.governor == result.governor
    assert back.governor_model == "TGOV1"
    assert [part.name for part in back.parts if part.kind == "governor"] == ["TGOV1"]
    assert free_of(case.path) == tuple(TRUTH)


def test_values_of_a_governor_can_be_set_by_name_and_tied(tmp_path):
    case = load_case(written(tmp_path, ("T3: 8.0", "T3: = 3.2 * governor.T2")))
    given = {"governor.R": 0.04}
    assert changed_values(case, given, "--set") == given
    assert case.values()["governor.T3"] == pytest.approx(8.0)
    one, other = simulate(case, {}).response, simulate(case, given).response
    end = [response.signals["p"][-1] for response in (one, other)]
    assert end[1] - 0.7 == pytest.approx(1.25 * (end[0] - 0.7), rel=1e-2)


def test_a_governor_on_open_circuit_is_said_not_to_act(tmp_path):
    opened = (
        ("infinite-bus", "open-circuit"),
        ("  network: {f0: 50, R: 0.01, X: 0.3, P: 0.7, Q: 0.1}\n", ""),
        ("  pref: [{at: 1.0, step: 0.002}]\n", "  vref: [{at: 1.0, step: 0.02}]\n"),
    )
    case = load_case(written(tmp_path, *opened))
    assert any("TGOV1 does not act" in note for note in typical_notes(case, case.values()))
    assert not any(name.startswith("governor") for name in system_of(case).parameters)


def test_a_simulated_speed_after_a_rejection_holds_where_there_is_a_governor(tmp_path):
    inputs = Inputs(0.0, 10.0, (InputStep(1.0, 1.0, BREAKER),))
    values = load_case(written(tmp_path)).values()
    without = {name: value for name, value in values.items() if not name.startswith("governor")}
    assert [*speed_notes(inputs, values)] == []
    assert len([*speed_notes(inputs, without)]) == 1


@pytest.mark.parametrize(("excess", "rests"), [(0.009, True), (0.011, False)])
def test_a_unit_at_its_limit_is_noted_and_one_beyond_it_is_refused(tmp_path, excess, rests):
    limit = f"T1: 0.5, VMAX: {0.7 - excess:g}"
    path = written(tmp_path, ("T1: 0.5", limit))
    if not rests:
        with pytest.raises(CaseError, match=r"P = 0\.7 pu: VMAX = 0\.689 where it needs 0\.7$"):
            load_case(path)
        return
    case = load_case(path)
    for notes in (check(case).notes, simulate(case, {}).notes):
        (note,) = [note for note in notes if "governor.VMAX" in note]
        assert "starts at 0.7, above governor.VMAX = 0.691" in note


def test_a_record_beyond_a_limit_of_the_governor_is_named(tmp_path):
    columns = np.genfromtxt(REFERENCE / "playback_ac8b_tgov1.csv", delimiter=",", names=True)
    names = ("t", "vt", "angle", "p", "q")
    table = np.column_stack([columns[name] for name in names])
    np.savetxt(tmp_path / "record.csv", table, delimiter=",", header=",".join(names), comments="")
    (tmp_path / "case.yaml").write_text(EVENT.replace("VMAX: 1.2", "VMAX: 0.57"))
    says = r"record\.csv: .* the start needs 0\.6000.*, above governor\.VMAX = 0\.57$"
    with pytest.raises(SimulationError, match=says):
        check(load_case(tmp_path / "case.yaml"))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("TGOV1", "TGOV9", "governor.model: 'TGOV9' is not a governor model; did you mean TGOV3"),
        ("T1: 0.5", "T9: 0.5", "governor.parameters.T9: not a parameter of TGOV1"),
        ("R: 0.05,", "R: 0,", "governor.parameters.R: 0 lies outside 0.001 ... 10 pu"),
        ("T1: 0.5", "VMAX: 0.2, VMIN: 0.3", "governor.parameters.VMIN: 0.3 is not below VMAX"),
        ("T1: 0.5", "VMAX: 0.6", "governor.parameters: TGOV1 does not rest at P = 0.7 pu"),
        ("model: TGOV1, ", "", "governor.model: is missing"),
        ("infinite-bus", "none", "governor: not allowed with plant none: it would have no input"),
        ("infinite-bus", "open-circuit", "test.pref: not allowed with plant open-circuit"),
        ("governor: {model: TGOV1, parameters: {R: 0.05, T1: 0.5, T2: 2.5, T3: 8.0}}\n", "",
         "test.pref: needs a governor: there is none"),
    ],
)  # fmt: skip
def test_a_fault_of_a_governor_is_reported_with_its_place(tmp_path, old, new, says):
    path = written(tmp_path, (old, new))
    with pytest.raises(CaseError) as refused:
        load_case(path)
    lines = str(refused.value).splitlines()
    assert any(says in line for line in lines), lines
    assert all(line.startswith(f"{path}:") for line in lines)
