"""Problems of least squares with known minima, and random ones with bounds.

Moré, Garbow & Hillstrom 1981 (data and minima), and the nonlinear regression sets of the NIST
Statistical Reference Datasets with their certified values (eleven digits).
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Case:
    """A residual function, where to start, and the sum of squares and point to be found."""

    fun: object
    starts: tuple
    squares: float
    minimum: tuple | None = None

    def jac(self, x):
        """Complex step: exact to rounding, for functions that accept complex numbers."""
        columns = [np.imag(self.fun(x + 1e-30j * unit)) / 1e-30 for unit in np.eye(len(x))]
        return np.column_stack(columns)


def numbers(text):
    return np.array(text.split(), dtype=float)


def rosenbrock(x):
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])


def powell_singular(x):
    return np.array(
        [
            x[0] + 10.0 * x[1],
            np.sqrt(5.0) * (x[2] - x[3]),
            (x[1] - 2.0 * x[2]) ** 2,
            np.sqrt(10.0) * (x[0] - x[3]) ** 2,
        ]
    )


def beale(x):
    powers = np.array([1, 2, 3])
    return np.array([1.5, 2.25, 2.625]) - x[0] * (1.0 - x[1] ** powers)


def box3d(x):
    t = 0.1 * np.arange(1, 11)
    return np.exp(-t * x[0]) - np.exp(-t * x[1]) - x[2] * (np.exp(-t) - np.exp(-10.0 * t))


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


OSBORNE = numbers(
    ".844 .908 .932 .936 .925 .908 .881 .850 .818 .784 .751 .718 .685 .658 .628 .603 .580 .558"
    " .538 .522 .506 .490 .478 .467 .457 .448 .438 .431 .424 .420 .414 .411 .406"
)


def osborne1(x):
    t = 10.0 * np.arange(33)
    return OSBORNE - (x[0] + x[1] * np.exp(-t * x[3]) + x[2] * np.exp(-t * x[4]))


MISRA = (
    numbers("77.6 114.9 141.1 190.8 239.9 289.0 332.8 378.4 434.8 477.3 536.8 593.1 689.1 760.0"),
    numbers("10.07 14.73 17.94 23.93 29.61 35.18 40.02 44.82 50.76 55.05 61.01 66.40 75.47 81.78"),
)
KOWALIK = (
    numbers("4 2 1 .5 .25 .167 .125 .1 .0833 .0714 .0625"),
    numbers(".1957 .1947 .1735 .16 .0844 .0627 .0456 .0342 .0323 .0235 .0246"),
)
MEYER = (
    50.0 + 5.0 * np.arange(16),
    numbers(
        "34780 28610 23650 19630 16370 13720 11540 9744 8261 7030 6005 5147 4427 3820 3307 2872"
    ),
)
BOXBOD = (numbers("1 2 3 5 7 10"), numbers("109 149 149 191 213 224"))
ECKERLE = (
    np.concatenate(
        [np.arange(400, 436, 5.0), 435 + 1.5 * np.arange(1, 21), 470 + 5.0 * np.arange(7)]
    ),
    numbers(
        ".0001575 .0001699 .0002350 .0003102 .0004917 .0008710 .0017418 .0046400 .0065895"
        " .0097302 .0149002 .0237310 .0401683 .0712559 .1264458 .2073413 .2902366 .3445623"
        " .3698049 .3668534 .3106727 .2078154 .1164354 .0616764 .0337200 .0194023 .0117831"
        " .0074357 .0022732 .0008800 .0004579 .0002345 .0001586 .0001143 .0000710"
    ),
)
THURBER = (
    numbers(
        "-3.067 -2.981 -2.921 -2.912 -2.840 -2.797 -2.702 -2.699 -2.633 -2.481 -2.363 -2.322"
        " -1.501 -1.460 -1.274 -1.212 -1.100 -1.046 -.915 -.714 -.566 -.545 -.400 -.309 -.109"
        " -.103 .010 .119 .377 .790 .963 1.006 1.115 1.572 1.841 2.047 2.200"
    ),
    numbers(
        "80.574 84.248 87.264 87.195 89.076 89.608 89.868 90.101 92.405 95.854 100.696 101.060"
        " 401.672 390.724 567.534 635.316 733.054 759.087 894.206 990.785 1090.109 1080.914"
        " 1122.643 1178.351 1260.531 1273.514 1288.339 1327.543 1353.863 1414.509 1425.208"
        " 1421.384 1442.962 1464.350 1468.705 1447.894 1457.628"
    ),
)
LANCZOS = (
    0.05 * np.arange(24),
    numbers(
        "2.5134 2.0443 1.6684 1.3664 1.1232 .9269 .7679 .6389 .5338 .4479 .3776 .3197 .2720"
        " .2325 .1997 .1723 .1493 .1301 .1138 .1000 .0883 .0783 .0698 .0624"
    ),
)


def regression(data, model):
    return lambda b: model(data[0], b) - data[1]


def cubic_ratio(t, b):
    return (b[0] + b[1] * t + b[2] * t**2 + b[3] * t**3) / (
        1.0 + b[4] * t + b[5] * t**2 + b[6] * t**3
    )


kowalik = regression(KOWALIK, lambda t, b: b[0] * (t**2 + t * b[1]) / (t**2 + t * b[2] + b[3]))
meyer = regression(MEYER, lambda t, b: b[0] * np.exp(b[1] / (t + b[2])))

TEXTBOOK = {
    "rosenbrock": Case(rosenbrock, ((-1.2, 1.0),), 0.0, (1.0, 1.0)),
    "powell singular": Case(powell_singular, ((3.0, -1.0, 0.0, 1.0),), 0.0),
    "beale": Case(beale, ((1.0, 1.0),), 0.0, (3.0, 0.5)),
    "box3d": Case(box3d, ((0.0, 10.0, 20.0),), 0.0),
    "wood": Case(wood, ((-3.0, -1.0, -3.0, -1.0),), 0.0, (1.0, 1.0, 1.0, 1.0)),
    "kowalik-osborne": Case(kowalik, ((0.25, 0.39, 0.415, 0.39),), 3.0750560385e-4),
    "meyer": Case(meyer, ((0.02, 4000.0, 250.0),), 87.945855171),
    "osborne 1": Case(osborne1, ((0.5, 1.5, -1.0, 0.01, 0.02),), 5.4648946975e-5),
}
CERTIFIED = {
    "Misra1a": Case(
        regression(MISRA, lambda t, b: b[0] * (1.0 - np.exp(-b[1] * t))),
        ((500.0, 1e-4), (250.0, 5e-4)),
        1.2455138894e-01,
        (2.3894212918e02, 5.5015643181e-04),
    ),
    "MGH09": Case(
        kowalik,
        ((25.0, 39.0, 41.5, 39.0), (0.25, 0.39, 0.415, 0.39)),
        3.0750560385e-04,
        (1.9280693458e-01, 1.9128232873e-01, 1.2305650693e-01, 1.3606233068e-01),
    ),
    "MGH10": Case(
        meyer,
        ((2.0, 400000.0, 25000.0), (0.02, 4000.0, 250.0)),
        8.7945855171e01,
        (5.6096364710e-03, 6.1813463463e03, 3.4522363462e02),
    ),
    "BoxBOD": Case(
        regression(BOXBOD, lambda t, b: b[0] * (1.0 - np.exp(-b[1] * t))),
        ((1.0, 1.0), (100.0, 0.75)),
        1.1680088766e03,
        (2.1380940889e02, 5.4723748542e-01),
    ),
    "Eckerle4": Case(
        regression(ECKERLE, lambda t, b: b[0] / b[1] * np.exp(-0.5 * ((t - b[2]) / b[1]) ** 2)),
        ((1.0, 10.0, 500.0), (1.5, 5.0, 450.0)),
        1.4635887487e-03,
        (1.5543827178e00, 4.0888321754e00, 4.5154121844e02),
    ),
    "Thurber": Case(
        regression(THURBER, cubic_ratio),
        (
            (1000.0, 1000.0, 400.0, 40.0, 0.7, 0.3, 0.03),
            (1300.0, 1500.0, 500.0, 75.0, 1.0, 0.4, 0.05),
        ),
        5.6427082397e03,
        (
            1.2881396800e03,
            1.4910792535e03,
            5.8323836877e02,
            7.5416644291e01,
            9.6629502864e-01,
            3.9797285797e-01,
            4.9727297349e-02,
        ),
    ),
    "Lanczos3": Case(
        regression(LANCZOS, lambda t, b: sum(b[k] * np.exp(-b[k + 1] * t) for k in (0, 2, 4))),
        ((1.2, 0.3, 5.6, 5.5, 6.5, 7.6), (0.5, 0.7, 3.6, 4.2, 4.0, 6.3)),
        1.6117193594e-08,
        (
            8.6816414977e-02,
            9.5498101505e-01,
            8.4400777463e-01,
            2.9515951832e00,
            1.5825685901e00,
            4.9863565084e00,
        ),
    ),
}
KNOWN = {**TEXTBOOK, **CERTIFIED}


def random_problem(seed):
    """A sum of exponentials with noise, its start, and bounds of which some bind."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 4.0, 60)
    truth = rng.uniform([0.5, 0.2, 0.5, 1.5], [2.0, 1.0, 2.0, 4.0])
    model = lambda x: x[0] * np.exp(-x[1] * t) + x[2] * np.exp(-x[3] * t)  # noqa: E731
    data = model(truth) + 1e-2 * rng.standard_normal(len(t))
    low = truth * rng.uniform(0.4, 1.1, 4)
    high = low + truth * rng.uniform(0.1, 0.8, 4)
    fun = lambda x: model(x) - data  # noqa: E731
    return fun, Case(fun, (), 0.0).jac, 0.5 * (low + high), (low, high)
