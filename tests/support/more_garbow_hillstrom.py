"""The problems of Moré, Garbow & Hillstrom 1981, typed from the paper: functions, starts, minima.

Testing unconstrained optimization software, ACM Transactions on Mathematical Software 7(1). Its
starts are also taken tenfold and a hundredfold, as the paper asks; some functions then overflow.
All functions accept complex numbers.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np


@dataclass(frozen=True)
class Published:
    """Residuals, the standard start, how many starts (x0, 10 x0, 100 x0), the minima.

    ``minima``: sums of squares, the lowest first; the others are the local minima that the paper
    lists, some of them with variables at infinity.
    """

    fun: object
    start: tuple
    tries: int
    minima: tuple

    @property
    def starts(self):
        return tuple(tuple(10.0**k * np.array(self.start)) for k in range(self.tries))


def numbers(text):
    return np.array(text.split(), dtype=float)


def rosenbrock(x):
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])


def freudenstein_roth(x):
    y = x[1]
    return np.array(
        [
            -13.0 + x[0] + ((5.0 - y) * y - 2.0) * y,
            -29.0 + x[0] + ((y + 1.0) * y - 14.0) * y,
        ]
    )


def powell_badly_scaled(x):
    return np.array([1e4 * x[0] * x[1] - 1.0, np.exp(-x[0]) + np.exp(-x[1]) - 1.0001])


def brown_badly_scaled(x):
    return np.array([x[0] - 1e6, x[1] - 2e-6, x[0] * x[1] - 2.0])


def beale(x):
    powers = np.array([1, 2, 3])
    return np.array([1.5, 2.25, 2.625]) - x[0] * (1.0 - x[1] ** powers)


def jennrich_sampson(x):
    i = np.arange(1, 11)
    return 2.0 + 2.0 * i - (np.exp(i * x[0]) + np.exp(i * x[1]))


def helical_valley(x):
    angle = np.arctan(x[1] / x[0]) / (2.0 * np.pi) + (0.5 if x[0].real < 0.0 else 0.0)
    radius = np.sqrt(x[0] ** 2 + x[1] ** 2)
    return np.array([10.0 * (x[2] - 10.0 * angle), 10.0 * (radius - 1.0), x[2]])


BARD = numbers(".14 .18 .22 .25 .29 .32 .35 .39 .37 .58 .73 .96 1.34 2.10 4.39")


def bard(x):
    u = np.arange(1.0, 16.0)
    v = 16.0 - u
    return BARD - (x[0] + u / (v * x[1] + np.minimum(u, v) * x[2]))


GAUSSIAN = numbers(
    ".0009 .0044 .0175 .0540 .1295 .2420 .3521 .3989 .3521 .2420 .1295 .0540 .0175 .0044 .0009"
)


def gaussian(x):
    t = 0.5 * (8.0 - np.arange(1, 16))
    return x[0] * np.exp(-0.5 * x[1] * (t - x[2]) ** 2) - GAUSSIAN


MEYER = numbers(
    "34780 28610 23650 19630 16370 13720 11540 9744 8261 7030 6005 5147 4427 3820 3307 2872"
)


def meyer(x):
    return x[0] * np.exp(x[1] / (45.0 + 5.0 * np.arange(1, 17) + x[2])) - MEYER


def gulf(x):
    t = 0.01 * np.arange(1, 100)
    distance = np.sqrt((25.0 + (-50.0 * np.log(t)) ** (2.0 / 3.0) - x[1]) ** 2)
    return np.exp(-(distance ** x[2]) / x[0]) - t


def box3d(x):
    t = 0.1 * np.arange(1, 11)
    return np.exp(-t * x[0]) - np.exp(-t * x[1]) - x[2] * (np.exp(-t) - np.exp(-10.0 * t))


def powell_singular(x):
    return np.array(
        [
            x[0] + 10.0 * x[1],
            np.sqrt(5.0) * (x[2] - x[3]),
            (x[1] - 2.0 * x[2]) ** 2,
            np.sqrt(10.0) * (x[0] - x[3]) ** 2,
        ]
    )


def wood(x):
    return np.array(
        [
            10.0 * (x[1] - x[0] ** 2),
            1.0 - x[0],
            np.sqrt(90.0) * (x[3] - x[2] ** 2),
            1.0 - x[2],
            np.sqrt(10.0) * (x[1] + x[3] - 2.0),
            (x[1] - x[3]) / np.sqrt(10.0),
        ]
    )


KOWALIK = (
    numbers(".1957 .1947 .1735 .1600 .0844 .0627 .0456 .0342 .0323 .0235 .0246"),
    numbers("4 2 1 .5 .25 .167 .125 .1 .0833 .0714 .0625"),
)


def kowalik_osborne(x):
    y, u = KOWALIK
    return y - x[0] * (u**2 + u * x[1]) / (u**2 + u * x[2] + x[3])


def brown_dennis(x):
    t = np.arange(1, 21) / 5.0
    return (x[0] + t * x[1] - np.exp(t)) ** 2 + (x[2] + x[3] * np.sin(t) - np.cos(t)) ** 2


OSBORNE_1 = numbers(
    ".844 .908 .932 .936 .925 .908 .881 .850 .818 .784 .751 .718 .685 .658 .628 .603 .580 .558"
    " .538 .522 .506 .490 .478 .467 .457 .448 .438 .431 .424 .420 .414 .411 .406"
)


def osborne1(x):
    t = 10.0 * np.arange(33)
    return OSBORNE_1 - (x[0] + x[1] * np.exp(-t * x[3]) + x[2] * np.exp(-t * x[4]))


def biggs_exp6(x):
    t = 0.1 * np.arange(1, 14)
    y = np.exp(-t) - 5.0 * np.exp(-10.0 * t) + 3.0 * np.exp(-4.0 * t)
    return x[2] * np.exp(-t * x[0]) - x[3] * np.exp(-t * x[1]) + x[5] * np.exp(-t * x[4]) - y


OSBORNE_2 = numbers(
    "1.366 1.191 1.112 1.013 .991 .885 .831 .847 .786 .725 .746 .679 .608 .655 .616 .606 .602"
    " .626 .651 .724 .649 .649 .694 .644 .624 .661 .612 .558 .533 .495 .500 .423 .395 .375 .372"
    " .391 .396 .405 .428 .429 .523 .562 .607 .653 .672 .708 .633 .668 .645 .632 .591 .559 .597"
    " .625 .739 .710 .729 .720 .636 .581 .428 .292 .162 .098 .054"
)


def osborne2(x):
    t = 0.1 * np.arange(65)
    peaks = [x[k] * np.exp(-((t - x[k + 7]) ** 2) * x[k + 4]) for k in (1, 2, 3)]
    return OSBORNE_2 - (x[0] * np.exp(-t * x[4]) + sum(peaks))


def watson(x):
    t = np.arange(1, 30)[:, None] / 29.0
    j = np.arange(len(x))
    slope = (j[1:] * x[1:] * t ** (j[1:] - 1)).sum(axis=1)
    value = (x * t**j).sum(axis=1)
    return np.concatenate([slope - value**2 - 1.0, [x[0], x[1] - x[0] ** 2 - 1.0]])


def penalty1(x):
    return np.append(np.sqrt(1e-5) * (x - 1.0), (x**2).sum() - 0.25)


def penalty2(x):
    n, small = len(x), np.sqrt(1e-5)
    i = np.arange(2, n + 1)
    y = np.exp(i / 10.0) + np.exp((i - 1) / 10.0)
    return np.concatenate(
        [
            [x[0] - 0.2],
            small * (np.exp(x[1:] / 10.0) + np.exp(x[:-1] / 10.0) - y),
            small * (np.exp(x[1:] / 10.0) - np.exp(-0.1)),
            [(np.arange(n, 0, -1) * x**2).sum() - 1.0],
        ]
    )


def variably_dimensioned(x):
    total = (np.arange(1, len(x) + 1) * (x - 1.0)).sum()
    return np.concatenate([x - 1.0, [total, total**2]])


def trigonometric(x):
    n = len(x)
    i = np.arange(1, n + 1)
    return n - np.cos(x).sum() + i * (1.0 - np.cos(x)) - np.sin(x)


def brown_almost_linear(x):
    return np.append(x[:-1] + x.sum() - (len(x) + 1.0), np.prod(x) - 1.0)


def discrete_boundary_value(x):
    n = len(x)
    h = 1.0 / (n + 1)
    t = h * np.arange(1, n + 1)
    left, right = np.append(0.0, x[:-1]), np.append(x[1:], 0.0)
    return 2.0 * x - left - right + h**2 * (x + t + 1.0) ** 3 / 2.0


def discrete_integral_equation(x):
    n = len(x)
    h = 1.0 / (n + 1)
    t = h * np.arange(1, n + 1)
    cube = (x + t + 1.0) ** 3
    below, above = np.cumsum(t * cube), ((1.0 - t) * cube)[::-1].cumsum()[::-1]
    return x + h * ((1.0 - t) * below + t * np.append(above[1:], 0.0)) / 2.0


def broyden_tridiagonal(x):
    left, right = np.append(0.0, x[:-1]), np.append(x[1:], 0.0)
    return (3.0 - 2.0 * x) * x - left - 2.0 * right + 1.0


def broyden_banded(x):
    near = [
        sum(x[j] * (1.0 + x[j]) for j in range(max(0, i - 5), min(len(x), i + 2)) if j != i)
        for i in range(len(x))
    ]
    return x * (2.0 + 5.0 * x**2) + 1.0 - np.array(near)


def linear_full_rank(x, m):
    short = 2.0 * x.sum() / m + 1.0
    return np.append(x, np.zeros(m - len(x))) - short


def linear_rank_one(x, m):
    return np.arange(1, m + 1) * (np.arange(1, len(x) + 1) * x).sum() - 1.0


def linear_rank_one_zeros(x, m):
    inside = (np.arange(2, len(x)) * x[1:-1]).sum()
    factor = np.concatenate([[0.0], np.arange(1, m - 1), [0.0]])
    return factor * inside - 1.0


def chebyquad(x, m):
    y = 2.0 * x - 1.0
    before, now, means = np.ones_like(y), y, []
    for i in range(1, m + 1):
        integral = -1.0 / (i**2 - 1.0) if i % 2 == 0 else 0.0
        means.append(now.mean() - integral)
        before, now = now, 2.0 * y * now - before
    return np.array(means)


def t_of(n):
    return np.arange(1, n + 1) / (n + 1.0)


INTEGRAL_START = tuple(t_of(10) * (t_of(10) - 1.0))
OSBORNE_2_START = (1.3, 0.65, 0.65, 0.7, 0.6, 3.0, 5.0, 7.0, 2.0, 4.5, 5.5)
PUBLISHED = {
    "Rosenbrock": Published(rosenbrock, (-1.2, 1.0), 3, (0.0,)),
    "Freudenstein-Roth": Published(freudenstein_roth, (0.5, -2.0), 3, (0.0, 48.98425367924)),
    "Powell badly scaled": Published(powell_badly_scaled, (0.0, 1.0), 1, (0.0,)),
    "Brown badly scaled": Published(brown_badly_scaled, (1.0, 1.0), 1, (0.0,)),
    "Beale": Published(beale, (1.0, 1.0), 1, (0.0,)),
    "Jennrich-Sampson": Published(jennrich_sampson, (0.3, 0.4), 1, (124.362182356,)),
    "helical valley": Published(helical_valley, (-1.0, 0.0, 0.0), 3, (0.0,)),
    "Bard": Published(bard, (1.0, 1.0, 1.0), 3, (8.21487730658e-3, 17.4286933333)),
    "Gaussian": Published(gaussian, (0.4, 1.0, 0.0), 1, (1.12793276962e-8,)),
    "Meyer": Published(meyer, (0.02, 4000.0, 250.0), 2, (87.945855171,)),
    "Gulf": Published(gulf, (5.0, 2.5, 0.15), 1, (0.0,)),
    "Box": Published(box3d, (0.0, 10.0, 20.0), 1, (0.0,)),
    "Powell singular": Published(powell_singular, (3.0, -1.0, 0.0, 1.0), 3, (0.0,)),
    "Wood": Published(wood, (-3.0, -1.0, -3.0, -1.0), 3, (0.0,)),
    "Kowalik-Osborne": Published(
        kowalik_osborne, (0.25, 0.39, 0.415, 0.39), 3, (3.0750560385e-4, 1.02734e-3)
    ),
    "Brown-Dennis": Published(brown_dennis, (25.0, 5.0, -5.0, -1.0), 3, (85822.2016263,)),
    "Osborne 1": Published(osborne1, (0.5, 1.5, -1.0, 0.01, 0.02), 1, (5.4648946975e-5,)),
    "Biggs EXP6": Published(biggs_exp6, (1.0, 2.0, 1.0, 1.0, 1.0, 1.0), 1, (0.0, 5.65564992565e-3)),
    "Osborne 2": Published(osborne2, OSBORNE_2_START, 1, (4.01377362935e-2,)),
    "Watson, 6": Published(watson, (0.0,) * 6, 1, (2.28767005355e-3,)),
    "Watson, 9": Published(watson, (0.0,) * 9, 1, (1.399760138e-6,)),
    "Watson, 12": Published(watson, (0.0,) * 12, 1, (4.722381e-10,)),
    "penalty I, 4": Published(penalty1, (1.0, 2.0, 3.0, 4.0), 1, (2.2499775e-5,)),
    "penalty I, 10": Published(penalty1, tuple(range(1, 11)), 1, (7.0876515e-5,)),
    "penalty II, 4": Published(penalty2, (0.5,) * 4, 1, (9.37629e-6,)),
    "penalty II, 10": Published(penalty2, (0.5,) * 10, 1, (2.93660e-4,)),
    "variably dimensioned": Published(
        variably_dimensioned, tuple(1.0 - np.arange(1, 11) / 10.0), 1, (0.0,)
    ),
    "trigonometric": Published(trigonometric, (0.1,) * 10, 1, (0.0, 2.79506e-5)),
    "Brown almost-linear": Published(brown_almost_linear, (0.5,) * 10, 3, (0.0, 1.0)),
    "discrete boundary value": Published(discrete_boundary_value, INTEGRAL_START, 1, (0.0,)),
    "discrete integral equation": Published(discrete_integral_equation, INTEGRAL_START, 3, (0.0,)),
    "Broyden tridiagonal": Published(broyden_tridiagonal, (-1.0,) * 10, 3, (0.0,)),
    "Broyden banded": Published(broyden_banded, (-1.0,) * 10, 3, (0.0,)),
    "linear, full rank": Published(partial(linear_full_rank, m=20), (1.0,) * 10, 1, (10.0,)),
    "linear, rank one": Published(
        partial(linear_rank_one, m=20), (1.0,) * 10, 1, (20 * 19 / (2 * 41),)
    ),
    "linear, rank one, zeros": Published(
        partial(linear_rank_one_zeros, m=20), (1.0,) * 10, 1, ((400 + 60 - 6) / (2 * 37),)
    ),
    "Chebyquad, 8": Published(partial(chebyquad, m=8), tuple(t_of(8)), 1, (3.51687372568e-3,)),
    "Chebyquad, 9": Published(partial(chebyquad, m=9), tuple(t_of(9)), 1, (0.0,)),
    "Chebyquad, 10": Published(
        partial(chebyquad, m=10), tuple(t_of(10)), 1, (4.77271369637e-3, 6.50395480053e-3)
    ),
}
