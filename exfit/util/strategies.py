"""The strategies of a descent, and how far a search goes, in words.

`exfit.estimate.solver` holds the functions of the strategies.
"""

from collections.abc import Mapping

PHASES: Mapping[str, str] = {
    "lm": "Levenberg-Marquardt",
    "dgn": "damped Gauss-Newton",
    "gn": "Gauss-Newton",
}
FROM_FURTHER_STARTS = "search"  # in the history: the point that the search from them found
WEIGHTED_BY_NOISE = "noise"  # in the history: the point where errors are weighted by its covariance
HISTORY_PHASES: Mapping[str, str] = {
    **PHASES,
    FROM_FURTHER_STARTS: "found from further starts",
    WEIGHTED_BY_NOISE: "weighted by the noise of the driving signals",
}
STRATEGIES: Mapping[str, str] = {
    "gn": "Gauss-Newton with full steps (a first one that fails is shortened once)",
    "dgn": "damped Gauss-Newton: each step capped, then shortened until Armijo's rule holds",
    "lm": "Levenberg-Marquardt",
    "lm-then-dgn": "lm to reach a better start, then dgn, and lm again where that stalls",
    "auto": "dgn; where noise or validation casts doubt on its match lm-then-dgn",
    "robust": "gn while it makes progress, then lm",
}
DEFAULT_STRATEGY = "lm-then-dgn"
SEARCHES: Mapping[str, str] = {
    "global": "the descent from the start of the case by its strategy, then further descents from "
    "points distributed over the bounds; the lowest minimum is the result, or one that the records "
    "do not tell from it if the validations hold on that one alone",
    "local": "the descent from the start of the case alone",
}
DEFAULT_SEARCH = "global"
EXPLAINED = "; ".join(f"{name}: {words}" for name, words in STRATEGIES.items())
SEARCHES_EXPLAINED = "; ".join(f"{name}: {words}" for name, words in SEARCHES.items())
