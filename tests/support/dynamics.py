"""PSS/E dynamics files: sound ones, and damage to them."""

import re

import numpy as np
from places import ROOT

SAMPLE = ROOT / "sample_data" / "unit.dyr"


def garbage(data, random):
    """Return a file with one damage of a kind that happens."""
    at = int(random.integers(len(data)))
    kind = random.integers(10)
    if kind == 0:
        return data[:at]
    if kind == 1:
        return data[:at] + bytes(random.integers(0, 256, 5, dtype=np.uint8)) + data[at:]
    if kind == 2:
        return data[:at] + b"O" + data[at + 1 :]
    if kind == 3:
        return data.replace(b"/", b"", int(random.integers(1, 4)))
    if kind == 4:
        return data[:at] + b" ,, " + data[at:]
    if kind == 5:
        return data[:at] + b" 3*0.0 " + data[at:]
    if kind == 6:
        return data[:at] + bytes([random.choice(list(b"'\"/,*\0\n-."))]) + data[at:]
    words = list(re.finditer(rb"[^\s/]+", data))
    word = words[int(random.integers(len(words)))]
    if kind == 7:
        return data[: word.start()] + data[word.end() :]
    if kind == 8:
        return data[: word.start()] + word[0] + b" " + data[word.start() :]
    return data[: word.start()] + b"1e999" + data[word.end() :]


SOUND = """\
1 GENROU 1 6.0 .035 .5 .077 3.25 0. 1.8 1.7 .3 .55 .25 .2 .12 .4 /
1 ESAC1A 1 0 0 0 766 .02 14.5 -14.5
  1.3 .024 1 .486 .3556 1
  3.14 .03 4.18 .1 14.5 -14.5 /
"""


def replaced(old, new, text=SOUND):
    assert text.count(old) == 1
    return text.replace(old, new)


TWO = SOUND + SOUND.replace("1 GENROU 1", "1 GENROU 2").replace("1 ESAC1A 1", "1 ESAC1A 2")
THREE = TWO + SOUND.replace("1 GENROU", "9 GENROU").replace("1 ESAC1A", "9 ESAC1A")
