"""Laws of runs with located crossings: order, equal bits, derivatives across crossings, rest."""

import numpy as np
import pytest
from oracle import EXCITERS, system_of, typical_values

from exfit.engine.located import located
from exfit.engine.system import trace
from exfit.engine.trace import in_order
from exfit.models import MODELS
from exfit.models.blocks import quadratic
from exfit.plants.playback import playback
from exfit.simulation.inputs import Direction, Inputs, InputStep, each
from exfit.simulation.simulator import Simulator

TIMES = np.linspace(0.0, 6.0, 601)
# what the response meets: a non-windup limit; the anti-windup of a PID, along which it slides, and
# two in series; a limit that moves with a state; gates of a regulator; contacts
CASES = {
    "AC1A": {"VAMAX": 6.0, "VAMIN": -6.0},
    "AC8B": {"VRMAX": 6.0, "VPIDMAX": 8.0},
    "ST6B": {"VAMAX": 2.5, "VAMIN": -2.0},
    "ST8C": {},
    "AC6A": {"VFELIM": 2.0, "VHMAX": 1.0},
    "REXS": {},
    "DC3A": {"KV": 0.02},
}
BUMPS = (InputStep(0.5, 0.05), InputStep(2.5, -0.1))


def unit(model, step, steps=BUMPS, times=TIMES):
    inputs = Inputs(0.0, float(times[-1]), steps)
    return Simulator(system_of(model), inputs, times, step, located=True)


def values(model):
    return typical_values(model, **CASES[model])


def free(model):
    """Return gains, times and limits that matter to the response."""
    names = ("KA", "TA", "KPR", "KIR", "VAMAX", "VRMAX", "TE", "KPA", "VPIMAX", "TRH", "KV", "TF")
    return tuple(name for name in names if values(model).get(name, 0.0) > 0.0)


@pytest.mark.parametrize("model", CASES)
def test_halving_the_step_cuts_the_error_as_a_fourth_order_does_though_limits_are_hit(model):
    samples = [
        unit(model, step).samples(values(model), ("vt",))[0] for step in (4e-3, 2e-3, 1e-3, 2.5e-4)
    ]
    errors = [np.abs(each - samples[-1]).max() for each in samples[:-1]]
    assert errors[2] <= max(errors[0] / 40.0, 1e-8)
    assert errors[2] < 1e-7


@pytest.mark.parametrize("model", CASES)
def test_a_set_gives_the_same_bits_alone_side_by_side_and_with_derivatives(model):
    rng, names = np.random.default_rng(1), free(model)
    sets = [
        values(model) | {name: values(model)[name] * rng.uniform(0.95, 1.05) for name in names}
        for _ in range(20)
    ]
    test = unit(model, 5e-3)
    together, _ = test.samples_of_many(sets, ("vt",))
    alone = [test.samples(each_set, ("vt",))[0] for each_set in sets]
    derived = [test.tangents(each_set, ("vt",), each(names))[0] for each_set in sets]
    assert np.array_equal(together, alone)
    assert np.array_equal(together, derived)


@pytest.mark.parametrize("model", CASES)
def test_derivatives_are_exact_across_crossings(model):
    test, at, names = unit(model, 2e-3), values(model), free(model)
    _, slopes = test.tangents(at, ("vt",), each(names))
    for name, column in zip(names, slopes[:, 0].T, strict=True):
        # a contact that jumps shows how exactly its instant is located
        size, bound = (1e-4, 5e-4) if model == "DC3A" else (1e-5, 5e-5)
        change = size * at[name]
        ends = [test.samples(at | {name: at[name] + k * change}, ("vt",))[0] for k in (1, -1)]
        difference = (ends[0] - ends[1])[:, 0] / (2.0 * change)
        assert np.abs(column - difference).max() <= bound * np.abs(difference).max() + 1e-12


