"""Recorded signals in place of the plant: another simulator's trajectories drive ours."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from places import REFERENCE as RECORDED

from exfit.case.load import load_case
from exfit.errors import CaseError, RecordError, SimulationError
from exfit.fitting.build import build_experiments
from exfit.simulation.simulator import Simulator
from exfit.workflows import fit, simulate

REFERENCE = RECORDED / "reference_ac1a.csv"
TOLD = json.loads(REFERENCE.with_suffix(".json").read_text())
NOISE = 1e-4  # pu, of vt; a hundred times that of efd

MACHINE = """\
plant:
  type: machine-playback
  machine: GENROU
  parameters: {Tppd0: 0.035, Xd: 1.8, Xpd: 0.3, Xppd: 0.25, Xl: 0.2}
  free:
    Tpd0: {start: 3.77, min: 1.0, max: 20.0}
    S10: {start: 0.05, min: 0.01, max: 1.0}
    S12: {start: 0.25, min: 0.02, max: 2.0}
test: {steady_until: 1.0}
record: {file: RECORD, time: t, channels: {efd: efd, vt: vt, ifd: {column: ifd, weight: 0.01}}}
estimate: {search: local}
"""
EXCITER = """\
model: AC1A
plant: {type: playback}
test: {vref: [{at: 1.0, step: 0.05}, {at: 11.0, step: -0.05}]}
record: {file: RECORD, time: t, channels: {vt: vt, ifd: ifd, efd: efd}}
parameters:
  fixed: {VALUES}
simulation: {step: 0.001}
estimate: {search: local}
"""


def in_effect():
    """Return the exciter's data of the reference as a case writes them."""
    values = {k: v for k, v in TOLD["params_in_effect"].items() if k != "bus"}
    values |= {"VAMAX": 9999.0, "VAMIN": -9999.0}
    return ", ".join(f"{name}: {value}" for name, value in values.items())


def exciter(record=REFERENCE, text=EXCITER):
    return text.replace("VALUES", in_effect()).replace("RECORD", str(record))


def case_of(text, folder, record=REFERENCE):
    path = folder / "case.yaml"
    path.write_text(text.replace("RECORD", str(record)))
    return load_case(path)


@pytest.fixture(scope="module")
def noisy(tmp_path_factory):
    """Write the reference with the noise of a recorder, seeded."""
    with REFERENCE.open() as file:
        header, *rows = csv.reader(file)
    table, rng = np.array(rows, dtype=float), np.random.default_rng(11)
    for name, size in (("vt", NOISE), ("efd", 100.0 * NOISE), ("ifd", 100.0 * NOISE)):
        table[:, header.index(name)] += size * rng.standard_normal(len(table))
    path = tmp_path_factory.mktemp("noisy") / "record.csv"
    np.savetxt(path, table, delimiter=",", header=",".join(header), comments="", fmt="%.8f")
    return path


# --- the machine alone ----------------------------------------------------------------------------


def test_the_recorded_field_voltage_gives_the_recorded_voltage(tmp_path):
    text = MACHINE.replace("free:", "# free:").replace("    Tpd0", "    # ")
    text = "\n".join(line for line in text.splitlines() if "start:" not in line)
    text = text.replace("Tppd0: 0.035", "Tpd0: 6.0, Tppd0: 0.035, S10: 0.12, S12: 0.4")
    found = simulate(case_of(text, tmp_path), {}).comparison
    # the trajectories are written to eight digits every 5 ms, and efd is drawn straight between
    assert found.overlays["vt"].max_error < 5e-6
    assert found.overlays["ifd"].max_error < 1e-4


@pytest.mark.long
def test_the_time_constant_and_the_saturation_are_found_through_noise(noisy, tmp_path):
    found = fit(case_of(MACHINE, tmp_path, noisy))
    values = {name: one.value for name, one in found.parameters.items()}
    assert found.success
    assert values["machine.Tpd0"] == pytest.approx(6.0, rel=0.01)
    assert values["machine.S10"] == pytest.approx(0.12, rel=0.05)
    assert values["machine.S12"] == pytest.approx(0.4, rel=0.05)
    # the noise of efd passes the field winding and adds to that of vt
    assert NOISE < found.comparison.rmse < 2.0 * NOISE


