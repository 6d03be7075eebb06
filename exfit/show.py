"""What the terminal shows: tables and lines, with rich."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress import TaskID
from rich.table import Table
from rich.text import Text

from exfit.case import Case
from exfit.check import STEPS, Check
from exfit.design import Design
from exfit.estimate import Progress
from exfit.features import Features
from exfit.inference import Uncertainty
from exfit.models.machines import Machine
from exfit.models.sheet import Model, Sheet
from exfit.profiles import Profiles
from exfit.result import Comparison, FitResult, Iteration, Minima

LINES = 12  # of the history that stay in sight
NARROW = 80  # columns where the width is unknown
GAP = 2  # between columns
MINIMA = 5  # columns of minima that fit beside each other
LABELLED = 25  # columns that the names and units of the features take

HISTORY = ("it", "phase", "f", "|g|", "step", "damping", "inner", "nfev")


def console() -> Console:
    """Return the terminal; a file or pipe is taken for a narrow one."""
    found = Console(highlight=False)
    return found if found.is_terminal else Console(highlight=False, width=NARROW)


def plain_table(*columns: str, numbers: Sequence[str] = ()) -> Table:
    """Return a table without frames; the named columns are numbers, aligned to the right."""
    table = Table(box=None, pad_edge=False, header_style="bold", show_edge=False)
    for column in columns[:-1]:
        table.add_column(column, justify="right" if column in numbers else "left", no_wrap=True)
    # the last column gives way where the terminal is narrow
    table.add_column(columns[-1], justify="right" if columns[-1] in numbers else "left")
    return table


def number(value: float | None, digits: int = 5) -> str:
    """Return a number in a few digits, a dash for None."""
    return "-" if value is None else f"{value:.{digits}g}"


class Watch:
    """Shows the iterations of a fit as they come: a live table, or lines in a file or pipe."""

    def __init__(self, console: Console, title: str) -> None:
        self.console, self.title = console, title
        self.lines: list[Iteration] = []
        self._live: Live | None = None

    @contextmanager
    def running(self) -> Iterator["Watch"]:
        """Show the table for as long as the fit runs."""
        if not self.console.is_terminal:
            yield self
            return
        with Live(console=self.console, auto_refresh=False) as self._live:
            yield self

    def __call__(self, line: Iteration) -> None:
        """Show one more iteration."""
        self.lines.append(line)
        if len(self.lines) == 1:
            self.console.print(self.title, markup=False)
        if self._live is None:
            heading = "{:>4} {:5} {:>10} {:>9} {:>9} {:>9} {:>5} {:>5}"
            if len(self.lines) == 1:
                self.console.print(heading.format(*HISTORY), soft_wrap=True)
            self.console.print(heading.format(*_cells(line)), soft_wrap=True)
        else:
            self._live.update(self._table(), refresh=True)

    def _table(self) -> RenderableType:
        table = plain_table(*HISTORY, numbers=[name for name in HISTORY if name != "phase"])
        for line in self.lines[-LINES:]:
            table.add_row(*_cells(line))
        hidden = len(self.lines) - LINES
        above = Text(f"({hidden} earlier iterations)", style="dim") if hidden > 0 else Text("")
        return Group(above, table)


def _cells(line: Iteration) -> tuple[str, ...]:
    return (
        str(line.number),
        line.phase,
        f"{line.cost:.4e}",
        f"{line.gradient_norm:.2e}",
        f"{line.step_norm:.2e}",
        f"{line.damping:.2e}" if line.damping == line.damping else "-",
        str(line.inner),
        str(line.nfev),
    )


def task(case: Case, strategy: str | None) -> str:
    """Return what a fit is about to do."""
    free = ", ".join(case.free())
    return f"{case.path.stem}: {case.subject}, {strategy or case.estimate.strategy}; free {free}"


def written(console: Console, folder: Path) -> None:
    """Say where the files are."""
    console.print(f"written to {folder}", soft_wrap=True, markup=False)


class Bar:
    """Shows how far many searches are, with the time left; in a file or pipe a line at the end."""

    def __init__(self, console: Console) -> None:
        self.console = console

    @contextmanager
    def running(self) -> Iterator[Callable[[Progress], None]]:
        """Return what is to be told the progress."""
        from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
        from rich.progress import Progress as Bars

        columns = (
            TextColumn("{task.description:<10}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            TextColumn("best cost {task.fields[best]:.4e}"),
        )
        with Bars(*columns, console=self.console) as bars:
            tasks: dict[str, TaskID] = {}

            def tell(now: Progress) -> None:
                if now.stage not in tasks:
                    tasks[now.stage] = bars.add_task(now.stage, total=now.total, best=now.best)
                bars.update(tasks[now.stage], completed=now.done, best=now.best)

            yield tell


def profiles(console: Console, found: Profiles) -> None:
    """Show the intervals that profiles give, beside those of the linear theory."""
    numbers = ("fitted", "min 95 %", "max 95 %", "linear min", "linear max")
    table = plain_table("parameter", *numbers, "unit", numbers=numbers)
    for one in found.profiles:
        linear = (None, None) if one.linear is None else one.linear
        cells = (number(value) for value in (one.value, one.low, one.high, *linear))
        table.add_row(one.name, *cells, one.unit, style="yellow" if any(one.ends) else "")
    console.print()
    console.print(table)
    console.print()
    open_ = [
        f"{one.name} is open {side}: {end}"
        for one in found.profiles
        for side, end in zip(("below", "above"), one.ends, strict=True)
        if end
    ]
    remarks(console, "open", open_)
    remarks(console, "note", found.notes)


def design(console: Console, found: Design) -> None:
    """Show what planned tests would tell of each parameter: standard errors in percent."""
    listed = ", ".join(f"{signal} {level:.2g}" for signal, level in found.noise.items())
    console.print(f"standard errors, with noise (pu): {listed}")
    console.print("of this test; of steps of 2, 5, 10 %; twice as long; with further signals")
    console.print()
    heads = ["this test", *(plan.label for plan in found.plans)]
    table = plain_table("parameter", *heads, numbers=heads)
    known = [found.own.confidence, *(plan.confidence for plan in found.plans)]
    for name in found.own.linear.names:
        table.add_row(name, *(_error(one.parameters[name]) for one in known))
    console.print(table)
    console.print()
    remarks(console, "open", found.sentences)


def _error(one: Uncertainty, of_record: bool = False) -> str:
    """Return a standard error as it is shown: in percent, but of a record in its own unit."""
    if one.relative_error is not None and not of_record:
        return percent(one.relative_error)
    return "-" if one.std_error is None else f"{one.std_error:.1e}"


def notes(console: Console, texts: Iterable[str]) -> None:
    """Show what must be known beside the numbers."""
    remarks(console, "note", texts)


def fit(console: Console, result: FitResult, folder: Path) -> None:
    """Show what a fit found, how well it is known, and where its files are."""
    console.print()
    console.print(fitted_table(result))
    console.print()
    outcome = "converged" if result.success else "NOT CONVERGED"
    style = "green" if result.success else "bold red"
    console.print(Text.assemble((outcome, style), f": {result.message}"))
    match = result.comparison
    several = len(result.comparisons) > 1
    figures = f"cost {result.start_cost:.4e} -> {result.cost:.4e}"
    if not several:
        figures += f"   rmse {match.rmse:.3e} pu   fit {match.fit_percent:.2f} %"
    console.print(figures)
    console.print(
        f"{result.nit} iterations, {result.nfev} residuals, {result.njev} Jacobians, "
        f"{result.simulations} simulations, {result.seconds:.2f} s"
    )
    console.print(f"sub-steps: {result.substeps}")
    if result.minima is not None:
        console.print()
        minima(console, result.minima, result.parameters)
    if result.knowledge is not None:
        console.print()
        remarks(console, "open", result.knowledge.sentences)
    notes(console, result.notes)
    if result.validation or several:
        comparisons(console, [*result.comparisons, *result.validation])
    console.print()
    written(console, folder)


def fitted_table(result: FitResult) -> Table:
    """Return the fitted values with their intervals; what belongs to a record stands last."""
    numbers = ("start", "fitted", "95 % interval", "error")
    table = plain_table("parameter", *numbers, "unit", "", numbers=numbers)
    for name, one in result.parameters.items():
        style = "yellow" if one.at_bound else ""
        mark = f"on its {one.at_bound}" if one.at_bound else ""
        interval, error = "-", "-"
        if result.knowledge is not None:
            known = result.knowledge.confidence.parameters[name]
            style = style or ("yellow" if known.why else "")
            if known.interval is not None:
                interval = " ... ".join(number(limit) for limit in known.interval)
            error = _error(known, one.of_record)
        cells = (number(one.start), number(one.value), interval, error, one.unit, mark)
        table.add_row(name, *cells, style=style)
    return table


def percent(share: float) -> str:
    """Return a share in percent, two digits of it."""
    return f"{100.0 * share:.2g} %" if share < 1.0 else f"{100.0 * share:.0f} %"


def remarks(console: Console, kind: str, texts: Iterable[str]) -> None:
    """Show sentences one below the other, each behind its kind."""
    table = Table.grid(padding=(0, 1))
    table.add_column(style="yellow", no_wrap=True)
    table.add_column()
    for text in texts:
        table.add_row(kind, Text(text))
    if table.row_count:
        console.print(table)


def minima(console: Console, found: Minima, parameters: Iterable[str]) -> None:
    """Show the distinct minima of a search from many starts, the lowest first."""
    refined = sum(one.starts for one in found.minima)
    console.print(
        f"{len(found.start_costs)} starts, {refined} refined, {found.failed} without a response; "
        f"distinct minima: {len(found.minima)}"
    )
    ranks = [str(rank + 1) for rank in range(min(len(found.minima), MINIMA))]
    table = plain_table("minimum", *ranks, numbers=ranks)
    shown = found.minima[:MINIMA]
    table.add_row("cost", *(f"{one.cost:.3e}" for one in shown))
    table.add_row("starts", *(str(one.starts) for one in shown))
    for name in parameters:
        table.add_row(name, *(number(one.values[name], 4) for one in shown))
    console.print(table)
    if len(found.minima) > MINIMA:
        console.print(f"and {len(found.minima) - MINIMA} more, all in result.json")


FEATURES = (
    ("initial value", "initial_value", "pu"),
    ("final value", "final_value", "pu"),
    ("rise time 10-90 %", "rise_time", "s"),
    ("overshoot", "overshoot_percent", "%"),
    ("peak time", "peak_time", "s"),
    ("settling time 2 %", "settling_time", "s"),
)


def comparisons(console: Console, found: Sequence[Comparison]) -> None:
    """Show records side by side: how well each is met, and its step measured beside simulated."""
    for some in _beside_each_other(console, found):
        console.print()
        console.print(_match_table(some))
        if any(one.measured or one.simulated for one in some):
            console.print()
            console.print(_feature_table(some))
    for one in found:
        if not one.accepted:
            console.print(
                f"[bold red]not accepted[/] {one.name}: rmse {one.rmse:.3e} exceeds "
                f"{one.rmse_limit:.3e}"
            )


def _beside_each_other(
    console: Console, found: Sequence[Comparison]
) -> Iterator[Sequence[Comparison]]:
    """Yield as many comparisons at a time as the terminal has room for."""
    widest = max(len(heading) for one in found for heading in (one.name, "simulated"))
    count = max(1, (console.width - LABELLED) // (2 * (widest + GAP)))
    for first in range(0, len(found), count):
        yield found[first : first + count]


def _folding(table: Table) -> Table:
    """Let the columns behind the unit fold: names of records may be long."""
    for column in table.columns[2:]:
        column.no_wrap, column.overflow = False, "fold"
    return table


def _match_table(found: Sequence[Comparison]) -> Table:
    names = [one.name for one in found]
    table = _folding(plain_table("", "unit", *names, numbers=names))
    table.add_row("f", "pu²", *(f"{one.cost:.4e}" for one in found))
    signals = list(dict.fromkeys(signal for one in found for signal in one.overlays))
    for signal in signals:
        label = "rmse" if len(signals) == 1 else f"rmse {signal}"
        errors = (one.overlays[signal].rmse if signal in one.overlays else None for one in found)
        table.add_row(label, "pu", *("-" if e is None else f"{e:.3e}" for e in errors))
    table.add_row("maximum error", "pu", *(f"{one.max_error:.3e}" for one in found))
    table.add_row("fit", "%", *(f"{one.fit_percent:.2f}" for one in found))
    return table


def _feature_table(found: Sequence[Comparison]) -> Table:
    headings = [f"{one.name}\n{kind}" for one in found for kind in ("measured", "simulated")]
    table = _folding(plain_table("step of vt", "unit", *headings, numbers=headings))
    for label, name, unit in FEATURES:
        cells = [_feature(one, name) for pair in found for one in (pair.measured, pair.simulated)]
        table.add_row(label, unit, *cells)
    return table


def _feature(found: Features | None, name: str) -> str:
    return "-" if found is None else number(getattr(found, name))


def check(console: Console, found: Check) -> None:
    """Show what a check found."""
    if found.deviations:
        console.print("exact Jacobian against central differences, relative, by their step")
        heads = [f"{step:.0e}" for step in STEPS]
        table = plain_table("parameter", *heads, "best", numbers=[*heads, "best"])
        for name, row in found.deviations.items():
            table.add_row(name, *(f"{value:.0e}" for value in row), f"{min(row):.1e}")
        console.print(table)
        _verdict(console, found.agrees, "derivatives agree", "derivatives DISAGREE")
    else:
        console.print("no free parameter: no derivative to check")
    _verdict(
        console,
        found.flat,
        f"a run without a step stays flat: it drifts by {found.drift:.1e} pu in 60 s",
        f"a run without a step is NOT flat: it drifts by {found.drift:.1e} pu in 60 s",
    )
    step = f"{found.step:g} s"
    console.print(f"sub-steps: {found.substeps} to each step of {step}")
    console.print(f"halving every step moves the response by {found.step_error:.1e} pu")
    console.print(f"bypassed: {', '.join(found.bypassed) or 'nothing'}")
    for note in found.notes:
        console.print(note)


def _verdict(console: Console, good: bool, yes: str, no: str) -> None:
    console.print(f"[green]{yes}[/]" if good else f"[bold red]{no}[/]")


def catalogue(
    console: Console,
    models: Iterable[Model],
    machines: Iterable[Machine],
    stabilisers: Iterable[Model],
) -> None:
    """Show the names of all models."""
    table = plain_table("exciter", "also", "")
    for one in models:
        table.add_row(one.name, ", ".join(one.aliases), one.title.partition(" (")[0])
    console.print(table)
    console.print()
    table = plain_table("machine", "")
    for machine in machines:
        table.add_row(machine.name, machine.title)
    console.print(table)
    console.print()
    table = plain_table("stabiliser", "")
    for one in stabilisers:
        table.add_row(one.name, one.title.partition(" (")[0])
    console.print(table)


def model(console: Console, one: Model) -> None:
    """Show a model's drawing, data sheet and states."""
    _described(console, one, one.drawing)


def machine(console: Console, one: Machine) -> None:
    """Show a machine's data sheet and states."""
    _described(console, one)


def _described(console: Console, one: Model | Machine, *drawing: str) -> None:
    console.print(f"[bold]{one.name}[/]: {one.title}")
    for text in drawing:
        console.print()
        console.print(text, markup=False, soft_wrap=True)
    console.print()
    console.print(data_sheet(one.sheet))
    console.print()
    console.print(f"states: {', '.join(one.states)}")


def data_sheet(rows: Sheet) -> Table:
    """Return a data sheet as a table."""
    table = plain_table("symbol", "typical", "unit", "range", "meaning", numbers=("typical",))
    for row in rows:
        limits = f"{row.low:g} ... {row.high:g}"
        cells = (row.symbol, f"{row.typical:g}", row.unit, limits, row.meaning)
        table.add_row(*(Text(cell) for cell in cells))
    return table
