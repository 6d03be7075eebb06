"""Whether the unit is of another type: other exciters by trial, where nothing else explains it."""

from collections.abc import Iterator, Sequence
from math import inf, isfinite, sqrt

import numpy as np

from exfit.case.other_model import ALONE, with_exciter
from exfit.errors import ExfitError
from exfit.fitting.build import build_experiments
from exfit.fitting.problem import residuals_of
from exfit.fitting.uncertainty import slices
from exfit.inference.noise import is_white, whiteness
from exfit.models import MODELS, find
from exfit.models.families import relatives
from exfit.results.cause import Cause
from exfit.verdict.causes.evidence import (
    Evidence,
    OutOfTime,
    Suspicion,
    Trial,
    largest_likelihood,
    likelihood,
    suspected,
)
from exfit.verdict.causes.trials import refitted
from exfit.verdict.residual_tests import step_pattern

OTHERS = "other exciters"  # what was not tried, in a note
OF_SCATTER = 10.0  # variance of the logarithm of a squared scatter, times the samples it is from
STRUCTURE = 0.01  # of the error beyond the noise: what leaves more is less likely than the model
BETTER = 5.0  # log-likelihood: half of the difference of criteria by which `rank` rejects a model
MOST_NAMED = 3  # exciters, the best first


def with_model(evidence: Evidence, suspicions: Sequence[Suspicion]) -> list[Suspicion]:
    """Return suspicions, the likeliest first, with that of the model.

    Others of its type are tried where the first leaves errors that are not white. Where there was
    no time for that, or none is better, it stands second if the first leaves much unexplained, else
    last.
    """
    kind, others = evidence.case.kind, list[Suspicion]()
    if not kind.has_exciter:
        return [*suspicions]
    if not (kind.finds_rest or evidence.pace.untried):  # an event takes too long
        if _explained(evidence, suspicions):
            return [*suspicions]
        try:
            others += _better(evidence, suspicions)
        except (KeyboardInterrupt, OutOfTime) as ending:
            evidence.pace.stopped((OTHERS,), isinstance(ending, KeyboardInterrupt))
    if not others:
        return _with_unnamed(evidence, suspicions)
    return sorted([*suspicions, *others], key=lambda each: -each.likelihood)


def _explained(evidence: Evidence, suspicions: Sequence[Suspicion]) -> bool:
    """Test whether the likeliest cause leaves white errors, which show nothing of the steps."""
    trial = next((each.trial for each in suspicions if isfinite(each.likelihood)), None)
    if trial is None:
        return False
    errors, blocks = trial.residuals(trial.theta), iter(slices(trial.residuals.sizes))
    for experiment in trial.residuals.experiments:
        simulator = experiment.with_inputs(trial.values)
        instants = [step.at + simulator.delay for step in simulator.inputs.steps]
        for channel in experiment.channels:
            own, time = errors[next(blocks)], simulator.times[channel.kept]
            pattern = step_pattern(own, np.searchsorted(time, instants).tolist())
            if not (is_white(whiteness(own)) and is_white(pattern)):
                return False
    return True


def _better(evidence: Evidence, suspicions: Sequence[Suspicion]) -> Iterator[Suspicion]:
    """Suspect the model where another one of its type matches better than with any other cause."""
    case, found = evidence.case, dict[str, Trial]()
    own = case.parts.exciter
    if own is None or case.external is not None:
        return
    catalogue = [name for name in MODELS if name != ALONE]
    for name in relatives(own.name, catalogue)[1:]:
        try:
            other = with_exciter(case, name, find(name, case.folder))
            trial = refitted(evidence, residuals_of(other, build_experiments(other)))
        except ExfitError:  # its values may tie another part, or have no start at rest
            continue
        if trial is not None:
            found[name] = trial
    count = len(evidence.residuals.free)
    likelihoods = {
        name: likelihood(evidence, trial.cost, len(trial.residuals.free) - count)
        for name, trial in found.items()
    }
    best = sorted(found, key=lambda name: -likelihoods[name])
    so_far = largest_likelihood(suspicions)
    named = [
        name
        for name in best[:MOST_NAMED]
        if likelihoods[name] > max(so_far, likelihoods[best[0]] - BETTER)
    ]
    if named:
        cause = Cause(
            f"the model: {', '.join(named)} would match better than {case.subject}",
            f"compare: exfit rank CASE --models {','.join((case.subject, *named))}",
        )
        trial = found[named[0]]
        numbers = len(trial.residuals.free) - count
        yield from suspected(evidence, trial.cost, numbers, cause)


def _with_unnamed(evidence: Evidence, suspicions: Sequence[Suspicion]) -> list[Suspicion]:
    """Return suspicions with that of a model that is not named."""
    samples = max(1, evidence.residuals.samples)
    noise = evidence.noise_cost * (1.0 + 2.0 * sqrt(OF_SCATTER / samples))
    beyond = evidence.cost - noise
    if beyond <= 0.0:
        return [*suspicions]
    own = likelihood(evidence, noise + STRUCTURE * beyond)
    cause = Cause(
        f"the model: the unit may be of another type than {evidence.case.subject}",
        "compare others: exfit rank CASE --models A,B",
    )
    place = 1 if -inf < largest_likelihood(suspicions) < own else len(suspicions)
    return [*suspicions[:place], Suspicion(cause, own), *suspicions[place:]]
