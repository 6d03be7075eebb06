"""The solution of a fit, carried over to the records that validate it."""

import pytest
from records import SAMPLES, case_of, config, found_in, write
from tables import read_columns

from exfit.fitting.build import build_experiment
from exfit.results.compare_with_record import compare_with_record
from exfit.workflows import fit
from exfit.workflows.responses import aligned, validation_of


@pytest.mark.long
def test_a_validation_is_aligned_without_moving_the_unit(tmp_path):
    """Its recorder is 30 ms late and 1 % off; the unit stays as the fit left it."""
    shown = read_columns(SAMPLES / "ac1a_down.csv", ["t", "vt"])
    write(tmp_path / "late.csv", t=shown["t"] + 0.03, vt=1.01 * shown["vt"])
    content = config("ac1a_typical")
    plain = fit(case_of(content, tmp_path))
    entry = content["validate"][0]
    entry["test"]["vt0"] = found_in(1.05, 1.0, 1.1)
    entry["record"] = {
        **entry["record"],
        "file": str(tmp_path / "late.csv"),
        "delay": found_in(0.0, -0.1, 0.1),
        "channels": {"vt": {"column": "vt", "scale": found_in(1.0, 0.9, 1.1)}},
    }
    case = case_of(content, tmp_path)
    found = fit(case)
    assert found.values == plain.values
    (before,), (after,) = plain.validation, found.validation
    assert after.rmse == pytest.approx(before.rmse, rel=0.05)
    setup = build_experiment(case, case.validations[0], found.values)
    pair = aligned(case, setup, found.values)
    assert validation_of(case, found.comparisons, *pair).rmse == after.rmse
    unaligned = compare_with_record(setup.with_enough_substeps(found.values), found.values)
    assert unaligned.rmse > 10 * after.rmse
