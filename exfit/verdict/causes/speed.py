"""A machine that turns faster or slower than rated, or that slows down, while its breaker is open.

Its voltage is the flux times the speed, the field current that of the flux.
"""

from collections.abc import Iterator
from dataclasses import replace

from exfit.case.changes import between
from exfit.fitting.nuisances import OF_SYSTEM, Nuisance
from exfit.fitting.residuals import Residuals
from exfit.fitting.system import system_of
from exfit.plants import SPEED
from exfit.results.cause import Cause
from exfit.simulation.inputs import InputStep
from exfit.verdict.causes.evidence import Evidence, Suspicion, suspected
from exfit.verdict.causes.trials import Opened, refitted, with_experiment, with_opened

FARTHEST = 0.1  # pu: protection trips a unit that is farther off
RARE = 5.0  # log-likelihood: a unit is mostly tested at rated speed


def turning(evidence: Evidence) -> Iterator[tuple[int, Residuals, list[Opened]]]:
    """Yield the residuals with each test whose speed nobody gives, and what to leave open of it.

    That is the speed at its start, and how far it changes, evenly, until its end.
    """
    case = evidence.case
    for number, _, experiment in evidence.tests:
        own, recording = experiment.simulator, case.recordings[number]
        seen = case.seen_from(recording)
        if not seen.kind.off_line or case.external is not None or SPEED in own.system.inputs:
            continue
        system = system_of(seen, recording, (SPEED,))
        begin, end, steps = own.inputs.start, own.inputs.end, own.inputs.steps
        change = InputStep(begin, 0.0, SPEED, ramp=end - begin)
        inputs = replace(own.inputs, steps=(*steps, change))
        levels = {**experiment.own, OF_SYSTEM["speed"]: 1.0}
        simulator = own.remade(system=system, inputs=inputs)
        changed = replace(experiment, simulator=simulator, own=levels)
        opened = [
            Opened.around(Nuisance("cause.speed", "speed"), 1.0, FARTHEST),
            Opened.around(Nuisance("cause.change", "step", len(steps)), 0.0, FARTHEST),
        ]
        yield number, with_experiment(evidence.residuals, number, changed), opened


def other_speed(evidence: Evidence) -> Iterator[Suspicion]:
    """Suspect the speed: off the rated one, and falling or rising evenly."""
    for number, changed, opened in turning(evidence):
        trial = refitted(evidence, with_opened(changed, number, opened))
        if trial is None:
            continue
        speed, change_of_speed = (trial.values[each.nuisance.name] for each in opened)
        cause = Cause(
            f"the speed{evidence.name_of(number)}: {speed:.4g} pu at the start and "
            f"{speed + change_of_speed:.4g} pu at the end would match, the case has 1",
            "look into the record of the speed or the frequency, or let the fit find it",
            "speed",
            {
                evidence.place(number, f"test.{key}"): between(
                    trial.values[each.nuisance.name], each.low, each.high
                )
                for key, each in zip(("speed", "speed_change"), opened, strict=True)
            },
        )
        yield from suspected(evidence, trial, len(opened), cause, -RARE)
