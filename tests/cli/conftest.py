"""Fixtures of the tests of commands."""

import pytest

from exfit import cli


@pytest.fixture
def run(capsys):
    """Return a function that runs a command as the shell does: code, output, errors."""

    def command(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            cli.main(args=[str(one) for one in arguments], prog_name="exfit")
        found = capsys.readouterr()
        return int(ended.value.code or 0), found.out, found.err

    return command
