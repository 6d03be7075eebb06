"""The commands that new and verify print."""

import shlex

import pytest

from exfit.cli.options import Interruption
from exfit.errors import ExfitError
from exfit.features.start.command import complete
from exfit.features.start.verify import _refuse_edited


def test_the_command_that_resumes_can_be_pasted_whatever_the_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("exfit.features.start.conversation.converse", interrupted)
    given = {"record": "unit 2's.csv", "output": "my report.html"}
    with pytest.raises(Interruption) as stop:
        complete(given, {}, "verify", introduced=True)
    *words, option, output = shlex.split(str(stop.value).splitlines()[-1])
    assert (words[:3], option, output) == (["exfit", "verify", "--answers"], "-o", "my report.html")
    assert words[3:] == ["unit 2's.answers.yaml"]
    assert (tmp_path / words[3]).exists()


def test_the_command_that_fits_an_edited_case_can_be_pasted(tmp_path):
    case = tmp_path / "unit 2's.yaml"
    case.write_text("model: AC1A\n")
    with pytest.raises(ExfitError) as refused:
        _refuse_edited(case)
    command = str(refused.value).partition("`")[2].partition("`")[0]
    assert shlex.split(command) == ["exfit", "fit", str(case)]
