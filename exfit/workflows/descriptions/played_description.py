"""How a record was played into a unit, in words: what drove it, from which rest, and how."""

from collections.abc import Iterator

from exfit.case.case import Case
from exfit.case.schema import Filter, MedianSection, Recording
from exfit.fitting.setup import ExperimentSetup
from exfit.plants.playback import initial
from exfit.signals import COMPARED_IN_EVENT, unit_of_signal
from exfit.util.text import show

RESTING = ("vt", *COMPARED_IN_EVENT)  # in the order in which a rest is described
SWING = {
    "power": "swing equation: Pm is a power, its torque (Pm - D dw) / (1 + dw)",
    "torque": "swing equation: Pm is a torque, less D dw",
}


def played_in(view: Case, recording: Recording, setup: ExperimentSetup) -> Iterator[str]:
    """Yield how a record was played in; nothing where it was not.

    ``view`` is the case with the plant of the record.
    """
    if not setup.driving:
        return
    yield f"recorded {' and '.join(setup.driving)} played in"
    if setup.test.steady is not None:
        levels = ", ".join(_levels(setup))
        yield f"at rest until {setup.test.steady:.4g} s" + (f" with {levels}" if levels else "")
    if view.kind.has_machine and view.kind.has_exciter:
        yield SWING[getattr(view.plant, "swing", "power")]
    masks = (*recording.record.mask, *(switching.masked for switching in setup.switchings))
    left_out = ", ".join(f"{start:.4g} ... {end:.4g} s" for start, end in masks)
    if left_out:
        yield f"left out of the comparison: {left_out}"
    everything = _filter(recording.record.filter)
    if everything:
        yield f"all channels {everything}"
    yield from _filters(recording)


def _levels(setup: ExperimentSetup) -> Iterator[str]:
    """Yield the levels at the start that the record gives."""
    for signal in RESTING:
        level = setup.experiment.own.get(initial(signal))
        if level is not None and signal in setup.record.signals:
            yield f"{signal} {level:.4g} {unit_of_signal(signal)}"


def _filters(recording: Recording) -> Iterator[str]:
    """Yield the filters of the channels."""
    for signal, channel in recording.record.channels.items():
        text = _filter(channel.filter)
        if text:
            yield f"{signal} {text}"


def _filter(given: Filter | None) -> str:
    """Return a filter in words; "" for none."""
    if given is None:
        return ""
    if isinstance(given, MedianSection):
        return f"as medians of {given.median} samples"
    return f"below {show(given.lowpass)} Hz"
