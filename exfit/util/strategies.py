"""The strategies of a search, in words; `exfit.estimate.strategies` holds their functions."""

from collections.abc import Mapping

PHASES: Mapping[str, str] = {
    "lm": "Levenberg-Marquardt",
    "dgn": "damped Gauss-Newton",
    "gn": "Gauss-Newton",
}
STRATEGIES: Mapping[str, str] = {
    "gn": "Gauss-Newton with full steps (a first one that fails is shortened once)",
    "dgn": "damped Gauss-Newton: each step capped, then shortened until Armijo's rule holds",
    "lm": "Levenberg-Marquardt",
    "lm-then-dgn": "lm to reach a better start, then dgn, and lm again where that stalls",
    "auto": "dgn; where noise or validation casts doubt on its match lm-then-dgn, then 16 more "
    "starts; the lowest minimum of all",
    "robust": "gn while it makes progress, then lm",
}
DEFAULT_STRATEGY = "lm-then-dgn"
EXPLAINED = "; ".join(f"{name}: {words}" for name, words in STRATEGIES.items())
