"""Numbers and lists as the sentences about a fit print them."""

from collections.abc import Sequence

PLAIN = 1e4  # below it a number is printed without an exponent


def listed(names: Sequence[str]) -> str:
    """Return names as "A, B and C"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def digits(number: float) -> str:
    """Return a number with two digits."""
    text = f"{number:.2g}"
    if "e" in text and 1.0 <= abs(number) < PLAIN:
        return f"{float(text):.0f}"
    return text.replace("e-0", "e-").replace("e+0", "e")
