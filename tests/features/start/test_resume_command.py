"""The commands that new and verify print."""

import shlex

import pytest

from exfit.cli.options import Interruption
from exfit.features.start.command import complete


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
