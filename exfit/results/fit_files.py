"""The files of a fit as texts: its tables, its parameters, its result."""

from collections.abc import Iterator, Sequence

from exfit.fitting.nuisances.parameters import prefix_from
from exfit.results.comparisons import Comparison
from exfit.results.io import result_text
from exfit.results.model import FitResult
from exfit.results.tables import (
    comparison_table,
    effects_table,
    history_table,
    iteration_responses_table,
    parameter_file,
    phase_end_file,
)
from exfit.util.file_names import (
    HISTORY,
    ITERATIONS,
    PARAMETERS,
    RESPONSE,
    SENSITIVITIES,
    WHOLE_FIT,
)


def files_of_fit(result: FitResult) -> Iterator[tuple[str, str]]:
    """Yield the names and contents of a fit's tables, and last of its result."""
    yield PARAMETERS, parameter_file(result)
    for end in result.phase_ends:
        yield f"parameters_{end.phase}.yaml", phase_end_file(result, end)
    yield HISTORY, history_table(result)
    if not prefix_from(result.comparison.name):  # the only record
        yield RESPONSE, comparison_table(result.comparison)
    else:
        yield from comparison_files(result.comparisons)
    yield from comparison_files(result.validation)
    for match in result.comparisons:
        if match.iteration_responses is not None:
            record = prefix_from(match.name).removesuffix(".")
            name = f"{record}-{ITERATIONS}" if record else ITERATIONS
            yield name, iteration_responses_table(match.iteration_responses)
    if result.knowledge is not None:
        yield SENSITIVITIES, effects_table(result.knowledge.effects)
    yield WHOLE_FIT, result_text(result)


def comparison_files(comparisons: Sequence[Comparison]) -> Iterator[tuple[str, str]]:
    """Yield the samples of each comparison under its name."""
    for match in comparisons:
        yield f"{match.name}.csv", comparison_table(match)
