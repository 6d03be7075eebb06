"""What every model of the catalogue keeps to; a new model is tested unasked."""

import os
import re
import subprocess
import sys
from itertools import pairwise, product
from math import ceil
from pathlib import Path

import numpy as np
import pytest
from oracle import (
    MACHINE_SATURATION,
    WITHOUT_PLANT,
    drawn_values,
    fastest_rate,
    leads_of,
    levels,
    lively_values,
    system_of,
    typical_values,
    vector,
)
from tiers import few_of

from exfit import models
from exfit.engine.kernel import Kernel, LinearKernel, Span
from exfit.engine.system import parameters_used, trace
from exfit.engine.trace import in_order
from exfit.errors import ModelError, SimulationError
from exfit.models import (
    GOVERNORS,
    LIMITERS,
    LOAD_CONTROLLERS,
    MODELS,
    STABILISERS,
    find,
    from_file,
)
from exfit.models.blocks import SHORTEST
from exfit.models.machines import MACHINES
from exfit.models.sheet import crossed_limits, saturation_faults, typical
from exfit.models.sheet import model as build
from exfit.plants import MACHINE, SATURATION, VT0
from exfit.plants.open_circuit import open_circuit
from exfit.plants.parts import Names, exciter_inputs, exciter_parameters
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

SHEETS = {**{n: m.sheet for n, m in MODELS.items()}, **{n: m.sheet for n, m in MACHINES.items()}}
FILES = Path(models.__file__).parent
ON_LOAD = "on load"
AT_GATE = "has the gate"  # what acts only while a limiter does
VOLTAGES = (0.8, 0.95, 1.0, 1.05, 1.2)
BOOSTED = {"AC11C": {"VBOOST": 2.0}}  # what acts at a low voltage only does so at any


@pytest.fixture(params=list(SHEETS))
def sheet(request):
    return SHEETS[request.param]


# --- data sheets ----------------------------------------------------------------------------------


def test_a_sheet_names_each_parameter_once_with_unit_and_meaning(sheet):
    for column in ("symbol", "meaning"):
        entries = [getattr(row, column) for row in sheet]
        assert len(set(entries)) == len(entries)
        assert all(entry.strip() == entry != "" for entry in entries)
    assert all(row.unit for row in sheet)


def test_each_exciter_marks_what_a_bump_test_is_fitted_for(model):
    """Of gains and times, which start above zero; never of a limit or a point of saturation."""
    free = [row for row in MODELS[model].sheet if row.free]
    assert free
    for row in free:
        assert row.typical > 0.0, row.symbol
        assert not row.symbol.endswith(("MIN", "MAX")), row.symbol
        assert row.symbol not in {"E1", "SE1", "E2", "SE2", "TR", "KE"}, row.symbol
        named = any(word in row.meaning for word in ("lead", "gain"))
        assert row.unit == "s" or row.symbol[0] in "Kka" or named, row.symbol


def test_a_lead_is_fitted_only_where_its_lag_does_not_cancel_it(model):
    rows = {row.meaning: row for row in MODELS[model].sheet}
    for row in rows.values():
        partner = rows.get(row.meaning.replace("lead", "lag"))
        if "lead" in row.meaning and partner is not None and partner.typical == row.typical:
            assert not row.free, row.symbol
            assert not partner.free, partner.symbol


def test_no_data_but_an_exciter_s_are_fitted_unless_a_case_says_so():
    parts = (*MACHINES.values(), *STABILISERS.values(), *GOVERNORS.values(), *LIMITERS.values())
    assert not [row.symbol for part in parts for row in part.sheet if row.free]


def test_a_typical_value_lies_within_its_range(sheet):
    for row in sheet:
        assert row.low <= row.typical <= row.high, row.symbol
        assert row.low < row.high, row.symbol
        assert np.isfinite([row.low, row.high]).all()


def test_typical_data_do_not_contradict_themselves(sheet):
    assert list(crossed_limits(typical(sheet))) == []
    assert list(saturation_faults(typical(sheet))) == []


def test_typical_machines_do_not_contradict_themselves():
    for machine in MACHINES.values():
        assert list(machine.faults(typical(machine.sheet))) == []
        assert list(machine.faults(typical(machine.sheet) | MACHINE_SATURATION)) == []


