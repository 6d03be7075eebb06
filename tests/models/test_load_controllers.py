"""A load controller above a governor: a second typing, its rest, its part of a case and a fit."""

import numpy as np
import pytest
from oracle import saturated
from typed_governors import TYPICAL, TypedUnit, integrated, lcfb1

from exfit.case.load import load_case
from exfit.errors import CaseError
from exfit.features.planner.export import export
from exfit.features.planner.psse import record_text
from exfit.features.planner.records import definition_of
from exfit.features.planner.units import read_unit
from exfit.models import GOVERNORS, LOAD_CONTROLLERS
from exfit.models.load_control import CONTROLLER, controlled
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical
from exfit.plants.parts import Names
from exfit.workflows import fit, simulate

DATA = saturated(MACHINES["GENROU"])
EXCITER = {"K": 40.0, "TE": 0.08}
LIVELY = {"Fbf": 1, "Pbf": 1, "Fb": 4.0, "Tpelec": 0.2, "db": 0.004, "emax": 0.05, "Kp": 0.1,
          "Ki": 0.08, "Irmax": 0.006}  # fmt: skip
CASE = """\
model: SEXS
plant:
  type: infinite-bus
  machine: GENROU
  parameters: MACHINE
  network: {f0: 60, X: 0.3, P: 0.6, Q: 0.1}
governor:
  model: TGOV1
  parameters: GOVERNOR
  load_controller: {model: LCFB1, parameters: CONTROLLER}
test: {vt0: 1.0, duration: 20.0, EVENTS}
parameters: {fixed: {K: 40, TE: 0.08, TATB: 1.0, TB: 0.0, EMIN: -99, EMAX: 99}}
simulation: {output_step: 0.05, accuracy: 1e-7}
"""
REFERENCE = "pref: [{at: 1.0, step: 0.008}]"
FREQUENCY = "fs: [{at: 1.0, step: 0.004, ramp: 2.0}, {at: 9.0, step: -0.006}]"


def case_of(folder, events=REFERENCE, **values):
    path = folder / "case.yaml"
    given = {
        "MACHINE": DATA,
        "GOVERNOR": TYPICAL["TGOV1"],
        "CONTROLLER": LIVELY | values,
        "EVENTS": events,
    }
    text = CASE
    for word, value in given.items():
        text = text.replace(word, str(value).replace("'", ""))
    path.write_text(text)
    return load_case(path)


@pytest.mark.parametrize("events", [REFERENCE, FREQUENCY])
def test_a_unit_with_a_load_controller_moves_as_in_a_second_typing(events, tmp_path):
    """Dead band, both limits and the bias act; integrated by DOP853."""
    case = case_of(tmp_path, events)
    response = simulate(case, {}).response
    ours, time = response.signals, response.time
    unit = TypedUnit("GENROU", DATA, EXCITER, "TGOV1", TYPICAL["TGOV1"])
    E = abs(1.0 - 0.3j * (0.6 - 0.1j))
    x0, vref, held = unit.start(1.0, E, 0.0, 0.3, 0.6)

    def signal(t):
        ramp = 0.004 * np.clip((t - 1.0) / 2.0, 0.0, 1.0) - 0.006 * (t >= 9.0)
        return ramp if events == FREQUENCY else 0.0

    def slopes(t, x):
        own, moving = x[:-2], x[-2:]
        pref = held + (0.008 if events == REFERENCE and t >= 1.0 else 0.0)
        power, _ = unit.powers(own, E, 0.0, 0.3)
        added, rates = lcfb1(moving, own[5] + signal(t), power, 0.6, LIVELY)
        return [*unit.slopes(own, vref, pref + added, signal(t), E, 0.0, 0.3), *rates]

    states = integrated(slopes, [*x0, 0.6, 0.0], time, (1.0, 3.0, 9.0), step=0.05)
    theirs = [unit.signals(x[:-2], E, 0.0, 0.3) for x in states.T]
    for name in theirs[0]:
        off = ours[name] - np.array([each[name] for each in theirs])
        assert np.abs(off[time != 1.0]).max() < 1e-5, name
    for name, column in zip(("PE", "INTEG"), states[-2:], strict=True):
        assert np.abs(ours[f"governor.{CONTROLLER}{name}"] - column).max() < 1e-5, name
    if events == REFERENCE:
        integral = np.abs(ours[f"governor.{CONTROLLER}INTEG"])
        assert integral.max() == pytest.approx(LIVELY["Irmax"], abs=1e-9)


