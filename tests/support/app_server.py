"""The server of exfit app beside a test: a process of its own, and its address."""

import subprocess
import sys
from contextlib import contextmanager


@contextmanager
def served(case, folder):
    """Serve a case from a folder; give the process and the address that it prints."""
    command = [sys.executable, "-m", "exfit", "app", str(case), "--no-browser"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=folder)
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
