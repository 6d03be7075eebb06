"""The models of a fit with their parameters, what they were judged by, and what must be known."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from math import exp, inf, log

from exfit.case.parts import MEANINGS
from exfit.errors import ExfitError
from exfit.features.drawings.diagram import block_diagram
from exfit.features.drawings.letters import diagram_and_remarks
from exfit.features.planner.export import export, place_of
from exfit.features.report.form import command_of
from exfit.features.report.words import DASH, has_no_equations, number
from exfit.output.blocks import (
    Block,
    Cell,
    Diagram,
    Heading,
    Mark,
    Note,
    Table,
    TableColumn,
    Verbatim,
    columns,
    interval,
    remarks,
    row,
)
from exfit.output.validations import criteria_table
from exfit.results.criteria import judged_by_criteria
from exfit.results.description import SheetRow
from exfit.results.model import FitResult, FittedParameter
from exfit.results.validation_result import Reported
from exfit.util.vocabulary import UNSTATED

Row = tuple[Cell, ...]

# formula of a curve, and what of a point lies on the exponential
EXPONENTIAL: Mapping[str, tuple[str, Callable[[float, float], float]]] = {
    "exponential": ("VX = AEX exp(BEX E)", lambda e, se: e * se),
    "exponential-se": ("VX = E SE, SE = AEX exp(BEX E),", lambda _, se: se),
}
FITTED_NUMBERS = ("start", "fitted", "95 % interval", "standard error", "bounds")
NO_DRAWING = "The model is that of the program: exfit has no drawing of it."
BY_TWIN = (
    "gave the derivatives of the search and, corrected by its difference to the program at the "
    "result, intervals and their profiles, fits to windows, poles and limits."
)
BY_QUOTIENTS = (
    "derivatives are difference quotients of its runs, intervals those of linear theory by them, "
    "and there is no view of poles and limits."
)


def model(result: Reported) -> Iterator[Block]:
    """Yield what simulated, the models that were fitted with their drawings, the saturation."""
    yield from map(Note, other_program(result))
    for part in result.parts:
        if part.kind.endswith("network"):
            continue
        if not part.drawing:
            yield Note(f"{part.heading}{f': {part.title}' if part.title else ''}.")
            continue
        _, said = diagram_and_remarks(part.drawing)
        diagram = block_diagram(part.drawing, part.name, part.title)
        yield Heading(part.name, 2)
        yield Note(part.title)
        if diagram:
            yield Diagram(f"Block diagram of {part.name}", diagram)
        yield from map(Note, said)
        if part.doubt:
            yield Note(f"Note: {part.name} {part.doubt}.")
    if curve := saturation(result):
        yield Note(curve)
    if has_no_equations(result):
        yield Note(NO_DRAWING, mark="faint")
    elif all(part.kind != "exciter" for part in result.parts):
        yield Note("The case has a machine without an exciter.", mark="faint")


def saturation(result: Reported) -> str:
    """Return the saturation curve of the exciter in words: its points, its form, its constants."""
    values = result.values_of("")
    if not {"E1", "SE1", "E2", "SE2"} <= values.keys():
        return ""
    e1, se1, e2, se2 = (values[name] for name in ("E1", "SE1", "E2", "SE2"))
    if se1 == se2 == 0.0:
        return "The exciter has no saturation: SE1 and SE2 are 0."
    points = f"SE({e1:g}) = {se1:.4g}, SE({e2:g}) = {se2:.4g}"
    if min(se1, se2) <= 0.0 or result.saturation not in EXPONENTIAL:
        return f"Saturation of the exciter: {points}, {result.saturation} between them."
    formula, height = EXPONENTIAL[result.saturation]
    heights = height(e1, se1), height(e2, se2)
    exponent = log(heights[1] / heights[0]) / (e2 - e1)
    factor = heights[0] * exp(-exponent * e1)
    constants = f"AEX = {factor:.4g}, BEX = {exponent:.4g} 1/pu"
    return f"Saturation of the exciter: {points}, which is {formula} with {constants}."


def other_program(result: Reported) -> Iterator[str]:
    """Yield sentences on the program that simulated the records; none where exfit did."""
    program = result.other_program
    if program is None:
        return
    failed = f", of which {program.failed} failed" if program.failed else ""
    files = [
        f" SHA-256 of {result.files.get(label, label)}: `{sha256}`."
        for label, sha256 in result.inputs.items()
        if label.startswith("program")
    ]
    yield (
        f"The simulated responses are runs of the planner's simulator, `{program.command}`, "
        f"not of exfit: {program.runs} runs{failed}.{''.join(files)}"
    )
    fitted = isinstance(result, FitResult)
    if program.twin is None:
        without = BY_QUOTIENTS if fitted else "there is no view of poles and limits."
        yield f"No plant of exfit stands beside it: {without}"
    else:
        gave = BY_TWIN if fitted else "gave poles and limits."
        listed = (
            f"{record}: {', '.join(f'{signal} {size:.2g} pu' for signal, size in own.items())}"
            for record, own in program.differences.items()
        )
        yield (
            f"The plant {program.twin} of exfit, its twin, {gave} Program and twin differ at these "
            f"values by at most: {'; '.join(listed)}."
        )
    yield f"`{command_of(result)}` repeats this, with the same program."


def parameters(result: Reported) -> Iterator[Block]:
    """Yield all parameters of a fit, or of values that were compared."""
    fitted = ""
    if isinstance(result, FitResult):
        fitted = ", not fitted"
        heads = columns("parameter", *FITTED_NUMBERS, "unit", "source", numbers=FITTED_NUMBERS)
        rows = tuple(_fitted(name, each) for name, each in result.parameters.items())
        yield Table(heads, rows, "Fitted parameters")
        yield from _given_values(result)
    for title, others in _not_fitted(result):
        if of_part := tuple(others):
            heads = columns("parameter", "value", "unit", "source", numbers=("value",))
            heads = (*heads, TableColumn("meaning", folds=True))
            yield Table(heads, of_part, f"{title}{fitted}")


def _fitted(name: str, parameter: FittedParameter) -> Row:
    """Write a fitted parameter with its interval, or why there is none."""
    mark: Mark = "" if parameter.determined else "doubt"
    within = Cell(parameter.why or "none", "doubt")
    if parameter.interval is not None:
        limits = interval(parameter.interval, parameter.rounded).replace("...", "…")
        notes = filter(None, (parameter.interval_note, parameter.why))
        within = Cell("\n".join([limits, *notes]))
    bounds = (number(parameter.min), number(parameter.max))
    said = (
        "fitted",
        f"on its {parameter.at_bound}" if parameter.at_bound else "",
        "" if parameter.physical else "not physical",
        "of the record" if parameter.of_record else "",
    )
    return (
        Cell(f"{name}\n{parameter.meaning}" if parameter.meaning else name, mark),
        Cell(number(parameter.start)),
        Cell(parameter.rounded(parameter.value), "strong"),
        within,
        Cell(number(parameter.linear_error, 2)),
        Cell("none" if bounds == (DASH, DASH) else " … ".join(bounds)),
        Cell(parameter.unit),
        Cell(", ".join(filter(None, said))),
    )


def _given_values(result: FitResult) -> Iterator[Block]:
    """Yield the given values whose standard errors the intervals include, and what each moves."""
    given = {} if result.knowledge is None else result.knowledge.given_errors
    own = {name: each for name, each in result.parameters.items() if each.std_error}
    rows = []
    for name, error in given.items():
        shifts = error.shifts
        shares = {n: abs(shifts[n]) / (own[n].std_error or inf) for n in own if n in shifts}
        most = max(shares, key=lambda n: shares[n], default=None)
        if most is None:
            continue
        moved = f"{most} by {number(shifts[most], 2)} {own[most].unit}".rstrip()
        source = result.sources.get(name, "the record at rest")
        mark: Mark = "doubt" if source in UNSTATED else ""
        rows.append((Cell(name, mark), Cell(number(error.std_error, 2)), Cell(source), Cell(moved)))
    if rows:
        heads = columns(
            "given value", "standard error", "source", "moves most", numbers=("standard error",)
        )
        yield Table(heads, tuple(rows), "Given values whose errors the intervals include")


def _not_fitted(result: Reported) -> Iterator[tuple[str, Iterable[Row]]]:
    """Yield rows of the values that were not fitted: of the parts, of ties, of networks."""

    def given(name: str, symbol: str, value: float, sheet: SheetRow) -> Row:
        source = result.source_of(name)
        if isinstance(result, FitResult) and name in result.refined:
            source = f"{source}: {number(result.refined[name], 6)}, moved within its error"
        return row(symbol, number(value, 6), sheet.unit, source, sheet.meaning)

    for part in result.parts:
        values = result.values_of(part.prefix)
        yield (
            part.heading,
            [
                given(part.prefix + symbol, symbol, values[symbol], sheet)
                for symbol, sheet in part.sheet.items()
                if symbol in values and part.prefix + symbol not in result.parameters
            ],
        )
    own = {symbol for part in result.parts if not part.prefix for symbol in part.sheet}
    yield (
        "Helpers",
        [
            given(name, name, value, SheetRow(meaning=MEANINGS.get(name, "used by ties")))
            for name, value in result.fixed.items()
            if name not in own
        ],
    )
    for test in result.tests:
        yield (
            f"Network of {test.name}",
            [
                row(symbol, number(each.value, 6), each.unit, each.source, each.meaning)
                for symbol, each in test.network.items()
                if f"network.{symbol}" not in result.parameters
            ],
        )


def criteria(result: Reported) -> Iterator[Block]:
    """Yield the criteria of a fit with their results, and where their limits are from.

    Criteria that are met beside a verdict that they are no match for are no approval.
    """
    judged = judged_by_criteria(result)
    passed: Mark = "ok" if result.holds else "strong"
    words: Mapping[bool | None, tuple[str, Mark]] = {
        True: ("Pass:", passed),
        False: ("Fail:", "bad"),
        None: ("Open:", "strong"),
    }
    word, mark = words[judged.passed]
    yield Note(f"{judged.sentence}.", "verdict", word, mark)
    if judged.criteria:
        yield criteria_table(result)
    yield Note(f"{result.criteria.source.removesuffix('.')}.", label="Source:")


def findings(result: Reported) -> Iterator[Block]:
    """Yield the unresolved findings, and the notes on a fit or a validation."""
    knowledge = result.knowledge if isinstance(result, FitResult) else None
    unresolved = () if knowledge is None else knowledge.sentences
    for title, texts in (("Unresolved", unresolved), ("Notes", result.notes)):
        if texts:
            yield Heading(title, 2)
            yield from remarks("", texts, "", "warning")
    if not unresolved and not result.notes:
        yield Note("None.")


def dynamics(result: FitResult) -> Iterator[Block]:
    """Yield the PSS/E records at the place of the unit, or why there are none.

    The place is bus 1 and machine 1 where the case does not say it.
    """
    try:
        bus, machine_id = place_of(result)
        records = export(result, bus, machine_id)
    except ExfitError as fault:
        yield from remarks("", [str(fault)], "", "warning")
        yield Note("There is no record.", mark="faint")
        return
    found = result.as_found is not None and result.as_found.bus is not None
    are = "are those of the planner's file" if found else "stand for those of the unit"
    yield Note(
        f"Bus {bus} and machine {machine_id} {are}; `exfit export --bus --id` writes others."
    )
    yield from remarks("", records.warnings, "", "warning")
    yield Verbatim(records.text)
