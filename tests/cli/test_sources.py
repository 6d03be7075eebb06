"""Where values come from, on the whole way: a new case, its fit, its report, an export, a refit."""

import re
from pathlib import Path

import pytest
import yaml
from dynamics import SOUND
from places import SAMPLES

from exfit.case.load import load_case
from exfit.results.io import load_result

FIT = ("--search", "local", "--no-plots")
RECORD = {"file": str(SAMPLES / "ac1a_up.csv"), "time": "t", "channels": {"vt": "vt"}}
FREE = {"KA": {"start": 400.0, "min": 10.0, "max": 5000.0}}
ON_LOAD = ("Tpq0", "Tppq0", "H", "D", "Xq", "Xpq")


def words(text):
    """Return a printed text on one line."""
    return " ".join(text.split())


def sources_of_rows(page):
    """Return the source of each row of the tables of parameters that were not fitted."""
    row = r'<tr><th scope="row">(\w+)</th><td class="n">[^<]*</td><td>[^<]*</td><td>([^<]*)</td>'
    return dict(re.findall(row, page))


@pytest.fixture
def new_case(run, empty_folder):
    """Return the path of a new case on a sample record, whose step was found."""
    record = str(SAMPLES / "ac1a_up.csv")
    assert run("new", "--model", "AC1A", "--record", record, "-o", "unit.yaml")[0] == 0
    path = Path("unit.yaml")
    path.write_text(path.read_text().replace('step: "?"', "step: 0.05"))
    return path


@pytest.mark.long
def test_what_a_new_case_fills_in_stays_typical_up_to_the_planners_file(run, new_case):
    text = new_case.read_text()
    new_case.write_text(
        text.replace(
            "VRMAX: {value: 6.03, source: typical}", "VRMAX: {value: 6.03, source: nameplate}"
        )
    )
    code, out, _ = run("fit", str(new_case), "--verbose", *FIT)
    assert code in (0, 3)  # with typical data it may not match
    printed = words(out)
    assert "sources of the values: " in printed
    assert "typical values taken for GENROU: Tpd0 6.35" in printed
    result = load_result("runs/unit-fit")
    machine = {f"machine.{symbol}" for symbol in result.machine}
    assert machine <= {*result.typical}
    assert result.sources["VRMAX"] == "nameplate"
    assert result.sources["KA"] == "fitted"
    assert run("report", "runs/unit-fit")[0] == 0
    rows = sources_of_rows(Path("runs/unit-fit/report.html").read_text(encoding="utf-8"))
    assert {rows[symbol] for symbol in result.machine} == {"typical"}
    assert (rows["VRMAX"], rows["VRMIN"]) == ("nameplate", "typical")
    code, out, err = run("export", "runs/unit-fit")
    assert code == 0
    symbols = ", ".join(result.machine)
    assert f"GENROU: typical, not of this unit, check: {symbols}\n" in err
    comments = words(out.replace("//", " "))
    assert f"GENROU: typical, not of this unit, check: {symbols}." in comments
    assert "ESAC1A: nameplate: VRMAX." in comments
    assert "ESAC1A: fitted: KA TA TE KF TF KC KD." in comments


def test_the_values_of_a_planners_file_are_its_own_and_what_is_filled_in_is_typical(
    run, empty_folder
):
    Path("unit.dyr").write_text(SOUND)
    assert run("import", "unit.dyr", "-o", "unit.yaml")[0] == 0
    content = yaml.safe_load(Path("unit.yaml").read_text())
    of_machine = {value["source"] for value in content["plant"]["parameters"].values()}
    assert of_machine == {"planner"}  # the record holds all that the machine has
    content["parameters"]["fixed"].pop("KA")
    content["parameters"]["free"] = FREE
    content["record"] = RECORD
    content["test"].pop("duration")
    content["estimate"] = {"causes": 0}  # of its misfit they would be most of the time
    Path("unit.yaml").write_text(yaml.safe_dump(content))
    assert run("fit", "unit.yaml", *FIT)[0] in (0, 3)
    result = load_result("runs/unit-fit")
    assert result.typical == ()
    code, out, err = run("export", "runs/unit-fit")
    assert (code, "typical" in err) == (0, False)
    comments = words(out.replace("//", " "))
    assert "typical" not in comments
    assert "GENROU: planner: Tpd0 Tppd0 Tpq0 Tppq0 H D Xd" in comments
    # KA, and the given values that the record refines: all that the result has as fitted
    (fitted,) = re.findall(r"ESAC1A: fitted: ([^.]*)\.", comments)
    assert {"KA"} <= {*fitted.split()} == {name for name in result.parameters if "." not in name}


@pytest.mark.long
def test_what_a_fit_found_is_fitted_where_it_comes_back(run, new_case):
    run("fit", str(new_case), *FIT)
    parameters = "runs/unit-fit/parameters.yaml"
    stated = yaml.safe_load(Path(parameters).read_text())["sources"]
    assert (stated["KA"], stated["KE"]) == ("fitted", "typical")
    content = yaml.safe_load(new_case.read_text())
    content["parameters"]["fixed"]["KA"] = 1.0
    content["parameters"]["free"].pop("KA")
    Path("again.yaml").write_text(yaml.safe_dump(content))
    assert load_case(Path("again.yaml")).sources()["KA"] == "not stated"
    run("fit", "again.yaml", "--parameters", parameters, "--set", "KE=1.1", *FIT)
    again = load_result("runs/again-fit")
    assert again.sources["KA"] == "fitted"
    assert again.sources["KE"] == "not stated"
    assert again.sources["VRMAX"] == "typical"
    text = Path(parameters).read_text().replace("KA: fitted", "KA: guessed")
    Path("parameters.yaml").write_text(text)
    code, _, err = run("fit", "again.yaml", "--parameters", "parameters.yaml", *FIT)
    assert code == 1
    assert "parameters.yaml: sources.KA: 'guessed' is not a source; known: nameplate" in err


@pytest.mark.long
def test_a_translated_case_keeps_the_sources_of_the_fit(run, new_case):
    text = new_case.read_text().replace(
        "Tpd0: {value: 6.35, source: typical}", "Tpd0: {value: 6.35, source: test report}"
    )
    new_case.write_text(text)
    run("fit", str(new_case), *FIT)
    assert run("translate", "runs/unit-fit", "--model", "EXAC1", "--no-plots")[0] in (0, 3)
    case = load_case(Path("runs/unit-EXAC1/unit-EXAC1.yaml"))
    sources = case.sources()
    assert (sources["machine.Tpd0"], sources["machine.H"]) == ("test report", "typical")
    assert (sources["KA"], sources["KE"]) == ("fitted", "typical")
    exported = words(Path("runs/unit-EXAC1/unit-EXAC1.dyr").read_text().replace("//", " "))
    assert "GENROU: test report: Tpd0." in exported
    assert "EXAC1: typical, not of this unit, check: " in exported
