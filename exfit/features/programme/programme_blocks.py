"""The outcomes of the tests of a programme, as blocks."""

from collections.abc import Iterator, Sequence
from math import inf, isfinite

from exfit.features.programme.result import (
    EnteredValue,
    FinishedTest,
    GovernorCurve,
    MeasuredValue,
    ProgrammeResult,
    SaturationResult,
    VCurve,
)
from exfit.features.programme.run import CheckedStep
from exfit.output import fits, models
from exfit.output.blocks import (
    Block,
    Heading,
    Table,
    TableColumn,
    columns,
    interval,
    notes,
    number,
    paragraph,
    remarks,
    row,
    unresolved,
)
from exfit.results.model import FitResult
from exfit.signals import TERMINALS
from exfit.workflows.model_check import Check

COMPARED = ("measured", "simulated", "differs")  # columns of a field signal


def programme(result: ProgrammeResult) -> Iterator[Block]:
    """Yield the results of the tests at rest, that of the bump tests together, and the faults."""
    for test in result.tests:
        if not isinstance(test.result, FitResult):
            yield Heading(f"{test.name} ({test.kind})")
            yield from _at_rest(test)
    if result.fit is not None:
        yield from fits.whole(result.fit)
    if result.values:
        yield values_table(result.values)
    for test in result.tests:
        if not test.holds and isinstance(test.result, FitResult):
            yield from remarks(f"{test.name}: {test.verdict}:", [test.reason], "bad")
    for name, fault in result.failed.items():
        yield from remarks(f"{name}: failed:", fault.splitlines(), "bad")
    yield from remarks("warning:", result.warnings)
    if result.not_run:
        names = ", ".join(result.not_run)
        yield paragraph(f"not run, interrupted: {names}; run again to go on", "bad")


def checked_step(checked: CheckedStep) -> Iterator[Block]:
    """Yield a test of a programme that is checked: its result at rest, or the check of its fit."""
    step = checked.step
    tests = "" if step.tests in ((), (step.name,)) else f" of {', '.join(step.tests)}"
    yield Heading(f"{step.name}{tests} ({step.kind})")
    if isinstance(checked.outcome, Check):
        yield from models.check(checked.outcome)
    elif checked.outcome is None:
        yield paragraph(checked.fault, "bad")
    else:
        yield from _at_rest(checked.outcome)


def _at_rest(test: FinishedTest) -> Iterator[Block]:
    if isinstance(test.result, SaturationResult):
        mark = fits.MARKS.get(test.verdict, "bad") if test.holds else "bad"
        yield paragraph(f"verdict: {test.verdict}: {test.reason}", mark)
        yield from saturation(test.result)
    elif isinstance(test.result, VCurve):
        yield from v_curve(test.result)
    elif isinstance(test.result, GovernorCurve):
        yield from governor(test.result)


def values_table(values: Sequence[EnteredValue]) -> Table:
    """Make the table of values that tests gave, each with the value in the file."""
    rows = []
    for value in values:
        known = value.given is not None
        given = f"{value.given:g}, {value.given_source}" if known else value.given_source or "none"
        rows.append(
            row(
                value.name,
                value.unit,
                value.rounded(value.value),
                interval(value.interval, value.rounded),
                value.source,
                value.test,
                given,
                "test" if value.entered else "file",
                mark="doubt" if value.excluded else "",
            )
        )
    heads = (
        TableColumn("value"),
        TableColumn("unit", expendable=1),
        TableColumn("measured", number=True),
        *columns("95 % interval", "source"),
        TableColumn("test", expendable=2),
        TableColumn("in the file"),
        TableColumn("used"),
    )
    return Table(heads, tuple(rows), "values passed on to later tests")


