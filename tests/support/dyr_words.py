"""The words of a PSS/E file, told apart without exfit: what two files differ in."""

import re

WORDS = re.compile(r"([\s,/'\"]+)")


def changed_words(before, after):
    """Return the numbers (before, after) of words that differ in two texts, alike between words.

    Words are what stands between blanks, commas, slashes and quotes.
    """
    old, new = WORDS.split(before), WORDS.split(after)
    assert len(old) == len(new)
    return [
        (float(first.upper().replace("D", "E")), float(second))
        for first, second in zip(old, new, strict=True)
        if first != second
    ]
