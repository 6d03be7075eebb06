"""The remedy of each cause, carried out: the changed case runs, and its cost is lower."""

from copy import deepcopy
from dataclasses import replace
from functools import partial

import faulty_cases
import faulty_events
import numpy as np
import pytest
import yaml
from faulty_cases import AT, content_of, free_near, recorded
from faulty_units import UNITS
from places import CONFIGS
from tiers import few_of

from exfit.case.load import load_case, parse_case
from exfit.case.rewriting import with_changes, with_freed
from exfit.features.events import CAUSES_AT_REST, CAUSES_OF_EVENTS
from exfit.registry import parts
from exfit.verdict import causes
from exfit.verdict.causes import recognisers
from exfit.verdict.causes.unit import remedy_of
from exfit.verdict.score_tests import parameters_of
from exfit.workflows import fit

COARSE, STATIC = (15, 1, 7), (16, 1, 7)  # seeds: AC8B every 20 ms, ST1A with efd
CASES = sorted(path.relative_to(CONFIGS) for path in CONFIGS.glob("**/*.yaml"))
CASES = [path for path in CASES if path.parts[0] not in ("programmes", "criteria")]


def case_file(folder, content, time, signals):
    """Write a case and its record; return the path of the case."""
    table = np.column_stack([time, *signals.values()])
    header = ",".join(["t", *signals])
    np.savetxt(folder / "record.csv", table, "%.12g", ",", header=header, comments="")
    content = deepcopy(content)
    for name in signals:
        content["record"]["channels"][name] |= {"column": name}
    content["record"] |= {"file": "record.csv", "time": "t"}
    path = folder / "unit.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


def drawn(kind, seed, folder):
    """Write a case with a fault, as the study of verdicts draws it."""
    fault = faulty_cases.drawn(kind, seed)
    (record,) = fault.faulty.given_records.values()
    return case_file(folder, fault.content, record.time, record.signals)


def of_event(kind, seed, folder):
    """Write the case of a grid event with a fault."""
    return faulty_events.drawn(kind, seed, folder).faulty


def spoilt(spoil, folder, step=0.01, until=8.0, **sections):
    """Write the case of the AC8B, with further sections, with a record that is spoilt."""
    unit, rng = UNITS["AC8B"], np.random.default_rng(1)
    content, time = content_of(unit, {"vt": 1.0}, 0.05), np.arange(0.0, until, step)
    signals = recorded(content, time)
    signals = {"vt": signals["vt"] + 1e-4 * rng.standard_normal(len(time))}
    content["parameters"] = {"fixed": dict(unit.fixed), "free": free_near(unit.free, rng)}
    return case_file(folder, content | sections, *spoil(time, signals))


def otherwise(folder, change):
    """Write the case of the AC8B, whose test was changed where it was recorded."""
    unit, rng = UNITS["AC8B"], np.random.default_rng(1)
    content, time = content_of(unit, {"vt": 1.0}, 0.05), np.arange(0.0, 8.0, 0.01)
    own = deepcopy(content)
    change(own["test"])
    signals = {"vt": recorded(own, time)["vt"] + 1e-4 * rng.standard_normal(len(time))}
    content["parameters"] = {"fixed": dict(unit.fixed), "free": free_near(unit.free, rng)}
    return case_file(folder, content, time, signals)


def ramped(test):
    test["vref"][0]["ramp"] = 0.2


def slowing_down(test):
    test["speed_change"] = -0.03


def folded(time, signals):
    return time, {"vt": signals["vt"] + 1e-3 * np.sin(2.0 * np.pi * 50.2 * time)}


def unsteady(time, signals):
    away = 2e-3 * np.clip(1.0 - time / (0.8 * AT), 0.0, 1.0)
    return time, {"vt": signals["vt"] + away}


def milliseconds(time, signals):
    return 1e3 * time, signals


def inverted_power(folder):
    """Write the case of a grid event whose recorder counts power into the unit."""
    path = faulty_events.drawn("H", 1, folder).sound
    content = yaml.safe_load(path.read_text())
    file = folder / content["record"]["file"]
    lines = file.read_text().splitlines()
    place = lines[0].split(",").index("p")
    rows = [line.split(",") for line in lines[1:]]
    turned = [
        ",".join([*row[:place], f"{-float(row[place])!r}", *row[place + 1 :]]) for row in rows
    ]
    file.write_text("\n".join([lines[0], *turned, ""]))
    return path


def exchanged_powers(folder):
    """Write the case of a grid event whose columns of p and q are exchanged."""
    path = faulty_events.drawn("H", 4, folder).sound  # p is above 0.75 pu
    file = folder / yaml.safe_load(path.read_text())["record"]["file"]
    heads, *rows = file.read_text().splitlines()
    other = {"p": "q", "q": "p"}
    heads = ",".join(other.get(each, each) for each in heads.split(","))
    file.write_text("\n".join([heads, *rows, ""]))
    return path


