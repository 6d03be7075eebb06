"""Figures: every axis says what it shows, whatever the result; a warning is an error."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from tiers import few_of

from exfit.output import figures as plots
from exfit.results.compare_with_record import driving_signals
from exfit.results.comparisons import (
    Comparison,
    LeftOut,
    Overlay,
    PlayedRecord,
    StepFeatures,
    match_of,
)
from exfit.results.model import FitResult, FittedParameter, Iteration
from exfit.results.verdict import GOOD, Verdict
from exfit.simulation.simulator import Response
from exfit.util.vocabulary import HISTORY_PHASES, PHASES

TIME = np.linspace(0.0, 2.0, 41)
RISE = np.where(TIME < 1.0, 1.0, 1.05)
PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Draw with few dots: nobody looks at these."""
    monkeypatch.setattr(plots.style, "DPI", 40)


def comparison(signals=("vt",), start=None):
    overlays = {name: Overlay(RISE, RISE + 1e-4 * np.sin(TIME), start) for name in signals}
    return Comparison(
        name="fit",
        record="bump.csv",
        cost=1e-6,
        accepted=True,
        channels={name: match_of(overlay) for name, overlay in overlays.items()},
        features=StepFeatures(None, None),
        time=TIME,
        overlays=overlays,
    )


def test_a_reference_that_was_recorded_is_drawn_beside_vt():
    overlay = Overlay(RISE, RISE, None, RISE)
    figure = plots.overlay(replace(comparison(), overlays={"vt": overlay}), "title")
    labels = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert labels == ["vref, from where vt rests", "measured", "simulated"]


def test_what_drove_a_simulation_is_drawn_above_what_came_of_it():
    """As a reviewer of a grid event looks at it: V and f, then P and Q with their differences."""
    driving = driving_signals(TIME, 0.9, {"vt": RISE, "angle": RISE, "vs": np.full(41, np.nan)})
    half = np.where(TIME > 1.0, RISE, np.nan)
    played = PlayedRecord(0.9, driving, {}, {"p": LeftOut(half, half)})
    figure = plots.overlay(replace(comparison(("p", "q")), played=played), "title")
    labels = [axes.get_ylabel().partition("\n")[0] for axes in figure.axes]
    assert labels[:3] == ["vt (pu)", "frequency (Hz)", "vs (pu)"]
    error = "simulated"
    assert labels[3:] == ["active power p (pu)", error, "reactive power q (pu)", error]
    legends = [
        [text.get_text() for text in axes.get_legend().get_texts()] for axes in figure.axes[3::2]
    ]
    assert legends == [["measured", "not compared", "simulated"], ["measured", "simulated"]]
    titles = [axes.get_title(loc="right") for axes in figure.axes]
    assert titles[0] == "recorded vt, played in; deviation +0.05 pu at 1 s"
    assert titles[2] == "recorded vs, played in"
    assert plots.png(figure).startswith(PNG)


def line(number, phase, values):
    return Iteration(
        number=number,
        phase=phase,
        cost=10.0**-number,
        gradient_norm=10.0 ** -(2 * number),
        step_norm=0.1,
        damping=float("nan") if number == 0 else 0.5,
        inner=0,
        nfev=number + 1,
        njev=number + 1,
        quality=float("nan") if number == 0 else 0.9,
        values=values,
    )


