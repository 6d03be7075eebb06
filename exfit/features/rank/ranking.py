"""Which of several models of the same records describes them best, and which they refute.

The models need not be nested, so that no likelihood ratio between them has a known distribution;
they are compared by the Bayesian information criterion (Schwarz 1978), whose difference is a weight
of evidence (Kass & Raftery 1995, section 3.2: above 10 it is very strong). Residuals that are not
white say the same over and over: each channel counts as its effective number of samples (the
quasi-likelihood of Burnham & Anderson 2002, section 2.5), that of the better model. Vuong's test
(1989) would need many steps: the difference of two responses is in a part of one.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log, nan, sqrt
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from exfit.fitting.noise import LEAST_NOISE
from exfit.inference.noise import effective_samples, is_white, whiteness
from exfit.inference.wording import listed
from exfit.results.comparisons import Comparison
from exfit.results.model import FitResult
from exfit.results.side_by_side import NOT_ACCEPTED, outcome_of
from exfit.results.verdict import GOOD, MATCHES, MISSES

Array = NDArray[np.float64]
Records = Literal["fit", "validation"]

# difference of the criterion from which on a model is refuted: a rival with as many parameters
# fits so much more of the noise by chance in one record of thirty, even with seven of them
STRONG = 10.0
# a search that has not ended well says nothing of its model
JUDGED = (GOOD, MATCHES, MISSES, NOT_ACCEPTED)


@dataclass(frozen=True)
class RankedModel:
    """A model among others: how well it matches, and what the records determine of it.

    outcome          the verdict on its fit, or that a validation is not accepted
    rmse             root mean square error of the fitted records, of the judged signals, per unit
    validation_rmse  of the records that no fit saw; None where there are none
    bic              Bayesian information criterion, above the lowest of all
    free             how many parameters of the unit were fitted, ``determined`` of them on both
                     sides
    refuted_by       the records, fitted or unseen, that another model describes so much better
                     that it is refuted; None where its search did not end well
    typical          the values of the exciter that were typical and not fitted
    typical_machine  the data of the machine that were, and act: as long as there are any, it is
                     not shown that the records refute a model, which other data may let match
    """

    name: str
    model: str
    outcome: str
    rmse: Annotated[float, nan]
    validation_rmse: float | None
    bic: Annotated[float, nan]
    free: int
    determined: int
    at_bound: tuple[str, ...]
    typical: Mapping[str, float]
    refuted_by: tuple[Records, ...] | None
    typical_machine: tuple[str, ...] = ()

    @property
    def matches(self) -> bool:
        """Whether its fit can be used."""
        return self.outcome in (GOOD, MATCHES)

    @property
    def possible(self) -> bool:
        """Whether no record refutes it."""
        return self.refuted_by == ()


@dataclass(frozen=True)
class Likelihood:
    """The errors (channels,) of some records: mean squares, samples, how many of them count.

    ``effective`` is conservative for responses that differ slowly, as those of exciters do.
    """

    squares: Array
    samples: Array
    effective: Array

    @classmethod
    def of(cls, comparisons: Sequence[Comparison]) -> "Likelihood":
        """Compute the likelihood of comparisons."""
        channels = [
            overlay.error[np.isfinite(overlay.error)]
            for match in comparisons
            for overlay in match.overlays.values()
        ]
        # below the least noise of a recorder nothing says more
        squares = [max(float(np.mean(errors**2)), LEAST_NOISE**2) for errors in channels]
        samples = np.array([*map(len, channels)], dtype=float)
        return cls(np.array(squares), samples, np.array([*map(_effective, channels)]))

    def deviance(self, samples: Array) -> float:
        """Return -2 log of the likelihood of so many samples, each channel's noise unknown.

        What is the same for all models is left out.
        """
        return float(samples @ np.log(self.squares))


def ranked(
    results: Mapping[str, FitResult], typical_machine: tuple[str, ...] = ()
) -> tuple[RankedModel, ...]:
    """Return models by their results, the best first: by unseen records, else by the criterion.

    All results are of the same records, and of a machine whose data act that are typical.
    """
    if not results:
        return ()
    fits = [*results.values()]
    fitted = [Likelihood.of(result.comparisons) for result in fits]
    unseen = [Likelihood.of(result.validation) for result in fits]
    counts = [len(result.parameters) for result in fits]
    judged = [outcome_of(result) in JUDGED for result in fits]
    refuted: dict[Records, list[bool]] = {
        "fit": _refuted(fitted, counts, judged),
        "validation": _refuted(unseen, [0] * len(fits), judged),
    }
    criteria = _criteria(fitted, counts)
    models = [
        _ranked(
            name,
            result,
            criterion - min(criteria),
            tuple(kind for kind, by in refuted.items() if by[k]) if judged[k] else None,
            typical_machine,
        )
        for k, ((name, result), criterion) in enumerate(zip(results.items(), criteria, strict=True))
    ]
    return tuple(sorted(models, key=_order))


def _order(model: RankedModel) -> tuple[bool, float, float]:
    validation = model.validation_rmse
    return model.refuted_by is None, 0.0 if validation is None else validation, model.bic


def _ranked(
    name: str,
    result: FitResult,
    bic: float,
    refuted_by: tuple[Records, ...] | None,
    typical_machine: tuple[str, ...],
) -> RankedModel:
    own = {key: each for key, each in result.parameters.items() if not each.of_record}
    return RankedModel(
        name=name,
        model=result.model,
        outcome=outcome_of(result),
        rmse=_rmse(result.comparisons),
        validation_rmse=_rmse(result.validation) if result.validation else None,
        bic=bic,
        free=len(own),
        determined=sum(parameter.determined for parameter in own.values()),
        at_bound=tuple(key for key, parameter in own.items() if parameter.at_bound),
        typical={key: result.fixed[key] for key in result.typical if key in result.fixed},
        refuted_by=refuted_by,
        typical_machine=typical_machine,
    )


def _rmse(comparisons: Sequence[Comparison]) -> float:
    return sqrt(sum(match.rmse**2 for match in comparisons) / len(comparisons))


def _criteria(models: Sequence[Likelihood], counts: Sequence[int]) -> list[float]:
    """Return the criterion of each model, but for a sum that all share."""
    effective = min(models, key=lambda model: model.deviance(model.samples)).effective
    penalty = log(max(float(np.sum(effective)), 1.0))
    return [
        model.deviance(effective) + count * penalty
        for model, count in zip(models, counts, strict=True)
    ]


def _refuted(
    models: Sequence[Likelihood], counts: Sequence[int], judged: Sequence[bool]
) -> list[bool]:
    """Find the models that another one describes the records strongly better than.

    What a better model has in more parameters counts against it; what it has in fewer does not
    count for it: that a model is larger than it need be is no evidence against it.
    """
    return [
        own
        and any(
            judged[k] and _gap(better, model, counts[k] - count) > STRONG
            for k, better in enumerate(models)
            if better is not model
        )
        for model, count, own in zip(models, counts, judged, strict=True)
    ]


def _gap(better: Likelihood, model: Likelihood, more: int) -> float:
    """Excess of the criterion of a model over that of another, never by its size."""
    gain = model.deviance(better.effective) - better.deviance(better.effective)
    return gain - max(more, 0) * log(max(float(np.sum(better.effective)), 1.0))


def _effective(errors: Array) -> float:
    """Number of independent samples that errors are worth: all of them where they are white."""
    return float(len(errors)) if is_white(whiteness(errors)) else effective_samples(errors)


def ranking_sentences(models: Sequence[RankedModel]) -> Iterator[str]:
    """Yield the sentences about models that the records tell apart, and about those they do not."""
    judged = [model for model in models if model.refuted_by is not None]
    if len(judged) > 1:
        yield _judgement(judged)
    if models and not any(model.matches for model in models):
        yield "none of these models matches the records"
    for model in models:
        if model.refuted_by is None:
            yield f"{model.name} is not judged: its search ended {model.outcome}"
    if len(judged) > 1 and judged[0].validation_rmse is None:
        yield "a record that no fit saw, under `validate`, tells models apart that this one cannot"


def _judgement(judged: Sequence[RankedModel]) -> str:
    """Select the models that the records do not refute."""
    possible = [model.name for model in judged if model.possible]
    typical = dict.fromkeys(name for model in judged for name in model.typical_machine)
    if typical and len(possible) < len(judged):
        best = listed(possible or [min(judged, key=lambda model: model.bic).name])
        return (
            f"with this machine the records match {best} best; that they refute the others is not "
            f"shown: {listed([*typical])} {'is' if len(typical) == 1 else 'are'} typical, and "
            "other values may let them match: give the machine's own, or free them under plant.free"
        )
    if len(possible) > 1:
        return (
            f"the records cannot tell {listed(possible)} apart: none of them is better by "
            f"{STRONG:g} of the criterion, apart from what more parameters gain"
        )
    if possible:
        return f"the records refute all of these models but {possible[0]}"
    best = min(judged, key=lambda model: model.bic).name
    if judged[0].name == best:
        return f"no model describes all channels best; {best} is the best on the whole"
    return (
        f"no model describes all records: {best} is the best on those fitted, {judged[0].name} on "
        "those that no fit saw. What the fitted step does not show, such as a limit that is "
        "typical here, decides the others: give it, or fit all records together"
    )
