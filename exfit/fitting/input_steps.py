"""The steps of a test, as the simulation takes them."""

from collections.abc import Iterator, Mapping

from exfit.case.case import Case
from exfit.case.schema import (
    BumpTest,
    StepSection,
    Switch,
    Unknown,
    start_value,
)
from exfit.errors import CaseError
from exfit.plants import BREAKER, NETWORK, REFERENCES
from exfit.simulation.inputs import InputStep

Values = Mapping[str, float]


def input_steps(case: Case, test: BumpTest, values: Values) -> list[InputStep]:
    """List the changes that a test makes, in the order of time; a switch sets a value from then on.

    ``values`` are those of the network at the start. Raises CaseError where the source would lose
    its voltage.
    """
    steps = [*_of_signals(test), *_of_angle(test), *_opening(test)]
    now = {name: values.get(NETWORK + name) for name in ("R", "X", "E")}
    events: list[StepSection | Switch] = [*test.E, *test.network]
    for event in sorted(events, key=lambda event: event.at):
        for name, level in now.items():
            step = _step_of(event, name, level)
            if step is not None:
                steps.append(InputStep(event.at, step, name))
                now[name] = None if level is None else level + step
        if now["E"] is not None and now["E"] <= 0.0:
            text = f"at {event.at:g} s the source falls to {now['E']:g} pu; it must stay above 0"
            raise CaseError([f"{case.path}: test: {text}"])
    return sorted(steps, key=lambda step: step.at)


def _of_signals(test: BumpTest) -> Iterator[InputStep]:
    """Yield the steps and ramps of the reference and of the stabiliser's signal."""
    for signal in REFERENCES:
        for event in test.events(signal):
            at, step = start_value(event.at) or 0.0, start_value(event.step) or 0.0
            yield InputStep(at, step, signal, isinstance(event.at, Unknown), event.ramp or 0.0)


def _of_angle(test: BumpTest) -> Iterator[InputStep]:
    """Yield the steps and ramps of the angle of the source, rad."""
    for event in test.angle_steps:
        yield InputStep(event.at, event.radians, "angle", ramp=event.ramp or 0.0)


def _opening(test: BumpTest) -> Iterator[InputStep]:
    """Yield the opening of the breaker."""
    if test.breaker is not None:
        opens = test.breaker.opens
        yield InputStep(start_value(opens) or 0.0, 1.0, BREAKER, isinstance(opens, Unknown))


def _step_of(event: StepSection | Switch, name: str, level: float | None) -> float | None:
    """Change of R, X or E by an event; None where it leaves it."""
    if isinstance(event, StepSection):
        return event.step if name == "E" else None
    then: float | None = getattr(event, name)
    return None if then is None or level is None else then - level
