"""Count how often the printed 95 % intervals hold the truth, on records made by simulation.

Run it as ``python tests/studies/coverage.py --records 500 --results coverage.json``. The cases are
those of tests/support/coverage_cases.py; each record is the response to the true parameters with
new noise, fitted as the command fits: from the start of the case and from further starts, with
profiles where linear theory does not serve. What is in the file of results already is not done
again, so that a study that was interrupted goes on.

The first ``--dense`` records of each case are also profiled densely: the others fitted anew at
values over the whole range of a parameter, from all minima that the search found and from the
truth. That interval, by the true covariance of the noise, is what the width of the printed one is
compared with.

With ``--given drawn`` each true value that the case gives lies about that one by its default error;
counted are the intervals of all that is fitted, given values too.
"""

import argparse
import json
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.stats import binomtest

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from coverage_cases import HARD_CASES, drawn, noisy, truth_of
from dense_profiles import dense_intervals
from truths import holds

from exfit.errors import ExfitError
from exfit.util.files import write
from exfit.workflows import fit
from exfit.workflows.case_search import STAGES
from exfit.workflows.search_state import SearchState, in_turn

RECORDS, SEED = 500, 2026
DENSE = 20
EVERY = 15.0  # s: how often the results are written
BAND = (0.92, 0.98)
WIDEST = 1.3  # times the dense profile's
OF_DRAWN = (
    "linear", "ac1a_limit", "ac1a_kd", "ac8b_unit2", "ac8b_ifd", "st3a", "st6b_instant"
)  # fmt: skip


def ignore(_):
    """Ignore a message."""


def record_of(task):
    """Return what the fit of one record of a case came to."""
    name, number, seed, dense = task
    began = time.process_time()
    rng = np.random.default_rng([seed, *name.encode(), number])
    case, setups, problem = noisy(name, rng)
    options = case.estimate
    state = in_turn(STAGES, SearchState(case, setups, (), problem, options.strategy, options))
    problem, search, determined = state.problem, state.found, state.determined
    uncertainty = determined.uncertainty
    fitted = problem.residuals.values(search.best.x)
    seconds = time.process_time() - began
    parameters = uncertainty.confidence.parameters if uncertainty else {}
    outcome = {
        "seconds": round(seconds, 3),
        "success": search.best.success,
        "cost": search.best.cost / problem.compressed.costs([truth_of(name, problem)])[0],
        "parameters": {
            parameter: {
                "value": fitted[parameter],
                "interval": known.interval,
                "method": known.method,
                "why": known.why,
            }
            for parameter, known in parameters.items()
        },
    }
    if dense:
        printed = {parameter: known.interval for parameter, known in parameters.items()}
        outcome["dense"] = dense_intervals(name, problem, search, printed)
        outcome["dense_seconds"] = round(time.process_time() - began - seconds, 3)
    return name, number, outcome


def drawn_of(task):
    """Return the intervals of a fit whose given values are drawn, each with its truth."""
    name, number, seed, _ = task
    began = time.process_time()
    try:  # a unit whose given values are far off may have no response
        case, truth = drawn(name, np.random.default_rng([seed, number, *name.encode()]))
        result = fit(case)
    except ExfitError as refusal:
        return name, number, {"seconds": 0.0, "parameters": {}, "refused": str(refusal)}
    known = {
        parameter: [*own.interval, truth[parameter]]
        for parameter, own in result.parameters.items()
        if own.interval is not None and parameter in truth
    }
    seconds = round(time.process_time() - began, 3)
    return name, number, {"seconds": seconds, "parameters": known}


def table_of_drawn(outcomes):
    """Return the table of cases whose given values are drawn."""
    table = Table(title="given values drawn by their default errors")
    for heading in ("case", "records", "intervals", "hold", "%", "s"):
        table.add_column(heading, justify="right")
    every = {"all": [each for of in outcomes.values() for each in of.values()]}
    for name, of in {**{name: [*of.values()] for name, of in outcomes.items()}, **every}.items():
        known = [holds(each[:2], each[2]) for o in of for each in o["parameters"].values()]
        share = percent(sum(known) / len(known)) if known else "-"
        seconds = f"{np.mean([each['seconds'] for each in of]):.2f}"
        table.add_row(name, str(len(of)), str(len(known)), str(sum(known)), share, seconds)
    return table


def width(interval, parameter):
    """Return the width of an interval in scaled units, an open side ending at the bound."""
    low, high = interval
    low, high = parameter.low if low is None else low, parameter.high if high is None else high
    return parameter.scaled(high) - parameter.scaled(low)


def is_closed(interval):
    """Return whether there is an interval with limits on both sides."""
    return interval is not None and None not in interval


