"""A breaker that opens in a record: a load rejection, which is no step of the reference."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from exfit.dsp.quality import present_median
from exfit.dsp.sampling import present_samples
from exfit.dsp.step_detection import running_median
from exfit.records.channel_inspection import InspectedChannel
from exfit.util.arrays import Array

POWERS, CURRENT = ("p", "q"), "it"  # what is zero without a stator current
NEAR_ZERO = 0.03  # of the largest power or current: transducers have such an offset
NOISE_OF_ZERO = 6.0  # times the noise: as near to zero
CERTAIN_FALL = 3.0  # times what is near zero: a smaller one may be a unit that is run down
FALLS_WITHIN = 0.15  # s, and a few samples: transducers of power take so long
FEW_SAMPLES = 5
FEWEST_BESIDE = 10  # samples before and after the opening
STILL_EXCITED = 0.3  # of its level before: a voltage that goes on
LOOKED_AT_AFTER = 2.0  # s
JUMP = (0.02, 20.0)  # of the voltage's level and times its noise: the least between two samples
FASTER_THAN_BESIDE = 4.0  # times what it moves from sample to sample just before and after
LONGEST_INTERVAL = 0.02  # s between two samples: in more a regulator moves the voltage, too
BEFORE_OPENING, RESPONDS_FOR = 0.5, 60.0  # s: what seems a step from then to then responds to it
REMEDY = (
    "a case has plant: {type: machine-on-load, ...} and test: {breaker: {opens: {start: auto}}}, "
    "as configs/rejection.yaml and docs/plants.md (Load rejection) show"
)


@dataclass(frozen=True)
class BreakerOpening:
    """The instant (s) at which the breaker of a unit on load opens, within ``error``.

    ``levels`` are those of power and stator current until then by signal, in the units of their
    columns, and ``seen_in`` the columns that fall to zero. Where none is recorded it is a guess by
    a ``jump`` of the voltage, as a share of its level.
    """

    at: float
    error: float
    seen_in: tuple[str, ...]
    levels: Mapping[str, float]
    jump: float | None = None

    @property
    def shown(self) -> str:
        """What the record shows of it."""
        columns = " and ".join(self.seen_in)
        if self.jump is not None:
            return (
                f"{columns} jumps by {100.0 * self.jump:+.2g} % at {self.at:.4g} s, between two "
                "samples, faster than any exciter"
            )
        falls = "falls" if len(self.seen_in) == 1 else "fall"
        return f"{columns} {falls} permanently to zero at {self.at:.4g} s"

    @property
    def in_words(self) -> str:
        """What the record shows, and what it is."""
        opens = "seems to open (a load rejection), or is it the grid?"
        if self.jump is None:
            opens = "opens (a load rejection), which is no step of the reference"
        return f"{self.shown}: the breaker {opens}"

    def causes(self, at: float) -> bool:
        """Check whether a step (s) that a channel seems to show is the response to the opening."""
        return -BEFORE_OPENING <= at - self.at <= RESPONDS_FOR


def breaker_opening(
    time: Array, samples: Mapping[str, Array], channels: Sequence[InspectedChannel]
) -> BreakerOpening | None:
    """Return the opening of the breaker that the channels of a record show, (M,) each, or None.

    It is the fall of all recorded powers and stator currents to zero while the voltage goes on,
    or, where none of them is recorded, a jump of the voltage between two samples.
    """
    by_signal = {channel.signal: channel for channel in channels if not channel.frequency}
    voltage = by_signal.get("vt")
    loads = {signal: by_signal[signal] for signal in (*POWERS, CURRENT) if signal in by_signal}
    unnamed = {each.name: each for each in channels if each.may_be_load and not each.frequency}
    if not loads and len(unnamed) > 1:
        loads = _falling(time, samples, unnamed)
    if not loads:
        return None if voltage is None else _jump(time, samples[voltage.name], voltage)
    opening = _fall(time, samples, loads)
    if opening is not None and voltage is not None:
        begin, end = opening.at - opening.error, opening.at + opening.error
        u = samples[voltage.name]
        before = present_median(u[(time < begin) & (time >= begin - LOOKED_AT_AFTER)])
        after = present_median(u[(time > end) & (time <= end + LOOKED_AT_AFTER)])
        if not abs(after) > STILL_EXCITED * abs(before):
            return None
    return opening


def _falling(
    time: Array, samples: Mapping[str, Array], channels: Mapping[str, InspectedChannel]
) -> dict[str, InspectedChannel]:
    """Find two open channels or more that fall to zero for good, as only a load does."""
    falling = {}
    for name, channel in channels.items():
        t, y = present_samples(time, samples[name])
        if len(y) < 4 * FEWEST_BESIDE:
            continue
        smooth = running_median(y)
        zero = max(NEAR_ZERO * float(np.max(np.abs(smooth))), NOISE_OF_ZERO * channel.noise)
        fall = _fall_of(t, smooth, zero)
        if abs(fall.level) > CERTAIN_FALL * zero and not fall.remains:
            falling[name] = channel
    return falling if len(falling) > 1 else {}


def _fall(
    time: Array, samples: Mapping[str, Array], loads: Mapping[str, InspectedChannel]
) -> BreakerOpening | None:
    """Find the fall of powers and currents to zero, None where any of them does not."""
    times, smooth, largest = dict[str, Array](), dict[str, Array](), dict[str, float]()
    for signal, channel in loads.items():
        t, y = present_samples(time, samples[channel.name])
        few = len(y) < 4 * FEWEST_BESIDE
        times[signal], smooth[signal] = (t[:0], y[:0]) if few else (t, running_median(y))
        largest[signal] = float(np.max(np.abs(smooth[signal]), initial=0.0))
    power = max((largest[signal] for signal in POWERS if signal in largest), default=0.0)
    zeros = {  # what counts as zero; powers have one scale
        signal: max(
            NEAR_ZERO * (power if signal in POWERS else largest[signal]),
            NOISE_OF_ZERO * channel.noise,
        )
        for signal, channel in loads.items()
    }
    falls = {signal: _fall_of(times[signal], smooth[signal], zeros[signal]) for signal in loads}
    certain = [
        signal for signal in loads if abs(falls[signal].level) > CERTAIN_FALL * zeros[signal]
    ]
    if not certain or any(fall.remains for fall in falls.values()):
        return None
    first = min(map(falls.__getitem__, certain), key=attrgetter("start"))
    return BreakerOpening(
        0.5 * (first.start + first.end),
        0.5 * (first.end - first.start),
        tuple(loads[signal].name for signal in certain),
        {signal: falls[signal].level for signal in sorted(loads.keys() & {*POWERS, CURRENT})},
    )


class _Fall(NamedTuple):
    """The last fall of a signal to zero: its level before, the two samples between, its end."""

    level: float = 0.0
    start: float = 0.0
    end: float = 0.0
    remains: bool = False


def _fall_of(time: Array, smooth: Array, zero: float) -> _Fall:
    """Return the fall of a signal (M,) to what counts as zero; without a level where it has none.

    The signal ``remains`` where it does not end there.
    """
    away = np.flatnonzero(np.abs(smooth) > zero)
    if not len(away):
        return _Fall()
    last = int(away[-1])
    if last >= len(smooth) - FEWEST_BESIDE:
        return _Fall(remains=True)
    begun = min(int(np.searchsorted(time, time[last] - FALLS_WITHIN)), last - FEW_SAMPLES)
    if begun < FEWEST_BESIDE:
        return _Fall()
    level = float(np.median(smooth[begun - FEWEST_BESIDE : begun]))
    half_gone = np.flatnonzero(np.abs(smooth[: last + 1]) > 0.5 * abs(level))
    gone = int(half_gone[-1]) if len(half_gone) else last
    return _Fall(level, float(time[gone]), float(time[gone + 1]))


def _jump(time: Array, samples: Array, channel: InspectedChannel) -> BreakerOpening | None:
    """Return the largest move of a voltage from one sample to the next, if it is a jump."""
    t, y = present_samples(time, samples)
    if len(y) < 2 * FEWEST_BESIDE or not channel.level:
        return None
    moves = np.abs(np.diff(y))
    k = int(np.argmax(moves))
    beside = np.delete(moves[max(k - FEW_SAMPLES, 0) : k + FEW_SAMPLES + 1], min(k, FEW_SAMPLES))
    share, times = JUMP
    least = max(share * abs(channel.level), times * channel.noise)
    jumps = moves[k] > max(least, FASTER_THAN_BESIDE * float(np.max(beside)))
    inside = FEWEST_BESIDE <= k < len(y) - FEWEST_BESIDE
    if not (jumps and inside and t[k + 1] - t[k] <= LONGEST_INTERVAL):
        return None
    middle, half = 0.5 * float(t[k] + t[k + 1]), 0.5 * float(t[k + 1] - t[k])
    return BreakerOpening(
        middle, half, (channel.name,), {}, float(y[k + 1] - y[k]) / abs(channel.level)
    )


def rejection_findings(opening: BreakerOpening | None) -> Iterator[str]:
    """Describe a record in which the breaker opens."""
    if opening is not None:
        yield f"{opening.in_words}; {REMEDY}"