def test_instants_sizes_ramps_and_the_delay_of_a_recorder_have_exact_derivatives():
    steps = (InputStep(0.5, 0.05, smooth=True), InputStep(2.5, -0.1, smooth=True, ramp=0.2))
    test, at = unit("AC1A", 2e-3, steps), values("AC1A")
    directions = [
        *(Direction(steps={k: move}) for k in (0, 1) for move in ((1.0, 0.0), (0.0, 1.0))),
        Direction(delay=1.0),
    ]
    _, slopes = test.with_inputs(steps, 0.0123).tangents(at, ("vt",), directions)
    for k, direction in enumerate(directions):
        ends = []
        for size in (1e-5, -1e-5):
            moved = [
                step._replace(at=step.at + size * d_at, step=step.step + size * d_step)
                for n, step in enumerate(steps)
                for d_at, d_step in [direction.steps.get(n, (0.0, 0.0))]
            ]
            changed = test.with_inputs(tuple(moved), 0.0123 + size * direction.delay)
            ends.append(changed.samples(at, ("vt",))[0][:, 0])
        difference = (ends[0] - ends[1]) / 2e-5
        assert np.abs(slopes[:, 0, k] - difference).max() <= 1e-4 * np.abs(difference).max()


def test_a_run_that_has_settled_is_not_simulated_on_and_stays_what_it_is():
    long = np.linspace(0.0, 300.0, 30001)
    steps = (InputStep(1.0, 0.05), InputStep(200.0, -0.02))
    settled = unit("AC1A", 5e-3, steps, long).samples(values("AC1A"), ("vt",))[0]
    inputs = Inputs(0.0, 300.0, steps)
    literal = Simulator(system_of("AC1A"), inputs, long, 2e-4).samples(values("AC1A"), ("vt",))[0]
    assert np.abs(settled - literal).max() < 1e-6
    before = settled[(long > 150.0) & (long < 200.0)]
    assert np.array_equal(before, np.full_like(before, before[0]))


def test_a_sample_at_a_jump_shows_the_value_before_it_and_a_second_one_that_behind_it():
    times = np.array([0.0, 0.5, 0.5, 1.0])
    test = unit("ST6B", 1e-2, BUMPS, times)
    efd = test.samples(values("ST6B"), ("efd",))[0][:, 0]
    assert efd[0] == pytest.approx(efd[1], abs=1e-12)
    assert abs(efd[2] - efd[1]) > 0.1


@pytest.mark.parametrize("model", EXCITERS)
def test_every_choice_has_a_mode_also_one_that_only_an_output_makes(model):
    system = playback(MODELS[model], quadratic, ("vt", "ifd", "p", "q"))
    traced = trace(system, system.outputs)
    run = located(traced, system.inputs, system.states)
    computed = [*run.states, *run.slopes, *run.outputs, run.guard]
    symbols = {node for node in in_order(computed) if node.op == "symbol" and node.varies}
    known = {*traced.x, *traced.u, *run.v, *run.signs, *run.modes.bits}
    assert symbols <= known


def test_a_sample_at_the_end_of_a_sub_step_is_read_however_its_place_is_rounded():
    """A nanosecond later the response differs by 1e-8 pu at most."""
    ends, directions = np.linspace(0.0, 6.0, 3001), each(("KA",))
    tests = [unit("AC1A", 1e-2, times=ends + late).remade(least=5) for late in (0.0, 1e-9)]
    at, beside = (test.samples(values("AC1A"), ("vt",))[0] for test in tests)
    assert np.abs(at - beside).max() < 1e-8
    at, beside = (test.tangents(values("AC1A"), ("vt",), directions) for test in tests)
    assert all(np.abs(a - b).max() < 1e-8 for a, b in zip(at, beside, strict=True))


def test_samples_may_be_asked_for_in_any_order():
    rng = np.random.default_rng(2)
    places = rng.permutation(len(TIMES))
    directions = (*each(("KA",)), Direction(delay=1.0))
    ordered, mixed = unit("AC1A", 5e-3), unit("AC1A", 5e-3, times=TIMES)
    mixed = mixed.at_times(TIMES[places])
    pairs = zip(
        ordered.tangents(values("AC1A"), ("vt",), directions),
        mixed.tangents(values("AC1A"), ("vt",), directions),
        strict=True,
    )
    for sorted_ones, unsorted_ones in pairs:
        assert np.array_equal(sorted_ones[places], unsorted_ones)
    samples, _ = ordered.samples(values("AC1A"), ("vt",))
    assert np.array_equal(samples[places], mixed.samples(values("AC1A"), ("vt",))[0])
