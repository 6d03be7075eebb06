"""Cases with limiters: what the file may say, what is refused, and what a fit finds of them."""

import csv

import numpy as np
import pytest

from exfit.case.load import load_case
from exfit.case.other_model import with_exciter
from exfit.case.peek import free_of, parameters_of
from exfit.errors import CaseError, ExfitError
from exfit.features.planner.export import export
from exfit.fitting.system import system_of
from exfit.models import MODELS
from exfit.output.run_folder import write_fit
from exfit.results.io import load_result
from exfit.workflows import fit, simulate

OEL = "{IINST: 1.9, TEN: 0.0, ITFPU: 99.0, ILIM: 0.1, KPOEL: 20.0}"
CASE = f"""\
model: ST1A
plant: {{type: infinite-bus, machine: GENROU, network: {{f0: 60, X: 0.3, P: 0.7, Q: 0.1}}}}
limiters:
  - {{model: OEL2C, place: takeover, parameters: {OEL}}}
  - {{model: UEL1}}
test: {{vt0: 1.0, duration: 8.0, vref: [{{at: 1.0, step: 0.1}}]}}
"""
FREE = (
    (", KPOEL: 20.0}}", "}, free: {KPOEL: {start: 15.0, min: 1.0, max: 100.0}}}"),
    ("model: UEL1", "model: UEL1, free: {KUR: {start: 1.9, min: 1.0, max: 3.0}}"),
    ("duration: 8.0, ", ""),
)
RECORD = """\
given: exact
record: {file: record.csv, time: t, channels: {vt: vt, efd: efd, ifd: ifd}}
parameters: {free: {KA: {start: 170.0, min: 50.0, max: 400.0}}}
estimate: {search: local}
"""


def written(folder, *changes, more=""):
    text = CASE
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    path = folder / "case.yaml"
    path.write_text(text + more)
    return path


def faults_of(folder, *changes, more=""):
    with pytest.raises(CaseError) as refused:
        load_case(written(folder, *changes, more=more))
    return str(refused.value)


def test_a_limiter_takes_over_in_a_step_on_load_and_is_named(tmp_path):
    result = simulate(load_case(written(tmp_path)), {})
    signals = result.response.signals
    assert "oel.OEL2C acts from 1 s to 8 s" in result.notes
    late = result.response.time > 1.5
    assert np.all(signals["efd"][late] == signals["oel.OEL2C"][late])


def test_without_acting_a_limiter_changes_no_digit(tmp_path):
    small = ("step: 0.1", "step: -0.01")
    with_them = simulate(load_case(written(tmp_path, small)), {}).response
    text = CASE.replace(*small)
    (tmp_path / "without.yaml").write_text(
        text[: text.index("limiters:")] + text[text.index("test:") :]
    )
    without = simulate(load_case(tmp_path / "without.yaml"), {}).response
    np.testing.assert_array_equal(with_them.signals["vt"], without.signals["vt"])


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ([("model: ST1A", "model: SEXS")], "SEXS has no input takeover (voel) for OEL2C: "),
        (
            [("place: takeover", "place: summing")],
            "ST1A has no input summing (vsum) for OEL2C",
        ),
        (
            [("model: UEL1", "model: OEL5C")],
            "OEL5C: a second one beside OEL2C; at most ",
        ),
        ([("model: UEL1", "model: UEL9")], "'UEL9' is not a limiter model; "),
        (
            [("model: UEL1", "model: UEL1, place: gate")],
            "known: takeover, takeover-output, ",
        ),
        (
            [("IINST: 1.9", "IINSTANT: 1.9")],
            "IINSTANT: not a parameter of OEL2C; did you ",
        ),
        ([("IINST: 1.9", "VOELMIN1: 11.0")], "11 is not below VOELMAX1 = 10"),
        ([("model: UEL1", "model: UEL1, parameters: {KUR: =oel.IINT}")], "oel.IINT is not a param"),
    ],
)
def test_what_does_not_fit_is_refused_at_its_place(changes, text, tmp_path):
    message = faults_of(tmp_path, *changes)
    assert text in message, message
    assert "limiters[" in message