def figures(parameter, truth, outcomes):
    """Return the figures of one parameter over the outcomes of a case."""
    every = [outcome["parameters"].get(parameter.name) for outcome in outcomes]
    intervals = [known and known["interval"] for known in every]
    printed = [interval for interval in intervals if interval is not None]
    held = sum(holds(interval, truth) for interval in printed)
    bounds = binomtest(held, len(printed)).proportion_ci(0.95, "exact") if printed else (0.0, 1.0)
    pairs = [
        (interval, outcome["dense"][parameter.name])
        for interval, outcome in zip(intervals, outcomes, strict=True)
        if "dense" in outcome
    ]
    closing = [interval for interval, dense in pairs if is_closed(dense)]
    both = [(interval, dense) for interval, dense in pairs if interval is not None]
    widths = np.array([[width(interval, parameter) for interval in pair] for pair in both])
    return {
        "records": len(outcomes),
        "printed": len(printed) / max(len(outcomes), 1),
        "closed": sum(map(is_closed, intervals)) / max(len(outcomes), 1),
        "holds": held / len(printed) if printed else None,
        "bounds": [*bounds],
        "dense closes": len(closing),
        "closed where dense closes": sum(map(is_closed, closing)) / len(closing)
        if closing
        else None,
        "width": float(np.median(widths[:, 0]) / np.median(widths[:, 1])) if both else None,
        "dense holds": [sum(holds(dense, truth) for _, dense in pairs), len(pairs)],
    }


def percent(share):
    """Return a share in per cent."""
    return "-" if share is None else f"{100.0 * share:.1f}"


def table_of(name, outcomes):
    """Return the table of a case, and its figures by parameter."""
    hard = HARD_CASES[name]
    free = noisy(name, np.random.default_rng(0))[2].residuals.free
    table = Table(title=f"{name}: {hard.title}; {len(outcomes)} records")
    headings = ("parameter", "holds %", "95 % bounds", "printed %", "closed %")
    more = ("of dense closed %", "width : dense", "dense holds", "methods")
    for heading in (*headings, *more):
        table.add_column(heading, justify="right")
    by_parameter = {}
    for parameter in free:
        numbers = figures(parameter, hard.truth[parameter.name], outcomes)
        by_parameter[parameter.name] = numbers
        share, ratio = numbers["holds"], numbers["width"]
        poor = share is not None and not BAND[0] <= share <= BAND[1]
        methods = [o["parameters"].get(parameter.name, {}).get("method") for o in outcomes]
        table.add_row(
            parameter.name,
            ("* " if poor else "") + percent(share),
            f"{percent(numbers['bounds'][0])} ... {percent(numbers['bounds'][1])}",
            percent(numbers["printed"]),
            percent(numbers["closed"]),
            f"{percent(numbers['closed where dense closes'])} of {numbers['dense closes']}",
            "-" if ratio is None else f"{ratio:.2f}" + (" *" if ratio > WIDEST else ""),
            "{}/{}".format(*numbers["dense holds"]),
            " ".join(f"{str(m)[0]}{methods.count(m)}" for m in sorted(set(methods), key=str)),
        )
    seconds = [outcome["seconds"] for outcome in outcomes]
    dense = [outcome["dense_seconds"] for outcome in outcomes if "dense" in outcome]
    ended = sum(outcome["success"] for outcome in outcomes)
    table.caption = (
        f"{ended} converged; {np.mean(seconds):.2f} s of processor a record"
        + (f", {np.mean(dense):.1f} s a dense profile" if dense else "")
        + f"; * outside {BAND[0]:.0%} to {BAND[1]:.0%}, or wider than {WIDEST} times the dense one"
    )
    return table, by_parameter


def stored(path):
    """Return the outcomes of a file of results, by case and record; none without it."""
    if path is None or not path.exists():
        return {}
    return json.loads(path.read_text(encoding="utf-8"))["outcomes"]


def arguments():
    """Return the arguments of the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=RECORDS, help="of each case")
    parser.add_argument("--case", action="append", choices=[*HARD_CASES], help="all by default")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="processes")
    parser.add_argument("--given", choices=("exact", "drawn"), default="exact")
    parser.add_argument("--dense", type=int, default=DENSE, help="records with dense profiles")
    parser.add_argument("--results", type=Path, help="JSON file, written as it goes")
    return parser.parse_args()


def main():
    """Fit the records of each case and print a table for each."""
    given = arguments()
    outcomes, figures_of, console = stored(given.results), {}, Console(width=120)

    def save():
        if given.results is not None:
            content = {"seed": given.seed, "figures": figures_of, "outcomes": outcomes}
            write(given.results, json.dumps(content))

    with ProcessPoolExecutor(given.threads) as pool:
        by_drawing = given.given == "drawn"
        for name in given.case or (OF_DRAWN if by_drawing else HARD_CASES):
            done, saved = outcomes.setdefault(name, {}), time.monotonic()
            numbers = [n for n in range(given.records) if str(n) not in done]
            tasks = [(name, number, given.seed, number < given.dense) for number in numbers]
            try:
                made = pool.map(drawn_of if by_drawing else record_of, tasks)
                for count, (_, number, outcome) in enumerate(made, 1):
                    done[str(number)] = outcome
                    if time.monotonic() > saved + EVERY:
                        print(f"{name}: {count} of {len(tasks)}", flush=True)
                        save()
                        saved = time.monotonic()
            finally:
                save()
            if by_drawing:
                continue
            table, figures_of[name] = table_of(name, [done[key] for key in sorted(done, key=int)])
            console.print(table)
            save()
    if by_drawing:
        console.print(table_of_drawn(outcomes))


if __name__ == "__main__":
    main()
