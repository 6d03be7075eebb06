"""The result of a fit as blocks: in brief, and whole; and the profiles of its parameters."""

from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from exfit.inference.confidence import closed
from exfit.inference.identifiability import ParameterEffect
from exfit.output.blocks import (
    NO_BREAK,
    Block,
    Mark,
    Note,
    Table,
    TableColumn,
    columns,
    error_of,
    figures,
    interval,
    notes,
    number,
    paragraph,
    percent,
    remarks,
    row,
    unresolved,
)
from exfit.output.validations import comparisons, criteria_table, in_a_line, played, rejections
from exfit.results.causes_in_words import causes_in_words
from exfit.results.criteria import judged_by_criteria
from exfit.results.model import FitResult, FittedParameter
from exfit.results.verdict import GOOD, MATCHES
from exfit.util.text import listed, percentage
from exfit.util.vocabulary import by_source

if TYPE_CHECKING:
    from exfit.workflows.profiles import Profiles

MARK_OF_CRITERIA: dict[bool | None, Mark] = {True: "ok", None: "doubt", False: "bad"}
MARKS: dict[str, Mark] = {GOOD: "ok", MATCHES: "doubt"}  # of verdicts; the others are bad


def briefs(
    result: FitResult, folder: Path | None = None, before: FitResult | None = None
) -> Iterator[list[Block]]:
    """Yield the result of a fit in brief, with the folder of its files, each time in fewer lines.

    Left out are the values of records, then causes from the last one on, then validations that
    are accepted, then notes from the last one on.
    """
    causes, noted = len(result.verdict.causes), len(result.notes)
    accepted = sum(not match.reason for match in result.validation)
    yield [*_brief(result, folder, before, (causes, accepted, noted), True)]
    for most in range(causes, 0, -1):
        yield [*_brief(result, folder, before, (most, accepted, noted), False)]
    for most in range(noted, -1, -1):
        yield [*_brief(result, folder, before, (min(causes, 1), 0, most), False)]


def _brief(
    result: FitResult,
    folder: Path | None,
    before: FitResult | None,
    most: tuple[int, int, int],
    of_records: bool,
) -> Iterator[Block]:
    """Yield a fit in brief, with at most so many causes, accepted validations and notes."""
    causes, accepted, noted = most
    yield fitted_table(result, before, of_records)
    yield figures(f"cost {result.start_cost:.4e} -> {result.cost:.4e}", *_errors(result))
    if result.criteria.given:
        judged = judged_by_criteria(result)
        counts = Counter(each.outcome for each in judged.criteria)
        text = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
        yield from remarks("criteria:", [text], MARK_OF_CRITERIA[judged.passed])
    yield from rejections(result.comparisons)
    good = [match for match in result.validation if not match.reason]
    for match in result.validation:
        if match.reason or match in good[:accepted]:
            yield in_a_line(match)
    if accepted < len(good):
        yield paragraph(f"further validations that are accepted: {len(good) - accepted}")
    yield from notes(result.notes[:noted])
    if noted < len(result.notes):
        yield paragraph(f"further notes: {len(result.notes) - noted}", "doubt")
    listed = [*_causes(result, folder)]
    yield from listed[:causes]
    if causes < len(listed):
        yield paragraph(f"further possible causes: {len(listed) - causes}", "faint")
    if folder is not None:
        shown = quote(folder.as_posix())
        yield paragraph(f"{written_to(folder)}; details: `exfit show --all {shown}`")
    yield verdict(result)


def written_to(folder: Path) -> str:
    """Say where files are: a path stays in one line, whatever blanks it has."""
    return f"written to {folder}".replace(" ", NO_BREAK)


