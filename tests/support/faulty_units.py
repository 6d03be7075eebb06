"""Units whose parameters are known, what is recorded of them, and other models of their kind."""

from collections.abc import Mapping
from dataclasses import dataclass

PLANT = {
    "type": "open-circuit",
    "machine": "GENROU",
    "parameters": {
        "Tpd0": 6.0, "Tppd0": 0.035, "Xd": 1.8, "Xpd": 0.3, "Xppd": 0.25, "Xl": 0.2, "S10": 0.12,
        "S12": 0.4,
    },
}  # fmt: skip
AC1A = {
    "TR": 0.0, "TB": 0.0, "TC": 0.0, "KE": 1.0, "VAMAX": 14.5, "VAMIN": -14.5, "VRMAX": 14.5,
    "VRMIN": -14.5, "E1": 4.18, "SE1": 0.10, "E2": 3.14, "SE2": 0.03, "KC": 0.486, "KD": 0.4039,
}  # fmt: skip
AC8B = {
    "KA": 0.5564, "TA": 0.0, "TR": 0.0, "KE": 1.0, "VPIDMAX": 999.0, "VPIDMIN": -999.0,
    "VRMAX": 35.0, "VRMIN": -35.0, "VFEMAX": 999.0, "VEMIN": 0.0, "E1": 6.5, "SE1": 0.3, "E2": 9.0,
    "SE2": 3.0, "KC": 0.3, "KD": 0.5,
}  # fmt: skip
ST1A = {
    "TR": 0.01, "VIMAX": 99.0, "VIMIN": -99.0, "TC1": 0.0, "TB1": 0.0, "TA": 0.02, "VAMAX": 14.5,
    "VAMIN": -14.5, "VRMAX": 7.8, "VRMIN": -6.7, "KC": 0.08, "TF": 1.0, "KLR": 4.54, "ILR": 4.4,
    "KF": 0.0,
}  # fmt: skip


@dataclass(frozen=True)
class Unit:
    """A unit whose parameters are known, what is recorded of it, and other models of its kind.

    ``noise`` is that of each recorded signal, of vt's; ``ceiling`` limits its exciter from above,
    where ``ceilings`` (pu) cut the response to a step of 5 %.
    """

    model: str
    fixed: Mapping[str, float]
    free: Mapping[str, float]
    noise: Mapping[str, float]
    rivals: tuple[str, ...]
    ceiling: str
    ceilings: tuple[float, float]


BRUSHLESS = {"KA": 364.15, "KF": 0.0413, "TE": 1.6724, "TF": 1.458, "TA": 0.0542}
PID = {"KPR": 78.84, "KIR": 6.0, "KDR": 30.0, "TDR": 0.1638, "TE": 1.4044}
STATIC = {"KA": 190.0, "TB": 8.0, "TC": 1.0}
UNITS = {
    "AC1A": Unit("AC1A", AC1A, BRUSHLESS, {"vt": 1.0}, ("AC8B", "SEXS"), "VRMAX", (4.0, 8.0)),
    "AC8B": Unit("AC8B", AC8B, PID, {"vt": 1.0}, ("AC1A", "SEXS"), "VRMAX", (3.0, 6.0)),
    "ST1A": Unit(
        "ST1A", ST1A, STATIC, {"vt": 1.0, "efd": 50.0}, ("SEXS", "AC1A"), "VRMAX", (1.6, 2.2)
    ),
    "AC1A, ifd": Unit(
        "AC1A", AC1A, BRUSHLESS, {"vt": 1.0, "ifd": 10.0}, ("AC8B", "SEXS"), "VRMAX", (4.0, 8.0)
    ),
}  # fmt: skip
OF_MODEL = {
    "AC1A": (AC1A, BRUSHLESS),
    "AC8B": (AC8B, PID),
    "SEXS": ({"EMIN": -10.0, "EMAX": 10.0}, {"TATB": 0.1, "TB": 10.0, "K": 200.0, "TE": 0.05}),
}
