"""import and export: what they print, what they leave, what they refuse, how they end."""

import json
import re
import shutil
from dataclasses import replace
from decimal import Decimal
from math import floor, log10
from pathlib import Path

import click
import numpy as np
import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH
from commands import COMMANDS
from dynamics import SAMPLE, SOUND, THREE, garbage, replaced
from places import ROOT
from tiers import few_of

from exfit import cli
from exfit.case.case_draft import LONGEST
from exfit.case.load import load_case
from exfit.case.stated_values import taken_apart
from exfit.features.planner.records import definition_of, definitions
from exfit.features.planner.units import read_unit
from exfit.models import GOVERNORS, LIMITERS, MODELS, STABILISERS
from exfit.models.sheet import record, typical
from exfit.output.run_folder import write_fit
from exfit.plants import MACHINE
from exfit.verdict import rule
from exfit.workflows import fit

WIDTH = 80


def test_a_bus_of_more_digits_than_python_reads_is_refused(tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["import", "unit.dyr", "--bus", "1" * 5000], prog_name="exfit")
    assert ended.value.code == 2
    assert "is not in the range 1<=x<=999999" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["--1", "-\N{ARABIC-INDIC DIGIT ONE}", "-"])
def test_what_is_no_number_is_the_name_of_a_bus(name, capsys):
    Path("unit.dyr").write_text(SOUND)
    with pytest.raises(SystemExit) as ended:
        cli.main(["import", "unit.dyr", "--bus", name], prog_name="exfit")
    assert ended.value.code == 1
    assert f"unit.dyr: no record of bus {name!r}" in capsys.readouterr().err


@pytest.fixture(autouse=True)
def workplace(empty_folder):
    """Work in a folder that holds nothing but unit.dyr."""
    Path("unit.dyr").write_text(SOUND)
    return empty_folder


def listing(folder):
    return sorted(str(path) for path in folder.rglob("*"))


# ---- import


def test_the_sample_becomes_a_case_that_runs_as_it_stands(run):
    code, out, err = run("import", SAMPLE, "-o", "case.yaml")
    assert (code, out) == (0, "written to case.yaml; next: exfit simulate case.yaml\n")
    assert err == ""
    text = Path("case.yaml").read_text()
    assert max(map(len, text.splitlines())) <= LONGEST
    for words in ("unit.dyr", "bus 101", "line 3", "line 6", "IEEEG1 on line 9"):
        assert words in text
    assert run("simulate", "case.yaml", "--no-plots", "-q") == (0, "", "")
    assert run("check", "case.yaml")[0] == 0


def of_part(case, prefix):
    """Return the values of a part of a case by symbol; the exciter's have no prefix."""
    values = case.values()
    own = [name for name in values if name.startswith(prefix) and (prefix or "." not in name)]
    return {name.removeprefix(prefix): values[name] for name in own}


def test_the_sample_holds_the_start_of_the_case_it_is_made_from():
    imported = read_unit(SAMPLE.read_text(), "unit.dyr")
    case = load_case(ROOT / "configs" / "ac1a_typical.yaml")
    assert imported.machine.values == of_part(case, MACHINE)
    exciter = dict(imported.exciter.values)
    for first, second in (("E1", "E2"), ("SE1", "SE2")):
        exciter[first], exciter[second] = exciter[second], exciter[first]
    assert exciter == of_part(case, "")


def test_without_a_file_the_case_goes_to_the_terminal(run):
    code, out, err = run("import", "unit.dyr")
    assert (code, err) == (0, "")
    fixed = yaml.safe_load(out)["parameters"]["fixed"]
    assert fixed["KA"] == {"value": 766.0, "source": "planner"}
    run("import", "unit.dyr", "-o", "case.yaml")
    assert Path("case.yaml").read_text() == out


