"""Grid events of two units through three commands: tests/studies/event_fleet.py has 40."""

from pathlib import Path

import pytest
from event_fleets import event_fleet

from exfit.features.fleet.folder import read_fleet


@pytest.mark.long
def test_events_verify_values_near_the_truth_and_no_unit_that_they_contradict(run, empty_folder):
    made = event_fleet(empty_folder, units=2)
    assert (len(made.off), len(made.inertia)) == (1, 1)
    ran = run("import", "--all", made.dyr, "-o", "cases", "--records", made.table,
              "--raw", made.raw)  # fmt: skip
    assert ran.code == 0, ran.err
    for case in Path("cases").glob("*.yaml"):  # an event would refine the inertia otherwise
        case.write_text(f"{case.read_text()}given: exact\n")
    ran = run("batch", "cases", "-o", "fleet", "--search", "local", "--workers", "1", "--quiet")
    assert ran.code == 3, ran.err
    ran = run("export", "--all", "fleet", "-o", "fitted.dyr")
    for bus in made.inertia:
        assert f"bus-{bus}-1: not verified: " in ran.err
    cases = read_fleet("fleet").cases
    verified = {case.bus: case.parameters for case in cases if case.holds}
    assert verified.keys() == made.off
    for bus, parameters in verified.items():
        true = {symbol: value for (_, symbol), value in made.truth[bus].items()}
        for symbol, fitted in parameters.items():
            if fitted.low is not None and fitted.high is not None:
                # ten standard errors of an interval of 95 %
                far = 2.5 * (fitted.high - fitted.low)
                assert fitted.value == pytest.approx(true[symbol], abs=far)
