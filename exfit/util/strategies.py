"""The strategies of a search, in words; `exfit.estimate.strategies` holds their functions."""

from collections.abc import Mapping

PHASES: Mapping[str, str] = {
    "lm": "Levenberg-Marquardt",
    "dgn": "damped Gauss-Newton",
    "gn": "Gauss-Newton",
}
STRATEGIES: Mapping[str, str] = {
    "gn": "Gauss-Newton, full steps only",
    "dgn": "damped Gauss-Newton",
    "lm": "Levenberg-Marquardt",
    "lm-then-dgn": "lm as far as the valley, dgn along it, lm again where a kink stalls that",
    "auto": "dgn, and where that is not good enough lm-then-dgn from the start: the better one",
    "robust": "gn as long as it works, then lm",
}
DEFAULT_STRATEGY = "lm-then-dgn"
EXPLAINED = "; ".join(f"{name}: {words}" for name, words in STRATEGIES.items())