def test_every_ceiling_has_its_floor(model):
    symbols = [row.symbol for row in MODELS[model].sheet]
    for symbol in symbols:
        if symbol.endswith("MIN"):
            # what an exciter reaches is limited by saturation or by VFEMAX: its floor may be alone
            assert symbol == "VEMIN" or symbol.replace("MIN", "MAX") in symbols, symbol


def test_a_title_and_a_drawing_are_present_and_narrow(model):
    found = MODELS[model]
    assert found.title
    assert len(found.drawing.splitlines()) >= 3
    assert max(map(len, found.drawing.splitlines())) <= 80


def test_the_drawing_shows_every_gain_and_time_constant(model):
    text = MODELS[model].title + MODELS[model].drawing
    points = ("E1", "SE1", "E2", "SE2")
    for row in MODELS[model].sheet:
        assert row.symbol in text or row.symbol in points, row.symbol


# --- rest -----------------------------------------------------------------------------------------


def set_to(values, vt0):
    return values | {VT0: vt0}


def test_rest_is_rest(surrounded):
    exciter, machine, saturation = surrounded
    system = system_of(exciter, machine, saturation)
    for values in (typical_values(exciter, machine), drawn_values(exciter, 5, machine)):
        for vt0 in VOLTAGES:
            told = set_to(values, vt0)
            rest = LinearKernel(system).rest(vector(system, told))
            states = dict(zip(system.states, rest.x, strict=True))
            setpoints = dict(zip(system.setpoints, rest.r, strict=True))
            at = system.motion(told, setpoints, states, {"vref": 0.0})
            assert at.outputs["vt"] == pytest.approx(vt0, rel=1e-12)
            assert at.outputs["efd"] == pytest.approx(at.outputs["ifd"], rel=1e-12)
            for name, slope in at.slopes.items():
                assert abs(slope) < 1e-10 * max(1.0, abs(states[name])), name


def test_an_exciter_alone_rests_at_any_output_and_voltage(exciter):
    found = MODELS[exciter]
    p = exciter_parameters(lively_values(exciter), found, SATURATION["quadratic"])
    # below every ceiling at every voltage
    for efd in (0.5, 1.0, 1.5):
        for vt in VOLTAGES:
            u = exciter_inputs(vt=vt, vc1=1.01 * vt, ifd=0.9 * efd, vs=0.01, p=0.7, q=0.2)
            x, d = Names(), Names()
            u.vref = found.rest(efd, u, p, x)
            assert found.equations(x, u, p, d) == pytest.approx(efd, rel=1e-12)
            for slope in vars(d).values():
                assert abs(getattr(slope, "slope", slope)) < 1e-9 * 100.0


def test_a_model_without_a_plant_rests_at_any_output():
    for name in WITHOUT_PLANT:
        system, values = system_of(name), typical_values(name)
        for v in (-3.0, 0.0, 0.7, 20.0):
            rest = LinearKernel(system).rest(vector(system, set_to(values, v)))
            slopes, _ = LinearKernel(system).motion(
                vector(system, values), rest.r, rest.x, np.zeros(1)
            )
            assert slopes == pytest.approx(0.0, abs=1e-12 * (1.0 + abs(v)))


def test_a_flat_run_stays_flat_for_a_minute(saturated):
    model, saturation = saturated
    system = system_of(model, saturation=saturation)
    for values in (typical_values(model), drawn_values(model, 6)):
        code = Kernel(system, ("vt",))
        p = vector(system, values)[:, None]
        (out,) = code.run(p, code.start(p), [Span(levels(60_000), 1e-3, 1)])
        assert np.abs(out - values[VT0]).max() < 1e-9


# --- the method -----------------------------------------------------------------------------------


