"""Numbers and lists as the sentences about a fit print them."""

from collections.abc import Sequence
from math import exp

from exfit.inference.linear import Linearisation

PLAIN = 1e4  # below it a number is printed without an exponent
MOST_EXPONENT = 7.0  # natural logarithm: beyond a factor of a thousand only the order counts


def listed(names: Sequence[str]) -> str:
    """Return names as "A, B and C"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def digits(number: float) -> str:
    """Return a number with two digits."""
    text = f"{number:.2g}"
    if "e" in text and 1.0 <= abs(number) < PLAIN:
        return f"{float(text):.0f}"
    return text.replace("e-0", "e-").replace("e+0", "e")


def error(lin: Linearisation, index: int, share: float) -> str:
    """Return a standard error, a share of what counts as 100 %, in percent or its own unit."""
    if lin.size[index] == abs(lin.values[index]):
        return f"{digits(100.0 * share)} %"
    return f"{digits(share * float(lin.size[index]))} {lin.units[index]}".strip()


def move(lin: Linearisation, index: int, share: float) -> str:
    """Word the move of a parameter; what would more than double it, as a factor."""
    if lin.logarithmic[index] and abs(share) > 1.0:
        return _factor(share)
    return ("+" if share > 0.0 else "-") + error(lin, index, abs(share))


def _factor(logarithm: float) -> str:
    if abs(logarithm) > MOST_EXPONENT:
        return "by orders of magnitude"
    return f"times {digits(exp(logarithm))}"
