"""The memory of simulations: worked out before them, and refused where it exceeds the limit."""

import numpy as np
import pytest
import yaml
from extreme_cases import TYPICAL, run, write_case
from places import SAMPLES

from exfit.cli import main
from exfit.errors import SimulationError
from exfit.fitting.memory import check_fit
from exfit.simulation.memory import GIGABYTE, RunSize, check_run

RUN = RunSize(2e6, 10_000, 11)
RECORD = RunSize(1e5, 20_000, 11, 2)


@pytest.mark.parametrize("more", ["steps", "samples", "outputs"])
def test_what_fits_no_longer_does_with_more_of_anything(more):
    check_run(RUN, 1e-3, 2.0)
    with pytest.raises(SimulationError, match=r"simulation\.memory raises it"):
        check_run(RUN._replace(**{more: 100 * getattr(RUN, more)}), 1e-3, 2.0)
    check_run(RUN._replace(**{more: 100 * getattr(RUN, more)}), 1e-3, 1000.0)


def test_the_records_of_a_fit_share_its_memory():
    check_fit([RECORD] * 3, 5, 2.0)
    with pytest.raises(SimulationError, match=r"5 parameters to 2000000 samples by 1e\+07 steps"):
        check_fit([RECORD] * 100, 5, 2.0)


def test_located_crossings_and_a_written_result_take_memory():
    with pytest.raises(SimulationError, match=r"simulation\.memory raises it"):
        check_run(RUN._replace(located=True), 1e-3, 2.0)
    short = RunSize(1e3, 20_000, 11, 3)
    check_fit([short] * 2, 1, 1.0)
    with pytest.raises(SimulationError, match="1 parameters to 200000 samples"):
        check_fit([short] * 10, 1, 1.0)


SIMULATING = (
    ("validate", "case.yaml", "--parameters", "values.yaml"),
    ("validate", "unseen.yaml"),
    ("profile", "case.yaml"),
    ("identify", "case.yaml"),
    ("identify", "case.yaml", "--design"),
    ("check", "case.yaml"),
)
FITTING = (
    ("fit", "case.yaml"),
    ("fit", "case.yaml", "case.yaml"),
    ("run", "case.yaml"),
    ("rank", "case.yaml", "--models", "AC1A", "--no-plots"),
    ("batch", "case.yaml", "--workers", "1"),
)


@pytest.mark.parametrize(
    "arguments",
    [*SIMULATING, *(pytest.param(each, marks=pytest.mark.long) for each in FITTING)],
    ids=" ".join,
)
def test_the_records_of_any_command_share_its_memory(tmp_path, monkeypatch, capfd, arguments):
    """Each of forty records is within the limit, and all of them are not."""
    monkeypatch.chdir(tmp_path)
    free = TYPICAL["parameters"]["free"]
    case = {**TYPICAL, "simulation": {"memory": 0.26}, "validate": []}
    record = {**TYPICAL["record"], "file": str(SAMPLES / "ac1a_up.csv")}
    one = {"test": case.pop("test"), "record": record}
    case["records"] = [{"name": f"r{k}", **one} for k in range(40)]
    del case["record"]
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(case), encoding="utf-8")
    values = {name: row["start"] for name, row in free.items()}
    (tmp_path / "values.yaml").write_text(yaml.safe_dump({"parameters": values}), encoding="utf-8")
    fixed = case["parameters"]["fixed"] | values
    case |= {"parameters": {"fixed": fixed}, "validate": case.pop("records")}
    (tmp_path / "unseen.yaml").write_text(yaml.safe_dump(case), encoding="utf-8")
    with pytest.raises(SystemExit):
        main(args=arguments, prog_name="exfit")
    said = " ".join("".join(capfd.readouterr()).split())
    assert "simulation.memory raises" in said  # the table of a batch cuts what follows


@pytest.mark.parametrize(("step", "code"), [(1e-6, 1), (0.02, 0)])
def test_a_run_that_is_too_long_ends_before_it_takes_memory(tmp_path, step, code):
    pytest.importorskip("resource")
    free = {name: row["start"] for name, row in TYPICAL["parameters"]["free"].items()}
    case = {key: TYPICAL[key] for key in ("model", "saturation", "plant")}
    case["test"] = {**TYPICAL["test"], "duration": 10_000.0}
    case["parameters"] = {"fixed": {**TYPICAL["parameters"]["fixed"], **free}}
    case["simulation"] = {"step": step, "output_step": 1.0}
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(case), encoding="utf-8")
    ended = run(tmp_path, "simulate", 60)
    assert (ended.code, "Traceback" in ended.error) == (code, False)
    assert ("simulation.memory raises it" in ended.error) == bool(code)
    assert ended.peak < (0.5 if code else 2.0) * GIGABYTE


@pytest.mark.long
@pytest.mark.parametrize("number", range(12))
def test_extreme_cases_stay_within_their_memory(tmp_path, number):
    pytest.importorskip("resource")
    command = ("simulate", "fit", "check")[number % 3]
    memory = write_case(tmp_path, np.random.default_rng((7, number)), command)
    ended = run(tmp_path, command, 60)
    assert "Traceback" not in ended.error
    assert ended.peak < GIGABYTE * memory
