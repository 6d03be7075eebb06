"""What made the simulated responses in place of exfit, in words."""

from collections.abc import Iterator
from shlex import join

from exfit.features.report.sections.reproduction import reproduction, reproduction_of_validation
from exfit.results.description import OtherProgram
from exfit.results.model import FitResult
from exfit.results.validation_result import Reported

NO_TWIN = "not stated: it needs the equations of a twin, and the case has none"


def other_program(result: Reported) -> tuple[str, ...]:
    """Return sentences on the program that simulated the records; none where exfit did."""
    program = result.other_program
    if program is None:
        return ()
    is_fit = isinstance(result, FitResult)
    return (
        " ".join([_responses(program), *_files(result)]),
        " ".join(_by_fitted_twin(program) if is_fit else _by_compared_twin(program)),
        _repetition(result),
    )


def has_no_equations(result: Reported) -> bool:
    """Tell whether a program without a twin simulated the records."""
    return result.other_program is not None and result.other_program.twin is None


def _responses(program: OtherProgram) -> str:
    failed = f", of which {program.failed} failed" if program.failed else ""
    return (
        f"The simulated responses are runs of the planner's own simulator, `{program.command}`, "
        f"not of exfit: {program.runs} runs{failed}."
    )


def _files(result: Reported) -> Iterator[str]:
    for label, sha256 in result.inputs.items():
        if label.startswith("program"):
            yield f"SHA-256 of {result.files.get(label, label)}: `{sha256}`."


def _by_fitted_twin(program: OtherProgram) -> Iterator[str]:
    if program.twin is None:
        yield (
            "No plant of exfit stands beside it: derivatives are difference quotients of its runs, "
            "intervals those of linear theory by them, and there is no view of poles and limits."
        )
        return
    yield (
        f"The plant {program.twin} of exfit, its twin, gave the derivatives of the search and, "
        "corrected by its difference to the program at the result, intervals and their profiles, "
        "fits to windows, poles and limits."
    )
    yield from _differences(program)


def _by_compared_twin(program: OtherProgram) -> Iterator[str]:
    if program.twin is None:
        yield "No plant of exfit stands beside it: there is no view of poles and limits."
        return
    yield f"The plant {program.twin} of exfit, its twin, gave poles and limits."
    yield from _differences(program)


def _differences(program: OtherProgram) -> Iterator[str]:
    listed = (
        f"{record}: {', '.join(f'{signal} {size:.2g} pu' for signal, size in own.items())}"
        for record, own in program.differences.items()
    )
    yield f"Program and twin differ at these values by at most: {'; '.join(listed)}."


def _repetition(result: Reported) -> str:
    if isinstance(result, FitResult):
        made = reproduction(result)
    else:
        made = reproduction_of_validation(result)
    return f"`{join((*made.fit, *made.options))}` repeats this, with the same program."
