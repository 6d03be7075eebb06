"""What an addition touches: in a copy of exfit, the few places named here, and every use has it."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from cases import FIRST_ORDER, TIME, TRUTH

import exfit

pytestmark = pytest.mark.long  # each copies the whole package

RECORD = {"file": "record.csv", "time": "t", "channels": {"vt": "vt"}}
ROOT = Path(exfit.__file__).parent
RUN = """
import sys
from click.testing import CliRunner
from exfit.cli import main
for line in sys.argv[1:]:
    result = CliRunner().invoke(main, line.split(), catch_exceptions=False)
    print(result.output)
    assert result.exit_code == 0, line
"""


class Copy:
    """A copy of exfit in a folder of its own, to which something is added."""

    def __init__(self, folder):
        self.folder = folder
        shutil.copytree(ROOT, folder / "exfit", ignore=shutil.ignore_patterns("__pycache__"))

    def write(self, path, text):
        (self.folder / path).write_text(text, encoding="utf-8")

    def add(self, path, before, line):
        """Put a line before a place that occurs once."""
        text = (self.folder / path).read_text(encoding="utf-8")
        assert text.count(before) == 1, f"{path}: {before}"
        self.write(path, text.replace(before, line + before))

    def record(self, **signals):
        """Write signals with a little noise into a file of a recorder."""
        rng = np.random.default_rng(0)
        noisy = [signal + 1e-3 * rng.standard_normal(len(TIME)) for signal in signals.values()]
        rows = np.column_stack([TIME, *noisy])
        header = ",".join(("t", *signals))
        np.savetxt(self.folder / "record.csv", rows, "%.9g", ",", header=header, comments="")

    def python(self, code, *arguments):
        run = subprocess.run(
            [sys.executable, "-c", code, *arguments],
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": str(self.folder), "COLUMNS": "200"},
            capture_output=True,
            text=True,
            check=False,
        )
        assert run.returncode == 0, run.stdout + run.stderr
        return run.stdout

    def exfit(self, *commands):
        """Run commands one after the other; return what they print."""
        return self.python(RUN, *commands)

    def completed(self, *words):
        """Return what a shell completes behind some words."""
        code = f"from exfit.cli.completion import {words[0]}; print(*{words[0]}(None, None, ''))"
        return self.python(code).split()


@pytest.fixture
def copy(tmp_path):
    return Copy(tmp_path)


def test_a_signal_is_one_row_and_an_output_of_its_plant(copy):
    """The error of the control, put out by the plant of a model alone, and recorded with noise."""
    plant = "exfit/plants/alone.py"
    row = 'SignalRow("verr", "control error", noise=1e-3, words=("verr",), turn=8),\n    '
    copy.add("exfit/signals.py", 'SignalRow("delta"', row)
    copy.add(plant, '"vref", "vt")\n', '"verr", ')
    copy.add(plant, '"vref": vref, "vt": output, **x', '"verr": vref - output, ')
    copy.record(vt=TRUTH, verr=np.where(TIME > 0.5 + 1e-9, 1.0, 0.0) - TRUTH)
    fitted = {**FIRST_ORDER, "record": {**RECORD, "channels": {"vt": "vt", "verr": "verr"}}}
    copy.write("case.yaml", json.dumps(fitted))
    shown = copy.exfit(
        "inspect record.csv",
        "fit case.yaml -o run",
        "fit case.yaml -o again --no-plots --strategy lm",
        "report run",
        "compare run again -o compared",
        "identify case.yaml --noise verr=0.01",
    )
    assert "verr is verr: sure, by its name: verr" in shown, shown
    result = json.loads((copy.folder / "run/result.json").read_text())
    assert result["parameters"]["k"]["value"] == pytest.approx(4.0, rel=0.01)
    page = (copy.folder / "run/report.html").read_text(encoding="utf-8")
    assert "control error verr (pu)" in page
    assert (copy.folder / "run/overlay.png").is_file()
    assert "verr" in (copy.folder / "compared/compare.csv").read_text().splitlines()[0]
    assert "verr=" in copy.completed("noises")


def test_an_exciter_is_one_file_and_a_case_to_try_it(copy):
    source = (copy.folder / "exfit/models/exciters/sexs.py").read_text(encoding="utf-8")
    title, _, rest = source.partition("\n")
    assert title.startswith('"""SEXS: ')
    records = rest.index("RECORDS = "), rest.index("STATES = ")
    text = '"""MINE: an exciter of our own.\n' + rest[: records[0]] + rest[records[1] :]
    copy.write("exfit/models/exciters/mine.py", text)
    plant = {"type": "open-circuit", "machine": "GENROU"}
    test = {"vt0": 1.0, "duration": 2.0, "vref": [{"at": 0.5, "step": 0.02}]}
    copy.write("mine.yaml", json.dumps({"model": "MINE", "plant": plant, "test": test}))
    shown = copy.exfit(
        "models", "models mine", "simulate mine.yaml -o run --no-plots", "check mine.yaml"
    )
    assert "an exciter of our own" in shown
    assert {"MINE", "SEXS"} <= {*copy.completed("exciters")}
    assert (copy.folder / "run/response.csv").is_file()