def whole(
    result: FitResult, folder: Path | None = None, before: FitResult | None = None
) -> Iterator[Block]:
    """Yield all of a fit: values, effort, how well they are determined, records, the verdict.

    The values of a fit ``before`` are beside the new ones; ``folder`` has the files.
    """
    yield fitted_table(result, before)
    several = len(result.comparisons) > 1
    if result.success:
        yield Note(result.message, "info", f"{result.outcome}:", "strong")
    yield figures(
        f"cost {result.start_cost:.4e} -> {result.cost:.4e}", *([] if several else _errors(result))
    )
    yield figures(
        f"{result.nit} iterations",
        f"{result.nfev} residuals",
        f"{result.njev} Jacobians",
        f"{result.simulations} simulations",
        f"{result.seconds:.2f} s",
        between=", ",
    )
    for end in result.phase_ends:
        errors = ", ".join(f"{match.rmse:.3e}" for match in end.comparisons)
        yield figures(
            f"end of {end.phase}: iteration {end.iteration}, cost {end.cost:.4e}",
            f"rmse {errors} pu",
            f"parameters_{end.phase}.yaml",
        )
    yield paragraph(f"sub-steps: {result.substeps}{_of_steps(result)}")
    if result.sources:
        counts = by_source(result.sources, result.sources).items()
        text = ", ".join(f"{len(names)}{NO_BREAK}{source}" for source, names in counts)
        yield Note(text, label="sources of the values:")
    if result.minima is not None:
        yield Note(result.minima.summary(result.cost), label="search:", mark="strong")
    if result.knowledge is not None:
        yield from remarks("sensitivity:", ranking(result.knowledge.effects), "strong")
        yield from unresolved(result.knowledge.sentences)
    yield from notes(result.notes)
    if result.validation or several:
        yield from comparisons([*result.comparisons, *result.validation])
    else:
        yield from played(result.comparisons)
    if result.criteria.given:
        yield criteria_table(result)
    yield from rejections([*result.comparisons, *result.validation])
    yield from _causes(result, folder)
    if folder is not None:
        yield paragraph(written_to(folder))
    yield verdict(result)


def _errors(result: FitResult) -> list[str]:
    """Write how well the fitted records are met: of several each."""
    errors = ", ".join(f"{match.rmse:.3e}" for match in result.comparisons)
    percentages = ", ".join(percentage(match.fit_percent) for match in result.comparisons)
    return [f"rmse {errors} pu", f"fit {percentages} %"]


def verdict(result: FitResult) -> Note:
    """Say in a sentence what a fit comes to."""
    mark = MARKS.get(result.verdict.verdict, "bad")
    return Note(result.verdict.sentence, "verdict", "verdict:", mark)


def _causes(result: FitResult, folder: Path | None) -> Iterator[Note]:
    """Yield the likeliest causes, each with its remedy."""
    label = "note:" if result.verdict.verdict == GOOD else "cause:"
    yield from remarks(label, causes_in_words(result, folder), kind="remedy")


def ranking(effects: Sequence[ParameterEffect]) -> Iterator[str]:
    """Yield in one sentence which parameter matters first."""
    ranked = (f"{effect.label}{NO_BREAK}{number(effect.of_noise, 2)}" for effect in effects)
    if effects:
        yield f"effect of 1 % of each on the response, in units of the noise: {', '.join(ranked)}"


def fitted_table(
    result: FitResult, before: FitResult | None = None, of_records: bool = True
) -> Table:
    """Make the table of fitted values with their intervals; those of records come last.

    Columns in which no parameter has anything are left out.
    """
    shown = {name: p for name, p in result.parameters.items() if of_records or not p.of_record}
    heads, lines = _heads(shown.values()), []
    for name, parameter in shown.items():
        before_it = "" if before is None else parameter.rounded(before.values.get(name))
        remarks = ", ".join(remarks_on(parameter))
        lines.append((name, number(parameter.start), before_it, *_found(result, name), remarks))
    empty = {"before": "", "error": "-", "by noise": "-", "": ""}
    kept = [
        place
        for place, head in enumerate(heads)
        if head.title not in empty or any(line[place] != empty[head.title] for line in lines)
    ]
    rows = [
        row(*(line[place] for place in kept), mark=_mark(result, parameter))
        for line, parameter in zip(lines, shown.values(), strict=True)
    ]
    return Table(tuple(heads[place] for place in kept), tuple(rows))


