"""The server of exfit app beside a test: a process of its own, and its address."""

import subprocess
import sys
from contextlib import contextmanager


@contextmanager
def served(case, folder):
    """Serve a case, None for none, from a folder; give the process and its address."""
    given = [] if case is None else [str(case)]
    command = [sys.executable, "-m", "exfit", "app", *given, "--no-browser"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=folder)
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