def test_halving_the_step_cuts_the_error_sixteenfold(model):
    """In the largest bump that meets no limit and no knee; the step lies on the grid.

    The fourth power shows where a step is short beside the model: at most 0.4 of 1 / rate.
    """
    if model == "IEEET4":
        pytest.skip("what is small stays in its dead band")
    system, values = system_of(model), lively_values(model)
    parts = ceil(0.01 * fastest_rate(system, values) / 0.4)
    code, p = Kernel(system, ("vt",)), vector(system, values)[:, None]

    def ends(steps, size):
        span = Span(np.full((steps + 1, 1), size), 0.5 / steps, parts)
        (out,) = code.run(p, code.start(p), [span])
        return out[:: steps // 50, 0, 0]

    def is_linear(size):
        whole, half = (ends(800, part) - values[VT0] for part in (size, size / 2))
        return np.abs(whole - 2.0 * half).max() < 1e-3 * np.abs(whole).max()

    size = next(size for size in (0.05, 1e-3, 3e-4) if is_linear(size))
    finest = ends(6400, size)
    errors = [np.abs(ends(steps, size) - finest).max() for steps in (50, 100, 200)]
    for coarse, fine in pairwise(errors):
        # the next term of the error is smaller by step * rate, a fifth to a third here
        assert 15.0 < coarse / fine < 19.0


def responses(model, sets, saturation="quadratic", size=0.3):
    """Return vt and the last state after a large bump up and down, for each set."""
    system = system_of(model, saturation=saturation)
    inputs = Inputs(0.0, 4.0, (InputStep(0.1, size), InputStep(2.0, -2 * size)))
    simulator = Simulator(system, inputs, np.linspace(0.0, 4.0, 81), 1e-3)
    return [simulator.samples(values, ("vt",))[0] for values in sets]


def tried(row, value):
    """Return values of a parameter, near and far from its own, and beyond zero."""
    factors = [value * factor for factor in (0.005, 0.01, 0.05, 0.2, 0.5, 2.0, 5.0, -0.03, 0.015)]
    shifts = [value + shift for shift in (-5.0, -0.5, 0.5, 1.0)]
    return [v for v in (*factors, *shifts) if row.low <= v <= row.high and v != value]


def awake_values(model):
    """Return lively data without gains of zero: what stands behind one would be inert."""
    values = lively_values(model)
    gains = [row.symbol for row in MODELS[model].sheet if row.symbol.startswith("K")]
    return values | {symbol: values[symbol] or 0.05 for symbol in gains}


def switched_values(model):
    """Return awake data with every switch in its other position: what it selects acts there."""
    values = awake_values(model) | BOOSTED.get(model, {})
    switches = {
        row.symbol: row.low + row.high - row.typical
        for row in MODELS[model].sheet
        if row.symbol.startswith("SW") or row.symbol == "SCT"
    }
    return [values | switches] if switches else []


def moves(model, symbol, row):
    """Return whether a parameter moves a response, by a bump of any size.

    One of 0.3 pu meets the usual limits, a larger one those of the field current; a small one does
    not hold a quick regulator at its limits throughout.
    """
    data = (lively_values(model), awake_values(model), *switched_values(model))
    for values, size in product(data, (0.3, 1.0, 0.02)):
        (before,) = responses(model, [values], size=size)
        for value in tried(row, values[symbol]):
            try:
                (after,) = responses(model, [values | {symbol: value}], size=size)
            except SimulationError:
                continue
            if np.abs(after - before).max() > 1e-6:
                return True
    return False


@pytest.mark.long
def test_no_parameter_is_inert_but_what_is_said_to_act_elsewhere_only(model):
    rows = {row.symbol: row for row in MODELS[model].sheet}
    if model not in WITHOUT_PLANT:
        of_machine = {MACHINE + row.symbol: row for row in MACHINES["GENROU"].sheet}
        rows |= {name: row for name, row in of_machine.items() if ON_LOAD not in row.meaning}
    inert = [symbol for symbol, row in rows.items() if not moves(model, symbol, row)]
    said = [symbol for symbol, row in rows.items() if {ON_LOAD, AT_GATE} & marks(row)]
    assert inert == said


def marks(row):
    """Return what the meaning of a parameter says about when it acts."""
    return {mark for mark in (ON_LOAD, AT_GATE) if mark in row.meaning}


def test_what_acts_on_load_only_is_said_to_and_nothing_else_is(exciter):
    for machine in MACHINES.values():
        used = parameters_used(system_of(exciter, machine.name))
        for row in machine.sheet:
            assert (MACHINE + row.symbol in used) == (ON_LOAD not in row.meaning), row.symbol


def test_what_acts_on_load_only_does_so_there(exciter):
    """In the equations, and in the rest that they have."""
    found = MODELS[exciter]
    symbols = [row.symbol for row in found.sheet if ON_LOAD in row.meaning]
    if exciter == "EXELI":
        pytest.skip("its stabiliser washes a power at rest out")
    values = lively_values(exciter)
    # the angle between voltage and current acts only where both take part
    values |= {symbol: values[symbol] or 0.5 for symbol in symbols} | BOOSTED.get(exciter, {})
    base = exciter_parameters(values, found, SATURATION["quadratic"])
    for symbol in symbols:
        for power in (0.0, 0.7):
            # a stabiliser acts on load only, and so does its place
            u = exciter_inputs(vt=1.0, ifd=1.8, p=power, q=0.3 * power, vs=0.01 * power)
            rests, motions = [], []
            # more of it, or less of a ceiling; of a place the next ones
            changes = (
                (0.0, 1.0, 2.0) if symbol == "VOS" else values[symbol] * np.array([0, 0.5, -0.5])
            )
            for change in changes:
                p = Names(**{**vars(base), symbol: values[symbol] + change})
                x, d = Names(), Names()
                vref = found.rest(2.0, u, p, x)
                rests.append([vref, x])
                u.vref, at = rests[0]
                motions.append([found.equations(at, u, p, d), d])
            moved = [own != other for own, *others in (rests, motions) for other in others]
            assert [any(moved[:2]), any(moved[2:])] == [power > 0.0] * 2, symbol


def test_all_parameters_of_an_exciter_reach_its_equations(model):
    used, found = parameters_used(system_of(model)), MODELS[model]
    rows = {row.symbol: row for row in found.sheet if ON_LOAD not in row.meaning}
    for symbol in rows.keys() - used:
        assert AT_GATE in rows[symbol].meaning, symbol
        assert moves_at_a_gate(model, symbol), symbol


def moves_at_a_gate(model, symbol):
    """Return whether a parameter moves an exciter while OEL has its gate."""
    p = exciter_parameters(lively_values(model), MODELS[model], SATURATION["quadratic"])
    u, x, found = exciter_inputs(vt=1.0, ifd=1.8, voel=-0.1), Names(), []
    u.vref = MODELS[model].rest(2.0, u, p, x)
    for factor in (1.0, 1.1):
        d, changed = Names(), Names(**{**vars(p), symbol: factor * getattr(p, symbol)})
        # an integral that has moved shows its gain
        moved = Names(**{name: value + 0.01 for name, value in vars(x).items()})
        found.append([MODELS[model].equations(moved, u, changed, d), d])
    return found[0] != found[1]


def test_a_time_constant_of_zero_is_the_limit_of_a_small_one(model):
    """A lead without its lag has no limit: it is zero as well, and so is the bypassed block.

    A derivative without its lag is none at all.
    """
    system, values = system_of(model), typical_values(model)
    sheets = {row.symbol: row for row in MODELS[model].sheet}
    if model not in WITHOUT_PLANT:
        sheets |= {MACHINE + row.symbol: row for row in MACHINES["GENROU"].sheet}
    for symbol in system.time_constants:
        if sheets[symbol].low > 0.0 or symbol not in parameters_used(system):
            continue
        if sheets[symbol].meaning == "lag of the derivative":
            continue
        alone = values | dict.fromkeys(leads_of(symbol, sheets), 0.0)
        none, small, twice, thrice = responses(
            model, [alone | {symbol: k * SHORTEST} for k in range(4)], size=0.005
        )
        # the difference is a T + b T^2 + c T^3 ...: the three small ones tell a and b
        assert np.abs(3.0 * (small - twice) + thrice - none).max() < 2.5e-6, symbol
        assert np.abs(small - none).max() < 5e-4, symbol


def test_a_time_constant_beyond_notice_equals_zero(model):
    """A lead is no block of its own: without notice, but not without effect."""
    system, values = system_of(model), typical_values(model)
    rows = {row.symbol: row for row in MODELS[model].sheet}
    leads = [lead for lag in rows if values[lag] > 0.0 for lead in leads_of(lag, rows)]
    for symbol in system.time_constants:
        if values[symbol] == 0.0 and symbol not in leads:
            one, other = responses(model, [values, values | {symbol: 0.99 * SHORTEST}])
            np.testing.assert_array_equal(one, other)


def limited_states(model):
    system = system_of(model)
    traced = trace(system, system.outputs)
    pairs = zip(system.states, traced.clamped, strict=True)
    return [name for name, node in pairs if node.op == "clip"]


def met_limits(exciter, values):
    """Return the states that meet a limit and leave it, over a bump up, down and up.

    None is ever beyond its limit, and none stays that is drawn back.
    """
    system = system_of(exciter)
    code = Kernel(system, system.outputs)
    p = vector(system, values)[:, None]
    start = code.start(p)
    r = dict(zip(system.setpoints, start.r[:, 0], strict=True))
    met = set()
    for size in (0.0, 1.0, -1.0, 0.0, 1.0):
        (out,) = code.run(p, start, [Span(np.full((1201, 1), size), 1e-3, 1)])
        x = {name: out[:, system.outputs.index(name), 0] for name in system.states}
        at = system.motion(values, r, x, {"vref": np.full(1201, size)})
        for name in limited_states(exciter):
            low, high = at.limits[name]
            # the ceiling of VE is a Newton step away, which leaves the square of how far the state
            # would have gone, or the ceiling went
            top = np.where(np.isfinite(high), high, 0.0) * np.ones(1201)
            beyond = np.abs(at.slopes[name][:-1]) * 1e-3 + np.abs(np.diff(top))
            margin = 1e-9 * (1.0 + np.abs(x[name])) + np.append(0.0, beyond**2)
            assert (x[name] <= high + margin).all(), name
            assert (x[name] >= low - margin).all(), name
            held = (x[name] == high) | (x[name] == low)
            drawn_back = held[:-1] & (at.slopes[name][:-1] != 0.0)
            assert (np.diff(x[name])[drawn_back] != 0.0).all(), name
            # what a lag drives leaves between two grid points
            met |= {name} if (held[:-1] & ~held[1:]).any() else set()
    return met


def test_a_state_stays_at_a_limit_only_while_pushed_against_it(exciter):
    values = lively_values(exciter)
    met = met_limits(exciter, values)
    if "VEMIN" in values:
        # an exciter that nothing drives down only tends to a floor of zero
        met |= met_limits(exciter, values | {"VEMIN": 0.9})
    if exciter in ("BBSEX1", "ST10C"):
        # the state of a limited lead-lag is held at the limits where there is no lead
        met |= met_limits(exciter, values | {"T2" if exciter == "BBSEX1" else "TC1": 0.0})
    if exciter == "IEEET4":
        # a motor is too slow to reach the ends of its rheostat in a bump test
        met |= met_limits(exciter, values | {"TRH": 0.2})
    # an integral that is frozen has no limit of its own, nor has a clamp a state
    assert met or not limited_states(exciter)


# --- the catalogue --------------------------------------------------------------------------------


def test_a_model_is_found_by_its_name_and_aliases_in_any_case(model, tmp_path):
    for name in (model, model.lower(), *MODELS[model].aliases):
        assert find(name, tmp_path) is MODELS[model]


def test_the_catalogue_lists_every_model_of_every_file():
    """A file has the parts of a model as names, that of a family calls a function."""
    found = []
    for path in FILES.glob("*/*.py"):
        text = path.read_text(encoding="utf-8")
        found += re.findall(r"^(\w+) = (?:documented|governor)\(", text, re.MULTILINE)
        found += [path.stem.upper()] if "\ndef equations(" in text else []
    shelves = (MODELS, STABILISERS, GOVERNORS, LOAD_CONTROLLERS, LIMITERS)
    assert sorted(found) == sorted(name for shelf in shelves for name in shelf)


def test_no_two_models_share_a_name():
    names = [name for found in MODELS.values() for name in (found.name, *found.aliases)]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("name", few_of(["AC1A", "ac1a", "ESAC1A", "esst4b", "FIRST_ORDER"], 2))
def test_finding_a_model_loads_its_file_alone(name):
    code = (
        "import sys; from pathlib import Path; from exfit.models import MODELS, STABILISERS, find;"
        f"print(find({name!r}, Path()).name, 'PSS1A' in STABILISERS, len(MODELS));"
        "print(*(file for file in sys.argv[1:] if 'exfit.models.exciters.' + file in sys.modules))"
    )
    files = {file for known in (MODELS, STABILISERS) for file in known.files.values()}
    environment = {**os.environ, "PYTHONPATH": str(FILES.parents[1])}
    done = subprocess.run(
        [sys.executable, "-c", code, *files],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    found, loaded = done.stdout.splitlines()
    model = found.split()[0]
    assert (found, loaded) == (f"{model} True {len(MODELS)}", MODELS.files[model])


def test_a_name_that_is_not_in_the_catalogue_is_no_key():
    assert "XYZ" not in MODELS
    assert MODELS.get("sheet") is None  # a file beside the models


def test_an_unknown_name_is_answered_with_the_nearest(tmp_path):
    with pytest.raises(ModelError, match=r"did you mean AC8[BC]"):
        find("AC88", tmp_path)
    with pytest.raises(
        ModelError, match=r"^XYZ is not in the catalogue, which exfit models lists$"
    ):
        find("XYZ", tmp_path)


USER = '''"""MINE: a lag.

vref -> [K / (1 + sT)] -> v
"""
from exfit.models.blocks import lag
from exfit.models.sheet import sheet

SHEET = sheet(("K", 2.0, "pu", (0.1, 10.0), "gain"), ("T", 0.5, "s", (0.01, 10.0), "lag"))
STATES = "V"

def equations(s, u, p, d):
    v, d.V = lag(u.vref, s.V, p.K, p.T)
    return v

def rest(v, u, p, x):
    x.V = v
    return v / p.K
'''


def test_a_user_s_file_is_a_model_like_any_other(tmp_path):
    from exfit.plants.alone import alone

    (tmp_path / "mine.py").write_text(USER)
    mine = find("mine.py", tmp_path)
    assert (mine.name, mine.title, mine.states) == ("MINE", "a lag", ("V",))
    simulator = Simulator(
        alone(mine), Inputs(0.0, 2.0, (InputStep(0.0, 1.0),)), np.linspace(0.0, 2.0, 41), 1e-3
    )
    samples, _ = simulator.samples({"K": 2.0, "T": 0.5, VT0: 0.0}, ("vt",))
    expected = 2.0 * (1.0 - np.exp(-simulator.times / 0.5))
    assert samples[:, 0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("def rest", "def restt"), "lacks rest"),
        (('STATES = "V"', ""), "lacks STATES"),
        (("import sheet", "import sheets"), "ImportError"),
        (("return v /", "return v //)"), "SyntaxError"),
        (('STATES = "V"', 'STATES = "V V"'), "STATES: duplicate name: V"),
        (('STATES = "V"', "raise SystemExit(0)"), "SystemExit"),
    ],
)
def test_a_file_that_is_no_model_is_refused_by_name(tmp_path, change, says):
    (tmp_path / "mine.py").write_text(USER.replace(*change))
    with pytest.raises(ModelError, match=says):
        from_file(tmp_path / "mine.py")


