"""Whether a fit holds on a record that was not fitted."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from exfit.fitting.experiment import Channel
from exfit.fitting.noise import noise_of, noise_shape
from exfit.results.comparisons import Comparison

MUCH_WORSE = 3.0  # times the error of the fit, or the noise of the record where that is larger


def judged(
    validation: Comparison,
    fitted: Sequence[Comparison],
    channels: Sequence[Channel],
    by_noise: Mapping[str, float] | None = None,
) -> Comparison:
    """Return a validation with its verdict: the limit of its rmse, and why it is not accepted.

    Without criteria of a case it must match better than a constant would, and its rmse must not
    exceed three times the largest one of the fit in the same signal, or three times the noise of
    its own record where that is larger: no model comes below the noise. Of a grid event that was
    played in, P and Q are judged so, and noise is what the driving signals carry, too.

    Args:
        validation: the comparison with a record that was not fitted.
        fitted: those with the records of the fit.
        channels: those of the validation's record; they give its noise.
        by_noise: the rms of errors (pu) by the noise of driving signals, by signal.
    """
    limits: dict[str, float | None] = {}
    for channel in channels:
        if channel.signal in validation.judging:
            fit_error = _error_of_fit(channel.signal, fitted)
            carried = (by_noise or {}).get(channel.signal, 0.0)
            noise = max(noise_of(channel) * noise_shape(channel).gain, carried)
            limit = None if fit_error is None else MUCH_WORSE * max(fit_error, noise)
            limits[channel.signal] = limit
    reasons = (_why_not(validation, each, fitted, limits[each]) for each in validation.judging)
    reason = "; ".join(filter(None, reasons))
    limit = limits[validation.judging[0]]
    return replace(validation, validation=True, limit=limit, accepted=not reason, reason=reason)


def _error_of_fit(signal: str, fitted: Sequence[Comparison]) -> float | None:
    """Return the largest rmse (pu) of the fit in a signal."""
    errors = [match.channels[signal].rmse for match in fitted if signal in match.channels]
    return max(errors, default=None)


def _why_not(
    validation: Comparison,
    signal: str,
    fitted: Sequence[Comparison],
    limit: float | None,
) -> str:
    """Word why a signal is rejected, "" if it is not."""
    name, rmse = validation.name, validation.channels[signal].rmse
    of_signal = f" of {signal}" if len(validation.judging) > 1 else ""
    if not validation.channels[signal].describes:
        if validation.played is not None:
            return (
                f"{signal} of {name} is matched no better than by a constant: check its sign, base "
                "and unit, the state of rest, and whether it is a record of this unit"
            )
        return (
            f"the response matches {name} no better than a constant would: check vt0 and the "
            "sign, size and time of its step, and whether it is a record of this unit"
        )
    if limit is None or rmse <= limit:
        return ""
    fit_error = _error_of_fit(signal, fitted)
    times = np.inf if not fit_error else rmse / fit_error
    return (
        f"on {name} the error{of_signal} is {times:.1f} times that of the fit, more than "
        f"{MUCH_WORSE:g} times: the fitted record does not determine what matters there, or the "
        "record is of another unit or test"
    )
