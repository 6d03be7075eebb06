"""The tables of docs/thesis.md: what the thesis prints beside what exfit finds."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import zip_longest

from thesis_numbers import (
    ABSOLUTE,
    APPROXIMATE,
    CURVES,
    DGN,
    INSTANTS,
    LM,
    LM_DGN,
    RELATIVE,
    RESULTS,
    SIMULATORS,
    STARTS,
    TABLES,
    TOOLBOX,
    TRUE,
    A,
    History,
    K,
)
from thesis_runs import (
    TRUTH,
    Fits,
    fits_of,
    jacobians_at,
    replays,
    simulated_twice,
    stale_levenberg_marquardt,
    unit_of,
)

import exfit
from exfit.results.model import Iteration

CASES = {
    "ac1a_typical": "1: AC1A, typical",
    "ac1a_good": "2: AC1A, good",
    "ac1a_low": "3: AC1A, low",
    "ac1a_high": "4: AC1A, high",
    "ac8b_unit1": "5: AC8B, unit 1",
    "ac8b_unit2": "5: AC8B, unit 2",
}
METHODS = {
    TOOLBOX: "toolbox",
    DGN: "DGN",
    LM: "LM",
    LM_DGN: "DGN from LM",
    "default": "`lm-then-dgn`",
    "auto": "`auto`",
}
# the curves of sample_data/andes that stand for each figure of 4.6
SHOWN = {
    "4.33": "ac1a_toolbox",
    "4.34": "ac1a_dgn",
    "4.35": "ac1a_lm",
    "4.36": "ac1a_low_lm",
}


HALF = 0.5  # without bounds, a scaled parameter is the value over twice its start


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def scientific(value: float) -> str:
    """Return a number with three significant digits, as the page writes f."""
    return f"{value:.2e}".replace("e-0", "e-")


def history_table(number: int) -> str:
    """Return a table of the thesis with exfit's columns beside it."""
    (history,) = (entry for entry in TABLES if entry.number == number)
    return trust_region_table(history) if history.phase == LM else armijo_table(history)


def armijo_table(history: History) -> str:
    """Return a history of damped Gauss-Newton."""
    ours = fits_of(history.case).by_method[history.method].history
    head = (
        "iteration",
        *(f"{name}, thesis" for name in ("norm of g", "f", "Armijo")),
        *(f"{name}, exfit" for name in ("norm of g", "f", "Armijo")),
    )
    exfit_rows = [(norm_of(line), scientific(line.cost), str(line.inner)) for line in ours]
    return table(head, numbered(history.rows, exfit_rows))


def trust_region_table(history: History) -> str:
    """Return a history of Levenberg-Marquardt: also with what the thesis' program renewed late."""
    ours = fits_of(history.case).by_method[history.method].history
    head = (
        "iteration",
        *(f"{name}, thesis" for name in ("norm of g", "f", "trials")),
        *(f"{name}, stale" for name in ("norm of g", "f", "trials", "f there")),
        *(f"{name}, exfit" for name in ("norm of g", "f", "trials")),
    )
    stale = [
        (
            f"{line.gradient_norm:.1e}",
            scientific(line.cost),
            str(line.trials),
            scientific(line.cost_there),
        )
        for line in stale_levenberg_marquardt(history.case)
    ]
    exfit_rows = [(norm_of(line), scientific(line.cost), str(line.trials)) for line in ours]
    return table(head, numbered(history.rows, stale, exfit_rows))


def norm_of(line: Iteration) -> str:
    """Return the norm of g over the parameters relative to their start."""
    return f"{HALF * line.gradient_norm:.1e}"


def numbered(*groups: Sequence[Sequence[str]]) -> list[list[str]]:
    """Return rows of which each group has its cells, empty ones where a group has ended."""
    empty = [[""] * len(group[0]) for group in groups]
    rows = zip_longest(*groups)
    return [
        [
            str(k),
            *(cell for cells, none in zip(row, empty, strict=True) for cell in cells or none),
        ]
        for k, row in enumerate(rows)
    ]


def parameter_table(name: str) -> str:
    """Return what each method found in a case, of the thesis and of exfit."""
    fits = fits_of(name)
    methods = list(fits.by_method)
    head = ["", "start"]
    for method in methods:
        head += [f"{METHODS[method]}, thesis", "exfit"]
    head += ["default of exfit", "95 %", "record made with"]
    rows = [parameter_row(symbol, name, fits) for symbol in STARTS[name]]
    costs = [
        "f",
        scientific(next(iter(fits.by_method.values())).start_cost),
        *(cell for method in methods for cell in ("", scientific(fits.by_method[method].cost))),
        scientific(fits.default.cost),
        "",
        scientific(fits.cost_of_truth),
    ]
    return table(head, [*rows, costs])


