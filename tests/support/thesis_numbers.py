"""What the thesis prints, typed from it: its tables, its parameters, its Jacobian.

J. Lai, Parameter Estimation of Excitation Systems, North Carolina State University. A history has
a row for each iteration: norm of g, f, Armijo reductions or trust-region trials.
"""

from dataclasses import dataclass

AC1A = ("KA", "KF", "TE", "TF", "TA", "KC", "KD")
AC8B = ("KPR", "KIR", "KDR", "TDR", "TA", "KA", "TE", "KC", "KD")


def parameters(names: tuple[str, ...], text: str) -> dict[str, float]:
    """Return values by name."""
    return dict(zip(names, map(float, text.split()), strict=True))


TYPICAL = parameters(AC1A, "766 0.024 1.3 1.0 0.02 0.486 0.3556")
STARTS = {
    "ac1a_typical": TYPICAL,
    "ac1a_good": TYPICAL | {"KA": 400.0},
    "ac1a_low": {name: 0.5 * value for name, value in TYPICAL.items()},
    "ac1a_high": {name: 1.5 * value for name, value in TYPICAL.items()},
    "ac8b_unit1": parameters(AC8B, "84 5 10 0.1 0 1 1.3 0.55 1.1"),
    "ac8b_unit2": parameters(AC8B, "84 5 10 0.1 0 1 1.3 0.55 1.1"),
}

# what each method came to, by the case and the method; sections 4.1 to 4.5
TOOLBOX, DGN, LM, LM_DGN = "toolbox", "dgn", "lm", "lm, dgn"
RESULTS = {
    ("ac1a_typical", TOOLBOX): parameters(
        AC1A, "615.65 0.032162 1.816 0.95218 0.021296 0.54693 0.36541"
    ),
    ("ac1a_typical", DGN): parameters(AC1A, "669.3898 0.0502 3.0419 1.7159 0.0339 0.5123 -0.3254"),
    ("ac1a_typical", LM): parameters(AC1A, "500.8150 0.0271 2.0854 1.0073 0.0186 0.4747 0.3537"),
    ("ac1a_typical", LM_DGN): parameters(AC1A, "1042.7 0.1 5.0 1.8 0.1 0.3 -0.2"),
    ("ac1a_good", TOOLBOX): parameters(
        AC1A, "402.95 0.024735 1.3159 1.0016 0.020028 0.54693 0.35962"
    ),
    ("ac1a_good", DGN): parameters(AC1A, "364.1523 0.0413 1.6724 1.4580 0.0542 0.4860 0.4039"),
    ("ac1a_low", LM): parameters(AC1A, "745.5704 0.0248 3.7373 1.2997 0.0048 0.4008 -0.2545"),
    ("ac1a_low", LM_DGN): parameters(AC1A, "1546.5 0 6.2 1.4 0 1.0 -0.3"),
    ("ac1a_high", LM): parameters(AC1A, "751.1027 0.0266 2.7584 1.3613 0.0262 0.6049 0.4179"),
    ("ac1a_high", LM_DGN): parameters(AC1A, "1546.5 0 6.2 1.4 0 1.0 -0.3"),
    ("ac8b_unit1", TOOLBOX): parameters(
        AC8B, "79.775 4.8165 10.1 0.1038 0 0.84681 1.3358 0.56259 1.0673"
    ),
    ("ac8b_unit1", DGN): parameters(
        AC8B, "78.8399 2.4636 37.0485 0.1638 0 0.5564 1.4044 0.0301 0.0511"
    ),
    ("ac8b_unit2", TOOLBOX): parameters(
        AC8B, "62.949 5.4821 9.8866 0.099983 0 0.81166 1.6154 0.57018 1.0466"
    ),
    ("ac8b_unit2", DGN): parameters(
        AC8B, "85.6266 2.5912 25.3810 0.2044 0 0.6209 1.8426 0.3233 0.0265"
    ),
}
# f at the end of a search, where the text prints more digits than the table; 4.4, 4.5 and 4.6
COSTS = {
    ("ac1a_typical", TOOLBOX): "9.6267e-4",
    ("ac1a_typical", DGN): "7.1094e-5",
    ("ac1a_typical", LM_DGN): "3.3027e-5",
    ("ac1a_good", DGN): "1.0498e-5",
    ("ac1a_low", LM_DGN): "9.2019e-5",
    ("ac8b_unit1", DGN): "8.1859e-5",
    ("ac8b_unit2", DGN): "4.7020e-5",
}
# f of the simulations of 4.6 in PSS/E and in MATLAB
SIMULATORS = {
    "4.33": (6.9144e-4, 9.6267e-4),
    "4.34": (1.0e-3, 7.1094e-5),
    "4.35": (2.9e-3, 3.3027e-5),
    "4.36": (9.0640e-4, 9.2019e-5),
}