def test_an_OEL_acts_on_open_circuit_and_a_UEL_does_not(tmp_path):
    plant = CASE[CASE.index("plant:") : CASE.index("limiters:")]
    alone = "plant: {type: open-circuit, machine: GENROU}\n"
    opened = (plant, alone), ("IINST: 1.9", "IINST: 1.06")
    case = load_case(written(tmp_path, *opened))
    assert {name.partition(".")[0] for name in system_of(case).states if "." in name} == {"oel"}
    result = simulate(case, {})
    assert any(note.startswith("oel.OEL2C acts from 1 s") for note in result.notes)
    assert "UEL1 does not act: the breaker is open" in result.notes
    free = ("model: UEL1", "model: UEL1, free: {KUR: {start: 1.9, min: 1.0, max: 3.0}}")
    assert "on open circuit UEL1 does not act" in faults_of(tmp_path, *opened, free)


def test_a_limiter_that_acts_at_the_start_is_refused_with_how_far_it_is_beyond(tmp_path):
    with pytest.raises(ExfitError, match=r"oel\.OEL2C acts at the start already, at -6\.5"):
        simulate(load_case(written(tmp_path, ("IINST: 1.9", "IINST: 1.4"))), {})


def test_another_exciter_in_a_ranking_needs_the_gate_too(tmp_path):
    case = load_case(written(tmp_path))
    system_of(with_exciter(case, "ST7B", MODELS["ST7B"]))
    with pytest.raises(CaseError, match="limiters: SEXS has no input voel for OEL2C"):
        system_of(with_exciter(case, "SEXS", MODELS["SEXS"]))


def test_a_tie_joins_limiter_and_exciter(tmp_path):
    tied = ("model: UEL1", "model: UEL1, parameters: {VULMAX: =oel.VOELMAX1 + 8}")
    case = load_case(written(tmp_path, tied))
    assert case.values()["uel.VULMAX"] == 18.0


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    folder = tmp_path_factory.mktemp("limiters")
    response = simulate(load_case(written(folder)), {}).response
    rng = np.random.default_rng(3)
    with (folder / "record.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["t", "vt", "efd", "ifd"])
        for k in range(0, len(response.time), 10):
            noisy = [
                response.signals[name][k] + noise * rng.standard_normal()
                for name, noise in (("vt", 2e-4), ("efd", 5e-3), ("ifd", 2e-3))
            ]
            table.writerow([response.time[k], *noisy])
    return fit(load_case(written(folder, *FREE, more=RECORD)))


@pytest.mark.long
def test_a_fit_finds_the_limiter_that_acts_and_says_which_parameters_nothing_shows(fitted):
    found = fitted.parameters["oel.KPOEL"]
    assert abs(found.value - 20.0) < 4.0 * found.std_error
    assert found.std_error < 0.1
    assert {name for name, entry in fitted.parameters.items() if entry.std_error is None} >= {
        "uel.KUR"
    }
    assert any(
        "uel.KUR has no effect on vt, efd and ifd" in text for text in fitted.knowledge.sentences
    )


def test_the_result_of_a_fit_keeps_its_limiters(fitted, tmp_path):
    write_fit(fitted, tmp_path / "run")
    back = load_result(tmp_path / "run")
    assert back.limiter_models == {"oel": "OEL2C", "uel": "UEL1"}
    assert back.limiters == fitted.limiters
    assert back.values["oel.KPOEL"] == fitted.parameters["oel.KPOEL"].value
    (match,) = back.comparisons
    assert match.limiters[0].name == "oel.OEL2C"
    assert match.limiters == fitted.comparisons[0].limiters


def test_names_are_known_at_a_glance(tmp_path):
    path = written(tmp_path, *FREE)
    assert free_of(path) == ("oel.KPOEL", "uel.KUR")
    assert "oel.IINST" in parameters_of(path)


def test_a_playback_needs_what_a_limiter_sees(tmp_path):
    path = written(tmp_path, more="")
    text = path.read_text()
    plant = text[text.index("plant:") : text.index("limiters:")]
    record = "record: {file: r.csv, time: t, channels: {vt: vt, efd: efd, ifd: ifd}}\n"
    path.write_text(
        text.replace(plant, "plant: {type: playback}\n").replace("duration: 8.0, ", "") + record
    )
    with pytest.raises(CaseError, match=r"channels\.p: missing; it drives UEL1"):
        system_of(load_case(path))


def test_an_export_writes_the_limiters_it_has_records_of(fitted):
    text = export(fitted, 1, "1").text
    assert "'OEL2C'" in text
    assert "'UEL1'" in text
