"""Units: what a name or a text says of them is read where it is certain, and nowhere else."""

import pytest

from exfit.records.units import alike, bare, needs_base, quantity_of, unit_in, unit_of, usual

UNITS = {
    "Ugen [kV]": "kV",
    "Ugen <kV>": "kV",
    "If (A)": "A",
    "If(A)": "A",
    "Ia (A)": "A",
    "t/ms": "ms",
    "Ugen/kV": "kV",
    "U / kV": "kV",
    "V/kV": "kV",
    "Erregerstrom/A": "A",
    "Time, s": "s",
    "Time, ms": "ms",
    "U, kV": "kV",
    "Zeit [s]": "s",
    "TIME (MS)": "MS",
    "[s]": "s",
    "[kV]": "kV",
    "P [MW]": "MW",
    "Q (Mvar)": "Mvar",
    "vt [p.u.]": "p.u.",
    "vt pu": "pu",
    "Voltage in p.u.": "p.u.",
    "Voltage in per unit": "per unit",
    "Ifd [%]": "%",
    "Vref (%)": "%",
    "I [mA]": "mA",
    "f (Hz)": "Hz",
    "U in V": "V",
    "P in MW": "MW",
    "Speed in 1/min": "1/min",
    "U_kV": "kV",
    "I_f mA": "mA",
    "t_ms": "ms",
    "U kVrms": "kVrms",
    "U [L1] [kV]": "kV",
    # a phase, an index, a limit, a ratio, a word
    "Ugen": None,
    "q": None,
    "U (L1)": None,
    "U L1": None,
    "U (S)": None,
    "U (A)": None,
    "Voltage (A)": None,
    "Phase (A)": None,
    "U/A": None,
    "I (a)": None,
    "V_A": None,
    "I_V": None,
    "U (T)": None,
    "U (C)": None,
    "U_s": None,
    "P_min": None,
    "U [2]": None,
    "U [1]": None,
    "data[1]": None,
    "Phase, A": None,
    "Ua/Ub": None,
    "V/Hz": None,
    "V/f": None,
    "omega rad/s": None,
    "rad/s": None,
    "1/min": None,
    "m/s": None,
    "Bus in use": None,
    "Generator volts": None,
    "": None,
}


@pytest.mark.parametrize("name", UNITS)
def test_a_unit_is_split_off_a_name_only_where_it_is_one(name):
    assert unit_in(name) == UNITS[name]


BARE = {
    "Ugen [kV]": "Ugen",
    "t/ms": "t",
    "Time, s": "Time",
    "U_kV": "U",
    "P in MW": "P",
    "[kV]": "[kV]",
    "U (A)": "U (A)",
    "V/Hz": "V/Hz",
}


@pytest.mark.parametrize("name", BARE)
def test_the_bare_name_is_what_comes_before_the_unit(name):
    assert bare(name) == BARE[name]


@pytest.mark.parametrize(
    "text",
    ["kV", "[kV]", "(s)", "ms", "A", "pu", "p.u.", "%", "-", "Mvar", "MVAR", "Volts", "µs", "°C",
     "kW", "VA", "Hz", "HZ", "Vdc", "V rms", "second"],
)  # fmt: skip
def test_a_unit_is_known_with_brackets_or_without(text):
    assert unit_of(text) == text.strip("[]()")


@pytest.mark.parametrize("text", ["", "Ugen", "L1", "[1]", "time", "kVolts per metre", "S", "(S)"])
def test_other_texts_are_no_units(text):
    assert unit_of(text) is None


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("kV", "KV", True),
        ("kV", "kv", True),
        ("pu", "p.u.", True),
        ("pu", "per unit", True),
        ("Volts", "V", True),
        ("Vdc", "V", True),
        ("µs", "us", True),
        ("MS", "ms", True),
        ("Mvar", "MVAR", True),
        ("Mvar", "mvar", True),
        ("MW", "mw", True),
        ("MW", "mW", False),
        ("MVA", "mVA", False),
        ("MV", "mV", False),
        ("kV", "V", False),
        ("A", "kA", False),
        ("steps", "Steps", True),
        ("steps", "kV", False),
    ],
)
def test_units_are_compared_as_they_are_meant(one, other, same):
    assert alike(one, other) == alike(other, one) == same


SPELT = ["V", "kV", "mV", "uV", "A", "kA", "mA", "W", "kW", "MW", "mW", "var", "kvar", "Mvar", "VA",
         "MVA", "mVA", "Hz", "s", "ms", "us", "min", "pu", "%", "Ω", "deg"]  # fmt: skip


@pytest.mark.parametrize("unit", SPELT)
def test_the_usual_spelling_is_spelt_usually(unit):
    assert usual(unit) == unit


QUANTITIES = {
    "kV": "voltage", "mV": "voltage", "Volts": "voltage", "A": "current", "MW": "power",
    "mvar": "reactive", "ms": "time", "min": "time", "Hz": "frequency", "MVA": "apparent",
    "pu": None, "%": None, "bar": None,
}  # fmt: skip


@pytest.mark.parametrize("unit", QUANTITIES)
def test_a_unit_measures_one_quantity(unit):
    assert quantity_of(unit) == QUANTITIES[unit]


@pytest.mark.parametrize("unit", ["pu", "p.u.", "P.U.", "1", "-", ""])
def test_numbers_per_unit_need_no_base(unit):
    assert not needs_base(unit)


@pytest.mark.parametrize("unit", ["%", "kV", "A", "Mvar", "steps"])
def test_numbers_of_other_units_need_a_base(unit):
    assert needs_base(unit)
