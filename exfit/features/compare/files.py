"""The files of a comparison of responses: their samples, how they differ, and a figure."""

from functools import partial
from pathlib import Path

from exfit.features.compare.agreement import Agreement
from exfit.features.compare.curves import RECORD
from exfit.output.figure_files import FigureFiles, PlannedFigure, PlannedFigures
from exfit.results.tables import table
from exfit.util.files import write_together
from exfit.util.text import to_json

SAMPLES, AT_RECORD, AGREEMENT = FILES = ("compare.csv", "compare-record.csv", "compare.json")


def write_agreement(agreement: Agreement, folder: Path) -> FigureFiles:
    """Write how responses differ as JSON, and their samples on their clocks; return a figure."""
    record = record_table(agreement)
    numbers = {
        SAMPLES: agreement_table(agreement),
        **({} if record is None else {AT_RECORD: record}),
        AGREEMENT: to_json(agreement.as_json()),
    }
    write_together(folder, numbers, ["compare.png", AT_RECORD])
    return FigureFiles.beside(folder / AGREEMENT, partial(_figure, agreement))


def _figure(agreement: Agreement) -> PlannedFigures:
    from exfit.features.compare import figure

    shows = "the responses and their differences"
    return {"compare.png": PlannedFigure(shows, partial(figure.agreement, agreement))}


def agreement_table(agreement: Agreement) -> str:
    """Return the responses and their differences from the first on their common clock, as CSV."""
    columns = {"t": agreement.time}
    several = len({entry.second for entry in agreement.between}) > 1
    for signal in agreement.signals:
        own = [entry for entry in agreement.between if entry.signal == signal]
        if not agreement.between:
            columns[f"{signal}_A"] = agreement.curves[0].signals[signal]
        columns |= {f"{signal}_A": entry.values[0] for entry in own}
        columns |= {f"{signal}_{entry.second}": entry.values[1] for entry in own}
        for entry in own:
            name = f"{signal}_{entry.second}_difference" if several else f"{signal}_difference"
            columns[name] = entry.error
    return table([*columns], [*columns.values()])


def record_table(agreement: Agreement) -> str | None:
    """Return the record and the responses at its samples, as CSV; None without a record."""
    compared = [entry for entry in agreement.differences if entry.first == RECORD]
    if not compared:
        return None
    columns = {"t": compared[0].time}
    for signal in agreement.signals:
        own = [entry for entry in compared if entry.signal == signal]
        columns |= {f"{signal}_{RECORD}": entry.values[0] for entry in own}
        columns |= {f"{signal}_{entry.second}": entry.values[1] for entry in own}
    return table([*columns], [*columns.values()])