@dataclass(frozen=True)
class History:
    """A table of the thesis: its number, the case, the method, the rows."""

    number: int
    case: str
    method: str
    rows: tuple[tuple[str, str, str], ...]

    @property
    def phase(self) -> str:
        """The search that made it: lm or dgn."""
        return LM if self.method == LM else DGN


def history(number: int, case: str, method: str, text: str) -> History:
    """Return a table of which each line is an iteration."""
    rows = tuple(tuple(line.split()) for line in text.strip().splitlines())
    return History(number, case, method, rows)


TABLES = (
    history(
        1,
        "ac1a_typical",
        DGN,
        """
        0.0034 0.0023 0
        0.0033 0.0018 9
        0.0086 0.0018 0
        0.0036 0.0006 0
        0.0016 0.0003 0
        0.0005 0.0002 0
        0.0002 0.0001 0
        0.0004 0.0001 0
        0.0003 0.0001 0
        0.0004 0.0001 0
        0.0004 0.0001 0
        """,
    ),
    history(
        2,
        "ac1a_typical",
        LM,
        """
        0.0034 0.0023 0
        0.0034 0.0023 1
        0.0034 0.0023 1
        0.0061 0.0019 4
        0.0061 0.0019 1
        0.0061 0.0019 1
        0.0061 0.0019 1
        0.0033 0.0016 2
        0.0033 0.0016 1
        0.0096 0.0014 3
        0.0096 0.0014 1
        0.0096 0.0014 1
        0.0096 0.0014 1
        0.0035 0.0013 5
        0.0035 0.0013 1
        0.0035 0.0013 1
        0.0035 0.0013 1
        0.0035 0.0013 1
        0.0071 0.0012 5
        0.0071 0.0012 1
        0.0071 0.0012 1
        """,
    ),
    history(
        3,
        "ac1a_typical",
        LM_DGN,
        """
        0.0006 0.0004 0
        0.0008 0.0002 0
        0.0011 0.0001 0
        0.0011 0.0001 0
        0.0010 0.0001 0
        0.0008 0.0001 0
        0.0007 0.0000 0
        0.0006 0.0000 0
        0.0005 0.0000 0
        0.0004 0.0000 0
        0.0003 0.0000 0
        0.0003 0.0000 0
        0.0002 0.0000 0
        0.0001 0.0000 0
        0.0001 0.0000 6
        0.0000 0.0000 0
        0.0000 0.0000 0
        0.0000 0.0000 0
        0.0000 0.0000 0
        0.0000 0.0000 0
        0.0000 0.0000 0
        """,
    ),
    history(
        4,
        "ac1a_good",
        DGN,
        """
        0.0237 0.0066 0
        0.0035 0.0001 0
        0.0025 0.0001 0
        0.0012 0.0000 0
        0.0005 0.0000 0
        0.0007 0.0000 0
        0.0003 0.0000 0
        """,
    ),
    history(
        5,
        "ac1a_low",
        LM,
        """
        0.0378 0.0244 0
        0.0378 0.0244 1
        0.0378 0.0244 1
        0.0378 0.0244 1
        0.0286 0.0096 2
        0.0286 0.0096 1
        0.0286 0.0096 1
        0.0102 0.0046 2
        0.0102 0.0046 1
        0.0102 0.0046 1
        0.0102 0.0046 1
        0.0102 0.0046 1
        0.0102 0.0046 1
        0.0019 0.0042 5
        0.0019 0.0042 1
        0.0019 0.0042 1
        0.0019 0.0042 1
        0.0019 0.0042 1
        0.0019 0.0042 1
        0.0019 0.0042 1
        0.0025 0.0034 2
        """,
    ),
    history(
        6,
        "ac1a_low",
        LM_DGN,
        """
        0.0051 0.0034 0
        0.0016 0.0004 0
        0.0011 0.0002 0
        0.0005 0.0002 0
        0.0002 0.0001 0
        0.0002 0.0001 0
        0.0002 0.0001 0
        0.0003 0.0001 0
        0.0003 0.0001 0
        0.0002 0.0001 0
        0.0003 0.0001 0
        0.0003 0.0001 0
        0.0003 0.0001 0
        0.0003 0.0001 0
        0.0003 0.0001 0
        0.0003 0.0001 0
        0.0003 0.0001 0
        0.0003 0.0001 0
        0.0003 0.0001 0
        0.0003 0.0001 0
        0.0003 0.0001 0
        """,
    ),
    history(
        7,
        "ac1a_high",
        LM,
        """
        0.0142 0.0244 0
        0.0142 0.0244 1
        0.0195 0.0244 1
        0.0195 0.0244 1
        0.0195 0.0096 2
        0.0114 0.0096 1
        0.0114 0.0096 1
        0.0114 0.0046 2
        0.0114 0.0046 1
        0.0312 0.0046 1
        0.0312 0.0046 1
        0.0312 0.0046 1
        0.0312 0.0046 1
        0.0312 0.0042 5
        0.0312 0.0042 1
        0.0312 0.0042 1
        0.0065 0.0042 1
        0.0065 0.0042 1
        0.0065 0.0042 1
        0.0065 0.0042 1
        0.0065 0.0034 2
        """,
    ),
    history(
        8,
        "ac1a_high",
        LM_DGN,
        """
        0.0055 0.0026 0
        0.0018 0.0004 1
        0.0014 0.0003 2
        0.0016 0.0003 8
        0.0011 0.0001 0
        0.0010 0.0001 0
        0.0007 0.00008 0
        0.0006 0.00006 0
        0.0004 0.00005 0
        0.0003 0.00005 0
        0.0004 0.00004 0
        0.0005 0.00004 0
        0.0005 0.00004 3
        0.0006 0.00004 1
        """,
    ),
    history(
        9,
        "ac8b_unit1",
        DGN,
        """
        74.8970 0.0040 0
        64.3266 0.0022 0
        58.5847 0.0015 1
        254.7465 0.0008 0
        212.7478 0.0008 0
        4.2138 0.0001 0
        9.9908 0.0001 0
        17.6911 0.0001 3
        """,
    ),
    history(
        10,
        "ac8b_unit2",
        DGN,
        """
        98.6792 0.0047 0
        41.7514 0.0008 1
        5.6289 0.0003 1
        8.2688 0.0002 0
        11.3389 0.0001 2
        12.0737 0.0001 0
        35.5202 0.0001 0
        5.5072 0.0001 0
        1.9256 0.0001 5
        2.1438 0.0000 4
        """,
    ),
)

