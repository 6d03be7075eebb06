"""Discrete-time linear models of a bump test: ARX, instrumental variables, output error.

A(q) y = B(q) u, with y the deviation of vt and u that of its reference. Each fit tries orders,
rates of sampling and prefilters, and keeps the model whose simulated response is nearest to the
record. Its response then stands for the record that the small-signal model is matched to: that is
the transfer to the parameters of the exciter.

Source: Ljung 1999, sections 4.2 (ARX, output error), 7.6 (instruments) and 14.4 (prefilters);
Steiglitz & McBride 1965; Young 1976 (refined instruments); Akaike 1970 (final prediction error).
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from related_work import Estimate, Method, Residuals, matched, samples, with_samples
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.signal import butter, lfilter

ORDERS = (3, 4, 5, 6)
EVERY = (1, 2, 5, 10)  # samples
CUTOFFS = (1.0, 3.0)  # Hz, of a Butterworth filter of order 2 before the sampling
ROUNDS = 15
MOST_EVALUATIONS = 50
FAR = 1e6  # of the record: what a model of output error is worth that grows without end


class Data(NamedTuple):
    """Deviations from the rest (M,): of the reference and of vt, at ``times`` (s)."""

    times: np.ndarray
    u: np.ndarray
    y: np.ndarray


class Model(NamedTuple):
    """A(q) = 1 + a1 q^-1 + ... and B(q) = b1 q^-1 + ...: coefficients (n + 1,)."""

    a: np.ndarray
    b: np.ndarray

    def response(self, u: np.ndarray) -> np.ndarray:
        """Return what the model makes of an input (M,)."""
        with np.errstate(all="ignore"):
            return lfilter(self.b, self.a, u)


Fit = Callable[[Data, int, Data], Model]  # of filtered data, an order, and the data unfiltered


def data_of(record: Residuals) -> Data:
    """Return the deviations of a record from the rest before its step, which is at a sample."""
    simulator, vt = record.experiments[0].simulator, samples(record)
    (step,) = simulator.inputs.steps
    u = np.where(simulator.times >= step.at, step.step, 0.0)
    return Data(simulator.times, u, vt - np.mean(vt[u == 0.0]))


def regressors(y: np.ndarray, u: np.ndarray, order: int) -> np.ndarray:
    """Return rows (M - n, 2 n) of what was before each sample from the n-th on."""
    lags = [slice(order - lag, len(y) - lag) for lag in range(1, order + 1)]
    return np.column_stack([*(-y[lag] for lag in lags), *(u[lag] for lag in lags)])


def model_of(coefficients: np.ndarray) -> Model:
    """Return the model of coefficients (2 n,), those of A first."""
    a, b = np.split(coefficients, 2)
    return Model(np.append(1.0, a), np.append(0.0, b))


def arx(data: Data, order: int, _: Data) -> Model:
    """Return the least squares of the equation error."""
    rows = regressors(data.y, data.u, order)
    return model_of(np.linalg.lstsq(rows, data.y[order:], rcond=None)[0])


def stable(model: Model) -> Model:
    """Return a model whose poles outside the unit circle are reflected into it."""
    poles = np.roots(model.a)
    outside = np.abs(poles) > 1.0
    poles[outside] = 1.0 / np.conj(poles[outside])
    return Model(np.real(np.poly(poles)), model.b) if outside.any() else model


def refined(data: Data, order: int, instruments: bool) -> Iterator[Model]:
    """Yield models, each of data filtered by 1/A of the one before, the first one by ARX.

    With ``instruments`` the past of y is multiplied by that of the response of the model before;
    else by itself, which is the iteration of Steiglitz and McBride.
    """
    model = arx(data, order, data)
    for _ in range(ROUNDS):
        model = stable(model)
        yield model
        y, u = (lfilter([1.0], model.a, signal) for signal in (data.y, data.u))
        rows = regressors(y, u, order)
        by = regressors(lfilter(model.b, model.a, u), u, order) if instruments else rows
        model = model_of(np.linalg.lstsq(by.T @ rows, by.T @ y[order:], rcond=None)[0])
    yield stable(model)


def instrumental(data: Data, order: int, plain: Data) -> Model:
    """Return the best model of refined instrumental variables."""
    return min(refined(data, order, instruments=True), key=lambda model: misfit(model, plain))


def output_error(data: Data, order: int, plain: Data) -> Model:
    """Return the least squares of the simulated response, from the best of Steiglitz-McBride."""
    first = min(refined(data, order, instruments=False), key=lambda model: misfit(model, plain))

    def errors(coefficients: np.ndarray) -> np.ndarray:
        error = model_of(coefficients).response(data.u) - data.y
        return np.where(np.isfinite(error), np.clip(error, -FAR, FAR), FAR)

    coefficients = np.concatenate([first.a[1:], first.b[1:]])
    end = least_squares(errors, coefficients, x_scale="jac", max_nfev=MOST_EVALUATIONS)
    return model_of(end.x)


def misfit(model: Model, data: Data) -> float:
    """Return the mean square error of a simulated response, inf where it is not finite."""
    error = model.response(data.u) - data.y
    square = float(np.mean(np.clip(error, -FAR, FAR) ** 2))
    return square if np.isfinite(error).all() else np.inf


def sampled(data: Data, every: int, cutoff: float | None) -> tuple[Data, Data]:
    """Return data at every so-manieth sample, filtered and unfiltered."""
    plain = Data(*(signal[::every] for signal in data))
    if cutoff is None:
        return plain, plain
    low_pass = butter(2, cutoff, fs=1.0 / (data.times[1] - data.times[0]))
    filtered = [lfilter(*low_pass, signal)[::every] for signal in data[1:]]
    return Data(plain.times, *filtered), plain


def candidates() -> Iterator[tuple[int, float | None]]:
    """Yield the samplings that are tried: at every so-manieth sample, or filtered at all."""
    yield from ((every, None) for every in EVERY)
    yield from ((1, cutoff) for cutoff in CUTOFFS)


def best_response(data: Data, fit: Fit) -> np.ndarray:
    """Return the response (M,) of the model, of all that are tried, that is nearest to a record.

    A model of p coefficients is judged by Akaike's final prediction error, (M + p) / (M - p) times
    its misfit to M samples.
    """
    lowest, best = np.inf, np.zeros_like(data.y)
    for every, cutoff in candidates():
        filtered, plain = sampled(data, every, cutoff)
        for order in ORDERS:
            model = fit(filtered, order, plain)
            count, coefficients = len(plain.y), 2 * order
            error = misfit(model, plain) * (count + coefficients) / (count - coefficients)
            if error < lowest:
                lowest = error
                best = CubicSpline(plain.times, model.response(plain.u))(data.times)
    return np.where(data.u == 0.0, 0.0, best)


def transferred(fit: Fit) -> Method:
    """Return the method that matches the small-signal response to that of a fitted model."""

    def of_record(record: Residuals) -> Residuals:
        data = data_of(record)
        return with_samples(record, samples(record) - data.y + best_response(data, fit))

    def method(records: Sequence[Residuals], starts: np.ndarray) -> list[Estimate]:
        modelled = {record: of_record(record) for record in dict.fromkeys(records)}
        pairs = zip(records, starts, strict=True)
        return [matched(modelled[record], start) for record, start in pairs]

    return method
