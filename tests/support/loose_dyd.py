"""PSLF records with drawn values, as anyone may have typed them, and damage to files of them."""

import re

import numpy as np

from exfit.features.planner.records import SORTED

PSLF_UNIT = """\
# dynamics data of a test
lodrep
wlwscc 4 "LOAD" 22.0 "1 " : #0 0.0 1.0
models
genrou 1 "GEN: 1/#" 18.0 "1 " : #9 mva=120.0 6.0 0.035 0.5 0.077 3.25 0.0 /
  1.8 1.7 0.3 0.55 0.25 0.2 /
# of 1999
  0.12 0.4 0.0 0.0 0.0
exac4 1 "GEN1" 18.0 "1 " : #9 "tr" 0.02 "vimax" 999 "vimin" -999 "tc" 1 "tb" 10 "ka" 150 /
  "Ta" 0.1 "vrmax" 5 "vrmin" -5 "kc" 0.0
"""


def styled(value, random):
    """Return a number in one of the ways in which programs write it, none of which rounds."""
    text = repr(float(value))
    ways = [text, f"{value:.17g}", f"{value:.16e}", f"{value:.16E}"]
    ways += [text[:-2]] if text.endswith(".0") else []
    ways += ["+" + text] if value >= 0 else []
    return str(random.choice(ways))


def loose_dyd(definition, values, random, bus=1, machine_id="1"):
    """Return a record with its values in their order or behind their names, on one line or more."""
    record = definition.record
    ignored = {symbol: float(random.integers(2)) for symbol in record.ignored}
    given = {**ignored, **values, **dict(record.absent)}
    given = {**dict(record.icons), **given}
    words = [styled(given[symbol], random) for symbol in definition.names]
    idle = {*ignored, *dict(record.absent)}
    if random.integers(2):
        spelled = dict(record.spelled)
        pairs = zip(definition.names, words, strict=True)
        pairs = [pair for pair in pairs if pair[0] not in idle or random.integers(3)]
        random.shuffle(pairs)
        words = [f'"{spelled.get(symbol, symbol).lower()}" {word}' for symbol, word in pairs]
    elif random.integers(2):
        while definition.names[len(words) - 1] in idle:
            words.pop()
    name = str(random.choice([record.name, record.name.upper()]))
    place = str(random.choice(['"G: 1/#"  15.75', "! !", '"" 0.0']))
    base = str(random.choice(["", "mva=120.5 ", "#9 mva=100 ", "#1 "]))
    text = f'{name}   {bus} {place} "{machine_id} " : {base}'
    for word in words:
        text += word + str(random.choice([" ", "  ", "\t", " /\n  ", " / \r\n# between\n ", "  "]))
    return text.rstrip(" /\r\n\t") + str(random.choice(["\n", " \n", "  # the end\n", "\r\n"]))


def garbage(data, random):
    """Return a file with one damage of a kind that happens."""
    at = int(random.integers(len(data)))
    kind = random.integers(8)
    if kind == 0:
        return data[:at]
    if kind == 1:
        return data[:at] + bytes(random.integers(0, 256, 5, dtype=np.uint8)) + data[at:]
    if kind == 2:
        return data[:at] + b"O" + data[at + 1 :]
    if kind == 3:
        return data.replace(b" /\n", b"\n", 1)
    if kind == 4:
        return data.replace(b" : ", b" ", int(random.integers(1, 3)))
    if kind == 5:
        return data[:at] + bytes([random.choice(list(b'"/:#\0\n-.!'))]) + data[at:]
    words = list(re.finditer(rb"[^\s/]+", data))
    word = words[int(random.integers(len(words)))]
    if kind == 6:
        return data[: word.start()] + data[word.end() :]
    return data[: word.start()] + b"1e999" + data[word.end() :]


def sorted_curve(values):
    """Return values with the lower voltage of a saturation curve first, as files have it."""
    if not {"E1", "E2"} <= values.keys() or values["E1"] <= values["E2"]:
        return values
    swapped = {first: second for pair in zip(*SORTED, strict=True) for first, second in [pair]}
    swapped |= {second: first for first, second in swapped.items()}
    return {name: values[swapped.get(name, name)] for name in values}
