"""Names of channels: what recorders, simulators and languages call a signal, and what is none."""

import pytest

from exfit.records.channel_names import Clarity, read_name
from exfit.records.units import unit_in

NAMES = {
    "vt": (
        "Generator PT volts", "Unit 2 Generator kV", "V_GEN_AVG", "Klemmspannung", "UGen", "U_g",
        "Tensão nos bornes", "Tension aux bornes", "Tensión del estator", "Gen V L12", "V1 (kV)",
        "ETRM 101[HYDRO 13.800]1", "s:ut in p.u.", "Maschinenspannung", "AVR1.rUgRel", "genvolts",
    ),
    "efd": (
        "Rotor volts", "FIELD_VDC", "Ufeld", "Vrotor", "Tensão de campo", "Läuferspannung",
        "Tension d'excitation", "UE", "Slip ring voltage", "Exciter output voltage", "s:ve", "V_fd",
        "EFD 101[HYDRO 13.800]1", "Fld V", "Vcc campo",
    ),
    "ifd": (
        "Rotor amps", "FLD ADC", "I_f", "Polradstrom", "Courant rotor", "Corriente de campo", "IE",
        "XADI 101[HYDRO 13.800]1", "LADIFD", "s:ie in p.u.", "Schleifringstrom", "EXC FLD AMPS",
    ),
    "p": ("Gen MW", "Puissance active", "Potência ativa", "POWR 1[A 20.0]1", "P_el", "Load (MW)"),
    "q": ("Gen MVAR", "Puissance réactive", "Potencia reactiva", "VARS 1[A 20.0]1", "kVAr"),
    "vref": ("AVR setpoint", "Spannungssollwert", "Consigne tension", "Ug Soll", "rUrefRel"),
    "gate": (
        "Gate", "Gate position (%)", "Wicket gate", "Guide vane opening", "Leitapparat", "Vannage",
        "Distribuidor",
    ),
    None: (
        "Exciter field current", "Pilot exciter volts", "Bus voltage", "Tension réseau",
        "Netzspannung", "MW setpoint", "VOLT 101[HYDRO 13.800]", "AVR output",
        "Rotor temperature", "V/Hz", "Speed reference", "Voltage error",
        "Excitation transformer voltage",        "Field current setpoint", "UEL", "If limit",
    ),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "signal"), [(name, signal) for signal, names in NAMES.items() for name in names]
)
def test_a_name_is_read_by_its_words_for_quantity_and_place(name, signal):
    assert read_name(name, unit_in(name)).signal == signal


@pytest.mark.parametrize(
    ("name", "unit", "signal"),
    [("Field", "V", "efd"), ("Field", "A", "ifd"), ("Rotor", "kV", "efd"), ("Channel 3", "MW", "p"),
     ("If", "kV", None), ("Vt", "Hz", None), ("Ug", "%", "vt"), ("Generator", "kA", "it")],
)  # fmt: skip
def test_a_unit_completes_a_name_or_contradicts_it(name, unit, signal):
    assert read_name(name, unit).signal == signal


@pytest.mark.parametrize(
    ("name", "signal", "other"),
    [("U_Err", "efd", "control error"), ("EXC FLD AMPS", "ifd", "brushless"),
     ("IE", "ifd", "brushless"),
     ("Gen bus voltage", "vt", "grid"), ("I", None, "it"), ("Field", None, "ifd"),
     ("Vs gen", None, "vs")],
)  # fmt: skip
def test_a_name_that_may_be_two_things_says_which(name, signal, other):
    reading = read_name(name, None)
    assert reading.signal == signal
    assert any(other in text for text in reading.others)
    assert reading.clarity >= Clarity.VAGUE


def test_a_planning_program_s_powers_are_on_the_base_of_the_grid():
    assert read_name("POWR 101[HYDRO 13.800]1", None).system_base
    assert not read_name("EFD 101[HYDRO 13.800]1", None).system_base