# what looks for a cause -> what is planted for it
PLANTED = {
    "iterations": partial(drawn, "too few iterations", COARSE),
    "unit of the time": partial(
        spoilt, milliseconds, step=5e-4, until=1.3, estimate={"iterations": 1}
    ),  # more of them would simulate for minutes
    "spikes": partial(drawn, "spikes", COARSE),
    "ripple": partial(drawn, "ripple", STATIC),
    "drift": partial(drawn, "drift", COARSE),
    "level of vt": partial(spoilt, lambda time, signals: (time, {"vt": 1.73 * signals["vt"]})),
    "rest before the step": partial(spoilt, unsteady),
    "levels at rest": partial(drawn, "base of ifd", STATIC),
    "sign of the step": partial(drawn, "sign of the step", COARSE),
    "size of the step": partial(drawn, "step off by 20 %", COARSE),
    "time of the step": partial(drawn, "instant", COARSE),
    "base of a channel": partial(drawn, "base of efd", STATIC),
    "polarity of a channel": partial(drawn, "inverted channel", STATIC),
    "zero of a channel": partial(drawn, "offset of a channel", STATIC),
    "vt0": partial(drawn, "vt0", COARSE),
    "clipped channel": partial(drawn, "clipped record", COARSE),
    "bounds": partial(drawn, "bound excludes the truth", COARSE),
    "machine data": partial(drawn, "Tpd0", STATIC),
    "other fixed values": partial(drawn, "Tpd0", STATIC),
    "limits": partial(drawn, "limit not of the unit", COARSE),
    "aliased ripple": partial(spoilt, folded, step=0.02),
    "speed": lambda folder: otherwise(folder, slowing_down),
    "ramp of the step": lambda folder: otherwise(folder, ramped),
    "further step": partial(drawn, "second step", COARSE),
    "recorder that averages": partial(drawn, "averaging recorder", COARSE),
    "record of the event": inverted_power,
    "columns of p and q": exchanged_powers,
    "equation of the speed": partial(of_event, "dialect andes", 1),
    "governor": partial(of_event, "TGOV1", 1),
    "stabiliser": partial(of_event, "stabiliser", 1),
    "controls out of service": partial(of_event, "idle governor", 1),
    "inertia and damping": partial(of_event, "H", 1),
    "transformer": partial(of_event, "transformer", 1),
}
# one function sees both
OTHER_PLACES = {
    "polarity of a channel": "base of a channel", "columns of p and q": "record of the event",
}  # fmt: skip


def catalogue():
    """Return all that looks for causes, by what it looks at."""
    own = {**recognisers.WITHOUT_TRIAL, **recognisers.BY_TRIAL, **recognisers.AFTER_TRIALS}
    of_events = [parts(plug) for plug in ("CAUSES_AT_REST", "CAUSES_OF_EVENTS")]
    return {**causes.ALWAYS, **own, **{k: v.load() for each in of_events for k, v in each.items()}}


def test_something_is_planted_for_all_that_looks_for_causes():
    assert PLANTED.keys() - OTHER_PLACES.keys() == catalogue().keys()
    assert {*CAUSES_AT_REST, *CAUSES_OF_EVENTS} <= PLANTED.keys()


@pytest.mark.long
@pytest.mark.parametrize("name", PLANTED)
def test_the_remedy_of_each_cause_runs_and_lowers_the_cost(name, tmp_path, monkeypatch):
    looked_for = OTHER_PLACES.get(name, name)
    only = {looked_for: catalogue()[looked_for]}
    monkeypatch.setattr(causes, "recognisers_of", lambda case: only)
    monkeypatch.setattr(causes, "ALWAYS", {})
    path = PLANTED[name](tmp_path)
    result = fit(path, search="local")
    changed = [cause for cause in result.verdict.causes if cause.changes]
    assert changed, result.verdict
    text = with_changes(path, changed[0].changes)
    other = fit(parse_case(text, path), search="local")
    assert other.cost < result.cost, changed[0]


@pytest.mark.parametrize("path", few_of(CASES, 3), ids=str)
def test_every_value_that_may_be_wrong_is_freed_by_its_remedy(path):
    case = load_case(CONFIGS / path)
    values, free, rows = case.values(), case.free(), case.rows()
    names = [
        name
        for name in parameters_of(case)
        if name in rows and values[name] and name not in free and name not in case.ties.by_name
    ]
    for name in names:
        remedy = remedy_of(case, {name: values[name]})
        changed = parse_case(with_changes(case.path, remedy.changes), case.path)
        assert (name in changed.free()) == ("network." not in name), remedy
        assert remedy.freed == ((name,) if name in changed.free() else ())
        assert changed.values()[name] == pytest.approx(values[name], rel=1e-2)
    freed_all = {name for name in names if "network." not in name}
    if freed_all:
        assert freed_all <= with_freed(case, freed_all).free().keys()
    assert replace(case, path=case.path).values() == values
