"""The program from its first import on."""

import subprocess
import sys

import pytest

from exfit.__main__ import INTERRUPTED
from exfit.cli.options import Interruption

INTERRUPTED_IMPORT = """\
import sys
class Interruption:
    def find_spec(self, name, path=None, target=None):
        if name == "{module}":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interruption())
from exfit.__main__ import main
main()
"""


@pytest.mark.parametrize("module", ["click", "exfit.cli", "exfit.cli.streams"])
def test_ctrl_c_while_the_program_is_imported_ends_it_without_a_traceback(module):
    code = INTERRUPTED_IMPORT.format(module=module)
    ran = subprocess.run(
        [sys.executable, "-c", code, "--help"], capture_output=True, text=True, check=False
    )
    assert (ran.returncode, ran.stdout, ran.stderr) == (INTERRUPTED, "", "Interrupted\n")
    assert Interruption.exit_code == INTERRUPTED


def test_python_m_exfit_is_the_program():
    ran = subprocess.run(
        [sys.executable, "-m", "exfit", "--version"], capture_output=True, text=True, check=True
    )
    assert "exfit" in ran.stdout
