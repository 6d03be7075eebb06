"""A breaker that opens is recognised, with its instant, and is no step of the reference."""

import numpy as np
import pytest
import yaml
from columns import Columns
from places import SAMPLES
from rejection_record import UNIT
from step_records import step_record
from tiers import few_of
from typed_rejection import Load, recorded_rejection

from exfit.case.case_draft import CaseDraft
from exfit.case.suggestion import bump_section
from exfit.errors import ExfitError
from exfit.features.start.starting_tests import starting_tests
from exfit.features.start.tables import TableRow
from exfit.features.start.tables import tests_of_table as named_tests
from exfit.records.formats import open_table
from exfit.records.inspection import inspect

OPENS, LENGTH, INTERVAL, TRANSDUCER = 5.0013, 12.0, 0.01, 0.03  # s
NOISE = 1e-3  # pu of power and current
LOADS = (Load(0.8, 0.2), Load(0.0, -0.3), Load(0.3, -0.1))


def rejection(load, **channels):
    """Return an inspected rejection: vt and ifd, and channels given before and after by level."""
    time = np.round(np.arange(0.0, LENGTH, INTERVAL), 3)
    signals = recorded_rejection("GENROU", UNIT, load, OPENS, time, 2e-4, 1)
    rng = np.random.default_rng(2)
    others = {}
    for name, (before, after) in channels.items():
        lag = np.exp(-np.maximum(time - OPENS, 0.0) / TRANSDUCER)
        others[name] = after + (before - after) * lag + rng.normal(0.0, NOISE, len(time))
    columns = {"t": time, "vt": signals["vt"], "ifd": signals["ifd"], **others}
    return inspect(Columns(columns))


@pytest.mark.parametrize("load", LOADS, ids=str)
def test_power_that_falls_to_zero_is_a_breaker_that_opens(load):
    inspection = rejection(load, p=(load.P, 0.0), q=(load.Q, 0.0))
    opening = inspection.opening
    assert set(opening.seen_in) == {name for name in "pq" if getattr(load, name.upper())}
    # half the level is gone ln 2 of the transducer's lag after the opening; a sample beside
    assert 0.0 <= opening.at - OPENS < TRANSDUCER + 2.0 * INTERVAL
    # the median of ten noisy samples
    assert opening.levels == pytest.approx({"p": load.P, "q": load.Q}, abs=3.0 * NOISE)
    assert not any("beyond 20 %" in text or "inverted" in text for text in inspection.findings)
    assert sum("load rejection" in text for text in inspection.findings) == 1
    assert inspection.as_json()["breaker_opens"]["at"] == opening.at


def test_stator_current_alone_shows_it():
    assert rejection(LOADS[0], it=(0.82, 0.0)).opening.seen_in == ("it",)


@pytest.mark.parametrize(
    "channels",
    [
        {"p": (0.8, 0.1), "q": (0.2, 0.0)},
        {"p": (0.8, 0.8)},
        {"p": (0.0, 0.8)},
        {"p": (0.0, 0.0)},
    ],
    ids=["house load", "load stays", "synchronised", "no load"],
)
def test_a_power_that_remains_or_never_was_is_no_opening(channels):
    assert rejection(LOADS[0], **channels).opening is None


def test_a_unit_that_is_run_down_or_loses_its_field_has_no_breaker_that_opens():
    time = np.arange(0.0, 40.0, 0.01)
    rng = np.random.default_rng(3)
    voltage = 1.0 + rng.normal(0.0, 1e-4, len(time))
    ramp = np.clip(0.8 * (30.0 - time) / 20.0, 0.0, 0.8) + rng.normal(0.0, NOISE, len(time))
    assert inspect(Columns({"t": time, "vt": voltage, "p": ramp})).opening is None
    gone = np.where(time < 20.0, 1.0, 0.0)
    dead = {"vt": gone * voltage, "p": 0.8 * gone + rng.normal(0.0, NOISE, len(time))}
    assert inspect(Columns({"t": time, **dead})).opening is None


@pytest.mark.parametrize("name", ["rejection.csv", "programme_rejection.csv"])
def test_without_power_a_jump_of_the_voltage_is_taken_for_it_as_a_guess(name):
    inspection = inspect(open_table(SAMPLES / name))
    assert abs(inspection.opening.at - 1.0013) <= inspection.opening.error
    (finding,) = (text for text in inspection.findings if "load rejection" in text)
    assert "seems to open" in finding
    assert not any("beyond 20 %" in text or "inverted" in text for text in inspection.findings)


@pytest.mark.parametrize("seed", few_of(range(8), 3))
def test_a_step_of_the_reference_is_none(seed):
    assert inspect(step_record(seed, length=6.0).table).opening is None


def test_the_suggested_sections_are_those_of_a_rejection():
    load = LOADS[0]
    inspection = rejection(load, p=(load.P, 0.0), q=(load.Q, 0.0))
    sections = yaml.safe_load(CaseDraft(bump_section(inspection)).text)
    assert sections["plant"]["type"] == "machine-on-load"
    powers = sections["plant"]["network"]
    assert powers == pytest.approx({"P": load.P, "Q": load.Q}, abs=3.0 * NOISE)
    assert sections["test"] == {"breaker": {"opens": {"start": "auto"}}}


def test_a_rejection_is_a_case_of_its_own_and_beside_other_records_it_is_refused():
    inspection = rejection(LOADS[0], p=(0.8, 0.0), q=(0.2, 0.0))
    (test,) = starting_tests([inspection])
    assert test.steps == ()
    with pytest.raises(
        ExfitError, match=r"p and q fall permanently to zero .* test: \{breaker: \{opens:"
    ):
        starting_tests([inspection, inspection])
    row = TableRow("tests.csv:2", inspection.path, inspection.steps[0].at, 0.05, None, None)
    with pytest.raises(ExfitError, match=r"tests.csv:2: .* machine-on-load"):
        named_tests([row], {inspection.path: inspection}, {})