def saturation(result: SaturationResult) -> Iterator[Block]:
    """Yield the numbers of the curve that is used, those of each form, and what limits them."""
    no_interval = result.verdict.in_place_of_interval
    curve, unit = result.curve, result.unit
    field = "exciter field current" if result.exciter else "base of ifd"
    residual = result.residual
    given: tuple[tuple[str, MeasuredValue | None, str], ...] = (
        (f"{field}, 1 pu on the air-gap line", curve.ifd_base, unit),
        ("base of efd", result.efd_base, result.efd_unit),
        ("resistance of the field", result.resistance, f"{result.efd_unit}/{unit}"),
        ("S(1.0)", curve.S10, "pu"),
        ("S(1.2)", curve.S12, "pu"),
        ("offset of the field current", curve.offset, "pu"),
        ("hysteresis, rising less falling", curve.hysteresis, "pu"),
        (
            "residual voltage",
            None if residual is None else MeasuredValue(residual, None, (None, None)),
            "pu",
        ),
    )
    rows, reasons = [], []
    for name, value, of_unit in given:
        if value is not None:
            limits = no_interval or interval(value.interval, value.rounded)
            rows.append(row(name, value.rounded(value.value), limits, of_unit))
            reasons += [f"{name}: {value.why}"] if value.why and not no_interval else []
    heads = ("value", "95 %")
    title = f"saturation curve, form {result.form}"
    yield Table(columns("", *heads, "unit", numbers=heads), tuple(rows), title)
    yield from remarks("-", reasons)
    rows = []
    for each in result.curves:
        cells = (value.rounded(value.value) for value in (each.ifd_base, each.S10, each.S12))
        words = ["used"] * (each.form == result.form) + ["rejected"] * each.refuted
        rows.append(row(each.form, *cells, f"{each.rms:.2g}", ", ".join(words)))
    forms = (f"base ({unit})", "S(1.0)", "S(1.2)", "rms (pu)")
    yield Table(columns("form", *forms, "", numbers=forms), tuple(rows), "forms of the curve")
    yield from notes(result.notes)


def v_curve(result: VCurve) -> Iterator[Block]:
    """Yield the verdict, each point with its field by record and model, and what was fitted."""
    yield paragraph(f"verdict: {result.verdict.sentence}")
    for signal, reading in result.readings.items():
        fitted = ", fitted" if reading.base_fitted else ""
        yield paragraph(
            f"{signal}: residuals {reading.rms:.2g} pu rms, limit {reading.limit:.2g} pu; 1 pu is "
            f"{reading.base:.5g} {reading.unit}{fitted}"
        )
    yield points_table(result)
    if result.parameters:
        yield parameters_table(result)
    yield from unresolved(result.undetermined)
    yield from notes((*(cause.sentence for cause in result.verdict.causes), *result.notes))


def governor(result: GovernorCurve) -> Iterator[Block]:
    """Yield the verdict on a test of a governor, and what was fitted."""
    yield paragraph(f"verdict: {result.verdict.sentence}")
    if result.parameters:
        yield parameters_table(
            result, f"{result.governor}, {result.reading.signal} over {result.over}"
        )
    yield from unresolved(result.undetermined)
    yield from notes(result.notes)


def points_table(result: VCurve) -> Table:
    """Make the table of points: power, voltage, and each field signal, measured and simulated."""
    compared = [f"{s} {word}" for s in result.readings for word in COMPARED]
    heads = ("point", *TERMINALS, *compared)
    rows = []
    for k in range(len(result.p)):
        cells = [f"{value:.3f}" for value in (result.p[k], result.q[k], result.vt[k])]
        for reading in result.readings.values():
            cells += [f"{reading.measured[k]:.4f}", f"{reading.simulated[k]:.4f}"]
            measured = float(reading.measured[k])
            share = float(reading.residuals[k]) / measured if measured else inf
            cells.append(f"{100.0 * share:+.2f} %" if isfinite(share) else "-")
        worst = any(reading.worst == k for reading in result.readings.values())
        rows.append(row(str(k + 1), *cells, "largest" if worst else ""))
    title = f"points on load, {result.machine}"
    return Table(columns(*heads, "", numbers=heads), tuple(rows), title)


def parameters_table(
    result: VCurve | GovernorCurve, title: str = "fitted to the points on load"
) -> Table:
    """Make the table of what was fitted, with its interval."""
    marks = {name: ", ".join(fits.remarks_on(each)) for name, each in result.parameters.items()}
    remark = any(marks.values())
    no_interval = result.verdict.in_place_of_interval
    rows = [
        row(
            name,
            number(parameter.start),
            parameter.rounded(parameter.value),
            no_interval or interval(parameter.interval, parameter.rounded),
            parameter.unit,
            parameter.meaning,
            *([marks[name]] if remark else []),
            mark="" if parameter.determined and parameter.physical else "doubt",
        )
        for name, parameter in result.parameters.items()
    ]
    heads = ("start", "fitted", "95 % interval")
    meaning = TableColumn("meaning", folds=True, expendable=1)
    last = columns("") if remark else ()
    heading = (*columns("parameter", *heads, "unit", numbers=heads), meaning, *last)
    return Table(heading, tuple(rows), title)
