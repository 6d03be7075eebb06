"""What a new case frees of a model, and a case with another exciter in place of its own."""

from collections.abc import Mapping
from dataclasses import replace

from exfit.case.case import Case
from exfit.case.parts import exciter_part
from exfit.case.schema import FreeSection, Parameters
from exfit.case.ties import Ties
from exfit.errors import CaseError
from exfit.models.blocks import SHORTEST
from exfit.models.machines import Machine
from exfit.models.sheet import Model, Parameter, SearchRange, typical
from exfit.models.speed_multiplier import times_speed

ALONE = "FIRST_ORDER"  # the model whose output is vt itself
BOUNDS = (0.1, 10.0)  # times the start
WITHIN = 2.0  # a factor: a start is at least so far from the bounds that its sheet names


def free_of(
    model: Model | Machine, values: Mapping[str, float] | None = None
) -> tuple[Parameter, ...]:
    """Return the parameters that a bump test is fitted for: those marked in the data sheet.

    Left out is what has no effect with these values, by default the typical ones: a gain or time
    of zero, the lag of a term whose gain is zero, and one of two alternatives. Of a sheet without a
    mark, as a user's own may be, they are its time constants and gains.
    """
    own = typical(model.sheet) if values is None else values

    def acts(row: Parameter, search: SearchRange) -> bool:
        value = own[row.symbol]
        if value == 0.0 or (search.needs and own[search.needs] == 0.0):
            return False
        if search.unlike and own[search.unlike] == value:
            return False
        return len({own[symbol] for symbol in search.instead_of}) <= 1

    marked = [(row, row.search) for row in model.sheet if row.search is not None]
    if marked:
        return tuple(row for row, search in marked if acts(row, search))
    return tuple(
        row
        for row in model.sheet
        if own[row.symbol] > 0.0 and (row.is_time or row.symbol.upper().startswith("K"))
    )


def bounds_of(row: Parameter, start: float | None = None) -> tuple[float, float]:
    """Return a tenth and ten times a start, as far as units of its kind and the sheet go."""
    value = row.typical if start is None else start
    low, high = (share * value for share in BOUNDS)
    if row.search is not None:
        low = max(low, min(row.search.low, value / WITHIN))
        high = min(high, max(row.search.high, value * WITHIN))
    if row.is_time:
        low = max(low, SHORTEST)
    return max(low, row.low), min(high, row.high)


def _free_section(row: Parameter) -> FreeSection:
    low, high = bounds_of(row)
    return FreeSection(start=row.typical, min=low, max=high)


def _refuse_followers(case: Case, own: set[str]) -> None:
    """Raise CaseError for each tie of another part that uses one of the exciter's parameters."""
    faults = [
        f"{case.path}: {tied} {tie.text}: {used} belongs to {case.subject}; a case for other "
        "models needs a number here"
        for tied, tie in case.ties.by_name.items()
        for used in tie.names
        if used in own and tied not in own
    ]
    if faults:
        raise CaseError(faults)


def with_exciter(case: Case, name: str, model: Model) -> Case:
    """Return a case with another exciter, by the ``name`` that a case gives it.

    Its free parameters and their bounds are those that ``exfit new`` writes, all others typical.
    Plant, tests, records and what is found about them stay. The case is no longer that of a file.
    Raises CaseError where it has no exciter, or where another part follows that.
    """
    if case.parts.exciter is None:
        raise CaseError(f"{case.path}: plant {case.plant.type} has no exciter to replace")
    symbols = (row.symbol for row in case.parts.exciter.sheet)
    own = {*symbols, *case.parameters.free, *case.parameters.fixed}  # with helpers of its ties
    _refuse_followers(case, own)
    others = (part for part in case.parts.all if part.kind != "exciter")
    multiplied = times_speed(model) if case.efd_times_speed else model
    exciter = exciter_part(multiplied, exponential=False)
    return replace(
        case,
        path=case.folder / f"{case.path.stem}-{model.name}",
        from_file=False,
        model=name,
        saturation="quadratic",
        parts=case.parts._replace(exciter=multiplied, all=(exciter, *others)),
        ties=Ties({tied: tie for tied, tie in case.ties.by_name.items() if tied not in own}),
        parameters=Parameters(free={row.symbol: _free_section(row) for row in free_of(model)}),
        given_values={key: given for key, given in case.given_values.items() if key not in own},
        given_sources={key: word for key, word in case.given_sources.items() if key not in own},
    )
