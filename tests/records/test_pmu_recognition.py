"""Columns of phasor measurement units, as programs that export them call them."""

import numpy as np
import pytest
from pmu_records import degrees, phasors_of, smooth_course

from exfit.records.pmu_recognition import pmu_content
from exfit.records.units import unit_in

COURSE = smooth_course(slip=0.3)
V, CURRENT = phasors_of(COURSE)
F = COURSE.frequency
MAGNITUDES = (np.abs(V), degrees(V), np.abs(CURRENT), degrees(CURRENT))
# names of voltage, its angle, current, its angle; frequency, rate of change, flags
NAMED = {
    "openPDC": ("U1-PM1", "U1-PA1", "U1-PM2", "U1-PA2", "U1-FQ", "U1-DF", "U1-SF"),
    "words": (
        "GEN1.V1 Magnitude (kV)", "GEN1.V1 Angle (deg)", "GEN1.I1 Magnitude (A)",
        "GEN1.I1 Angle (deg)", "GEN1.Frequency (Hz)", "GEN1.df/dt (Hz/s)", "GEN1.Status",
    ),
    "letters": ("VP_M", "VP_A", "IP_M", "IP_A", "F", "DF", "STAT"),
    "schema": ("v_BUS_m", "v_BUS_a", "i_GEN_m", "i_GEN_a", "f", "dfdt", "status"),
    "historian": (
        "UNIT1.V.MAG", "UNIT1.V.ANG", "UNIT1.I.MAG", "UNIT1.I.ANG", "UNIT1.FREQ", "UNIT1.ROCOF",
        "UNIT1.QUALITY",
    ),
}  # fmt: skip


def content(columns, units=None):
    given = units or {name: unit for name in columns if (unit := unit_in(name))}
    return pmu_content(
        {name: np.asarray(y, float) for name, y in columns.items()}, given, [*columns]
    )


@pytest.mark.parametrize("program", NAMED)
def test_the_phasors_of_a_unit_are_known_by_the_names_of_a_program(program):
    names = NAMED[program]
    samples = (*MAGNITUDES, F, np.zeros_like(F), np.zeros_like(F))
    pmu = content(dict(zip(names, samples, strict=True)))
    assert (pmu.voltage.magnitudes, pmu.voltage.angles) == ((names[0],), (names[1],))
    assert (pmu.current.magnitudes, pmu.current.angles) == ((names[2],), (names[3],))
    assert (pmu.frequency, pmu.rate, pmu.status) == names[4:]
    assert pmu.voltage.angle_unit == "deg"
    assert pmu.voltage.wraps > 0


def test_three_phases_are_one_phasor():
    columns = {
        f"{quantity}{phase}_{part}": samples
        for quantity in "VI"
        for phase in "ABC"
        for part, samples in (("MAG", np.abs(V)), ("ANG", np.angle(V)))
    }
    pmu = content(columns)
    assert pmu.voltage.magnitudes == ("VA_MAG", "VB_MAG", "VC_MAG")
    assert pmu.current.angles == ("IA_ANG", "IB_ANG", "IC_ANG")
    assert pmu.voltage.angle_unit == "rad"


def test_numbered_phasors_are_no_phases():
    pmu = content(
        {
            **{f"U-PM{k} (V)": np.abs(V) for k in (1, 2, 3)},
            **{f"U-PA{k} (deg)": degrees(V) for k in (1, 2, 3)},
        }
    )
    assert pmu.voltage.magnitudes == ("U-PM1 (V)",)
    assert pmu.voltage.rivals == ("U-PM2 (V)", "U-PM3 (V)")


def test_an_angle_by_its_unit_belongs_to_the_column_before_it():
    names = ("G V", "G VA", "G I", "G IA")
    units = dict(zip(names, ("KV", "DEG", "A", "DEG"), strict=True))
    pmu = content(dict(zip(names, MAGNITUDES, strict=True)), units)
    assert pmu.voltage.angles == ("G VA",)
    assert pmu.current.angles == ("G IA",)


def test_the_positive_sequence_comes_before_the_phases():
    columns = {"VA_MAG": V.real, "VA_ANG": degrees(V), "V1_MAG": np.abs(V), "V1_ANG": degrees(V)}
    assert content(columns).voltage.magnitudes == ("V1_MAG",)


def test_a_bump_test_has_no_phasors():
    assert (
        content({"Ut [kV]": np.abs(V), "Uf [V]": F, "If [A]": np.abs(CURRENT), "P [MW]": F}) is None
    )
