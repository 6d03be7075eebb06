"""Magnitude and angle of what has two components."""

from math import pi

from exfit.engine.trace import Signal, cos, is_zero, sin, sqrt, where

NEWTON_STEPS = 4  # to an angle: each cubes the error, which is 0.33 at first


def modulus(a: Signal, b: Signal) -> Signal:
    """Return sqrt(a^2 + b^2); where b is not there at all, a, which is then positive."""
    return a if is_zero(b) else sqrt(a * a + b * b)


def angle(x: Signal, y: Signal) -> Signal:
    """Return the angle of the point (x, y), in radians between -pi and pi; not for x = y = 0."""
    size = sqrt(x * x + y * y)
    radians = where(y < 0.0, -pi / 2.0, pi / 2.0) * (1.0 - x / size)
    for _ in range(NEWTON_STEPS):
        radians = radians + (y * cos(radians) - x * sin(radians)) / size
    return radians
