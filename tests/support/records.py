"""Cases with records of the AC1A: the sample records, and others that the simulator makes."""

from copy import deepcopy
from functools import cache

import numpy as np
import yaml
from cases import with_local_search
from places import ROOT

from exfit.case.load import load_case
from exfit.fitting.build import build_experiments

SAMPLES = ROOT / "sample_data"
STEP = {"up": 0.05, "down": -0.05}  # pu, at 1 s, of all sample records
NOISE = 1e-4  # pu, of vt in all sample records
TIME = np.arange(0.0, 6.0, 0.01)
TEST = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}]}
# where the fit of the sample record ends
UNIT = {"KA": 332.83, "KF": 0.0444, "TE": 1.5238, "TF": 1.5754, "TA": 0.0545, "KC": 0.5111}
UNIT["KD"] = 0.2477


def config(name):
    """Return a case of the collection, whose paths lead to the sample records."""
    return deepcopy(_parsed(name))


@cache
def _parsed(name):
    text = (ROOT / "configs" / f"{name}.yaml").read_text()
    return yaml.safe_load(text.replace("../sample_data", SAMPLES.as_posix()))


def found_in(start, low, high):
    """Return a value that the fit finds."""
    return {"start": start, "min": low, "max": high}


def recording(name, file=None, at=1.0, step=None, channels=None, **record):
    """Return an entry of records on a sample record of the AC1A."""
    file = SAMPLES / f"ac1a_{name}.csv" if file is None else file
    return {
        "name": name,
        "test": {"vref": [{"at": at, "step": STEP[name] if step is None else step}]},
        "record": {
            "file": str(file),
            "time": "t",
            "channels": {"vt": "vt"} if channels is None else channels,
            **record,
        },
    }


def several(*records, free=None, **sections):
    """Return the AC1A's case with several records in place of one."""
    content = config("ac1a_typical")
    for key in ("test", "record", "validate"):
        del content[key]
    content["records"] = list(records)
    if free is not None:
        content["parameters"]["free"] = free
        known = {name: value for name, value in UNIT.items() if name not in free}
        content["parameters"]["fixed"] |= known
    return {**content, **sections}


def case_of(content, folder):
    """Write a case into a folder and load it; its search is local, unless it says otherwise."""
    path = folder / "case.yaml"
    path.write_text(yaml.safe_dump(with_local_search(content), sort_keys=False))
    return load_case(path)


def write(path, **columns):
    """Write a record, gaps as empty cells."""
    rows = np.column_stack(list(columns.values()))
    line = ",".join(["%.10g"] * len(columns)) + "\n"
    numbers = line * len(rows) % tuple(rows.ravel().tolist())
    path.write_text(",".join(columns) + "\n" + numbers.replace("nan", ""))
    return path


def one(test, channels=None, free=None, **record):
    """Return the AC1A's case with one synthetic record, record.csv."""
    content = config("ac1a_typical")
    del content["validate"]
    content["test"] = test
    content["record"] = {
        "file": "record.csv",
        "time": "t",
        "channels": {"vt": "vt"} if channels is None else channels,
        **record,
    }
    content["parameters"]["fixed"] |= UNIT
    content["parameters"]["free"] = {}
    for name in free or ():
        start = content["parameters"]["fixed"].pop(name)
        content["parameters"]["free"][name] = found_in(start, start / 10, start * 10)
    return content


def synthetic(folder, test, time, seed=0, noise=NOISE, signals=("vt",)):
    """Write the response of the unit to a test, with noise; return its signals."""
    write(folder / "record.csv", t=time, vt=time)
    case = case_of(one(test), folder)
    values = case.values()
    response = build_experiments(case)[0].with_enough_substeps(values).response(values)
    rng = np.random.default_rng(seed)
    shown = {
        name: response.signals[name] + noise * rng.standard_normal(len(time)) for name in signals
    }
    write(folder / "record.csv", t=time, **shown)
    return shown


def workbook_of(text_file, path, sheets, time="t", factor=1.0):
    """Write the columns of a text file on each of some sheets, the time renamed and scaled."""
    from openpyxl import Workbook

    names, *rows = text_file.read_text().splitlines()
    book = Workbook(write_only=True)
    for title in sheets:
        sheet = book.create_sheet(title)
        sheet.append([time, *names.split(",")[1:]])
        for row in rows:
            first, *others = map(float, row.split(","))
            sheet.append([first * factor, *others])
    book.save(path)
    return path
