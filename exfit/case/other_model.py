"""A case with another exciter in place of its own, from the typical data of that exciter."""

from collections.abc import Mapping
from dataclasses import replace

from exfit.case.case import Case
from exfit.case.draft.free_parameters import bounds_of, free_of
from exfit.case.parts import exciter_part
from exfit.case.schema import FreeSection, Parameters
from exfit.case.ties import Tie, Ties
from exfit.errors import CaseError
from exfit.models.sheet import Model, Parameter
from exfit.models.speed_multiplier import times_speed


def with_exciter(case: Case, name: str, model: Model) -> Case:
    """Return a case with another exciter, by the ``name`` that a case gives it.

    Its free parameters and their bounds are those that ``exfit new`` writes, all others typical.
    Plant, tests, records and what is found about them stay. The case is no longer that of a file.
    Raises CaseError where it has no exciter, or where another part follows that.
    """
    if case.parts.exciter is None:
        raise CaseError([f"{case.path}: plant {case.plant.type} has no exciter to replace"])
    own = _names_of_exciter(case)
    ties = {tied: tie for tied, tie in case.ties.by_name.items() if tied not in own}
    _refuse_ties(case, ties, own)
    others = (part for part in case.parts.all if part.kind != "exciter")
    multiplied = times_speed(model) if case.efd_times_speed else model
    exciter = exciter_part(multiplied, exponential=False)
    return replace(
        case,
        path=case.folder / f"{case.path.stem}-{model.name}",
        from_file=False,
        model=name,
        saturation="quadratic",
        parts=replace(case.parts, exciter=multiplied, all=(exciter, *others)),
        ties=Ties(ties),
        parameters=Parameters(free={row.symbol: _section(row) for row in free_of(model)}),
        given_values={key: given for key, given in case.given_values.items() if key not in own},
        given_sources={key: word for key, word in case.given_sources.items() if key not in own},
    )


def _section(row: Parameter) -> FreeSection:
    low, high = bounds_of(row)
    return FreeSection(start=row.typical, min=low, max=high)


def _names_of_exciter(case: Case) -> set[str]:
    """Return the parameters of the exciter of a case, and the helpers of its ties."""
    exciter, section = case.parts.exciter, case.parameters
    rows = () if exciter is None else exciter.sheet
    return {*(row.symbol for row in rows), *section.free, *section.fixed}


def _refuse_ties(case: Case, ties: Mapping[str, Tie], own: set[str]) -> None:
    """Raise CaseError for each tie that uses one of the exciter's ``own`` parameters."""
    faults = [
        f"{case.path}: {name} {tie.text}: {used} belongs to {case.subject}; a case for other "
        "models needs a number here"
        for name, tie in ties.items()
        for used in tie.names
        if used in own
    ]
    if faults:
        raise CaseError(faults)
