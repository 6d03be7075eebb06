"""A setting that makes this machine compute as another is in effect where it is asked for."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import settings
from settings import SETTINGS

import exfit

CODE = """
import json, sys, settings
print(json.dumps([[*settings.faults(each)] for each in json.loads(sys.argv[1])]))
"""


def faults(environment, asked):
    """Return which of some settings are not in effect in a fresh process, for each set of them."""
    folders = [Path(settings.__file__).parent, Path(exfit.__file__).parents[1]]
    others = {n: v for n, v in os.environ.items() if n not in SETTINGS["oldest"]}
    done = subprocess.run(
        [sys.executable, "-c", CODE, json.dumps(asked)],
        capture_output=True,
        text=True,
        check=True,
        env={**others, "PYTHONPATH": os.pathsep.join(map(str, folders)), **environment},
    )
    return json.loads(done.stdout)


def test_the_settings_of_this_run_are_in_effect():
    assert list(settings.faults(os.environ)) == []


# the settings alone are shown to be in effect by the runs under them
ALONE = [pytest.param(name, marks=pytest.mark.long) for name in SETTINGS if name != "oldest"]


@pytest.mark.parametrize("name", ["oldest", *ALONE])
def test_a_setting_takes_effect(name):
    assert faults(SETTINGS[name], [SETTINGS[name]]) == [[]]


@pytest.mark.long
def test_without_its_setting_no_machine_computes_as_an_old_one():
    names = ["prescott", "x86-64", *(["numpy"] if settings.DISPATCHED else [])]
    assert all(faults({}, [SETTINGS[name] for name in names]))
