"""A model as data: its data sheet, its states and its functions."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from inspect import cleandoc
from itertools import chain, pairwise
from math import inf, isfinite
from types import MappingProxyType
from typing import Any, NamedTuple

from exfit.errors import ModelError
from exfit.util.text import magnitude_fault

Limits = tuple[float, float]

MOST_LAGS = 8  # of a ramp tracking filter of a stabiliser, M N


class SearchRange(NamedTuple):
    """The search of a bump test's fit for a parameter: from ``low`` to ``high``, where units lie.

    It is left out where the parameter that it ``needs`` is zero, as the lag of a term without its
    gain; where it equals the time that it must be ``unlike``, as a lead that its lag cancels; and
    where a lag and a lead that it is ``instead_of`` do its work.
    """

    low: float = 0.0
    high: float = inf
    needs: str = ""
    unlike: str = ""
    instead_of: tuple[str, ...] = ()


FREE = SearchRange()  # ends the row of a parameter that a bump test is fitted for
LOADING = SearchRange(high=1.0)  # a rectifier that commutates longer supplies nothing
DEMAGNETISING = SearchRange(high=3.0)
FEEDBACK = SearchRange(high=1.0)
REGULATOR_LAG = SearchRange(high=1.0)
EXCITER_LAG = SearchRange(low=0.02, high=10.0)
LAG_OF_KF = SearchRange(needs="KF")
LEAD_OF_TB, LAG_OF_TC = SearchRange(unlike="TB"), SearchRange(unlike="TC")

# units and ranges of many rows: limits, gains, and times, of which 0 leaves out a lag or a lead
Kind = tuple[str, Limits]
LIMIT = ("pu", (-9999.0, 9999.0))
WITHIN_10, WITHIN_1000 = ("pu", (-10.0, 10.0)), ("pu", (-1000.0, 1000.0))
WITHIN_10000 = ("pu", (-10000.0, 10000.0))
UP_TO_10, UP_TO_100 = ("pu", (0.0, 10.0)), ("pu", (0.0, 100.0))
UP_TO_1000, UP_TO_10000 = ("pu", (0.0, 1000.0)), ("pu", (0.0, 10000.0))
GAIN, PID_GAIN = ("pu", (0.01, 100000.0)), ("pu", (0.0, 100000.0))
INTEGRAL_GAIN = ("pu/s", (0.0, 100000.0))
SHORT_TIME, TIME, LONG_TIME = ("s", (0.0, 10.0)), ("s", (0.0, 100.0)), ("s", (0.0, 1000.0))
POSITIVE_TIME, WASHOUT_TIME = ("s", (0.01, 100.0)), ("s", (0.01, 1000.0))
DIVIDING_TIME = ("s", (0.001, 100.0))


class Parameter(NamedTuple):
    """One row of a data sheet; between ``low`` and ``high`` lie its physical values.

    ``search`` says how a fit of a bump test finds it, unless the case says otherwise. Fixed are, as
    a rule, limits and saturation, which a small step hardly reaches; the transducer, which is
    known; KE and what scales the supply, which base values fix; what acts on load or in a limiter;
    a gain behind a PID, of which the products with the PID's gains alone act; a lead and its lag
    that typically cancel; and the rectifier's loading in a static exciter, where it moves a ceiling
    alone.
    """

    symbol: str
    typical: float
    unit: str
    low: float
    high: float
    meaning: str
    search: SearchRange | None = None

    @property
    def free(self) -> bool:
        """Whether a bump test is fitted for it, as a rule."""
        return self.search is not None

    @property
    def is_time(self) -> bool:
        """Whether it is a time constant."""
        return self.unit == "s"

    @property
    def domain(self) -> Limits:
        """The range in which the equations hold, at least ``low`` to ``high``.

        A gain or factor (its name begins with K) may have any size, and any sign unless the sheet
        begins above 0: then it is divided by. A time constant may be as long as it likes. Whatever
        else there is, as a voltage or the saturation, ends where its sheet does.
        """
        if self.is_time:
            return self.low, inf
        if self.symbol.upper().startswith("K"):
            return (self.low if self.low > 0.0 else -inf), inf
        return self.low, self.high

    def is_physical(self, value: float) -> bool:
        """Test for a value in the range of the sheet."""
        return self.low <= value <= self.high

    def range_fault(self, value: float) -> str | None:
        """Explain a value that the equations exclude; None where they do not."""
        fault = magnitude_fault(value) if isfinite(value) else None
        if fault is not None:
            return fault
        low, high = self.domain
        if isfinite(value) and low <= value <= high:
            return None
        if value < low and high == inf:
            return f"{value:g} is below {low:g} {self.unit}, the least that the equations allow"
        return f"{value:g} lies outside {self.physical_range}, its data sheet's range"

    @property
    def physical_range(self) -> str:
        """The range of the sheet, in words."""
        return f"{self.low:g} ... {self.high:g} {self.unit}"


Sheet = tuple[Parameter, ...]
Row = tuple[str, float, str, Limits, str] | tuple[str, float, str, Limits, str, SearchRange]


SharedRow = tuple[str, str, Limits, str] | tuple[str, str, Limits, str, SearchRange]


def sheet(*rows: Row | Parameter) -> Sheet:
    """Make the data sheet of rows (symbol, typical value, unit, (low, high), meaning).

    FREE, or another range of search, behind the meaning marks what a bump test is fitted for.
    Rows that exciters share stand among them as ``*shared(TR=0.0, KA=46.0)``.
    """
    made: list[Parameter] = []
    for row in rows:
        if not isinstance(row, Parameter):
            symbol, typical, unit, (low, high), *described = row
            row = Parameter(symbol, float(typical), unit, float(low), float(high), *described)
        made.append(row)
    return tuple(made)


def limits(ceiling: str, high: float, low: float, of: str, kind: Kind = LIMIT) -> Sheet:
    """Make the rows of the ceiling and the floor of something, ``VRMAX`` and ``VRMIN``."""
    floor = ceiling.replace("MAX", "MIN")
    return sheet((ceiling, high, *kind, f"ceiling of {of}"), (floor, low, *kind, f"floor of {of}"))


def table(*rows: SharedRow) -> Sheet:
    """Make rows that models share, of (name, unit, (low, high), meaning): see ``chosen``."""
    return tuple(
        Parameter(name, 0.0, unit, *bounds, meaning, *search)
        for name, unit, bounds, meaning, *search in rows
    )


def chosen(rows: Sheet, **typical: float) -> Sheet:
    """Take rows of a table by their names, each with the typical value of this model, ``KA=46.0``.

    A name is a symbol, followed by _ and a word where the symbol has several meanings.

    Raises KeyError for a name that is not in the table.
    """
    known = {row.symbol: row for row in rows}
    return tuple(
        known[name]._replace(symbol=name.partition("_")[0], typical=value)
        for name, value in typical.items()
    )


# rows that exciters share by name: the unit, the range and the meaning of each
SHARED = (
    *table(
        ("TR", "s", (0.0, 1.0), "voltage transducer lag"),
        ("KA", *GAIN, "regulator gain", FREE),
        ("TA", *TIME, "regulator time constant", REGULATOR_LAG),
        ("TB", *TIME, "regulator lag"),
        ("TC", *TIME, "regulator lead"),
        ("VRMAX", *LIMIT, "regulator ceiling"),
        ("VRMIN", *LIMIT, "regulator floor"),
        ("KE", *UP_TO_10, "exciter constant"),
        ("TE", *POSITIVE_TIME, "exciter time constant", EXCITER_LAG),
        ("KF", *UP_TO_10, "stabilising feedback gain", FEEDBACK),
        ("TF", *POSITIVE_TIME, "stabilising feedback time constant", LAG_OF_KF),
        ("E1", *UP_TO_100, "first voltage of the saturation curve"),
        ("SE1", *UP_TO_1000, "saturation at E1"),
        ("E2", *UP_TO_100, "second voltage of the saturation curve"),
        ("SE2", *UP_TO_1000, "saturation at E2"),
        ("KC", *UP_TO_100, "rectifier loading factor"),
        ("KD", *UP_TO_100, "demagnetising factor", DEMAGNETISING),
        ("VEMIN", *LIMIT, "floor of the exciter voltage"),
        ("KP", "pu", (0.01, 100.0), "potential source gain"),
        ("KI", *UP_TO_100, "current source gain, on load"),
        ("XL", *UP_TO_10, "reactance of the potential source, on load"),
        ("THETAP", "deg", (-360.0, 360.0), "angle of the potential source, on load"),
        ("VBMAX", "pu", (0.01, 9999.0), "ceiling of the source voltage"),
        ("VBMAX1", "pu", (0.01, 9999.0), "ceiling of the source voltage"),
        ("KC1", *UP_TO_100, "loading factor of the supply's rectifier"),
        ("VFEMAX", *LIMIT, "ceiling of the exciter's field current"),
        ("VAMAX", *LIMIT, "regulator ceiling"),
        ("VAMIN", *LIMIT, "regulator floor"),
        ("KIR", *INTEGRAL_GAIN, "integral gain", FREE),
        ("TDR", *SHORT_TIME, "lag of the derivative", SearchRange(needs="KDR")),
        ("TF1", *POSITIVE_TIME, "stabilising feedback time constant", LAG_OF_KF),
        ("KG", *UP_TO_100, "feedback gain of the field voltage loop"),
        ("EFDMAX", "pu", (0.01, 9999.0), "ceiling of the field voltage"),
        ("EFDN", *UP_TO_100, "field voltage where the feedback gain changes"),
        ("K", *GAIN, "regulator gain", FREE),
        ("KA_FIXED", "pu", (0.0001, 100000.0), "regulator gain"),
        ("KB", "pu", (0.01, 10000.0), "second stage gain"),
        ("KC_FREE", *UP_TO_100, "rectifier loading factor", LOADING),
        ("KDR", "pu s", (0.0, 100000.0), "derivative gain", SearchRange(needs="TDR")),
        ("KD_OF_PID", "pu s", (0.0, 100000.0), "derivative gain", SearchRange(needs="TD")),
        ("KE_ABOVE_0", "pu", (0.01, 10.0), "exciter constant"),
        ("KE_OR_0", *WITHIN_10, "exciter constant, or 0"),
        ("KE_SIGNED", *WITHIN_10, "exciter constant"),
        ("KF_FIXED", *UP_TO_10, "stabilising feedback gain"),
        ("KF_TO_EFDN", *UP_TO_10, "stabilising feedback gain up to EFDN", FEEDBACK),
        ("KH", *UP_TO_100, "feedback gain of the exciter's field current", FREE),
        ("KIR_OF_REGULATOR", *INTEGRAL_GAIN, "integral gain of the regulator", FREE),
        ("KI_OF_PID", *INTEGRAL_GAIN, "integral gain", FREE),
        ("KLR", *UP_TO_1000, "field current limiter gain"),
        ("KN", *UP_TO_10, "stabilising feedback gain beyond EFDN"),
        ("KPR", *PID_GAIN, "proportional gain", FREE),
        ("KPR_OF_REGULATOR", *PID_GAIN, "proportional gain of the regulator", FREE),
        ("KP_OF_PID", *PID_GAIN, "proportional gain", FREE),
        ("KP_OR_0", *UP_TO_100, "potential source gain"),
        ("KR", "pu", (0.01, 1000.0), "gain of the regulator's supply"),
        ("SW1", "1", (1.0, 2.0), "supply: 1 terminals, 2 independent"),
        ("TATB", "1", (0.0, 100.0), "regulator lead, as a share of its lag", FREE),
        ("TA_FIXED", *SHORT_TIME, "regulator time constant"),
        ("TA_OF_FIRING", *SHORT_TIME, "firing circuit time constant", FREE),
        ("TB_ALONE", *TIME, "regulator lag", FREE),
        ("TB_FREE", *TIME, "regulator lag", LAG_OF_TC),
        ("TC_FREE", *TIME, "regulator lead", LEAD_OF_TB),
        ("TD", *SHORT_TIME, "lag of the derivative", SearchRange(needs="KD")),
        ("TE_OR_0", *SHORT_TIME, "exciter time constant", EXCITER_LAG),
        ("TF2", *TIME, "stabilising feedback lag"),
        ("VEMAX", *LIMIT, "ceiling of the exciter voltage"),
        ("VGMAX", "pu", (0.0, 9999.0), "ceiling of the field voltage feedback"),
        ("VRMAX_AT_VT_OR_0", *LIMIT, "regulator ceiling at rated voltage, or 0"),
        ("VRMAX_OR_0", *LIMIT, "regulator ceiling, or 0"),
        ("VRMIN_AT_VT", *LIMIT, "regulator floor at rated voltage"),
    ),
    *limits("VIMAX", 0.0, 0.0, "the voltage error"),
    *limits("VPIDMAX", 0.0, 0.0, "the PID"),
    *limits("VMMAX", 0.0, 0.0, "the field voltage loop"),
    *limits("VRMAX_OF_EFD", 0.0, 0.0, "the field voltage"),
    *limits("VRMAX_OF_EFD_AT_VT", 0.0, 0.0, "the field voltage at rated voltage"),
    *limits("VRMAX_OF_EXCITER", 0.0, 0.0, "the exciter's field voltage"),
)
shared = partial(chosen, SHARED)


def renamed(rows: Sheet, **symbols: str) -> Sheet:
    """Return a data sheet with other symbols for some quantities, ``VRMAX="EFEMAX"``."""
    return tuple(row._replace(symbol=symbols.get(row.symbol, row.symbol)) for row in rows)


def with_typical(rows: Sheet, **values: float) -> Sheet:
    """Return a data sheet with other typical values for some symbols, ``KA=210.0``."""
    return tuple(row._replace(typical=values.get(row.symbol, row.typical)) for row in rows)


def not_searched(rows: Sheet, *symbols: str) -> Sheet:
    """Return a data sheet of which a fit of a bump test leaves some symbols as they are."""
    return tuple(row._replace(search=None) if row.symbol in symbols else row for row in rows)


@dataclass(frozen=True)
class DynamicsRecord:
    """The entry of a model in a planner's file: the symbols of its constants (CONs) in their order.

    ``icons`` are the integers before or, where they are listed, among them, each a symbol and the
    only value that the model stands for, unless its sheet has the symbol; ``absent`` are symbols
    that the model does not have, with the only value that it stands for; ``held`` are those of the
    model that the record does not have, with the value that makes the model that of the record;
    ``unused`` are those that the program reads and does without, always or where another one is 0,
    which is named: the model then has 0; ``exchanged`` are two whose values change places there;
    ``ignored`` are symbols (integers too) that act only where a limiter does, or otherwise not in
    the model's own equations: any value will do; ``doubt`` says what is not settled about the
    order; ``spelled`` are symbols with their names in the file, where these differ by more than
    capitals; ``times_speed`` says that efd is multiplied by the speed there; ``places`` are where a
    limiter acts by the value of its flag, OEL or UEL, which is one of the integers; ``signals`` are
    those of the codes of a stabiliser's inputs, where they are others than usual; ``user`` is what
    stands between the name of a user's model and its data.
    """

    name: str
    cons: tuple[str, ...]
    icons: tuple[tuple[str, int], ...]
    absent: tuple[tuple[str, float], ...]
    ignored: tuple[str, ...]
    doubt: str
    held: tuple[tuple[str, float], ...] = ()
    times_speed: bool = False
    spelled: tuple[tuple[str, str], ...] = ()
    places: tuple[tuple[int, str], ...] = ()
    unused: tuple[tuple[str, str], ...] = ()
    exchanged: tuple[str, ...] = ()
    signals: tuple[tuple[int, str], ...] = ()
    user: tuple[str, ...] = ()


Records = tuple[DynamicsRecord, ...]
NONE: Mapping[Any, Any] = MappingProxyType({})


def record(
    name: str,
    cons: str,
    *,
    icons: Mapping[str, int] = NONE,
    absent: Mapping[str, float] = NONE,
    ignored: str = "",
    doubt: str = "",
    held: Mapping[str, float] = NONE,
    times_speed: bool = False,
    spelled: Mapping[str, str] = NONE,
    places: Mapping[int, str] = NONE,
    unused: Mapping[str, str] = NONE,
    exchanged: str = "",
    signals: Mapping[int, str] = NONE,
    user: str = "",
) -> Records:
    """Return a record from its symbols in one text, ``"TR KA TA"``; several are added."""
    made = DynamicsRecord(
        name,
        tuple(cons.split()),
        tuple(icons.items()),
        tuple(absent.items()),
        tuple(ignored.split()),
        doubt,
        tuple(held.items()),
        times_speed,
        tuple(spelled.items()),
        tuple(places.items()),
        tuple(unused.items()),
        tuple(exchanged.split()),
        tuple(signals.items()),
        tuple(user.split()),
    )
    return (made,)


def record_of_2016(
    name: str,
    cons: str,
    *,
    flags: str = "OEL UEL",
    switches: str = "",
    places: Mapping[int, str] = NONE,
    doubt: str = "",
    user: str = "",
) -> Records:
    """Return a record whose integers say where limiters act, its flags, and what it switches."""
    icons = dict.fromkeys(f"{flags} {switches}".split(), 1)
    return record(name, cons, icons=icons, ignored=flags, places=places, doubt=doubt, user=user)


# what is not settled about orders of PSLF
OF_A_LIST = "its order is that of a public list of parameters, not confirmed by a file"
AS_IN_PSSE = "its order is taken to be that of PSS/E, not confirmed by a file"
# what is not settled about orders of PSS/E
OF_TWO_PROGRAMS = "its order is as InterPSS and PowerWorld read it, not confirmed by PSS/E"
# what flags of limiters mean (InterPSS); 0 says that the input is not used
ONE_GATE = {1: "summing", 2: "takeover"}
TWO_GATES = {**ONE_GATE, 3: "takeover-output"}


@dataclass(frozen=True)
class Model:
    """An exciter, a stabiliser, a governor or a limiter: the content of its file, under one name.

    ``equations(s, u, p, d)`` takes states, inputs and parameters, writes the slopes into ``d`` and
    returns the output; ``rest(output, u, p, x)`` writes the states that hold an output at rest into
    ``x`` and returns the reference that does so. Setpoints are what it finds at the start and then
    keeps: ``rest`` writes them beside the states, ``equations`` reads them there. ``records`` are
    its PSS/E records, its own one first, ``pslf_records`` those of PSLF; ``inputs`` the signals
    that a stabiliser or a limiter listens to, ``places`` where a limiter may act on an exciter, the
    usual one first; ``doubt`` what is not settled about its diagram, to be read behind its name;
    ``dialects`` the equations of programs that have others, with the fields that these replace.

    A governor's output is the turbine's power Pm, its reference ``pref``; it sees ``dw``, the speed
    less 1, and ``p``, the electrical power, all per unit on the machine's base.
    """

    name: str
    title: str
    drawing: str
    aliases: tuple[str, ...]
    sheet: Sheet
    states: tuple[str, ...]
    setpoints: tuple[str, ...]
    records: Records
    inputs: tuple[str, ...]
    equations: Callable[..., Any]
    rest: Callable[..., Any]
    pslf_records: Records = ()
    places: tuple[str, ...] = ()
    doubt: str = ""
    dialects: tuple[tuple[str, tuple[tuple[str, Any], ...]], ...] = ()

    def in_dialect(self, dialect: str) -> "Model":
        """Return the model with the equations that another program has for it, where it has."""
        return replace(self, **dict(dict(self.dialects).get(dialect, ())))


def documented(
    equations: Callable[..., Any],
    rest: Callable[..., Any],
    rows: Sheet,
    states: str,
    *,
    text: str | None = None,
    setpoints: str = "",
    aliases: str = "",
    records: Records = (),
    pslf_records: Records = (),
    inputs: str = "",
    places: str = "",
    doubt: str = "",
    dialects: Mapping[str, Mapping[str, Any]] = NONE,
) -> Model:
    """Return the model that the docstring of its equations names and draws, or a ``text``.

    It begins with ``NAME: title``; then comes the drawing.
    """
    heading, _, drawing = (text or cleandoc(equations.__doc__ or "")).partition("\n")
    name, _, title = heading.partition(": ")
    return Model(
        name=name,
        title=title.rstrip("."),
        drawing=drawing.strip("\n"),
        aliases=tuple(aliases.split()),
        sheet=tuple(rows),
        states=tuple(states.split()),
        setpoints=tuple(setpoints.split()),
        records=records,
        inputs=tuple(inputs.split()),
        equations=equations,
        rest=rest,
        pslf_records=pslf_records,
        places=tuple(places.split()),
        doubt=doubt,
        dialects=tuple((program, tuple(own.items())) for program, own in dialects.items()),
    )


NEEDED = ("equations", "rest", "SHEET", "STATES")  # of a file that defines a model
OPTIONAL = ("SETPOINTS", "ALIASES", "RECORDS", "PSLF_RECORDS", "INPUTS", "PLACES", "DOUBT")


def model(name: str, parts: Mapping[str, Any]) -> Model:
    """Return the model that a file's names define.

    Raises ModelError where one is missing: a docstring ``NAME: title``, then the drawing, and
    SHEET, STATES, equations and rest.
    """
    _refuse_incomplete(name, parts)
    equations, rest, rows, states = (parts[part] for part in NEEDED)
    given = {part.lower(): parts[part] for part in OPTIONAL if part in parts}
    for part in ("aliases", "inputs", "places"):
        if not isinstance(given.get(part, ""), str):  # listed one by one
            given[part] = " ".join(given[part])
    for part in {"records", "pslf_records"} & given.keys():
        several = (each if isinstance(each, tuple) else (each,) for each in given[part])
        given[part] = tuple(chain.from_iterable(several))
    found = documented(equations, rest, rows, states, text=str(parts["__doc__"]), **given)
    names = {
        "STATES": (*found.states, *found.setpoints),
        "SHEET": tuple(row.symbol for row in found.sheet),
    }
    for part, listed in names.items():
        repeated = sorted({symbol for symbol in listed if listed.count(symbol) > 1})
        if repeated:
            raise ModelError(f"model {name}: {part}: duplicate name: {', '.join(repeated)}")
    return replace(found, name=name)


def _refuse_incomplete(name: str, parts: Mapping[str, Any]) -> None:
    """Raise ModelError where a file lacks a part of a model, or one is of another kind."""
    missing = [part for part in ("__doc__", *NEEDED) if not parts.get(part)]
    if missing:
        raise ModelError(f"model {name}: its file lacks {', '.join(missing)}")
    equations, rest, rows, states = (parts[part] for part in NEEDED)
    if not all(isinstance(row, Parameter) for row in rows):
        raise ModelError(f"model {name}: its SHEET is not what sheet(...) returns")
    texts, functions = (states, parts.get("SETPOINTS", "")), (equations, rest)
    if not (all(isinstance(text, str) for text in texts) and all(map(callable, functions))):
        raise ModelError(
            f"model {name}: STATES (and SETPOINTS) must be a text of names, equations and "
            "rest must be functions"
        )


def typical(rows: Sheet) -> dict[str, float]:
    """Return the typical value of every parameter."""
    return {row.symbol: row.typical for row in rows}


def crossed_limits(values: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Yield (symbol, fault) for each lower limit ``MIN`` that is not below its ``MAX``."""
    for symbol, low in values.items():
        partner = symbol.replace("MIN", "MAX")
        if partner != symbol and partner in values and low >= values[partner]:
            yield symbol, f"{low:g} is not below {partner} = {values[partner]:g}"


