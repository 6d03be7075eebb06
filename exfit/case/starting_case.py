"""A case to start from: a model, a record, and what is typical for all that is not known."""

from collections.abc import Iterator
from pathlib import Path

from exfit.case.suggestion import FILL_IN, bump_section, record_section, relative
from exfit.case.templates import commented, parameter_line
from exfit.models.blocks import SHORTEST
from exfit.models.machines import Machine
from exfit.models.sheet import Model, Parameter, Sheet
from exfit.records.inspection import Inspection
from exfit.util.text import yaml_number

ALONE = "FIRST_ORDER"  # the model whose output is vt itself
ON_LOAD = 0.05  # pu of power at rest: with less the breaker is taken for open
BOUNDS = (0.1, 10.0)  # times the typical value
GAINS = ("pu", "pu/s", "pu s")  # units of a gain
# in what a parameter means: what a fit of a bump test leaves as it is
STAYS = (
    "transducer", "exciter constant", "source", "supply", "on load", "limit", "gate", "feedforward",
    "setting", "feedback gain of the field voltage loop", "1 for an integral",
)  # fmt: skip
PID = "proportional gain"
BEHIND_PID = ("KA",)
LOADING, ROTATING = "KC", "KD"


def free_of(model: Model) -> tuple[Parameter, ...]:
    """Return the parameters of a model that a bump test is fitted for.

    They are the gains and time constants of its data sheet that are typically above zero. Left out
    are limits and saturation, which a small step hardly reaches; the transducer, which is known;
    KE and what scales the supply, which base values fix; what acts on load or in a limiter; a gain
    behind a PID, whose products with the PID's gains alone act; a lead that its lag cancels; and
    the rectifier's loading where it moves nothing but a ceiling, in a static exciter.
    """
    rows = model.sheet
    rotating = {row.symbol for row in rows} >= {ROTATING}
    pid = any(PID in row.meaning for row in rows)
    return tuple(
        row
        for row in rows
        if row.typical > 0.0
        and _may_be_free(row)
        and not (pid and row.symbol in BEHIND_PID)
        and not (row.symbol == LOADING and not rotating)
        and not _cancels(row, rows)
    )


def bounds_of(row: Parameter) -> tuple[float, float]:
    """Return a tenth and ten times the typical value, as far as the data sheet goes."""
    low, high = (share * row.typical for share in BOUNDS)
    if row.unit == "s":
        low = max(low, SHORTEST)
    return max(low, row.low), min(high, row.high)


def starting_case(
    model: Model, name: str, machine: Machine, found: Inspection, folder: Path
) -> str:
    """Return the text of a case of a model, by the ``name`` that the case gives it, and a record.

    ``folder`` is where the case will stand. What must be filled in is no number, so that the case
    is refused until it is.
    """
    lines = [
        f"# {model.name} on the record {_plain(found.path.name)}: a case to start from.",
        "# Values are typical: put those of the unit in their place. `exfit check` tries",
        "# the case, `exfit identify` tells what its test leaves open, `exfit fit` fits.",
        *(f"# Look: {_plain(text)}." for text in found.findings),
        "# about: {Plant: ..., Unit: ..., Rated: ..., Tested by: ...}  # for reports",
        f"model: {name}",
        *_plant(model, machine, found),
        *bump_section(found, vt0=model.name == ALONE),
        *record_section(found, relative(found.path, folder), only=("vt",)),
        *_parameters(model),
        "# validate:               # a record that the fit does not see, as the step down",
        "#   - name: down",
        "#     test: {vref: [{at: 1.0, step: -0.05}]}",
        "#     record: {file: down.csv, time: t, channels: {vt: vt}}",
    ]
    return "\n".join(lines) + "\n"


def _may_be_free(row: Parameter) -> bool:
    """Tell whether a parameter is a gain or a time constant, and none that stays."""
    if any(word in row.meaning for word in STAYS):
        return False
    gain = row.symbol.startswith("K") and row.unit in GAINS
    return gain or row.unit in ("s", "1/s") or "lead" in row.meaning


def _cancels(row: Parameter, rows: Sheet) -> bool:
    """Tell whether a lead and its lag are alike."""
    other = (
        row.meaning.replace("lead", "lag")
        if "lead" in row.meaning
        else row.meaning.replace("lag", "lead")
    )
    return any(
        one.meaning == other and one.typical == row.typical for one in rows if one is not row
    )


def _plant(model: Model, machine: Machine, found: Inspection) -> Iterator[str]:
    yield "plant:"
    if model.name == ALONE:
        yield "  type: none"
        return
    power = found.channel_of("p")
    per_unit = power is not None and power.unit in (None, "pu")
    on_load = power is not None and (not per_unit or abs(power.level) > ON_LOAD)
    if on_load and power is not None:
        reactive = found.channel_of("q")
        yield commented("  type: infinite-bus", f"{_plain(power.name)} shows power")
        yield "  network:"
        yield commented(f"    f0: {FILL_IN}", "Hz, rated frequency")
        yield commented("    R: 0.0", "pu, resistance to the source")
        yield commented(f"    X: {FILL_IN}", "pu, reactance to the source: transformer and grid")
        yield commented(f"    P: {_level(found, 'p')}", "pu of the machine, before the step")
        told = reactive is not None and reactive.unit in (None, "pu")
        yield commented(f"    Q: {_level(found, 'q') if told else FILL_IN}", "pu, before the step")
    else:
        yield commented("  type: open-circuit", "the breaker is open, at rated speed")
    yield commented(f"  machine: {machine.name}", machine.title)
    yield "  parameters:"
    for row in machine.sheet:
        yield parameter_line(row, yaml_number(row.typical), "    ")


def _level(found: Inspection, signal: str) -> str:
    one = found.channel_of(signal)
    if one is None or one.unit not in (None, "pu"):
        return FILL_IN
    return yaml_number(float(f"{one.level:.4g}"))


def _parameters(model: Model) -> Iterator[str]:
    free = free_of(model)
    yield "parameters:"
    if len(free) < len(model.sheet):
        yield commented("  fixed:", "stays as it is; what a fit shall find goes under free")
    for row in model.sheet:
        if row not in free:
            yield parameter_line(row, yaml_number(row.typical), "    ")
    if free:
        yield commented("  free:", "found between a tenth and ten times the typical value")
    for row in free:
        low, high = bounds_of(row)
        yield f"    # {row.unit}, {row.meaning}"
        values = (f"{_short(row.typical)}", f"{_short(low)}", f"{_short(high)}")
        yield f"    {row.symbol}: {{start: {values[0]}, min: {values[1]}, max: {values[2]}}}"


def _short(value: float) -> str:
    return yaml_number(float(f"{value:.6g}"))


def _plain(text: str) -> str:
    """Return a text that fits into a comment."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