def test_a_unit_among_several_is_chosen(run, workplace):
    Path("unit.dyr").write_text(replaced("9 GENROU 1 6.0", "9 GENROU 1 7.0", THREE))
    before = listing(workplace)
    code, out, err = run("import", "unit.dyr", "-o", "case.yaml")
    assert (code, out) == (1, "")
    assert "3 units; select one by --bus and --id" in err
    for unit in ("bus 1, id 1: GENROU, ESAC1A", "bus 1, id 2:", "bus 9, id 1:"):
        assert unit in err
    assert listing(workplace) == before
    code, out, err = run("import", "unit.dyr", "--bus", "9")
    assert (code, err) == (0, "")
    assert yaml.safe_load(out)["plant"]["parameters"]["Tpd0"]["value"] == 7.0
    assert run("import", "unit.dyr", "--bus", "1", "--id", "2")[0] == 0
    assert "no record of bus 2" in run("import", "unit.dyr", "--bus", "2")[2]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("ESAC1A", "ESAC1Z", ["unit.dyr:2: ESAC1Z: exfit has no exciter of that name", "ESAC1A"]),
        ("GENROU", "GENCLS", ["unit.dyr:1: GENCLS is a constant voltage", "nothing to verify"]),
        (" 766 ", " ", ["unit.dyr:2: ESAC1A: 18 values", "19", "TR TB TC KA TA"]),
        (" 766 ", " -1 ", ["unit.dyr:2: ESAC1A: KA: -1 lies outside 0.01 ... 100000 pu"]),
        (" 766 ", " 7O6 ", ["unit.dyr:2: ESAC1A: KA: '7O6' is not a number"]),
    ],
)
def test_a_fault_ends_with_1_and_writes_nothing(run, workplace, old, new, words):
    Path("unit.dyr").write_text(replaced(old, new))
    before = listing(workplace)
    code, out, err = run("import", "unit.dyr", "-o", "case.yaml")
    assert (code, out) == (1, "")
    assert err.startswith("Error: ")
    for word in words:
        assert word in err
    assert listing(workplace) == before


@pytest.mark.parametrize("seed", few_of(range(100), 25))
def test_a_damaged_file_ends_in_a_message_or_a_sound_case(run, seed):
    Path("unit.dyr").write_bytes(garbage(SAMPLE.read_bytes(), np.random.default_rng(1000 + seed)))
    code, out, err = run("import", "unit.dyr")
    assert "Traceback" not in err
    if code:
        assert (code, out) == (1, "")
        assert re.match(r"Error: unit\.dyr(:\d+: |: 2 units; |: has no record)", err)
    else:
        assert yaml.safe_load(out)["model"] == "AC1A"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.dyr"], "none.dyr: cannot be read: No such file"),
        (["."], ".: cannot be read: Is a directory"),
        (["empty.dyr"], "empty.dyr: has no record of a unit"),
    ],
)
def test_a_file_that_is_none_is_reported(run, arguments, words):
    Path("empty.dyr").write_text("// nothing\n")
    code, out, err = run("import", *arguments)
    assert (code, out) == (1, "")
    assert words in err


@pytest.mark.parametrize(
    "arguments",
    [
        ["import"],
        ["import", "unit.dyr", "--bus", "1000000"],
        ["import", "unit.dyr", "--bus", "0"],
        ["export"],
        ["export", "run", "--format", "xml"],
        ["export", "run", "--id", "123"],
        ["export", "run", "--id", "a/"],
    ],
)
def test_wrong_usage_ends_with_2(run, arguments):
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert "Usage: exfit" in err


@pytest.mark.parametrize("command", ["import", "export"])
def test_a_file_that_exists_is_kept_unless_forced(run, fitted, command):
    source = "unit.dyr" if command == "import" else fitted
    Path("taken").write_text("mine")
    code, _, err = run(command, source, "-o", "taken")
    assert code == 1
    assert err == "Error: taken: exists already; --force overwrites it\n"
    assert Path("taken").read_text() == "mine"
    assert run(command, source, "-o", "taken", "--force")[0] == 0
    assert Path("taken").read_text() != "mine"
    code, _, err = run(command, source, "-o", ".", "--force")
    assert (code, err) == (1, "Error: .: cannot be written: it is a folder\n")
    code, _, err = run(command, source, "-o", "taken/below")
    assert code == 1
    assert "cannot be written" in err


# ---- a stabiliser

