"""Linearisations of small fits, for the tests of what a fit knows about its parameters."""

import numpy as np

from exfit.inference.linear import Linearisation, ResidualBlock


def linearised(values, errors, jacobian, **changes):
    """Return the linearisation of a plain least-squares fit of one channel; bounds are far off."""
    values, errors = np.asarray(values, dtype=float), np.asarray(errors, dtype=float)
    count = len(values)
    plain = {
        "names": tuple("abcdefghi"[:count]),
        "units": ("pu",) * count,
        "values": values,
        "logarithmic": np.zeros(count, dtype=bool),
        "width": 10.0 * np.abs(values),
        "held": (None,) * count,
        "errors": errors,
        "jacobian": np.asarray(jacobian, dtype=float),
        "influence": errors,
        "curvature": np.ones(len(errors)),
        "channels": (ResidualBlock("vt", slice(0, len(errors))),),
    }
    return Linearisation(**{**plain, **changes})


def std_errors(known):
    """Return the standard errors of all parameters, nan for none."""
    return np.array(
        [np.nan if one.std_error is None else one.std_error for one in known.parameters.values()]
    )


def decay(t, a, c):
    """Return a exp(-c t) and its derivatives to a and c."""
    shape = np.exp(-c * t)
    return a * shape, np.column_stack([shape, -t * a * shape])


def autoregressive(rng, phi, shape):
    """Return stationary noise e_k = phi e_{k-1} + w_k of variance 1 along the last axis."""
    from scipy.signal import lfilter

    white = rng.standard_normal(shape)
    white[..., 1:] *= np.sqrt(1.0 - phi**2)
    return lfilter([1.0], [1.0, -phi], white, axis=-1)