# 3.3: dv/dk and dv/da of k/(s + a) at t = 0, 0.1 ... 1.5 s, for k = 4 and a = 2
K, A = 4.0, 2.0
FIRST_K, FIRST_A = 5.0, 2.5  # where its search begins
INSTANTS = tuple(round(0.1 * k, 1) for k in range(16))
APPROXIMATE = (
    "0 .0907 .1649 .2257 .2754 .3161 .3495 .3768 .3991 .4174 .4324 .4446 .4547 .4629 .4696 .4751",
    "0 -.0173 -.0613 -.1216 -.1910 -.2641 -.3374 -.4085 -.4757 -.5381 -.5953 -.6471 -.6937 -.7352"
    " -.7720 -.8044",
)
TRUE = (
    "0 .0906 .1648 .2256 .2753 .3161 .3494 .3767 .3991 .4174 .4323 .4446 .4546 .4629 .4696 .4751",
    "0 -.0175 -.0616 -.1219 -.1912 -.2642 -.3374 -.4082 -.4751 -.5372 -.5940 -.6454 -.6916 -.7326"
    " -.7689 -.8009",
)
ABSOLUTE = (
    "0 0 -.0001 -.0001 -.0001 -.0001 -.0001 -.0001 -.0001 -.0001 -.0001 0 0 0 0 0",
    "0 -.0002 -.0003 -.0003 -.0002 -.0001 .0001 .0003 .0006 .0009 .0013 .0017 .0022 .0026 .0031"
    " .0035",
)
RELATIVE = (
    "nan -.0004 -.0003 -.0003 -.0003 -.0002 -.0002 -.0002 -.0002 -.0001 -.0001 -.0001 -.0001 -.0001"
    " -.0001 -.0001",
    "nan .0108 .0046 .0024 .0013 .0005 -.0002 -.0007 -.0012 -.0017 -.0022 -.0027 -.0031 -.0036"
    " -.0040 -.0044",
)
# the curves of sample_data/andes, by the values that they are simulated with
CURVES = {
    "ac1a_toolbox": ("ac1a_typical", TOOLBOX),
    "ac1a_dgn": ("ac1a_typical", DGN),
    "ac1a_lm": ("ac1a_typical", LM),
    "ac1a_low_lm": ("ac1a_low", LM),
    "ac1a_good_dgn": ("ac1a_good", DGN),
}