def test_the_power_returns_to_where_it_was_but_for_the_dead_band(tmp_path):
    free = case_of(
        tmp_path, REFERENCE.replace("0.008", "0.002"), db=0.0, Irmax=0.05, Fbf=0, Ki=0.05
    )
    p = simulate(free, {}).response.signals["p"]
    assert p.max() > 0.61
    assert p[-1] == pytest.approx(0.6, abs=2e-3)
    off = simulate(free, {"governor.load_controller.Pbf": 0.0}).response.signals["p"]
    assert off[-1] == pytest.approx(0.6 + 0.002 / 0.05, abs=5e-3)  # on its way by T3


@pytest.mark.parametrize("name", GOVERNORS)
def test_every_governor_rests_with_a_load_controller_as_without(name):
    governor, controller = GOVERNORS[name], LOAD_CONTROLLERS["LCFB1"]
    both = controlled(governor, controller)
    assert both is controlled(governor, controller)
    p = Names(**typical(both.sheet))
    rests = []
    for model in (governor, both):
        x, d, u = Names(), Names(), Names(dw=0.0, p=0.5)
        pref = model.rest(0.5, u, p, x)
        assert vars(x).keys() == {*model.states, *model.setpoints}
        rests.append((pref, model.equations(x, Names(**vars(u), pref=pref), p, d)))
        assert vars(d).keys() == {*model.states}
    assert rests[0] == rests[1]


@pytest.mark.long
def test_an_integral_gain_is_found_through_noise(tmp_path):
    case = case_of(tmp_path, db=0.0)
    response = simulate(case, {}).response
    rng = np.random.default_rng(3)
    p = response.signals["p"] + 1e-3 * rng.standard_normal(len(response.time))
    np.savetxt(
        tmp_path / "record.csv", np.transpose([response.time, p]), "%.9f", ",", header="t,p",
        comments="",
    )  # fmt: skip
    text = case.path.read_text().replace(", 'Ki': 0.08", "").replace(", Ki: 0.08", "")
    text = text.replace("}}\ntest", "}, free: {Ki: {start: 0.04, min: 0.001, max: 1.0}}}\ntest")
    text = text.replace(", duration: 20.0", "")
    text += "record: {file: record.csv, time: t, channels: {p: p}}\n"
    text += "estimate: {search: local}\n"
    case.path.write_text(text)
    found = fit(load_case(case.path))
    low, high = found.parameters["governor.load_controller.Ki"].interval
    assert low < 0.08 < high
    assert high - low < 0.03
    assert found.load_controller_model == "LCFB1"
    assert found.governor["load_controller.Kp"] == LIVELY["Kp"]
    unit = read_unit(export(found, 7, "1").text, "unit.dyr")
    controller = {f"load_controller.{name}": x for name, x in unit.load_controller.values.items()}
    assert controller == pytest.approx(
        {name: found.governor[name] for name in controller}, rel=1e-3
    )


def test_a_load_controller_without_a_governor_is_left_out():
    records = [
        record_text(one, typical(one.model.sheet), 7, "1")
        for one in map(definition_of, ("GENROU", "SEXS", "LCFB1"))
    ]
    unit = read_unit("\n".join(records), "unit.dyr")
    assert (unit.governor, unit.load_controller) == (None, None)
    (warning,) = (each.text for each in unit.warnings if "LCFB1" in each.text)
    assert warning == "load controller LCFB1 is left out: the unit has no governor"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("model: LCFB1", "model: LCFB2", "'LCFB2' is not a load controller model"),
        ("Irmax:", "Imax:", "governor.load_controller.parameters.Imax"),
        ("Tpelec: 0.2", "Tpelec: -0.2", "governor.load_controller.parameters.Tpelec"),
    ],
)
def test_what_a_load_controller_cannot_be_is_refused_at_its_place(old, new, says, tmp_path):
    path = case_of(tmp_path).path
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(CaseError, match=says):
        load_case(path)
