"""How well a load rejection determines a machine, and whether its intervals hold the truth.

    python tests/studies/rejection.py [RECORDS]

fits that many records (40) of a reactive rejection, from Q = -0.3 pu, and of one on the q axis,
with vt and ifd at 1 kHz, noise 2e-4 pu, and the instant to be found. Printed are the largest error
of each parameter, the errors in standard errors (rms), and how many of the given intervals hold the
truth.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from rejection_cases import (
    D_AXIS,
    OPENS,
    Q_AXIS,
    REACTIVE,
    TRUE,
    case_of,
    of_machine,
    on_the_q_axis,
)

import exfit

TRUTH = TRUE | {"breaker.opens": OPENS, "vt0": 1.0}
RECORDS = 40


def study(title, load, free, end, records):
    """Print what becomes of each parameter over many records of one rejection."""
    fits = [
        of_machine(exfit.fit(case_of(load, free, end=end, seed=seed, opens={"start": "auto"})))
        for seed in range(records)
    ]
    print(f"{title}: P {load.P:g}, Q {load.Q:.4f} pu, {records} records")
    for name in fits[0]:
        found, true = [of_record[name] for of_record in fits], TRUTH[name]
        errors = np.array([parameter.value - true for parameter in found])
        deviations = errors / np.array([parameter.std_error for parameter in found])
        given = [p.interval for p in found if p.interval and None not in p.interval]
        held = sum(low <= true <= high for low, high in given)
        largest = 100.0 * np.abs(errors).max() / true
        rms = float(np.sqrt(np.mean(deviations**2)))
        print(f"  {name:14s} {largest:.2g} %  {rms:.2f} sigma  {held} of {len(given)} hold it")


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else RECORDS
    study("d axis", REACTIVE, D_AXIS, 10.0, count)
    study("q axis", on_the_q_axis(0.25), Q_AXIS, 3.0, count)