PLANT = '''"""A model alone whose reference and voltage are offset, as a plant of its own."""

from dataclasses import replace

from exfit.plants.alone import ALONE

OFFSET = replace(ALONE, name="offset", title="the model with an offset")
'''
SECTION = '''class OffsetPlant(PlantSection):
    """A plant of its own."""

    type: Literal["offset"] = Field(description="What surrounds the model.")


'''


def test_a_plant_is_one_file_one_section_and_one_line(copy):
    copy.write("exfit/plants/offset.py", PLANT)
    copy.add(
        "exfit/plants/__init__.py",
        '        "open-circuit": ',
        '        "offset": "offset:OFFSET",\n',
    )
    copy.add("exfit/case/schema/plants.py", "\nPlant = Annotated[", SECTION + "\n")
    copy.add(
        "exfit/case/schema/plants.py",
        "    Annotated[Later[OpenCircuit],",
        '    Annotated[Later[OffsetPlant], Tag("offset")]\n    | ',
    )
    test = {"vt0": 0.0, "duration": 3.0, "vref": [{"at": 0.5, "step": 1.0}]}
    case = {**FIRST_ORDER, "plant": {"type": "offset"}, "test": test}
    copy.write("case.yaml", json.dumps(case))
    shown = copy.exfit("simulate case.yaml -o run --no-plots", "check case.yaml", "schema")
    assert '"offset"' in shown


def test_a_strategy_is_its_words_and_its_function(copy):
    copy.add("exfit/util/vocabulary.py", '"auto": ', '"twice": "lm, then lm again",\n    ')
    copy.add(
        "exfit/estimate/solver.py",
        '"auto": ',
        '"twice": alone(lambda searches: searches.lm),\n    ',
    )
    copy.record(vt=TRUTH)
    case = {**FIRST_ORDER, "record": RECORD, "estimate": {"strategy": "twice"}}
    copy.write("case.yaml", json.dumps(case))
    shown = copy.exfit("fit --help", "fit case.yaml -o run --no-plots")
    assert "lm, then lm again" in " ".join(shown.split())


COMMAND = '''"""The command poles."""

from pathlib import Path

import click

from exfit.cli.options import case_argument


@click.command()
@case_argument
def poles(case: Path) -> None:
    """Print the poles of CASE."""
    click.echo(f"poles of {case}")
'''


def test_a_command_is_the_folder_of_its_feature(copy):
    """Beside its tests and its page in the documentation."""
    (copy.folder / "exfit/features/poles").mkdir()
    table = '{"poles": ("examine", "Print the poles of CASE.", "command:poles")}'
    copy.write("exfit/features/poles/__init__.py", f"COMMANDS = {table}\n")
    copy.write("exfit/features/poles/command.py", COMMAND)
    shown = copy.exfit("--help", "poles --help", "poles case.yaml")
    assert "Print the poles of CASE" in shown
    assert "poles of case.yaml" in shown