STABILISER = replace(
    MODELS["FIRST_ORDER"], name="PSSX", records=record("PSSX", "a k", icons={"MODE": 1})
)


@pytest.fixture
def pssx(monkeypatch):
    """Let exfit know one stabiliser of which only the data matter."""
    with monkeypatch.context() as patch:
        patch.setattr("exfit.features.planner.records.STABILISERS", {"PSSX": STABILISER})
        forget_records()
        yield
    forget_records()


def forget_records():
    definitions.cache_clear()
    definition_of.cache_clear()


def test_a_stabiliser_goes_into_the_case_with_its_model_and_parameters(run, pssx):
    Path("unit.dyr").write_text(SOUND + "1 PSSX 1 0 1e-5 20 /\n")
    code, out, err = run("import", "unit.dyr")
    assert (code, err) == (0, "Warning: unit.dyr:5: PSSX: MODE: 0 is not modelled; 1 is taken\n")
    found = taken_apart(yaml.safe_load(out)).content["stabiliser"]
    assert found.pop("sources") == {"k": "planner", "a": "planner"}
    assert found == {"model": "PSSX", "parameters": {"k": 20.0, "a": 1e-5}}


def test_a_fitted_stabiliser_is_written_behind_its_exciter(run, fitted, pssx):
    parameters = {**result_of(fitted)["parameters"], "stabiliser.k": of_value(7.0)}
    changes = {"stabiliser_model": "PSSX", "stabiliser": {"k": 5.0, "a": 3.0}}
    sources = {**result_of(fitted)["sources"], "stabiliser.k": "fitted"}
    named(fitted, parameters=parameters, history=[], knowledge=None, sources=sources, **changes)
    code, out, _ = run("export", fitted)
    assert code == 0
    assert out.splitlines()[-1].split() == ["1", "'PSSX'", "1", "1", "3.0", "7.0", "/"]
    assert "// PSSX: fitted: k." in out.splitlines()
    unit = read_unit(out, "out.dyr")
    assert unit.stabiliser is not None
    assert unit.stabiliser.values == {"k": 7.0, "a": 3.0}


def test_an_integer_of_a_record_is_not_cut_off(run, fitted):
    values = typical(STABILISERS["PSS2B"].sheet)
    named(fitted, stabiliser_model="PSS2B", stabiliser={**values, "M": 4.5})
    code, out, err = run("export", fitted)
    assert (code, out) == (1, "")
    assert "PSS2B: stabiliser.M: 4.5 is not a whole number" in err
    named(fitted, stabiliser={**values, "M": 4.0})
    assert "1  'PSS2B'  1  1  0  3  0  4  1 " in run("export", fitted)[1]


@pytest.mark.parametrize(("band", "record"), [(0.0, "TGOV1"), (2e-4, "TGOV1D")])
def test_a_governor_with_a_dead_band_is_written_as_the_form_that_has_one(run, fitted, band, record):
    values = typical(GOVERNORS["TGOV1"].sheet) | {"DBH": band, "DBL": -band}
    named(fitted, governor_model="TGOV1", governor=values)
    _, out, err = run("export", fitted)
    assert f"1  '{record}'  1  0.05  0.5 " in out
    assert "cannot hold DBH" not in err


def test_a_stabiliser_without_a_record_is_left_out_with_a_warning(run, fitted):
    named(fitted, stabiliser_model="OWN_PSS", stabiliser={"k": 5.0})
    assert "stabiliser OWN_PSS has no PSS/E record: it is left out" in run("export", fitted)[2]


