"""A case to start from: a model, a record, and what is typical for all that is not known."""

from collections.abc import Iterator
from pathlib import Path
from textwrap import wrap

from exfit.case.suggestion import FILL_IN, bump_section, record_section, relative, weights_section
from exfit.case.templates import commented, parameter_line, source_lines
from exfit.models.blocks import SHORTEST
from exfit.models.machines import Machine
from exfit.models.sheet import Model, Parameter
from exfit.records.channel_inspection import InspectedChannel
from exfit.records.inspection import Inspection
from exfit.util.sources import TYPICAL
from exfit.util.text import yaml_number

WIDTH = 80  # columns of a note
ALONE = "FIRST_ORDER"  # the model whose output is vt itself
ON_LOAD = 0.05  # pu of power at rest: with less the breaker is taken for open
FIELD_WITHOUT_LOAD = (0.95, 1.6)  # of the voltage: air-gap line, and its excess by saturation
FIELD_ON_LOAD = (0.5, 5.0)  # of the voltage: under-excited to ceiling
BOUNDS = (0.1, 10.0)  # times the typical value


def free_of(model: Model) -> tuple[Parameter, ...]:
    """Return the parameters that a bump test is fitted for: those marked in the data sheet.

    Of a sheet without a mark, as a user's own may be, they are its time constants and gains.
    """
    marked = tuple(row for row in model.sheet if row.free)
    return marked or tuple(
        row
        for row in model.sheet
        if row.typical > 0.0 and (row.unit == "s" or row.symbol.upper().startswith("K"))
    )


def bounds_of(row: Parameter) -> tuple[float, float]:
    """Return a tenth and ten times the typical value, as far as the data sheet goes."""
    low, high = (share * row.typical for share in BOUNDS)
    if row.unit == "s":
        low = max(low, SHORTEST)
    return max(low, row.low), min(high, row.high)


def starting_case(
    model: Model, name: str, machine: Machine, inspection: Inspection, folder: Path
) -> str:
    """Return the text of a case of a model, by the ``name`` that the case gives it, and a record.

    ``folder`` is where the case will be written. What must be filled in is no number, so that the
    case is refused until it is.
    """
    lines = [
        f"# {model.name} on the record {_plain(inspection.path.name)}: a case to start from.",
        "# Values are typical: replace them by those of the unit, and the words under",
        "# `sources`. `exfit check` tries the case, `exfit identify` shows what its test",
        "# resolves, `exfit fit` fits.",
        *(line for text in inspection.findings for line in _note(text)),
        *(line for text in _other_bases(model, inspection) for line in _note(text)),
        "# about: {Plant: ..., Unit: ..., Rated: ..., Tested by: ...}  # for reports",
        f"model: {name}",
        *_plant(model, machine, inspection),
        *bump_section(inspection, vt0=model.name == ALONE),
        *record_section(inspection, relative(inspection.path, folder), only=("vt",)),
        *_parameters(model),
        *weights_section(inspection),
        "# validate:               # a record that the fit does not see, as the step down",
        "#   - name: down",
        "#     test: {vref: [{at: 1.0, step: -0.05}]}",
        "#     record: {file: down.csv, time: t, channels: {vt: vt}}",
    ]
    return "\n".join(lines) + "\n"


def _plant(model: Model, machine: Machine, inspection: Inspection) -> Iterator[str]:
    yield "plant:"
    if model.name == ALONE:
        yield "  type: none"
        return
    power, sources = inspection.channel_of("p"), dict[str, str]()
    if power is not None and _on_load(power):
        yield commented("  type: infinite-bus", f"{_plain(power.name)} shows power")
        yield from _network(inspection)
        sources = _network_sources(inspection)
    else:
        yield commented("  type: open-circuit", "the breaker is open, at rated speed")
    yield commented(f"  machine: {machine.name}", machine.title)
    yield "  parameters:"
    for row in machine.sheet:
        yield parameter_line(row, yaml_number(row.typical), "    ")
    sources |= {row.symbol: TYPICAL for row in machine.sheet}
    yield from source_lines(sources, "  ")


def _note(text: str) -> list[str]:
    """Return a note as lines of comment."""
    return wrap(f"# note: {_plain(text)}.", WIDTH, subsequent_indent="#   ", break_long_words=False)


def _other_bases(model: Model, inspection: Inspection) -> Iterator[str]:
    """Yield the field signals whose level in per unit is none that the machine has at rest."""
    power, voltage = inspection.channel_of("p"), inspection.channel_of("vt")
    loaded = power is not None and _on_load(power)
    vt = voltage.level if voltage is not None and voltage.seems_per_unit else 1.0
    low, high = (share * vt for share in (FIELD_ON_LOAD if loaded else FIELD_WITHOUT_LOAD))
    for signal in () if model.name == ALONE else ("efd", "ifd"):
        channel = inspection.channel_of(signal)
        if channel is None or not channel.seems_per_unit or low <= channel.level <= high:
            continue
        where = "on load" if loaded else "with the breaker open"
        yield (
            f"{channel.name} rests at {channel.level:.4g}, the model {where} at {low:.3g} to "
            f"{high:.3g} pu: 1 pu of {signal} is that of the air-gap line; give the channel a base"
        )


def _on_load(power: InspectedChannel) -> bool:
    """Return whether a channel shows active power at rest."""
    return not _per_unit(power) or abs(power.level) > ON_LOAD


def _network(inspection: Inspection) -> Iterator[str]:
    yield "  network:"
    yield commented(f"    f0: {FILL_IN}", "Hz, rated frequency")
    yield commented("    R: 0.0", "pu, resistance to the source")
    yield commented(f"    X: {FILL_IN}", "pu, reactance to the source: transformer and grid")
    yield commented(f"    P: {_level(inspection, 'p')}", "pu of the machine, before the step")
    yield commented(f"    Q: {_level(inspection, 'q')}", "pu, before the step")


def _network_sources(inspection: Inspection) -> dict[str, str]:
    """Return where the values of the network come from that are not to be filled in."""
    measured = [signal for signal in ("p", "q") if _level(inspection, signal) != FILL_IN]
    return {"R": TYPICAL, **{signal.upper(): "measured" for signal in measured}}


def _per_unit(channel: InspectedChannel) -> bool:
    return channel.unit in (None, "pu")


def _level(inspection: Inspection, signal: str) -> str:
    """Return the level of a signal at rest, to be filled in where the record does not show it."""
    channel = inspection.channel_of(signal)
    if channel is None or not _per_unit(channel):
        return FILL_IN
    return yaml_number(float(f"{channel.level:.4g}"))


def _parameters(model: Model) -> Iterator[str]:
    free = free_of(model)
    yield "parameters:"
    if len(free) < len(model.sheet):
        yield commented("  fixed:", "stays as it is; move to free what a fit is to find")
    for row in model.sheet:
        if row not in free:
            yield parameter_line(row, yaml_number(row.typical), "    ")
    if free:
        yield commented("  free:", "found between a tenth and ten times the typical value")
    for row in free:
        yield f"    # {row.unit}, {row.meaning}"
        start, low, high = map(_short, (row.typical, *bounds_of(row)))
        yield f"    {row.symbol}: {{start: {start}, min: {low}, max: {high}}}"
    yield from source_lines({row.symbol: TYPICAL for row in model.sheet if row not in free}, "  ")


def _short(value: float) -> str:
    return yaml_number(float(f"{value:.6g}"))


def _plain(text: str) -> str:
    """Return a text that fits into a comment."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