def test_a_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(ModelError, match=r"none\.py: cannot be read: No such file"):
        find("none.py", tmp_path)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("v, d.V =", "v, d.W ="), "states and slopes .*V, W"),
        (("p.K, p.T)\n", "p.K, p.TX)\n"), "TX"),
        (("x.V = v", "x.W = v"), "states and rest .*V, W"),
        (("    v, d.V", "    if s.V > 0: pass\n    v, d.V"), "where"),
    ],
)
def test_equations_that_do_not_fit_their_declarations_are_refused(tmp_path, change, says):
    from exfit.plants.alone import alone

    assert change[0] in USER
    (tmp_path / "mine.py").write_text(USER.replace(*change))
    mine = find("mine.py", tmp_path)
    with pytest.raises(ModelError, match=says):
        trace(alone(mine), ("vt",))


def test_a_model_is_made_of_the_names_of_its_file():
    parts = {
        "__doc__": "X: a title.\n\n a -> b\n",
        "SHEET": SHEETS["FIRST_ORDER"],
        "STATES": "A B",
        "equations": print,
        "rest": print,
    }
    made = build("X", parts)
    assert (made.title, made.drawing, made.states) == ("a title", " a -> b", ("A", "B"))


def test_the_graph_of_a_model_is_small(model):
    """A model that unrolls something by mistake makes thousands of nodes."""
    traced = trace(system_of(model), system_of(model).outputs)
    assert len(list(in_order([*traced.slopes, *traced.outputs, *traced.clamped]))) < 1000


@pytest.mark.parametrize("state", ["EQP", "PSID", "vt", "vref", "efd", "ifd"])
def test_a_state_with_the_name_of_something_else_is_refused(tmp_path, state):
    """Two rows of one name would be written beyond the arrays that hold them."""
    (tmp_path / "mine.py").write_text(USER.replace('"V"', f'"{state}"').replace(".V", f".{state}"))
    mine = find("mine.py", tmp_path)
    with pytest.raises(ModelError, match=f"{state} is taken"):
        open_circuit(mine, MACHINES["GENROU"], SATURATION["quadratic"])
