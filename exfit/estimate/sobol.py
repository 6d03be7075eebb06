"""Points that fill a cube evenly: Sobol's sequence, shifted at random.

SciPy has it as well, behind half a second of imports that every fit would wait for.
"""

import random
from collections.abc import Iterator
from itertools import count, islice

import numpy as np

from exfit.estimate.arrays import Array

BITS = 30  # of each number


def sobol(number: int, dimensions: int, seed: int) -> Array:
    """Return the first points (number, dimensions) of a sequence in the unit cube.

    Of 2^k points each interval of length 2^-k of every side holds one. The initial direction
    numbers, and the digital shift that takes the first point away from the corner, are drawn at
    random.

    Source: Sobol 1967; Bratley & Fox 1988 (direction numbers, Gray code); Matousek 1998 (shift).
    """
    draw = random.Random(seed)
    directions = np.array(
        [_directions(polynomial, draw) for polynomial in islice(_primitive(), dimensions)]
    )
    points = np.zeros((number, dimensions), dtype=np.int64)
    points[0] = [draw.getrandbits(BITS) for _ in range(dimensions)]
    for k in range(1, number):
        lowest_zero = (k & -k).bit_length() - 1
        points[k] = points[k - 1] ^ directions[:, lowest_zero]
    return np.asarray((points + 0.5) / 2.0**BITS, dtype=np.float64)


def _primitive() -> Iterator[int]:
    """Yield polynomials over GF(2) as bits, the first of degree zero, then all primitive ones."""
    yield 1
    for polynomial in count(3, 2):
        if _is_primitive(polynomial):
            yield polynomial


def _is_primitive(polynomial: int) -> bool:
    """Return whether the powers of x, modulo the polynomial, go through all its residues."""
    degree = polynomial.bit_length() - 1
    power, order = 1, 0
    while True:
        power <<= 1
        if power >> degree:
            power ^= polynomial
        order += 1
        if power == 1:
            return order == (1 << degree) - 1
        if order == 1 << degree or power == 0:
            return False


def _directions(polynomial: int, draw: random.Random) -> list[int]:
    """Return the direction numbers that a polynomial and random odd initial numbers give."""
    degree = polynomial.bit_length() - 1
    numbers = [2 * draw.getrandbits(k) + 1 for k in range(degree)] if degree else [1] * BITS
    for k in range(len(numbers), BITS):
        following = numbers[k - degree] ^ (numbers[k - degree] << degree)
        for j in range(1, degree):
            if polynomial >> (degree - j) & 1:
                following ^= numbers[k - j] << j
        numbers.append(following)
    return [value << (BITS - 1 - k) for k, value in enumerate(numbers)]
