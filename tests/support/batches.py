"""Cases for batches: small ones, each in a file with its record."""

import numpy as np
import yaml
from cases import FIRST_ORDER, TIME, TRUTH, with_local_search

from exfit.case.peek import files_of

NOISE = 1e-3


def record_file(path, seed=3):
    """Write a record of FIRST_ORDER, with noise of its own by the seed; return its path."""
    samples = TRUTH + NOISE * np.random.default_rng(seed).standard_normal(len(TIME))
    rows = (f"{t:.6g},{v:.9g}" for t, v in zip(TIME, samples, strict=True))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(["t,v", *rows]) + "\n")
    return path


def case_file(path, record, **changes):
    """Write a case of FIRST_ORDER with a record; return its path."""
    section = {"file": str(record), "time": "t", "channels": {"vt": "v"}}
    content = with_local_search({**FIRST_ORDER, "record": section, **changes})
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


def files_of_case(case):
    """Return a case and the files that it names, as a batch counts them."""
    return files_of(case)
