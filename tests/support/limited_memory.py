"""Read files in a process of its own whose memory is limited, as a system without more would."""

import json
import subprocess
import sys
from pathlib import Path

ALLOWED = 3 << 30  # bytes of addresses; libraries reserve far more of them than they use
CHILD = r"""
import json, re, resource, sys
from contextlib import suppress
from pathlib import Path

import numpy, scipy.signal, comtrade

resource.setrlimit(resource.RLIMIT_AS, ({allowed}, {allowed}))

from exfit.errors import RecordError
from exfit.records.formats import open_table
from exfit.records.inspection import inspect

for name in sys.argv[1:]:
    print(json.dumps([name]), flush=True)
    try:
        inspect(open_table(Path(name)))
        message = ""
    except RecordError as fault:
        message = str(fault)
    try:  # that of getrusage begins with the peak of the process that started this one
        status = Path("/proc/self/status").read_text()
    except OSError:
        status = "VmHWM: 0 kB"
    peak = 1024 * int(re.search(r"VmHWM:\s*(\d+)", status)[1])
    own = 1024 * resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    print(json.dumps([name, message, max(peak, own)]), flush=True)
"""


def inspected_in_a_process(paths):
    """Return message ("" where all is well) and peak so far (bytes) of each file, by its name.

    The peak is 0 where the system does not say it; the limit holds all the same.

    A file that ends the process, or that takes all it may, is missing with all that follow it.
    """
    child = subprocess.run(
        [sys.executable, "-c", CHILD.format(allowed=ALLOWED), *map(str, paths)],
        capture_output=True,
        text=True,
        timeout=300,
    )
    lines = [json.loads(line) for line in child.stdout.splitlines()]
    return {
        Path(line[0]).name: (line[1], line[2]) for line in lines if len(line) == 3
    }, child.stderr
