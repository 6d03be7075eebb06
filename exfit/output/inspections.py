"""The content of a recorder's file as blocks."""

from collections.abc import Iterator, Sequence

from exfit.dsp.sampling import Sampling
from exfit.output.blocks import Block, Table, Verbatim, columns, notes, number, paragraph, row
from exfit.records.channel_inspection import InspectedChannel
from exfit.records.inspection import Inspection
from exfit.records.pmu_recognition import PmuContent

NAME_WIDTH = 22  # letters of a channel's name that leave room for its numbers
GUESSED = ("name", "level")  # where a unit may be from that the file does not state
MOST_ROWS = 40  # channels, steps or notes of a file that someone reads through
MOST_NAMES = 12  # of channels in one line
MORE = "... and {:,} more in inspect.json"


def inspection(result: Inspection, record: Sequence[str]) -> Iterator[Block]:
    """Yield the content of a file, and the sections of a case that it suggests."""
    clock = " and ".join(result.clock.columns)
    yield paragraph(
        f"{result.path.name}: {len(result.time)} samples by {clock}, "
        f"{result.sampling.start:.6g} ... {result.sampling.end:.6g} s"
    )
    yield paragraph(in_words(result.sampling))
    yield _channels(result)
    yield from _more(len(result.channels) - MOST_ROWS)
    of_pmu = frozenset[str]() if result.pmu is None else result.pmu.columns
    for line in _signals([each for each in result.channels if each.name not in of_pmu]):
        yield paragraph(line)
    if result.pmu is not None:
        yield paragraph(_of_pmu(result.pmu))
    kind = result.kind
    yield paragraph(f"a {kind.name}{'' if kind.sure else '?'}: {kind.why}")
    if result.steps and not result.is_event:
        yield _steps(result)
        yield from _more(len(result.steps) - MOST_ROWS)
    yield from notes(result.findings[:MOST_ROWS])
    yield from _more(len(result.findings) - MOST_ROWS)
    yield paragraph("sections of a case; check the guesses in # comments:")
    yield Verbatim("\n".join(record))


def _of_pmu(pmu: PmuContent) -> str:
    """Say what a file holds of a phasor measurement unit."""
    phasors = [phasor for phasor in (pmu.voltage, pmu.current) if phasor is not None]
    parts = [
        f"{phasor.quantity} {_some(phasor.magnitudes)} with the angle {_some(phasor.angles)}"
        f"{f', wrapped {phasor.wraps} times' if phasor.wraps else ''}"
        for phasor in phasors
    ]
    parts += [
        f"{what} {name}"
        for what, name in (
            ("frequency", pmu.frequency),
            ("its rate", pmu.rate),
            ("flags", pmu.status),
        )
        if name is not None
    ]
    return f"a phasor measurement unit: {'; '.join(parts)}"


def in_words(sampling: Sampling) -> str:
    """Say how a record is sampled."""
    rate = f"{sampling.rate:.4g} Hz" if sampling.rate >= 1.0 else f"every {sampling.step:.4g} s"
    if sampling.even:
        text = f"sampled evenly, {rate}, {1e3 * sampling.step:.6g} ms apart"
    else:
        low, high = 1e3 * sampling.smallest, 1e3 * sampling.largest
        text = (
            f"sampled unevenly, {rate}: {low:.4g} to {high:.4g} ms apart, "
            f"mostly {1e3 * sampling.step:.4g}"
        )
    count = len(sampling.gaps)
    return text + (f"; {count} gap{'s' if count > 1 else ''}" if count else "; no gaps")


def _channels(result: Inspection) -> Table:
    """Make the table of the channels; of many those that matter most."""
    heads = ("at rest", "smallest", "largest", "noise", "rounded to")
    many = len(result.channels) > MOST_ROWS
    rows = []
    for channel in result.foremost[:MOST_ROWS] if many else result.channels:
        name = channel.name
        if len(name) > NAME_WIDTH:
            name = name[: NAME_WIDTH - 1] + "…"
        rows.append(
            row(
                name,
                (channel.unit or "") + ("?" if channel.unit_from in GUESSED else ""),
                "" if channel.signal is None else channel.signal + ("" if channel.sure else "?"),
                number(channel.level),
                number(channel.low),
                number(channel.high),
                f"{channel.frequency:.4g} Hz" if channel.frequency else number(channel.noise, 2),
                number(channel.quantum, 2),
            )
        )
    return Table(columns("channel", "unit", "is", *heads, numbers=heads), tuple(rows))


def _more(count: int) -> Iterator[Block]:
    """Say how many rows are left out, if any are."""
    if count > 0:
        yield paragraph(MORE.format(count))


def _some(texts: Sequence[str]) -> str:
    """Join texts in one line, the first of many."""
    more = [MORE.format(len(texts) - MOST_NAMES)] * (len(texts) > MOST_NAMES)
    return ", ".join([*texts[:MOST_NAMES], *more])


def _signals(channels: Sequence[InspectedChannel]) -> Iterator[str]:
    """Name the signal of each channel, with the reason, and the channels without one."""
    for channel in channels:
        if channel.signal:
            surely = "sure" if channel.sure else "a guess"
            yield f"{channel.name} is {channel.signal}: {surely}, by {channel.why}"
    others = [channel.name for channel in channels if not channel.signal]
    if others:
        yield f"not recognised: {_some(others)}"


def _steps(result: Inspection) -> Table:
    rows = []
    for step in result.steps[:MOST_ROWS]:
        sizes = _some([f"{name} {size:+.4g}" for name, size in step.sizes.items()])
        at = f"{step.at:.4f}" if not step.from_start else f"<= {step.at:.4g}"
        rows.append(row(at, "-" if step.from_start else f"{step.error:.1g}", sizes))
    heads = columns("step at (s)", "+- (s)", "lasting changes", numbers=("step at (s)",))
    return Table(heads, tuple(rows))
