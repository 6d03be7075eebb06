"""Channels: which signal each is, what is sure, what is a guess and why, what must be asked."""

import numpy as np
import pytest
import yaml
from columns import Columns
from step_records import step_record

from exfit.case.case_draft import CaseDraft
from exfit.case.suggestion import record_section
from exfit.records.inspection import inspect

TABLE = step_record(1, length=6.0).table.content
TIME = TABLE["t"]
VT, EFD, IFD = (TABLE[name] for name in ("vt", "efd", "ifd"))
NOISE = 1e-4 * np.random.default_rng(5).standard_normal(len(TIME))


def inspected(units=(), **columns):
    return inspect(Columns({"t": TIME, **columns}, units=dict(units)))


def channel(inspection, name):
    return next(entry for entry in inspection.channels if entry.name == name)


def test_name_unit_level_and_shape_make_a_channel_sure():
    inspection = inspected({"Ugen": "kV"}, Ugen=13.8 * VT, Ug=VT)
    sure = channel(inspection, "Ug")
    assert (sure.signal, sure.sure) == ("vt", True)
    for reason in ("its name: ug", "its level: 0.9999 pu", "its shape: it moves with the step"):
        assert reason in sure.why
    assert channel(inspection, "Ugen").signal is None  # each signal once
    assert "its unit: kV" in channel(inspected({"Ugen": "kV"}, Ugen=13.8 * VT), "Ugen").why


def test_a_quantity_alone_is_a_guess_and_of_two_neither_is_taken():
    (voltage,) = inspected(Voltage=VT).channels
    assert (voltage.signal, voltage.sure, voltage.question) == ("vt", False, "")
    (volts,) = inspected({"Voltage": "V"}, Voltage=110.0 * VT).channels
    assert volts.signal == "vt"
    assert "does not say of what" in volts.question
    inspection = inspected(U=13.8 * VT, V=92.0 * EFD)
    assert [entry.signal for entry in inspection.channels] == [None, None]
    assert channel(inspection, "U").question == "is it vt, the terminal voltage, or is V?"


def test_of_two_voltages_with_like_names_the_one_that_moves_is_the_generators():
    still = 1.0 + NOISE
    inspection = inspected(**{"Voltage A": still, "Voltage B": VT})
    assert channel(inspection, "Voltage B").signal == "vt"
    (bus,) = [entry for entry in inspected(Ug=still, efd=EFD).channels if entry.signal == "vt"]
    assert not bus.sure
    assert "does not move with the step" in bus.question


def test_an_abbreviation_is_an_error_where_it_rests_at_zero_and_is_asked_about_elsewhere():
    error = inspected(Ug=VT, U_Err=VT[0] - VT + np.where(TIME > 2.0, 0.05, 0.0))
    assert channel(error, "U_Err").signal is None
    excitation = channel(inspected(Ug=VT, U_Err=EFD), "U_Err")
    assert excitation.signal == "efd"
    assert not excitation.sure
    assert "or a control error?" in excitation.question


def test_an_unknown_channel_is_asked_about_if_it_may_be_a_signal_that_is_missing():
    inspection = inspected({"X7": "A"}, Ug=VT, X7=600.0 * IFD, other=NOISE)
    assert channel(inspection, "X7").question == "is it ifd? It moves with the step"
    assert channel(inspection, "other").question == ""
    complete = inspected({"X7": "A"}, Ug=VT, Ifd=IFD, X7=3.0 * EFD)
    assert channel(complete, "X7").question == ""
    assert any(text.startswith("X7: is it ifd?") for text in inspection.findings)


def test_the_field_of_a_brushless_exciter_is_not_the_generators():
    inspection = inspected({"Exciter field current": "A"}, Ug=VT, **{"Exciter field current": IFD})
    assert channel(inspection, "Exciter field current").signal is None


@pytest.mark.parametrize("lacking", ["vt", "efd", "ifd"])
def test_a_channel_without_samples_where_others_have_them_ends_nothing(lacking):
    """A dead channel, and a recorder that takes its channels in turn."""
    odd = np.arange(len(TIME)) % 2 == 1
    for own, of_others in ((odd & False, odd | True), (odd, ~odd)):  # where each has samples
        columns = {
            name: np.where(own if name == lacking else of_others, samples, np.nan)
            for name, samples in (("vt", VT), ("efd", EFD), ("ifd", IFD))
        }
        shown = inspected(**columns)
        assert {entry.name for entry in shown.channels} == {"vt", "efd", "ifd"}


def test_a_frequency_that_wanders_is_no_step_of_the_test():
    wandering = {"f (Hz)": 50.0 + 0.01 * np.tanh(4.0 * (TIME - 4.0)) + NOISE}
    (step,) = inspected(Ug=VT, **wandering).steps
    assert "Ug" in step.seen_in
    assert len(inspected(**wandering).steps) == 1  # where no channel is a signal


@pytest.mark.parametrize(("factor", "unit"), [(0.4, None), (0.4, "pu"), (-0.4, None), (40.0, "%")])
def test_a_relative_field_voltage_has_its_scale_found_within_what_machines_have(factor, unit):
    units = {"Uf": unit} if unit else {}
    inspection = inspected(units, Ug=VT, Uf=factor * EFD)
    section = yaml.safe_load(CaseDraft(record_section(inspection, "a.csv")).text)
    scale = section["record"]["channels"]["efd"]["scale"]
    assert scale["min"] < scale["start"] < scale["max"]
    assert scale["min"] < 1.0 / factor < scale["max"]
    assert any("air-gap line" in text for text in inspection.findings)


def test_power_in_per_unit_of_the_grid_needs_a_base():
    columns = {"ETRM 1[A 20.0]1": VT, "POWR 1[A 20.0]1": 0.5 + 10.0 * NOISE}
    section = yaml.safe_load(CaseDraft(record_section(inspected(**columns), "a.csv")).text)
    assert section["record"]["channels"]["p"] == {
        "column": "POWR 1[A 20.0]1", "unit": "pu", "base": "?"
    }  # fmt: skip
