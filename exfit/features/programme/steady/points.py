"""The points of a test at rest, given in the case itself or in a file."""

from pathlib import Path

from exfit.features.programme.case.schema_at_rest import (
    CURVE_SIGNALS,
    POINT_SIGNALS,
    SaturationTest,
    SteadyTest,
)
from exfit.records.points import Points, given_points, read_points


def points_of(test: SaturationTest | SteadyTest, folder: Path) -> Points:
    """Return the points of a test, by signal; its file lies in a folder. Raises RecordError."""
    if test.file is None:
        signals = CURVE_SIGNALS if isinstance(test, SaturationTest) else POINT_SIGNALS
        return given_points(test.points or (), signals, Path(test.name))
    names = {signal: column.column or signal for signal, column in test.columns.items()}
    units = {names[signal]: column.unit for signal, column in test.columns.items()}
    read = read_points(folder / test.file, units, test.sheet)
    return Points(
        {signal: read.columns[name] for signal, name in names.items()},
        {signal: read.units[name] for signal, name in names.items() if name in read.units},
        read.source,
        read.sha256,
    )
