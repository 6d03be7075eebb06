"""Which of several models of the same records describes them best, and which they reject.

The models need not be nested, so that no likelihood ratio between them has a known distribution;
they are compared by the Bayesian information criterion (Schwarz 1978), whose difference is a weight
of evidence (Kass & Raftery 1995, section 3.2: above 10 it is very strong). Residuals that are not
white repeat themselves: each channel counts as its effective number of samples (the
quasi-likelihood of Burnham & Anderson 2002, section 2.5), that of the better model. Vuong's test
(1989) would need many steps: the difference of two responses is in a part of one.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log, nan, sqrt
from typing import Annotated, Literal

import numpy as np

from exfit.fitting.noise import LEAST_NOISE
from exfit.inference.noise import effective_samples, is_white, whiteness
from exfit.results.comparisons import Comparison
from exfit.results.model import FitResult
from exfit.results.side_by_side import NOT_ACCEPTED, outcome_of
from exfit.results.verdict import GOOD, MATCHES, MISSES
from exfit.util.arrays import Array
from exfit.util.text import listed

Records = Literal["fit", "validation"]

# difference of the criterion from which on a model is rejected: a rival with as many parameters
# fits so much more of the noise by chance in one record of thirty, even with seven of them
STRONG = 10.0
# a search that has not ended well says nothing of its model
JUDGED = (GOOD, MATCHES, MISSES, NOT_ACCEPTED)


@dataclass(frozen=True)
class RankedModel:
    """A model among others: how well it matches, and what the records determine of it.

    outcome          the verdict on its fit, or that a validation is not accepted
    rmse             root mean square error of the fitted records, of the judged signals, per unit
    validation_rmse  of the records that were not fitted; None where there are none
    bic              Bayesian information criterion, above the lowest of all
    free             how many parameters of the unit were fitted, ``determined`` of them on both
                     sides
    refuted_by       the records, fitted or unseen, that another model describes so much better
                     that it is rejected; None where its search did not end well
    typical          the values of the exciter that were typical and not fitted
    typical_machine  the data of the machine that were, and act: as long as there are any, it is
                     not shown that the records reject a model, which other data may let match
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
        """Whether no record rejects it."""
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
        effective = [
            float(len(errors)) if is_white(whiteness(errors)) else effective_samples(errors)
            for errors in channels
        ]
        return cls(np.array(squares), samples, np.array(effective))

    @property
    def penalty(self) -> float:
        """What the criterion counts for a parameter."""
        return log(max(float(np.sum(self.effective)), 1.0))

    def deviance(self, samples: Array) -> float:
        """Return -2 log of the likelihood of so many samples, each channel's noise unknown.

        What is the same for all models is left out.
        """
        return float(samples @ np.log(self.squares))

    def gap(self, other: "Likelihood", more: int) -> float:
        """Excess of the criterion of another model, which has so many parameters fewer.

        What this one has in more parameters counts against it; what it has in fewer does not count
        for it: that a model is larger than it need be is no evidence against it.
        """
        gain = other.deviance(self.effective) - self.deviance(self.effective)
        return gain - max(more, 0) * self.penalty


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
    # the criterion of each, but for a sum that all share
    best = min(fitted, key=lambda model: model.deviance(model.samples))
    criteria = [
        model.deviance(best.effective) + count * best.penalty
        for model, count in zip(fitted, counts, strict=True)
    ]
    models = [
        _ranked_model(
            name,
            result,
            criterion - min(criteria),
            tuple(kind for kind, by in refuted.items() if by[k]) if judged[k] else None,
            typical_machine,
        )
        for k, ((name, result), criterion) in enumerate(zip(results.items(), criteria, strict=True))
    ]
    return tuple(
        sorted(models, key=lambda m: (m.refuted_by is None, m.validation_rmse or 0.0, m.bic))
    )


def _ranked_model(
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


def _refuted(
    models: Sequence[Likelihood], counts: Sequence[int], judged: Sequence[bool]
) -> list[bool]:
    rivals = [
        (model, count) for model, count, own in zip(models, counts, judged, strict=True) if own
    ]
    return [
        own and any(rival.gap(model, more - count) > STRONG for rival, more in rivals)
        for model, count, own in zip(models, counts, judged, strict=True)
    ]


def ranking_sentences(models: Sequence[RankedModel]) -> Iterator[str]:
    """Yield the sentences about models that the records distinguish, and that they do not."""
    judged = [model for model in models if model.refuted_by is not None]
    if len(judged) > 1:
        yield _comparison(judged)
    if models and not any(model.matches for model in models):
        yield "none of these models matches the records"
    for model in models:
        if model.refuted_by is None:
            yield f"{model.name} is not judged: {model.outcome}"
    if len(judged) > 1 and judged[0].validation_rmse is None:
        yield "add a record under `validate`: it may distinguish models that the fitted ones do not"


def _comparison(judged: Sequence[RankedModel]) -> str:
    """Word which models the records do not reject, and which is best where they reject all."""
    possible = [model.name for model in judged if model.possible]
    typical = [*dict.fromkeys(name for model in judged for name in model.typical_machine)]
    best = min(judged, key=lambda model: model.bic).name
    if typical and len(possible) < len(judged):
        return (
            f"with this machine the records match {listed(possible or [best])} best; the others "
            f"are not rejected: {listed(typical)} {'is' if len(typical) == 1 else 'are'} typical, "
            "and with other values they may match: give those of the machine, or free them under "
            "plant.free"
        )
    if len(possible) > 1:
        return (
            f"the records do not distinguish {listed(possible)}: their criteria differ by at most "
            f"{STRONG:g}, apart from what more parameters gain"
        )
    if possible:
        return f"the records reject all of these models but {possible[0]}"
    if judged[0].name == best:
        return f"no model describes all channels best; {best} is the best overall"
    return (
        f"no model describes all records: {best} is the best on those fitted, {judged[0].name} on "
        "the others. These depend on what the fitted step does not show, such as a limit that is "
        "typical here: give its value, or fit all records together"
    )
