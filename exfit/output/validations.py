"""Records beside simulations, as blocks."""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from math import isnan

from exfit.dsp.features import LABELS
from exfit.output.blocks import (
    Block,
    Cell,
    Mark,
    Note,
    Table,
    TableColumn,
    columns,
    notes,
    number,
    paragraph,
    remarks,
    row,
)
from exfit.results.comparisons import Comparison, Excursion, JudgedCriterion, StepFeatures
from exfit.results.criteria import judged_by_criteria
from exfit.results.validation_result import Reported, ValidationResult
from exfit.util.text import percentage

MARKS: Mapping[str, Mark] = {"met": "ok", "not met": "bad"}  # of criteria
FEATURE_COLUMNS = ("measured", "+-", "simulated")  # +-: half of the 95 % interval


def comparisons(all_of_them: Sequence[Comparison]) -> Iterator[Block]:
    """Yield the match of each record, side by side, and its step measured beside simulated."""
    if answered := [match for match in all_of_them if match.overlays]:
        yield _errors(answered)
    yield from played(all_of_them)
    stepped = {
        match.name: match.features
        for match in all_of_them
        if match.features.measured or match.features.simulated
    }
    if not stepped:
        return
    beside = (
        TableColumn(kind, number=True, group=name, folds=True)
        for name in stepped
        for kind in FEATURE_COLUMNS
    )
    rows = (
        row(label, unit, *(cell for each in stepped.values() for cell in each.cells(key)))
        for label, key, unit in LABELS
    )
    yield Table((*columns("step of vt", "unit"), *beside), tuple(rows), leading=2)
    yield from remarks("-", _without(stepped), "faint")


def _without(stepped: Mapping[str, StepFeatures]) -> Iterator[str]:
    """Name the lines that features are read without, and the features that are missing."""
    for name, features in stepped.items():
        if features.measured is not None and features.measured.removed:
            yield f"{name}: measured without {features.measured.removed}"
    for name, features in stepped.items():
        why = {} if features.measured is None else features.measured.why
        yield from (f"{name}: {label}: {why[key]}" for label, key, _ in LABELS if key in why)


def played(all_of_them: Sequence[Comparison]) -> Iterator[Block]:
    """Yield the signals that were played in, and the errors of those that are compared."""
    events = [match for match in all_of_them if match.played is not None]
    rows: list[tuple[Cell, ...]] = []
    for match in events:
        driving = {} if match.played is None else match.played.driving
        texts = (
            name if signal.excursion is None else f"{name} ({signal.excursion.text(signal.unit)})"
            for name, signal in driving.items()
        )
        yield from remarks(f"{match.name}: played in:", [", ".join(texts)], "")
        for signal, error in ({} if match.played is None else match.played.errors).items():
            numbers = ((error.largest, "+.2e"), (error.largest_at, ".4g"), (error.at_rest, "+.1e"))
            cells = ("-" if isnan(own) else format(own, form) for own, form in numbers)
            peaks = (_peak(error.measured), _peak(error.simulated))
            rmse = f"{match.channels[signal].rmse:.2e}"
            rows.append(row(match.name, signal, rmse, *cells, *peaks))
    if events:
        yield Table(
            (
                *columns("record", "signal"),
                TableColumn("rms", number=True),
                TableColumn("largest", number=True),
                TableColumn("at", number=True, expendable=2),
                TableColumn("at rest", number=True, expendable=1),
                TableColumn("peak rec.", number=True),
                TableColumn("peak sim.", number=True),
            ),
            tuple(rows),
            "simulated minus recorded, pu, and the peaks of both from rest:",
        )


def rejections(all_of_them: Iterable[Comparison]) -> Iterator[Note]:
    """Yield the reason for each record that is not accepted."""
    return remarks("not accepted:", (match.reason for match in all_of_them), "bad")


def in_a_line(match: Comparison) -> Note:
    """Say in a line how well a record that was not fitted is met."""
    if match.reason:
        return Note(match.reason, "verdict", "not accepted:", "bad")
    figures = f"rmse {match.rmse:.3e} pu, fit {percentage(match.fit_percent)} %"
    return Note(f"{figures}, accepted", "verdict", f"validation {match.name}:", "ok")


def criteria_table(result: Reported) -> Table:
    """Make the table of a result's criteria: on each record difference, limit and outcome."""
    unseen = {match.name for match in result.validation}
    return table_of_criteria(judged_by_criteria(result).criteria, unseen)


def table_of_criteria(
    criteria: Iterable[JudgedCriterion],
    unseen: Container[str] | None,
    title: str = "Criteria: simulated minus recorded",
) -> Table:
    """Make the table of criteria, with the use of each record if those ``unseen`` are known."""
    rows = []
    for each in criteria:
        use = []
        if unseen is not None:
            use = ["to validate" if each.record in unseen else "to fit" if each.record else ""]
        numbers = (number(each.difference, 2), number(each.limit, 3))
        outcome = Cell(
            f"{each.outcome}: {each.why}" if each.why else each.outcome, MARKS.get(each.outcome, "")
        )
        rows.append((*row(each.record or "-", *use, each.label, *numbers, each.unit), outcome))
    heads = (
        TableColumn("record", folds=True),
        *([] if unseen is None else [TableColumn("used", expendable=1)]),
        TableColumn("criterion", folds=True),
        *columns("difference", "limit", "unit", numbers=("difference", "limit")),
        TableColumn("result", folds=True),
    )
    return Table(heads, tuple(rows), title)


def validation(result: ValidationResult) -> Iterator[Block]:
    """Yield the rejections, the fitted records, the criteria, and the match of each record."""
    all_of_them = result.matches
    yield from rejections(all_of_them)
    if result.criteria.given:
        yield criteria_table(result)
    for role, chosen in (("fitted, not judged:", False), ("validated:", True)):
        records = [f"{m.name} ({m.record})" for m in all_of_them if m.validation is chosen]
        if records:
            yield paragraph(f"{role} {', '.join(records)}")
    for match in all_of_them:
        yield from remarks("step:", (step.text for step in match.steps))
        yield from notes(match.notes)
    yield from comparisons(all_of_them)


def _errors(matches: Sequence[Comparison]) -> Table:
    signals = list(dict.fromkeys(signal for match in matches for signal in match.channels))
    of_events = f" {matches[0].judged_by}" if matches[0].is_event else ""
    rows = [row("cost", "pu²", *(f"{match.cost:.4e}" for match in matches))]
    for signal in signals:
        errors = (match.channels.get(signal) for match in matches)
        cells = ("-" if error is None else f"{error.rmse:.3e}" for error in errors)
        rows.append(row("rmse" if len(signals) == 1 else f"rmse {signal}", "pu", *cells))
    largest = (f"{match.max_error:.3e}" for match in matches)
    rows.append(row(f"maximum error{of_events}", "pu", *largest))
    percentages = (percentage(match.fit_percent) for match in matches)
    rows.append(row(f"fit{of_events}", "%", *percentages))
    names = (TableColumn(match.name, number=True, folds=True) for match in matches)
    return Table((*columns("", "unit"), *names), tuple(rows), leading=2)


def _peak(excursion: Excursion | None) -> str:
    return "-" if excursion is None else f"{excursion.value:+.4g}"