def result(free=2, iterations=4, phases=("lm", "dgn"), at_bound=None):
    names = [f"K{k}" for k in range(free)]
    history = tuple(
        line(k, phases[min(k // 2, len(phases) - 1)], dict.fromkeys(names, 1.0 + 0.1 * k))
        for k in range(iterations + 1)
    )
    end = history[-1].values
    return FitResult(
        case=Path("bump.yaml"),
        about={},
        model="AC1A",
        strategy="lm-then-dgn",
        saturation="quadratic",
        parameters={
            name: FittedParameter(end[name], 1.0, 0.1, 10.0, at_bound, unit="pu") for name in names
        },
        fixed={},
        ties={},
        machine={},
        machine_model=None,
        network={},
        network_model=None,
        stabiliser={},
        stabiliser_model=None,
        cost=1.0,
        comparisons=(comparison(start=RISE),),
        knowledge=None,
        minima=None,
        status=1,
        message="the gradient vanished",
        success=True,
        interrupted=False,
        history=history,
        nfev=iterations + 1,
        njev=iterations + 1,
        simulations=2 * iterations + 2,
        substeps=1,
        seconds=0.1,
        notes=(),
        validation=(),
        versions={},
        inputs={},
        verdict=Verdict(GOOD),
    )


def response(states):
    names = ("vref", "vt", *states)
    return Response(TIME, {name: RISE + k for k, name in enumerate(names)}, 1)


def shown(figure):
    return [axes for axes in figure.axes if axes.get_visible()]


def draws(figure):
    """Draw a figure; a glyph that is missing or a layout that fails would be a warning."""
    assert isinstance(figure, Figure)
    return plots.png(figure).startswith(PNG)


@pytest.mark.long
@pytest.mark.parametrize(
    ("signals", "start"), [(("vt",), None), (("vt",), RISE), (("vt", "efd", "ifd"), RISE)]
)
def test_an_overlay_has_a_panel_and_a_panel_of_errors_for_each_signal(signals, start):
    figure = plots.overlay(comparison(signals, start), "bump")
    assert draws(figure)
    assert len(shown(figure)) == 2 * len(signals)
    for k, name in enumerate(signals):
        upper, lower = figure.axes[2 * k], figure.axes[2 * k + 1]
        assert name in upper.get_ylabel()
        assert "(pu)" in upper.get_ylabel()
        assert "pu)" in lower.get_ylabel()
        labels = [text.get_text() for text in upper.get_legend().get_texts()]
        expected = ["simulated"] if start is None else ["start values", "fitted"]
        assert labels == ["measured", *expected]
    assert figure.axes[-1].get_xlabel() == "time (s)"
    assert figure.get_suptitle() == "bump"


@pytest.mark.parametrize("iterations", [pytest.param(0, marks=pytest.mark.long), 40])
@pytest.mark.parametrize("phases", [("gn",), ("lm", "dgn")])
def test_convergence_shows_cost_gradient_and_damping_of_every_phase(phases, iterations):
    figure = plots.convergence(result(iterations=iterations, phases=phases))
    assert draws(figure)
    cost, gradient, damping = shown(figure)
    assert "pu²" in cost.get_ylabel()
    assert "gradient" in gradient.get_ylabel()
    assert "damping" in damping.get_ylabel()
    assert damping.get_xlabel() == "iteration"
    used = phases if iterations > 1 else phases[:1]
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == [PHASES[phase] for phase in used]


def test_every_phase_of_a_history_has_its_colour():
    found = result(phases=tuple(HISTORY_PHASES), iterations=20)
    for figure in (plots.convergence(found), plots.trajectories(found)):
        assert draws(figure)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == [*HISTORY_PHASES.values()]


def test_a_vanished_gradient_has_no_place_on_a_logarithmic_axis_but_breaks_nothing():
    whole = result(free=1, iterations=1, phases=("gn",))
    still = [Iteration(**{**vars(one), "cost": 0.0, "gradient_norm": 0.0}) for one in whole.history]
    found = FitResult(**{**vars(whole), "history": tuple(still)})
    assert draws(plots.convergence(found))


@pytest.mark.parametrize(
    ("free", "iterations"), few_of([(2, 1), (1, 0), (1, 40), (8, 0), (8, 40)], 1)
)
def test_every_free_parameter_has_its_trajectory_with_value_and_unit(free, iterations):
    found = result(free=free, iterations=iterations)
    figure = plots.trajectories(found)
    assert draws(figure)
    panels = shown(figure)
    assert len(panels) == free
    for axes, (name, one) in zip(panels, found.parameters.items(), strict=True):
        assert axes.get_title() == f"{name} = {one.value:.5g} pu"
    assert all(axes.get_xlabel() == "iteration" for axes in panels[-3:])


def test_phases_are_explained_where_there_is_more_than_one():
    (legend,) = plots.trajectories(result(phases=("lm", "dgn"))).legends
    assert [text.get_text() for text in legend.get_texts()] == [
        "Levenberg-Marquardt",
        "damped Gauss-Newton",
    ]
    assert plots.trajectories(result(phases=("lm",))).legends == []


def test_a_parameter_on_its_bound_says_so():
    (axes,) = shown(plots.trajectories(result(free=1, at_bound="max")))
    assert axes.get_title().endswith("(on its max)")


@pytest.mark.parametrize(
    "states",
    [
        pytest.param(("V",), id="a model alone"),
        pytest.param((), id="no state"),
        pytest.param(("efd", "ifd", "EQP", "VC", "VL", "VA", "VE", "VF"), id="machine"),
    ],
)
def test_a_response_shows_every_signal_once(states):
    figure = plots.response(response(states), "bump")
    assert draws(figure)
    first, *others = shown(figure)
    assert [text.get_text() for text in first.get_legend().get_texts()] == ["vref", "vt"]
    assert first.get_ylabel() == "vref, vt (pu)"
    assert [axes.get_ylabel() for axes in others] == [f"{name} (pu)" for name in states]
    assert figure.get_supxlabel() == "time (s)"


def test_a_state_that_never_moves_is_named_but_not_drawn():
    signals = {"vref": RISE, "vt": RISE, "VA": RISE, "VC": np.ones(len(TIME))}
    figure = plots.response(Response(TIME, signals, 1), "bump")
    assert [axes.get_ylabel() for axes in shown(figure)] == ["vref, vt (pu)", "VA (pu)"]
    assert "VC" in figure.get_supxlabel()


@pytest.mark.long
def test_a_signal_that_moves_by_rounding_errors_alone_looks_flat():
    wobble = 1.0 + 1e-15 * np.sin(40.0 * TIME)
    signals = {"vref": RISE, "vt": RISE, "VA": wobble}
    figure = plots.response(Response(TIME, signals, 1), "bump")
    low, high = figure.axes[1].get_ylim()
    assert high - low > 0.01
    assert draws(figure)


def test_drawing_leaves_nothing_behind_in_pyplot():
    import sys

    draws(plots.overlay(comparison(), "bump"))
    assert (
        "matplotlib.pyplot" not in sys.modules or not sys.modules["matplotlib.pyplot"].get_fignums()
    )