def _heads(parameters: Collection[FittedParameter]) -> tuple[TableColumn, ...]:
    linear = any(parameter.linear_error is not None for parameter in parameters)
    by_noise = any(parameter.noise_interval is not None for parameter in parameters)
    error = "by noise" if by_noise else "error"
    return (
        TableColumn("parameter"),
        TableColumn("start", number=True, expendable=1 if linear else 2),
        TableColumn("before", number=True),
        TableColumn("fitted", number=True),
        TableColumn("95 % interval", number=True),
        TableColumn(error, number=True, expendable=2 if linear else 1),
        TableColumn("unit"),
        TableColumn(""),
    )


def _mark(result: FitResult, parameter: FittedParameter) -> Mark:
    vague = result.knowledge is not None and parameter.why
    return "doubt" if parameter.at_bound or not parameter.physical or vague else ""


def _found(result: FitResult, name: str) -> tuple[str, str, str, str]:
    """Write a fitted value, its interval, its error where linear theory serves, and its unit."""
    parameter, error = result.parameters[name], "-"
    if parameter.noise_interval is not None:
        error = half_width(parameter)
    elif result.knowledge is not None and parameter.linear_error is not None:
        known = result.knowledge.confidence.parameters.get(name)  # of no value moved with all
        error = "-" if known is None else error_of(known, parameter.of_record)
    limits = result.verdict.in_place_of_interval or interval(parameter.interval, parameter.rounded)
    return parameter.rounded(parameter.value), limits, error, parameter.unit


def half_width(parameter: FittedParameter) -> str:
    """Write half of the interval from the noise alone: in percent, but of a record in its unit."""
    if not closed(parameter.noise_interval):
        return "-"
    low, high = parameter.noise_interval
    half = 0.5 * (high - low)
    if parameter.of_record or not parameter.value:
        return f"±{half:.1e}"
    return f"±{percent(half / abs(parameter.value))}"


def remarks_on(parameter: FittedParameter) -> Iterator[str]:
    """Yield the remarks on a value."""
    if parameter.at_bound:
        yield f"on its {parameter.at_bound}"
    if not parameter.physical:
        yield "not physical"
    if parameter.moved is not None:
        yield f"{parameter.moved:+.1f} σ"
    if parameter.interval_note:
        yield parameter.interval_note


def profiles(result: "Profiles") -> Iterator[Block]:
    """Yield the intervals that profiles give, beside those of the linear theory."""
    heads = ("fitted", "min 95 %", "max 95 %", "linear min", "linear max")
    rows = []
    for profile in result.profiles:
        linear = (None, None) if profile.linear is None else profile.linear
        rows.append(
            row(
                profile.name,
                profile.rounded(profile.value),
                result.verdict.in_place_of_interval or profile.rounded(profile.low),
                *map(profile.rounded, (profile.high, *linear)),
                profile.unit,
                mark="doubt" if any(profile.ends) else "",
            )
        )
    yield Table(columns("parameter", *heads, "unit", numbers=heads), tuple(rows))
    sides = ("no lower limit", "no upper limit")
    yield from unresolved(
        f"{profile.name} has {side}: {end}"
        for profile in result.profiles
        for side, end in zip(sides, profile.ends, strict=True)
        if end and not result.verdict.misfit
    )
    yield from notes(result.notes)


def _of_steps(result: FitResult) -> str:
    """Word the steps of the simulation that are divided."""
    steps = sorted({match.step for match in result.comparisons if match.step})
    return f" in each step of {listed([f'{step:g}' for step in steps])} s" if steps else ""