def parameter_row(symbol: str, name: str, fits: Fits) -> list[str]:
    """Return the row of one parameter."""
    cells = [symbol, f"{STARTS[name][symbol]:g}"]
    for method, result in fits.by_method.items():
        cells += [f"{RESULTS[name, method][symbol]:g}", f"{result.values[symbol]:.4g}"]
    truth = f"{TRUTH[unit_of(name)][symbol]:g}"
    return [*cells, *own_cells(symbol, fits.default), truth]


def own_cells(symbol: str, result: exfit.FitResult) -> list[str]:
    """Return the value and the interval that exfit finds without settings."""
    if symbol not in result.parameters:
        return [f"{result.values[symbol]:.4g} (fixed)", ""]
    parameter = result.parameters[symbol]
    if parameter.interval is None:
        return [f"{parameter.value:.4g}", "not determined"]
    low, high = parameter.interval
    return [f"{parameter.value:.4g}", f"{low:.3g} ... {high:.3g}"]


def summary_table() -> str:
    """Return every search: where it began and ended, in the thesis and with exfit."""
    head = (
        "case",
        "method",
        "f, thesis",
        "iterations",
        "f, exfit",
        "iterations",
        "simulations",
        "rmse",
        "down-step",
    )
    return table(head, (row for name in CASES for row in summary_rows(name)))


def summary_rows(name: str) -> Iterable[list[str]]:
    """Yield the rows of a case."""
    for method, result in fits_of(name).every.items():
        histories = [entry for entry in TABLES if (entry.case, entry.method) == (name, method)]
        costs, count = "", ""
        for history in histories:
            costs = f"{history.rows[0][1]} → {history.rows[-1][1]}"
            count = str(len(history.rows) - 1)
        yield [
            CASES[name],
            METHODS[method],
            costs,
            count,
            f"{scientific(result.start_cost)} → {scientific(result.cost)}",
            str(result.nit),
            str(result.simulations),
            scientific(result.rmse),
            scientific(result.validation[0].rmse),
        ]


def jacobian_table() -> str:
    """Return the Jacobian of 3.3 at its sixteen instants."""
    ours = jacobians_at(K, A)
    head = (
        "t (s)",
        *(
            f"d{numerator}: {column}"
            for numerator in ("v/dk", "v/da")
            for column in ("approximate", "true", "absolute", "relative", "exfit", "absolute")
        ),
    )
    printed = [
        [texts[column].split() for texts in (APPROXIMATE, TRUE, ABSOLUTE, RELATIVE)]
        for column in range(2)
    ]
    rows = []
    for k, instant in enumerate(INSTANTS):
        cells = [f"{instant:g}"]
        for column in range(2):
            cells += [decimal(values[k]) for values in printed[column]]
            value = ours.differences[k, column]
            cells += [f"{value:.7f}", f"{ours.closed[k, column] - value:.0e}"]
        rows.append(cells)
    return table(head, rows)


def decimal(text: str) -> str:
    """Return a number of the thesis as it prints it."""
    return "NaN" if text == "nan" else f"{float(text):.4f}" if float(text) else "0"


def simulators_table() -> str:
    """Return f of each simulator with the same values."""
    head = ("figure", "values of", "f, PSS/E", "f, MATLAB", "f, ANDES", "f, exfit", "apart (pu)")
    rows = []
    for number, curve in SHOWN.items():
        psse, matlab = SIMULATORS[number]
        simulated = simulated_twice(curve)
        rows.append(
            [
                number,
                values_of(curve),
                scientific(psse),
                scientific(matlab),
                scientific(simulated.cost(simulated.andes)),
                scientific(simulated.cost(simulated.exfit)),
                scientific(simulated.apart),
            ]
        )
    return table(head, rows)


def values_of(curve: str) -> str:
    """Return which values of the thesis a curve is simulated with."""
    case, method = CURVES[curve]
    return f"case {CASES[case][0]}, {METHODS[method]}"


def replay_table() -> str:
    """Return how the step down of unit 1 is matched, replayed in several ways."""
    matches = replays("ac8b_unit1", fits_of("ac8b_unit1").default)
    rows = [
        [label, scientific(match.cost), scientific(match.rmse), delay_of(match.of_record)]
        for label, match in matches.items()
    ]
    return table(("step down", "f", "rmse (pu)", "delay found (s)"), rows)


def delay_of(of_record: Mapping[str, float]) -> str:
    """Return the delay that a validation found, if it looked for one."""
    return ", ".join(f"{value:.4f}" for value in of_record.values())
