"""The tables of docs/thesis.md: what the thesis prints beside what exfit finds."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import zip_longest

from thesis_numbers import (
    ABSOLUTE,
    APPROXIMATE,
    COSTS,
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
    K,
)
from thesis_runs import (
    TRUTH,
    Trialled,
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


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of Markdown, between marks that say that a script wrote it."""
    lines = [head, ["---"] * len(head), *rows]
    body = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return f"<!-- table -->\n{body}\n<!-- /table -->"


def scientific(value: float) -> str:
    """Return a number with three significant digits, as the page writes f."""
    return f"{value:.2e}".replace("e-0", "e-")


def millionths(cost: float) -> str:
    """Return f in units of 1e-6."""
    value = 1e6 * cost
    return f"{value:.4g}" if value < 1e4 else f"{value:.0f}"


def history_table(number: int) -> str:
    """Return a table of the thesis with exfit's columns beside it."""
    (history,) = (entry for entry in TABLES if entry.number == number)
    counted = "trials" if history.phase == LM else "Armijo"
    ours = fits_of(history.case).by_method[history.method].history
    exfit_rows = [
        (norm_of(line), cost_of(line), str(line.trials if history.phase == LM else line.inner))
        for line in ours
    ]
    head = ("", "thesis: norm of g", "f", counted)
    if history.phase == LM:
        stale = [
            (f"{line.gradient_norm:.6f}", cost_of(line), str(line.trials), f"{line.cost_there:.7f}")
            for line in stale_levenberg_marquardt(history.case)
        ]
        head = (*head, "stale: norm of g", "f", counted, "f there")
        groups = (history.rows, stale, exfit_rows)
    else:
        groups = (history.rows, exfit_rows)
    return table((*head, "exfit: norm of g", "f", counted), numbered(*groups))


def settled(result: exfit.FitResult) -> int:
    """Return the iteration from which f is within 5 % of where it ends."""
    return next(line.number for line in result.history if line.cost < 1.05 * result.cost)


def first_full_step(result: exfit.FitResult) -> dict[str, float]:
    """Return where the first step of damped Gauss-Newton leads before it is cut."""
    start, first = result.history[:2]
    return {
        name: value + (first.values[name] - value) / first.damping
        for name, value in start.values.items()
    }


def norm_of(line: Iteration) -> str:
    """Return the norm of g over the parameters relative to their start."""
    return f"{line.gradient_norm:.6f}"


def cost_of(line: Iteration | Trialled) -> str:
    """Return f with the digits that distinguish costs above the noise."""
    return f"{line.cost:.7f}"


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
    fits, start = fits_of(name), STARTS[name]
    first = next(iter(fits.by_method.values()))
    rows = [["start", *map(as_given, start.values()), millionths(first.start_cost)]]
    for method, result in fits.by_method.items():
        theirs = RESULTS[name, method]
        cost = COSTS.get((name, method))
        printed = "" if cost is None else as_given(1e6 * float(cost))
        rows.append(
            [f"{METHODS[method]}, thesis", *(as_given(theirs[key]) for key in start), printed]
        )
        found = [short(result.values[symbol]) for symbol in start]
        rows.append([f"{METHODS[method]}, exfit", *found, millionths(result.cost)])
    rows += own_rows(fits.default, start)
    truth = [as_given(TRUTH[unit_of(name)][symbol]) for symbol in start]
    rows.append(["record made with", *truth, millionths(fits.cost_of_truth)])
    return table(("", *start, "f·10⁶"), rows)


def own_rows(result: exfit.FitResult, names: Iterable[str]) -> list[list[str]]:
    """Return the values that exfit finds without settings, and the ends of their intervals."""
    values, low, high = ["default of exfit"], ["95 % from"], ["to"]
    for symbol in names:
        values.append(short(result.values[symbol]))
        parameter = result.parameters.get(symbol)
        interval = None if parameter is None else parameter.interval
        ends = map(short, interval) if interval else ["fixed" if parameter is None else "-"] * 2
        for row, end in zip((low, high), ends, strict=True):
            row.append(end)
    return [[*values, millionths(result.cost)], [*low, ""], [*high, ""]]


def as_given(value: float) -> str:
    """Return a value with all digits that it is given with."""
    return f"{value:.8g}"


def short(value: float | None) -> str:
    """Return a value with four significant digits, a dash for the open side of an interval."""
    return "-" if value is None else f"{value:.4g}"


def sensitivity_table(name: str) -> str:
    """Return by how much 1 % of each parameter moves the response, the largest first."""
    uncertainty = fits_of(name).default.knowledge
    assert uncertainty is not None
    effects = uncertainty.effects
    head = [effect.parameter for effect in effects]
    return table(head, [[f"{effect.of_noise:.2g}" for effect in effects]])


def summary_table() -> str:
    """Return every search: where it began and ended, in the thesis and with exfit."""
    head = ("case", "method", "f, thesis", "f·10⁶, exfit", "iterations", "simulations", "step down")
    return table(head, (row for name in CASES for row in summary_rows(name)))


def summary_rows(name: str) -> Iterator[list[str]]:
    """Yield the rows of a case."""
    printed = {entry.method: entry.rows for entry in TABLES if entry.case == name}
    for method, result in fits_of(name).every.items():
        rows = printed.get(method)
        yield [
            CASES[name],
            METHODS[method],
            f"{rows[0][1]} → {COSTS.get((name, method), rows[-1][1])}" if rows else "",
            f"{millionths(result.start_cost)} → {millionths(result.cost)}",
            f"{len(rows) - 1}; {result.nit}" if rows else str(result.nit),
            str(result.simulations),
            scientific(result.validation[0].rmse),
        ]


def jacobian_table(column: int) -> str:
    """Return dv/dk (column 0) or dv/da (1) of 3.3 at its sixteen instants."""
    ours = jacobians_at(K, A)
    values, errors = ours.differences[:, column], (ours.closed - ours.differences)[:, column]
    printed = [text[column].split() for text in (APPROXIMATE, TRUE, ABSOLUTE, RELATIVE)]
    name = ("dv/dk", "dv/da")[column]
    head = (f"{name} at t (s)", "approximate", "true", "absolute", "relative", "exfit", "absolute")
    rows = [
        [f"{instant:g}", *map(decimal, row), f"{value:.7f}", f"{error:.0e}"]
        for instant, row, value, error in zip(
            INSTANTS, zip(*printed, strict=True), values, errors, strict=True
        )
    ]
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
                scientific(simulated.andes.f),
                scientific(simulated.exfit.f),
                scientific(abs(simulated.between.largest[0])),
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
