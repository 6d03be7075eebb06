"""What governors share: limits a unit may start on, the dead band of the speed, the rating.

A form with a dead band (TGOV1D) is no model of its own but the model (TGOV1) with DBH and DBL:
its equations take ``outside_band(u.dw, p)`` for the speed, its sheet has ``*BAND``, its records are
``banded``. ``governor`` makes the model: it adds Trate_Mbase to the sheet, makes of what is per
unit of the turbine what is per unit of the machine, and says both behind the drawing.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from inspect import cleandoc
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, NamedTuple

from exfit.models.blocks import Limited, Signal, clip, inf, limited, rate, where
from exfit.models.sheet import OF_TWO_PROGRAMS, Model, Parameter, Records, documented, record, sheet

# pu: a recorded power is known to about 1 % (transformers of class 0.5), a limit to two decimals
AT_LIMIT = 0.01

BAND = sheet(
    ("DBH", 0.0, "pu", (0.0, 1.0), "dead band above the rated speed"),
    ("DBL", 0.0, "pu", (-1.0, 0.0), "dead band below the rated speed"),
)
RATED = sheet(("Trate_Mbase", 1.0, "1", (0.01, 100.0), "turbine rating over the machine's base"))
OF_BAND = """
The speed acts as far as it is outside its dead band, from DBL to DBH, which
0 leaves out; a form with it has a D behind its name in a .dyr file."""
OF_RATING = """
All is per unit of the turbine, whose rating is Trate_Mbase times the machine's
base: 1 where Trate (MW) is 0. A .dyr file does not have that base: an import
names a Trate."""
# what records hold that have the rating, or not, and no band
ON_RATING = {"Trate_Mbase": 1.0}
PLAIN = {"DBH": 0.0, "DBL": 0.0, **ON_RATING}


class GateCurve(NamedTuple):
    """Symbols of the points of a curve over the gate; "" is the first height, 0, or a last gate, 1.

    ``beyond``, it may go on beyond a gate of 1, and points end before the first gate of 0;
    ``level``, its height may stay.
    """

    gates: tuple[str, ...]
    heights: tuple[str, ...]
    beyond: bool = False
    level: bool = False

    @property
    def symbols(self) -> set[str]:
        """All symbols of its points."""
        return {*self.gates, *self.heights} - {""}


def _numbered(height: str, count: int, beyond: bool = False, level: bool = False) -> GateCurve:
    gates, heights = (tuple(f"{name}{k}" for k in range(1, count + 1)) for name in ("GV", height))
    return GateCurve(gates, heights, beyond, level)


GATE_CURVES = (
    GateCurve(("G0", "G1", "G2", ""), ("", "P1", "P2", "P3")),
    _numbered("PGV", 6),
    _numbered("PGV", 10, beyond=True),
    _numbered("BGV", 10, beyond=True, level=True),
)


def in_use(start: Signal, limit: Signal) -> Signal:
    """Limit that acts: where a unit starts beyond it by at most AT_LIMIT, it is the start.

    ``start`` is what the limited value is at rest, or the limit where that is not beyond it. So
    does PowerWorld, however far beyond ("If Valve > Vmax, then Vmax = Valve", help on TGOV1).
    """
    near = (start - limit <= AT_LIMIT) & (limit - start <= AT_LIMIT)
    return where(near, start, limit)


def outside_band(dw: Signal, p: Signal) -> Signal:
    """Take the dead band off the change of the speed: without a step, as PowerWorld 24 does.

    A band of 0 is left out: its two edges would be one corner, where nothing changes.
    """
    none = (p.DBH <= 0.0) & (p.DBL >= 0.0)
    within = clip(dw, where(none, -1.0, p.DBL), where(none, 1.0, p.DBH))
    return where(none, dw, dw - within)


def banded(name: str, cons: str, **given: Any) -> Records:
    """Return the records of a governor and of its form with a dead band, which has its rating."""
    plain = record(name, cons, held=PLAIN, **given)
    return (*plain, *with_band(name, cons, **{"doubt": OF_TWO_PROGRAMS, **given}))


def with_band(name: str, cons: str, **given: Any) -> Records:
    """Return the record of the form of a governor with a dead band; it may have the rating."""
    cons = f"{cons} DBH DBL{'' if 'Trate' in cons.split() else ' Trate'}"
    ignored = dict.fromkeys(["Trate", *given.get("ignored", "").split()])
    return record(f"{name}D", cons, **{**given, "held": ON_RATING, "ignored": " ".join(ignored)})


def governor(
    equations: Callable[..., Any],
    rest: Callable[..., Any],
    rows: Iterable[Parameter],
    states: str,
    text: str = "",
    **given: Any,
) -> Model:
    """Return the documented model of a governor whose equations are per unit of its turbine."""
    rows = (*rows, *RATED)
    text = f"{(text or cleandoc(equations.__doc__ or '')).rstrip()}\n"
    text += "".join(OF_BAND for row in rows if row.symbol == "DBH") + OF_RATING

    def output(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
        return p.Trate_Mbase * equations(s, of_turbine(u, p), p, d)

    def at_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
        return rest(pm / p.Trate_Mbase, of_turbine(u, p), p, x)

    return documented(output, at_rest, rows, states, text=text, **given)


def of_turbine(u: Signal, p: Signal) -> SimpleNamespace:
    """Return the inputs of a governor with the power per unit of the turbine."""
    return SimpleNamespace(**{**vars(u), "p": u.p / p.Trate_Mbase})


def backlash(x: Signal, y: Signal, width: Signal) -> tuple[Signal, Limited]:
    """Play: y stays until x is farther than ``width`` from it, and then follows at that distance.

    A width of 0 is none.
    """
    none = width <= 0.0
    low, high = where(none, -inf, x - width), where(none, inf, x + width)
    return where(none, x, clip(y, low, high)), limited(0.0, y, low, high)


def curve(x: Signal, xs: Sequence[Signal], ys: Sequence[Signal]) -> Signal:
    """Return y on the lines through points (K,) that rise, the first and the last without end.

    A point that is not right of all before is left out, as the zeros that end a list in a file.
    """
    (x0, y0), *further = zip(xs, ys, strict=True)
    y = y0
    for k, (x1, y1) in enumerate(further):
        rises = x1 > x0
        line = y0 + (x - x0) * (y1 - y0) / where(rises, x1 - x0, 1.0)
        y = where(rises if k == 0 else rises & (x > x0), line, y)
        x0, y0 = where(rises, x1, x0), where(rises, y1, y0)
    return y


def delayed(u: Signal, x: Signal, v: Signal, T: Signal) -> tuple[Signal, Signal, Signal]:
    """exp(-sT) by its Padé approximant of order two, whose phase errs by (wT)^5 / 720.

    That is (1 - sT/2 + s²T²/12) / (1 + sT/2 + s²T²/12); at rest x is u, and v is 0.
    """
    pole = rate(T)
    return u - v, v * pole, (12.0 * (u - x) - 6.0 * v) * pole


def gate_faults(values: Mapping[str, float]) -> Iterable[tuple[str, str]]:
    """Yield (symbol, fault) where a curve over the gate does not rise, or ends behind a gate of 1.

    Points may coincide, and those at (0, 0) are none.
    """
    known = [curve for curve in GATE_CURVES if curve.symbols <= values.keys()]
    for curve in known:
        if any(curve.symbols < other.symbols for other in known):
            continue  # the first points of that one
        points = [
            (values.get(gate, 1.0), values.get(height, 0.0))
            for gate, height in zip(curve.gates, curve.heights, strict=True)
        ]
        names = zip(curve.gates[1:], curve.heights[1:], strict=True)
        for (gate, height), (before, after) in zip(names, pairwise(points), strict=True):
            text = _does_not_rise(before, after, curve)
            if text:
                yield height if curve.level else gate or height, text
        if points[-1][0] > 1.0 and not curve.beyond:
            yield curve.gates[-1], f"{points[-1][0]:g} is above 1, where the curve ends"


def _does_not_rise(
    before: tuple[float, float], after: tuple[float, float], curve: GateCurve
) -> str:
    """Say how a point is not above and behind the one before; nothing where it is, or is none."""
    none = after[0] == 0.0 if curve.beyond else after == (0.0, 0.0)
    along, up = after[0] - before[0], after[1] - before[1]
    if none or after == before or (up >= 0.0 if curve.level else along > 0.0 and up > 0.0):
        return ""
    text = f"({after[0]:g}, {after[1]:g}) is not above and behind the point before"
    return f"the point {text}, ({before[0]:g}, {before[1]:g})"
