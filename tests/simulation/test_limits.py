"""Which limits a response meets, and for how long: SciPy's run of the same equations, and laws."""

from functools import cache

import numpy as np
import pytest
from oracle import lively_values, system_of, typical_values
from places import CONFIGS
from scipy.integrate import solve_ivp

from exfit.case.load import load_case
from exfit.fitting.build import build_experiments
from exfit.fitting.problem import free_parameters
from exfit.models import MODELS
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.limits import equation_limits, limits_hit
from exfit.simulation.simulator import Simulator

STEP = 1e-3  # s
END = 4.0
CLOCK = np.linspace(0.0, END, 401)
LIMITED = [name for name in MODELS if name != "FIRST_ORDER"]
BUMP = 0.02  # pu, as in a test


@cache
def simulator(name, size, step=STEP, delay=0.0):
    inputs = Inputs(0.0, END, (InputStep(1.0, size),))
    return Simulator(system_of(name), inputs, CLOCK, step, delay=delay)


def by_name(hits):
    return {(hit.limit, hit.signal): hit for hit in hits}


# --- another run ----------------------------------------------------------------------------------


def seconds(there, times):
    """Return how long something is so, of equal steps."""
    return np.count_nonzero(there) * (times[1] - times[0])


def oracle_run(name, values, size, held):
    """Return a fine clock and a state by SciPy's LSODA; the slopes hold it at its limit."""
    system = system_of(name)
    start = system.rest(values)

    def slopes(t, y):
        x = dict(zip(system.states, y, strict=True))
        told = system.motion(values, start.setpoints, x, {"vref": size}).slopes
        return [float(told[state]) for state in system.states]

    times = np.linspace(1.0, END, 30001)
    begin = [float(start.states[state]) for state in system.states]
    options = {"method": "LSODA", "rtol": 1e-9, "atol": 1e-11, "max_step": 2e-3}
    found = solve_ivp(slopes, (1.0, END), begin, t_eval=times, **options)
    return times, found.y[system.states.index(held)]


@pytest.mark.parametrize(
    ("name", "state", "limit", "size"),
    [("SEXS", "EFD", "EMAX", 0.4), ("IEEET1", "VR", "VRMAX", 0.4)],
)
def test_a_large_step_meets_just_the_ceiling_and_for_as_long_as_in_another_run(
    name, state, limit, size
):
    values = typical_values(name)
    (hit,) = limits_hit(simulator(name, size), values)
    times, course = oracle_run(name, values, size, state)
    ceiling = values[limit]
    there = course >= ceiling * (1.0 - 1e-7)
    assert (hit.limit, hit.signal) == (limit, state)
    assert hit.value == pytest.approx(ceiling, rel=1e-12)
    # a grid point of either run, at either end
    assert hit.seconds == pytest.approx(seconds(there, times), abs=2.0 * STEP)
    assert hit.first == pytest.approx(times[np.argmax(there)], abs=2.0 * STEP)
    assert hit.share == pytest.approx(hit.seconds / END)


def test_a_clamp_is_met_while_its_input_wants_to_be_beyond():
    """VIMAX of ST1A: the error is the step less what vt has followed."""
    values = typical_values("ST1A", TR=0.0, VIMAX=0.1, VRMAX=99.0, VAMAX=99.0, KF=0.0)
    size = 0.3
    hit = by_name(limits_hit(simulator("ST1A", size), values))["VIMAX", ""]
    fine = np.linspace(1.0, END, 30001)
    inputs = simulator("ST1A", size).inputs
    run = Simulator(system_of("ST1A"), inputs, fine, STEP).response(values, ("vt", "vref"))
    error = run.signals["vref"] - run.signals["vt"]
    error[0] = error[1]
    expected = seconds(error > 0.1, fine)
    assert expected > 0.1
    assert hit.seconds == pytest.approx(expected, abs=2.0 * STEP)
    assert hit.first == 1.0


def test_the_field_current_limit_is_met_where_vfe_stands_at_it():
    values = typical_values("AC8B")
    hit = by_name(limits_hit(simulator("AC8B", 0.4), values))["VFEMAX", "VE"]
    told = simulator("AC8B", 0.4).response(values).signals
    ve, ifd = told["VE"], told["ifd"]
    low, high = sorted([(values["E1"], values["SE1"]), (values["E2"], values["SE2"])])
    a, b = np.sqrt(low[0] * low[1]), np.sqrt(high[0] * high[1])
    slope = (b - a) / (high[0] - low[0])
    vx = np.maximum(a + slope * (ve - low[0]), 0.0) ** 2
    vfe = values["KE"] * ve + vx + values["KD"] * ifd
    there = vfe >= values["VFEMAX"] - 1e-6
    assert hit.seconds == pytest.approx(0.01 * np.count_nonzero(there), abs=0.03)
    assert vfe.max() == pytest.approx(values["VFEMAX"], abs=1e-4)
    assert hit.first == pytest.approx(CLOCK[np.argmax(there)], abs=0.011)


