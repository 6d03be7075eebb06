"""Rows of data sheets that exciters share by name: the unit, the range and the meaning of each."""

from exfit.models.sheet import (
    DEMAGNETISING,
    EXCITER_LAG,
    FEEDBACK,
    FREE,
    LAG_OF_KF,
    REGULATOR_LAG,
    Limits,
    Parameter,
    SearchRange,
    Sheet,
)

SHARED: tuple[tuple[str, str, Limits, str] | tuple[str, str, Limits, str, SearchRange], ...] = (
    ("TR", "s", (0.0, 1.0), "voltage transducer lag"),
    ("KA", "pu", (0.01, 100000.0), "regulator gain", FREE),
    ("TA", "s", (0.0, 10.0), "regulator time constant", REGULATOR_LAG),
    ("TB", "s", (0.0, 100.0), "regulator lag"),
    ("TC", "s", (0.0, 100.0), "regulator lead"),
    ("VRMAX", "pu", (-9999.0, 9999.0), "regulator ceiling"),
    ("VRMIN", "pu", (-9999.0, 9999.0), "regulator floor"),
    ("KE", "pu", (0.0, 10.0), "exciter constant"),
    ("TE", "s", (0.01, 100.0), "exciter time constant", EXCITER_LAG),
    ("KF", "pu", (0.0, 10.0), "stabilising feedback gain", FEEDBACK),
    ("TF", "s", (0.01, 100.0), "stabilising feedback time constant", LAG_OF_KF),
    ("E1", "pu", (0.0, 100.0), "first voltage of the saturation curve"),
    ("SE1", "pu", (0.0, 100.0), "saturation at E1"),
    ("E2", "pu", (0.0, 100.0), "second voltage of the saturation curve"),
    ("SE2", "pu", (0.0, 100.0), "saturation at E2"),
    ("KC", "pu", (0.0, 100.0), "rectifier loading factor"),
    ("KD", "pu", (0.0, 100.0), "demagnetising factor", DEMAGNETISING),
    ("VEMIN", "pu", (-9999.0, 9999.0), "floor of the exciter voltage"),
    ("KP", "pu", (0.01, 100.0), "potential source gain"),
    ("KI", "pu", (0.0, 100.0), "current source gain, on load"),
    ("XL", "pu", (0.0, 10.0), "reactance of the potential source, on load"),
    ("THETAP", "deg", (-360.0, 360.0), "angle of the potential source, on load"),
    ("VBMAX", "pu", (0.01, 9999.0), "ceiling of the source voltage"),
    ("VFEMAX", "pu", (-9999.0, 9999.0), "ceiling of the exciter's field current"),
    ("VAMAX", "pu", (-9999.0, 9999.0), "regulator ceiling"),
    ("VAMIN", "pu", (-9999.0, 9999.0), "regulator floor"),
    ("KIR", "pu/s", (0.0, 100000.0), "integral gain", FREE),
    ("TDR", "s", (0.0, 10.0), "lag of the derivative", SearchRange(needs="KDR")),
    ("VIMAX", "pu", (-9999.0, 9999.0), "ceiling of the voltage error"),
    ("VIMIN", "pu", (-9999.0, 9999.0), "floor of the voltage error"),
    ("TF1", "s", (0.01, 100.0), "stabilising feedback time constant", LAG_OF_KF),
    ("KG", "pu", (0.0, 100.0), "feedback gain of the field voltage loop"),
)
ROWS = {
    symbol: Parameter(symbol, 0.0, unit, *limits, meaning, *search)
    for symbol, unit, limits, meaning, *search in SHARED
}


def shared(**typical: float) -> Sheet:
    """Take rows that exciters share, each with the typical value of this one, ``KA=46.0``.

    Raises KeyError for a symbol that no exciters share.
    """
    return tuple(ROWS[symbol]._replace(typical=value) for symbol, value in typical.items())
