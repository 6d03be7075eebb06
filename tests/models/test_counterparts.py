"""Which parameters of two models are the same quantity."""

import pytest

from exfit.models import MODELS
from exfit.models.counterparts import (
    CEILINGS,
    FACTORS,
    FLOORS,
    GAIN,
    LAG,
    LEAD,
    LEAD_AS_SHARE,
    OUTPUT_FLOOR,
    REMOVABLE,
    SAME,
    WITHOUT_EFFECT,
    by_quantity,
    counterparts,
    has_effect,
    quantity,
)

QUANTITIES = {quantity(row) for model in MODELS.values() for row in model.sheet}
MEANINGS = {row.meaning for model in MODELS.values() for row in model.sheet}


def test_every_quantity_that_is_named_is_in_a_data_sheet():
    """A data sheet that is worded anew would silently lose its counterparts."""
    named = {*WITHOUT_EFFECT, *CEILINGS, *FLOORS, *REMOVABLE, *FACTORS, GAIN, LAG, LEAD}
    named |= {LEAD_AS_SHARE, OUTPUT_FLOOR, *SAME.values()}
    assert named <= QUANTITIES
    assert SAME.keys() <= MEANINGS


def test_a_parameter_is_the_counterpart_of_itself(model):
    sheet = MODELS[model].sheet
    for row, same in counterparts(sheet, sheet):
        assert quantity(row) == quantity(same)
        assert row == same or by_quantity(sheet)[quantity(row)] == same


@pytest.mark.parametrize(
    ("model", "symbol", "other", "counterpart"),
    [
        ("AC1A", "KD", "DC4B", None),
        ("ESAC8B", "KD", "DC4B", "KD"),
        ("AC8B", "KDR", "DC4B", "KD"),
        ("IEEEX1", "TF1", "DC1A", "TF"),
        ("SEXS", "K", "AC1A", "KA"),
        ("EXAC1", "KC", "AC1A", "KC"),
        ("EXST1", "KC", "AC1A", None),
        ("EXST1", "KC", "ST1A", "KC"),
        ("AC1A", "VAMAX", "EXAC1", "VRMAX"),
        ("AC2A", "VFEMAX", "EXAC2", "VLR"),
        ("DC1A", "VRMAX", "DC2A", "VRMAX"),
    ],
)
def test_what_a_parameter_is_counts_and_not_its_name(model, symbol, other, counterpart):
    pairs = counterparts(MODELS[model].sheet, MODELS[other].sheet)
    found = {row.symbol: same and same.symbol for row, same in pairs}
    assert found[symbol] == counterpart


def test_a_value_without_effect_has_none():
    rows = {row.symbol: row for row in MODELS["AC1A"].sheet}
    assert has_effect(rows["KF"], 0.03)
    assert not has_effect(rows["KF"], 0.0)
    assert not has_effect(rows["KE"], 1.0)
    assert has_effect(rows["VRMIN"], -5.43)
    assert not has_effect(rows["VRMAX"], 999.0)