@pytest.mark.long
def test_an_offset_of_the_recorded_field_voltage_does_no_harm(noisy, tmp_path):
    shifted = MACHINE.replace("efd: efd", "efd: {column: efd, offset: 0.3}")
    one, other = (fit(case_of(text, tmp_path, noisy)) for text in (MACHINE, shifted))
    for name, found in one.parameters.items():
        assert other.parameters[name].value == pytest.approx(found.value, rel=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("base", [0.4, -0.4])
def test_the_scale_of_a_relative_field_voltage_is_found_with_the_time_constant(base, tmp_path):
    """In pu of another base: its scale and T'd0 both show in how vt and ifd move, at no noise."""
    with REFERENCE.open() as file:
        header, *rows = csv.reader(file)
    table = np.array(rows, dtype=float)
    table[:, header.index("efd")] *= base
    path = tmp_path / "relative.csv"
    np.savetxt(path, table, delimiter=",", header=",".join(header), comments="", fmt="%.10f")
    low, high = sorted((0.8 / base, 1.6 / base))
    scale = f"{{column: efd, scale: {{start: {1.3 / base}, min: {low}, max: {high}}}}}"
    text = MACHINE.replace("efd: efd", f"efd: {scale}")
    text = "\n".join(
        line for line in text.splitlines() if "S10:" not in line and "S12:" not in line
    )
    text = text.replace("Xl: 0.2", "Xl: 0.2, S10: 0.12, S12: 0.4")
    result = fit(case_of(text, tmp_path, path))
    assert result.success
    assert result.parameters["efd.scale"].value == pytest.approx(1.0 / base, rel=1e-4)
    assert result.parameters["machine.Tpd0"].value == pytest.approx(6.0, rel=1e-4)


# --- the exciter alone ----------------------------------------------------------------------------


def test_the_recorded_voltage_and_field_current_give_the_recorded_field_voltage(tmp_path):
    found = simulate(case_of(exciter(), tmp_path), {}).comparison
    assert list(found.overlays) == ["efd"]
    # a gain of 364 sees the eighth digit of vt, and what lies between samples of 5 ms: at the
    # steps efd runs through 3 pu within a few of them
    assert found.rmse < 2e-2
    away = np.abs((found.time - 1.0) % 10.0) > 0.5
    assert np.abs(found.overlays["efd"].error[away]).max() < 2e-3


@pytest.mark.long
def test_a_gain_is_found_from_what_drives_the_exciter(tmp_path):
    free = "  free:\n    KA: {start: 200, min: 20, max: 2000}\nsimulation"
    text = exciter(text=EXCITER.replace("simulation", free)).replace("KA: 364.1523, ", "")
    found = fit(case_of(text, tmp_path))
    assert found.parameters["KA"].value == pytest.approx(364.1523, rel=0.01)


def test_a_known_reference_is_taken_as_it_is(tmp_path):
    """With the reference of the record the same start is found, by way of the efd it holds."""
    known = exciter().replace("{type: playback}", f"{{type: playback, vref: {1.00518036}}}")
    one, other = (
        simulate(case_of(text, tmp_path), {}).response.signals for text in (exciter(), known)
    )
    assert other["vref"][0] == pytest.approx(1.00518036, rel=1e-12)
    # eight digits of vref, and the rounded constants of the other rectifier, behind the gain
    assert np.abs(other["efd"] - one["efd"]).max() < 1e-3
    changed = simulate(case_of(known, tmp_path), {"KA": 400.0}).response.signals
    # the same error behind a larger gain holds another efd
    assert changed["efd"][0] > 1.05 * other["efd"][0]


def test_a_reference_that_holds_nothing_is_refused(tmp_path):
    """A regulator that integrates holds any efd where vref = vt, and none elsewhere."""
    text = (
        exciter()
        .replace("AC1A", "AC8B")
        .replace("{type: playback}", "{type: playback, vref: 1.01}")
    )
    text = "\n".join(
        line for line in text.splitlines() if "{TR" not in line and "param" not in line
    )
    with pytest.raises(SimulationError, match="no state of rest"):
        simulate(case_of(text, tmp_path), {})


def test_an_exciter_that_needs_the_field_current_says_so(tmp_path):
    text = exciter().replace("ifd: ifd, ", "")
    with pytest.raises(CaseError, match=r"record: channels\.ifd: missing; it drives AC1A"):
        simulate(case_of(text, tmp_path), {})


def test_what_drives_is_not_compared(tmp_path):
    setup = build_experiments(case_of(exciter(), tmp_path))[0]
    assert [channel.signal for channel in setup.channels] == ["efd"]
    assert set(setup.experiment.simulator.inputs.recorded) == {"vt", "ifd"}


STABILISED = """\
model: SEXS
plant: {type: open-circuit, machine: ONE_AXIS}
test:
  vt0: 1.0
  duration: 4.0
  vs: {table: [[0, 0.0], [0.5, 0.0], [1.0, 0.03], [1.6, -0.02], [2.5, 0.01], [4, 0.0]]}
parameters: {fixed: {K: 50, TE: 0.05, EMAX: 9, EMIN: -9}}
"""
PLAYED = """\
model: SEXS
plant: {type: playback}
test: {steady_until: 0.5}
record: {file: RECORD, time: t, channels: {vt: vt, vs: {column: vs, offset: 0.01}, efd: efd}}
parameters: {fixed: {K: 50, TE: 0.05, EMAX: 9, EMIN: -9}}
"""


def test_a_recorded_stabiliser_drives_the_exciter(tmp_path):
    """Its offset does no harm; without it efd is explained by the voltage alone, and is another's.

    The lines between the samples of vt, 2 ms apart, are 1e-6 off, behind a gain of 50.
    """
    response = simulate(case_of(STABILISED, tmp_path), {}).response
    rows = STABILISED.partition("table: ")[2].partition("}")[0]
    times, levels = zip(*json.loads(rows), strict=True)
    vs = np.interp(response.time, times, levels)
    columns = [response.time, response.signals["vt"], vs, response.signals["efd"]]
    record = tmp_path / "record.csv"
    np.savetxt(record, np.transpose(columns), delimiter=",", header="t,vt,vs,efd", comments="")
    played = simulate(case_of(PLAYED, tmp_path, record), {}).comparison
    assert played.overlays["efd"].max_error < 1e-3
    without = PLAYED.replace(" vs: {column: vs, offset: 0.01},", "")
    alone = simulate(case_of(without, tmp_path, record), {}).comparison
    assert alone.overlays["efd"].max_error > 0.1


@pytest.mark.parametrize(
    ("text", "old", "new", "says"),
    [
        (PLAYED, "0.5}", "0.5, vs: [{at: 1, step: 0.1}]}",
         "test.vs: the record's channel vs gives the signal as well"),
        (PLAYED, "0.5}", "0.5, vs: recorded}", "test.vs: not allowed with plant playback"),
        (EXCITER, "vt: vt, ", "", "record.channels.vt: is missing"),
        (EXCITER, ", efd: efd", "", "record.channels.efd: is missing"),
        (EXCITER, "test: {vref: [{at: 1.0, step: 0.05}, {at: 11.0, step: -0.05}]}", "test: {}",
         "test.steady_until: is missing"),
        (EXCITER, "test: {", "test: {begin: -1, vt0: 1, ", "test.begin: not allowed with plant"),
        (EXCITER, "test: {", "test: {steady_until: 3, ", "3 s is after the first step, at 1 s"),
        (EXCITER, "vt: vt", "vt: {column: vt, weight: 2}", "channels.vt.weight: has no effect"),
        (MACHINE, "efd: efd", "efd: {column: efd, weight: 5}", "channels.efd.weight: has no"),
        (MACHINE, "efd: efd, ", "", "record.channels.efd: is missing"),
        (MACHINE, "plant:", "model: AC1A\nplant:", "model: not allowed with plant machine-play"),
        (MACHINE, ", vt: vt, ifd: {column: ifd, weight: 0.01}", "", "neither vt nor ifd"),
        (MACHINE, "{steady_until: 1.0}", "{vref: [{at: 1, step: 0.1}]}",
         "test.vref: not allowed with plant machine-playback"),
        (MACHINE, "Tpd0: {start: 3.77", "Tpd0: {start: 30", "Tpd0.start: 30 lies outside"),
    ],
)  # fmt: skip
def test_what_a_playback_lacks_or_cannot_have_is_reported(tmp_path, text, old, new, says):
    assert old in text
    with pytest.raises(CaseError, match=r"case\.yaml") as refused:
        case_of(exciter(text=text.replace(old, new)), tmp_path)
    assert says in str(refused.value)


@pytest.mark.long
def test_a_steady_part_that_is_none_is_refused_or_reported(tmp_path):
    beyond = MACHINE.replace("steady_until: 1.0", "steady_until: 100")
    with pytest.raises(RecordError, match=r"ends at 20 s, before test\.steady_until = 100 s"):
        fit(case_of(beyond, tmp_path))
    late = fit(case_of(MACHINE.replace("steady_until: 1.0", "steady_until: 5.0"), tmp_path))
    words = "before 5 s, where the record should be at rest"
    assert any(words in cause.cause for cause in late.verdict.causes)


@pytest.mark.long
def test_a_steady_part_behind_noise_is_not_complained_of(noisy, tmp_path):
    found = fit(case_of(MACHINE, tmp_path, noisy))
    assert not any("at rest" in cause.cause for cause in found.verdict.causes)


@pytest.mark.long
def test_a_signal_on_another_base_is_reported(noisy, tmp_path):
    """Field current relative to rated, as recorders give it."""
    scaled = MACHINE.replace("{column: ifd,", "{column: ifd, scale: 0.46,")
    causes = [cause.cause for cause in fit(case_of(scaled, tmp_path, noisy)).verdict.causes]
    assert any(text.startswith("the base of ifd") and "starts from" in text for text in causes)


def test_a_known_reference_far_away_is_reached_too(tmp_path):
    """Newton's steps end where the exciter rests at that very reference."""
    steps = "vref: [{at: 1.0, step: 0.05}, {at: 11.0, step: -0.05}]"
    for vref in (1.004, 1.012):
        text = exciter().replace("{type: playback}", f"{{type: playback, vref: {vref}}}")
        case = case_of(text.replace(steps, "steady_until: 1.0"), tmp_path)
        setup = build_experiments(case)[0]
        still = replace(setup.experiment.simulator.inputs, recorded={})
        simulator = Simulator(
            setup.experiment.simulator.system, still, np.linspace(0.0, 1.0, 11), 1e-3
        )
        efd = simulator.response({**case.values(), **setup.experiment.own}).signals["efd"]
        assert np.ptp(efd) < 1e-9 * efd[0]


def test_short_times_of_a_played_machine_ask_for_sub_steps(tmp_path):
    case = case_of(MACHINE, tmp_path)
    setup = build_experiments(case)[0]
    values = {**case.values(), **setup.experiment.own, "machine.Tppd0": 5e-4}
    assert setup.experiment.simulator.substeps(values) >= 2