# ---- export


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Return a folder with fits of a few iterations, one of AC1A and one of AC8B."""
    place = tmp_path_factory.mktemp("fits")
    for name in ("ac1a_typical", "ac8b_unit1"):
        case = yaml.safe_load((ROOT / "configs" / f"{name}.yaml").read_text())
        case["record"]["file"] = str(ROOT / "sample_data" / Path(case["record"]["file"]).name)
        case |= {"validate": [], "estimate": {"search": "local", "iterations": 2}}
        path = place / f"{name}.yaml"
        path.write_text(yaml.safe_dump(case, sort_keys=False))
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(rule, "causes_of", lambda *_: ())  # of a fit that is not at its end yet
            with pytest.raises(SystemExit):
                cli.main(["fit", str(path), "--no-plots", "-q", "-o", str(place / name)])
    return place


@pytest.fixture
def fitted(results):
    """Return the folder of a fit of AC1A."""
    shutil.copytree(results / "ac1a_typical", "run")
    named("run", machine_model="GENROU")
    return Path("run")


@pytest.fixture
def fitted_ac8b(results):
    """Return the folder of a fit of AC8B."""
    shutil.copytree(results / "ac8b_unit1", "run8")
    named("run8", machine_model="GENROU")
    return Path("run8")


def of_value(value):
    """Return an entry of a fitted parameter."""
    others = {"at_bound": None, "of_record": False, "std_error": None, "interval": None}
    others |= {"noise_interval": None, "given_error": None}
    texts = {"interval_method": None, "why": None, "unit": "", "meaning": "", "physical": True}
    return {"value": value, "start": 1.0, "min": 0.0, "max": 1e9, **others, **texts}


def named(folder, **changes):
    """Put values into a result."""
    path = Path(folder) / "result.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))


def result_of(folder):
    return json.loads((Path(folder) / "result.json").read_text())


def bears(value, error):
    """Return how many significant digits a value has down to the second one of its error."""
    return max(floor(log10(abs(value))) - floor(log10(error)) + 2, 4)


def test_a_fitted_value_is_written_in_the_digits_that_its_interval_bears(run, fitted):
    run("export", fitted, "-o", "out.dyr")
    unit = read_unit(Path("out.dyr").read_text(), "out.dyr")
    texts = dict(zip(unit.exciter.definition.names, unit.exciter.fields, strict=True))
    parameters = result_of(fitted)["parameters"]
    for name, stored in parameters.items():
        value, low_high = stored["value"], stored["interval"] or [None, None]
        error = stored["std_error"] if None in low_high else (low_high[1] - low_high[0]) / 3.92
        digits = Decimal(texts[name].text).normalize().as_tuple().digits
        most = 5 if error is None else min(bears(value, error), 7)
        assert len(digits) <= most, name
        assert float(texts[name].text) == pytest.approx(value, rel=5.0001e-4)


def test_a_value_tied_to_a_fitted_one_has_as_few_digits_and_another_one_all(run, fitted):
    stored = result_of(fitted)
    fixed = {**stored["fixed"], "VRMAX": 14.123456789, "VRMIN": -15.987654321}
    named(fitted, fixed=fixed, ties={"VRMAX": "=KA/20", "VRMIN": "=-VAMAX-1.5"})
    out = run("export", fitted)[1]
    assert re.search(r" 14\.123\s+-15\.987654321\s", out)


def test_a_fit_comes_back_from_its_export(run, fitted):
    code, out, err = run("export", fitted, "-o", "out.dyr", "--bus", "101", "--id", "G1")
    assert (code, out) == (0, "written to out.dyr\n")
    assert "the fit does not hold: not converged" in err
    text = Path("out.dyr").read_text()
    assert max(map(len, text.splitlines())) <= WIDTH
    comments = [line for line in text.splitlines() if line.startswith("//")]
    told = " ".join(comments)
    for words in ("exfit 0", "AC1A", "ac1a_up.csv", "fitted: KA TA TE KF TF KC KD"):
        assert words in told
    unit = read_unit(text, "out.dyr", 101, "G1")
    stored = result_of(fitted)
    assert unit.machine.values == stored["machine"]
    swapped = {"E1": "E2", "SE1": "SE2", "E2": "E1", "SE2": "SE1"}
    fixed = {swapped.get(name, name): value for name, value in stored["fixed"].items()}
    assert unit.exciter.values.items() >= fixed.items()
    assert unit.exciter.values.keys() == fixed.keys() | stored["parameters"].keys()
    assert run("import", "out.dyr", "-o", "again.yaml")[0] == 0
    assert of_part(load_case(Path("again.yaml")), "") == unit.exciter.values


@pytest.mark.parametrize(
    ("section", "name", "value", "words"),
    [
        ("parameters", "KA", -5.0, "ESAC1A: KA: -5 lies outside 0.01 ... "),
        ("fixed", "VRMAX", -15.0, "ESAC1A: VRMIN: -14.5 is not below VRMAX = -15"),
        ("machine", "Tpd0", -5.0, "GENROU: machine.Tpd0: -5 lies outside "),
        ("machine", "Xpd", 5.0, "GENROU: machine.Xd: 1.8 is not above Xpd = 5"),
    ],
)
def test_a_value_outside_its_data_sheet_is_not_exported(run, fitted, section, name, value, words):
    stored = result_of(fitted)
    entry = {**stored[section][name], "value": value} if section == "parameters" else value
    stored[section][name] = entry
    Path("changed.json").write_text(json.dumps(stored))
    code, out, err = run("export", "changed.json", "-o", "out.dyr")
    assert (code, out) == (1, "")
    assert f"Error: changed.json: {words}" in err
    assert not Path("out.dyr").exists()


def test_a_place_that_no_record_can_hold_is_asked_for_and_then_taken(run, fitted):
    found = {"source": "u.dyr", "model": "AC1A", "values": {}, "records": [], "why": "made up"}
    named(fitted, as_found={**found, "bus": 10**7, "id": "G1", "file": "u.dyr"})
    code, _, err = run("export", fitted)
    assert code == 1
    assert "as_found: bus 10000000, id 'G1' cannot be written to a record; give them with" in err
    code, out, _ = run("export", fitted, "--bus", "7", "--id", "G1")
    assert code == 0
    assert re.search(r"(?m)^7  'ESAC1A'  G1 ", out)


def test_a_result_or_its_folder_gives_the_same_on_the_terminal(run, fitted):
    code, out, _ = run("export", fitted)
    assert code == 0
    assert out.splitlines()[-1].endswith("/")
    assert run("export", fitted / "result.json", "--format", "dyr")[1] == out


def test_fitted_values_of_the_machine_go_over_those_of_the_case(run, fitted):
    parameters = {**result_of(fitted)["parameters"], "machine.Tpd0": of_value(5.5)}
    sources = {**result_of(fitted)["sources"], "machine.Tpd0": "fitted"}
    named(fitted, parameters=parameters, history=[], knowledge=None, sources=sources)
    _, out, _ = run("export", fitted)
    assert read_unit(out, "out.dyr").machine.values["Tpd0"] == 5.5
    assert "// GENROU: fitted: Tpd0." in out.splitlines()


def test_values_that_no_one_gave_are_named(run, fitted):
    sources = dict.fromkeys(["TR", "KE", "machine.Tpq0", "machine.H"], "typical")
    named(fitted, sources={**sources, "KA": "fitted", "TE": "maker"})
    _, out, err = run("export", fitted)
    assert "ESAC1A: typical, not of this unit, check: TR, KE\n" in err
    assert "GENROU: typical, not of this unit, check: Tpq0, H\n" in err
    for line in ("typical, not of this unit, check: TR, KE.", "fitted: KA.", "maker: TE."):
        assert f"// ESAC1A: {line}" in out.splitlines()
    assert "// ESAC1A: not stated: TB TC" in out


def test_given_values_without_a_source_that_an_interval_rests_on_are_named(run, fitted):
    content = result_of(fitted)
    ka = content["parameters"]["KA"] | {
        "interval": [300.0, 400.0],
        "noise_interval": [340.0, 360.0],
    }
    shifts = dict.fromkeys(content["parameters"], 0.0)
    content["knowledge"]["given_errors"] = {
        name: {"std_error": 0.1, "shifts": shifts | {"KA": shift}}
        for name, shift in (("SE1", 30.0), ("SE2", 0.1), ("machine.Tpd0", 20.0))
    }
    content["parameters"]["KA"], content["sources"]["machine.Tpd0"] = ka, "measured"
    named(fitted, **content)
    said = "the interval of KA rests on data that nobody measured: SE1 (not stated)"
    _, out, err = run("export", fitted)
    assert f"{said}\n" in err
    assert f"// {said}." in out.splitlines()
    content["knowledge"]["given_errors"]["SE1"]["shifts"] = {"K": 1.0}
    named(fitted, **content)
    assert "given_errors: what they move are not the parameters" in run("export", fitted)[2]


def with_limiter(folder, model, name, place=None, **changes):
    """Put a limiter of the catalogue into a result whose exciter is another, of typical data."""
    limiter = LIMITERS[name]
    values = typical(limiter.sheet)
    text = "" if place is None else f"limiters: [{{model: {name}, place: {place}}}]\n"
    at = {"limiter_models": {"oel": name}, "limiters": {"oel": values}}
    exciter = {"model": model, "fixed": typical(MODELS[model].sheet), "parameters": {}}
    of_none = {"history": [], "inputs": {}, "knowledge": None}
    named(folder, **at, **exciter, **of_none, case_text=text, **changes)
    return values


def test_fitted_values_of_a_limiter_are_named_with_those_that_are_typical(run, fitted):
    sources = {"oel.ITFPU": "fitted", "oel.TF": "typical", "oel.K1": "typical"}
    with_limiter(fitted, "AC1A", "OEL3C", sources=sources)
    named(fitted, parameters={"oel.ITFPU": of_value(1.3)})
    code, out, err = run("export", fitted)
    assert code == 0
    record = out.splitlines()[-1].split()
    assert record[:5] == ["1", "'OEL3C'", "1", "0", "1.3"]
    assert "OEL3C: typical, not of this unit, check: TF, K1\n" in err
    assert "OEL3C: its order is that of PowerWorld's list" in err
    assert "// OEL3C: fitted: ITFPU." in out.splitlines()
    # ESAC1A has no flag of it
    assert "OEL3C: the exciter's record does not give its place: set its flag" in err


@pytest.mark.parametrize(
    ("model", "place", "flags"),
    [
        ("AC1C", "summing", ["1", "1"]),
        ("AC1C", None, ["2", "1"]),  # at its usual place
        ("AC7C", "takeover-output", ["3", "1"]),
        ("DC4B", "takeover", ["2", "2"]),
        ("ST7B", "takeover", ["3", "0"]),
    ],
)
def test_the_place_of_a_limiter_is_the_flag_of_its_exciter(run, fitted, model, place, flags):
    with_limiter(fitted, model, "OEL2C", place)
    code, out, err = run("export", fitted)
    assert code == 0
    (record,) = (line.split() for line in out.splitlines() if f"'{model}'" in line)
    assert record[3:5] == flags
    assert "set its flag" not in err
    of_exciter = [text for _, text in read_unit(out, "out.dyr").warnings if text.startswith(model)]
    assert not [text for text in of_exciter if "is not modelled" in text]


def test_a_place_whose_flag_no_source_gives_is_warned_of(run, fitted):
    with_limiter(fitted, "ST6C", "OEL2C", "takeover")
    assert "OEL2C: the exciter's record does not give its place" in run("export", fitted)[2]


def test_without_a_record_of_the_machine_only_the_exciter_is_written(run, fitted):
    named(fitted, machine_model=None)
    code, out, err = run("export", fitted)
    assert code == 0
    assert "only the exciter is written" in err
    assert "GENROU" not in out
    assert "'ESAC1A'" in out


def test_a_form_of_saturation_that_psse_does_not_have_is_warned_of(run, fitted):
    named(fitted, saturation="exponential")
    assert "PSS/E takes E1 SE1 E2 SE2 as quadratic" in run("export", fitted)[2]


def test_a_multiplier_that_the_record_does_not_have_is_warned_of(run, fitted):
    assert "efd_times_speed" not in run("export", fitted)[2]
    text = result_of(fitted)["case_text"]
    named(fitted, case_text=f"efd_times_speed: true\n{text}")
    code, out, err = run("export", fitted)
    words = "fitted with efd_times_speed; ESAC1A does not multiply efd by the speed"
    assert code == 0
    assert words in err
    assert f"// {words}." in out.splitlines()


def test_an_order_that_is_in_doubt_is_reported_twice(run, fitted_ac8b):
    doubt = MODELS["AC8B"].records[0].doubt
    code, out, err = run("export", fitted_ac8b)
    assert code == 0
    assert f"Warning: run8/result.json: AC8B: {doubt}" in err.splitlines()
    assert f"// AC8B: {doubt}." in out.replace("\n//  ", "").splitlines()


def test_what_another_record_cannot_hold_is_named_with_its_value(run, fitted_ac8b):
    code, out, err = run("export", fitted_ac8b, "--model", "esac8b")
    assert code == 0
    stored = result_of(fitted_ac8b)
    for name in ("KC", "KD"):
        (text,) = re.findall(rf"ESAC8B cannot hold {name} = (\S+): it is lost", err)
        assert float(text) == pytest.approx(stored["parameters"][name]["value"], rel=5.0001e-4)
    # limits that never act, and gains of zero, are no loss
    assert "VPIDMAX" not in err
    assert "cannot hold TA" not in err
    assert "'ESAC8B'" in out
    assert "'AC8B'" not in out


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"model": "OWN"}, "OWN is not a model of the catalogue: it has no PSS/E record"),
        ({"model": "FIRST_ORDER"}, "FIRST_ORDER has no PSS/E record"),
        ({"inputs": {"model": "0" * 64}}, "AC1A is not a model of the catalogue"),
        ({"fixed": {}}, "ESAC1A: no value of TR, TB, TC, VAMAX"),
        ({"machine": {}}, "GENROU: no value of machine.Tpd0"),
        ({"parameters": {"KA": of_value(None)}}, "parameters.KA.value: None is not a number"),
        ({"parameters": {"KA": of_value("1")}}, "parameters.KA.value: '1' is not a number"),
    ],
)
def test_a_result_that_cannot_be_written_is_reported(run, fitted, workplace, changes, words):
    named(fitted, **changes)
    before = listing(workplace)
    code, out, err = run("export", fitted, "-o", "out.dyr")
    assert (code, out) == (1, "")
    assert err.startswith("Error: run/result.json: ")
    assert words in err
    assert listing(workplace) == before


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"{", "not JSON"),
        (b"\xff\xfe\x00", "not UTF-8 text"),
        (b"[1]", "not a mapping"),
        (b'{"validation": []}', "not the result of a fit"),
        (b"[" * 100_000, "not JSON"),
        (None, "No such file"),
    ],
)
def test_a_file_that_is_no_result_is_reported(run, content, words):
    if content is not None:
        Path("result.json").write_bytes(content)
    code, out, err = run("export", "result.json")
    assert (code, out) == (1, "")
    assert words in err


def test_a_record_that_the_model_is_not_written_as_is_reported_with_those_it_is(run, fitted):
    code, _, err = run("export", fitted, "--model", "ESAC1")
    assert code == 1
    assert "--model ESAC1: not a record of AC1A; did you mean ESAC1A?" in err


def test_a_fit_of_a_user_s_own_model_has_no_record(run):
    """Though its file may have the name of a model of the catalogue."""
    shutil.copy(ROOT / "exfit" / "models" / "exciters" / "first_order.py", "ac1a.py")
    rows = "\n".join(f"{t:.6g},{v:.9g}" for t, v in zip(TIME, TRUTH, strict=True))
    Path("up.csv").write_text(f"t,v\n{rows}\n")
    measured = {"file": "up.csv", "time": "t", "channels": {"vt": "v"}}
    case = {**FIRST_ORDER, "model": "ac1a.py", "record": measured}
    Path("case.yaml").write_text(yaml.safe_dump(case))
    assert run("fit", "case.yaml", "--no-plots", "-q", "-o", "run")[0] == 0
    assert result_of("run")["model"] == "AC1A"
    assert "it has no PSS/E record" in run("export", "run")[2]


def test_every_option_of_both_commands_is_explained_and_the_names_are_found():
    for command in ("import", "export"):
        for one in COMMANDS[command].params:
            if isinstance(one, click.Option):
                assert one.help, one.name
    assert definition_of("GENROU") is not None


def test_a_machine_that_was_fitted_alone_is_written_alone(run, tmp_path):
    case = load_case(ROOT / "configs" / "machine_playback.yaml")
    write_fit(fit(case), tmp_path / "alone")
    code, out, _ = run("export", tmp_path / "alone")
    unit = [line for line in out.splitlines() if line.startswith("1 ")]
    assert code == 0
    assert len(unit) == 1
    assert "'GENROU'" in unit[0]
    code, _, err = run("export", tmp_path / "alone", "--model", "ESAC1A")
    assert (code, "the fit is of GENROU, without an exciter" in err) == (1, True)
    told = json.loads((tmp_path / "alone" / "result.json").read_text())
    told |= {"model": "ONE_AXIS", "machine_model": "ONE_AXIS"}
    (tmp_path / "alone" / "result.json").write_text(json.dumps(told))
    code, _, err = run("export", tmp_path / "alone", "--format", "dyd")
    assert (code, "ONE_AXIS has no PSLF record" in err) == (1, True)


# ---- PSLF


def test_a_file_of_pslf_becomes_a_case_and_gives_a_new_one_its_data(run):
    sample = ROOT / "sample_data" / "unit.dyd"
    code, out, err = run("import", sample, "-o", "case.yaml")
    assert (code, out) == (0, "written to case.yaml; next: exfit simulate case.yaml\n")
    assert "unit.dyd:10: esac1a: its order is taken to be that of PSS/E" in err
    assert run("check", "case.yaml")[0] == 0
    psse = run("import", SAMPLE, "-o", "other.yaml")
    assert psse[0] == 0
    cases = load_case(Path("case.yaml")), load_case(Path("other.yaml"))
    assert cases[0].values() == cases[1].values()
    record = ROOT / "sample_data" / "ac1a_up.csv"
    options = ["--record", record, "--step", "0.02", "-o", "new.yaml"]
    assert run("new", "--planner", sample, *options)[0] == 0
    by_hand = Path("new.yaml").read_text()
    assert "those of unit.dyd" in by_hand
    assert run("new", "--planner", sample, "--bus", "NORTH G1", *options, "--force")[0] == 0
    assert Path("new.yaml").read_text() == by_hand
    assert run("import", "--all", sample, "-o", "cases")[0] == 0
    assert Path("cases/bus-101-1.yaml").exists()


@pytest.mark.parametrize("options", [["-o", "out.dyd"], ["--format", "dyd", "-o", "out.txt"]])
def test_a_fit_is_written_for_pslf(run, fitted, options):
    code, _, err = run("export", fitted, "--bus", "101", *options)
    assert code == 0
    assert "esac1a: its order is taken to be that of PSS/E" in err
    text = Path(options[-1]).read_text()
    assert max(map(len, text.splitlines())) <= WIDTH
    unit = read_unit(text, "out.dyd", 101, "1")
    assert run("export", fitted, "--bus", "101", "-o", "out.dyr")[0] == 0
    psse = read_unit(Path("out.dyr").read_text(), "out.dyr", 101, "1")
    assert unit.exciter.values == psse.exciter.values
    assert unit.machine.values == psse.machine.values


def test_efd_times_the_speed_is_a_flag_of_pslf(run, fitted):
    sample = (ROOT / "sample_data" / "unit.dyd").read_text()
    Path("flag.dyd").write_text(sample.replace("14.5 -14.5\nieeeg1", "14.5 -14.5 1\nieeeg1"))
    record = ROOT / "sample_data" / "ac1a_up.csv"
    given = ["--planner", "flag.dyd", "--record", record, "--step", "0.02"]
    assert run("new", *given, "-o", "new.yaml")[0] == 0
    assert yaml.safe_load(Path("new.yaml").read_text())["efd_times_speed"] is True
    text = result_of(fitted)["case_text"]
    named(fitted, case_text=f"efd_times_speed: true\n{text}")
    code, out, err = run("export", fitted, "--format", "dyd")
    assert code == 0
    assert "does not multiply" not in err
    assert read_unit(out, "out.dyd").exciter.times_speed


def test_a_format_is_not_for_all_units(run, fitted):
    code, _, err = run("export", "--all", fitted, "--format", "dyd", "-o", "out.dyd")
    assert code == 2
    assert "--format: not allowed with --all" in err