# --- over the catalogue ---------------------------------------------------------------------------


def test_a_model_without_limits_shows_none():
    assert equation_limits(system_of("FIRST_ORDER")) == ()
    assert limits_hit(simulator("FIRST_ORDER", 5.0), typical_values("FIRST_ORDER")) == ()


@pytest.mark.parametrize("name", LIMITED)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_large_step_meets_a_limit_and_passes_none(name, sign):
    values = lively_values(name)
    hits = list(limits_hit(simulator(name, 20.0 * BUMP), values))
    hits += limits_hit(simulator(name, -20.0 * BUMP), values)
    assert hits
    told = simulator(name, sign * 20.0 * BUMP)
    held = {
        (one.limit, one.signal)
        for one in equation_limits(system_of(name))
        if one.clamped and one.signal
    }
    response = told.response(values).signals
    for hit in limits_hit(told, values):
        assert 0.0 < hit.seconds <= END - 1.0 + STEP
        assert 0.0 < hit.share < 1.0
        assert hit.first >= 1.0
        if (hit.limit, hit.signal) in held and hit.value == values.get(hit.limit):
            ceiling = "MAX" in hit.limit
            course = response[hit.signal] if ceiling else -response[hit.signal]
            # a state is put back on its limit after each step; of samples between, rounding
            assert course.max() <= (1.0 if ceiling else -1.0) * hit.value + 1e-9 * abs(hit.value)


@pytest.mark.parametrize("name", LIMITED)
def test_a_small_step_meets_none(name):
    assert limits_hit(simulator(name, 1e-5), lively_values(name)) == ()


@pytest.mark.parametrize("name", LIMITED)
def test_limits_far_away_change_the_response_as_little_as_no_hit_says(name):
    """Where no limit is met, moving all of them out leaves every sample as it was."""
    values = lively_values(name)
    sizes = [
        size
        for size in (0.02, 0.005, 0.001, 0.0001)
        if not limits_hit(simulator(name, size), values)
    ]
    wider = values | {
        symbol: value + (50.0 if "MAX" in symbol else -50.0)
        for symbol, value in values.items()
        if ("MAX" in symbol or "MIN" in symbol)
        and symbol in {one.limit for one in equation_limits(system_of(name))}
    }
    if name in ("DC3A", "ST5B", "ST6B"):
        return  # their limits are gains too, or the floor of another limiter
    assert wider != values
    size = sizes[0]
    samples = [simulator(name, size).samples(v, ("vt", "efd"))[0] for v in (values, wider)]
    np.testing.assert_allclose(samples[0], samples[1], rtol=0.0, atol=1e-10)


@pytest.mark.each_model
@pytest.mark.parametrize("name", LIMITED)
def test_every_limit_of_the_data_sheet_is_known(name):
    """But those that a model says it does not have in its own words."""
    rows = {row.symbol for row in MODELS[name].sheet if row.symbol.endswith(("MAX", "MIN"))}
    assert rows <= {one.limit for one in equation_limits(system_of(name))}


@pytest.mark.parametrize("case", ["first_order", "ac8b_unit1"])
def test_sample_cases_off_their_limits_show_none(case):
    loaded = load_case(CONFIGS / f"{case}.yaml")
    setups = build_experiments(loaded)
    values = {one.name: one.start for one in free_parameters(loaded, setups)} | loaded.values()
    for one in (setup.experiment for setup in setups):
        assert limits_hit(one.with_inputs(values), one.parameters(values)) == ()


# --- what is told ---------------------------------------------------------------------------------


def test_hits_come_in_the_order_of_their_instants():
    hits = limits_hit(simulator("AC1A", -0.4), typical_values("AC1A"))
    assert len(hits) > 1
    assert [hit.first for hit in hits] == sorted(hit.first for hit in hits)


def test_a_delayed_recorder_sees_the_hit_later():
    values = typical_values("SEXS")
    (now,), (later,) = (
        limits_hit(simulator("SEXS", 0.4, delay=delay), values) for delay in (0.0, 0.05)
    )
    assert later.first - now.first == pytest.approx(0.05)
    assert later.seconds == now.seconds


def test_a_limit_computed_at_the_start_has_the_name_of_its_parameter():
    values = typical_values("IEEET1", VRMAX=0.0)
    (hit,) = limits_hit(simulator("IEEET1", 0.8), values)
    assert hit.limit == "VRMAX"
    assert hit.value > 1.0


def test_long_runs_are_followed_to_their_end():
    """More points than are evaluated at once: the same seconds as on a coarser grid."""
    values = typical_values("SEXS")
    (coarse,) = limits_hit(simulator("SEXS", 0.4), values)
    (fine,) = limits_hit(simulator("SEXS", 0.4, step=1e-4), values)
    assert fine.seconds == pytest.approx(coarse.seconds, abs=2.0 * STEP)