class SaturationPoint(NamedTuple):
    """A point of a saturation curve and the names of its values."""

    e: float
    se: float
    of_e: str
    of_se: str


def saturation_points(values: Mapping[str, float]) -> list[SaturationPoint]:
    """Return the two points of a curve, the lower voltage first; none without a saturation.

    Where both SE are zero there is none, and E1 and E2 say nothing.
    """
    if not {"E1", "SE1", "E2", "SE2"} <= values.keys() or values["SE1"] == values["SE2"] == 0.0:
        return []
    names = ("E1", "SE1"), ("E2", "SE2")
    return sorted(SaturationPoint(values[e], values[se], e, se) for e, se in names)


def saturation_faults(values: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Yield (symbol, fault) where two saturation points contradict each other.

    VX = E SE grows with the voltage; at zero voltage there is none.
    """
    for low, high in pairwise(saturation_points(values)):
        if low.e == high.e:
            yield "E1", f"{low.e:g} equals E2: two points are needed"
        elif low.e == 0.0 < low.se:
            yield low.of_e, f"0 is no point of a saturation curve, unless {low.of_se} is 0"
        elif high.e * high.se <= low.e * low.se:
            yield high.of_se, _not_above(low, high)


def _not_above(low: SaturationPoint, high: SaturationPoint) -> str:
    return f"{high.se:g} at {high.e:g} pu is not above {low.se:g} at {low.e:g} pu"


def stabiliser_faults(values: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Yield (symbol, fault) for a ramp tracking filter, a transducer or a switch that cannot be."""
    lags = values.get("M", 1.0) * values.get("N", 1.0)
    if "N" in values and lags > MOST_LAGS:
        yield "N", f"M N = {lags:g} lags of the ramp tracking filter exceed {MOST_LAGS}"
    if values.get("ALI", 0.0) > 0.0 and values["BLI"] == 0.0:  # of PSS4B
        yield "BLI", f"0 leaves the transducer with ALI = {values['ALI']:g} undamped"
    on, off = values.get("PPSSON", 0.0), values.get("PPSSOFF", 0.0)
    if off > on > 0.0:
        yield "PPSSOFF", f"{off:g} is above PPSSON = {on:g}"


def contradictions(values: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Yield (symbol, fault) for what does not go together in any model's values."""
    yield from crossed_limits(values)
    if {"P1", "GV1"} & values.keys():
        from exfit.models.governor_parts import gate_faults

        yield from gate_faults(values)
    yield from saturation_faults(values)
    yield from stabiliser_faults(values)


def exponential_faults(values: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Yield (symbol, fault) for a saturation that is zero at one point, or that falls."""
    for low, high in pairwise(saturation_points(values)):
        for point in (low, high):
            if point.se == 0.0:
                text = "0 lies on no exponential saturation curve; give both SE as 0, or neither"
                yield point.of_se, text
        if high.se <= low.se and high.e * high.se > low.e * low.se:
            yield high.of_se, _not_above(low, high)
