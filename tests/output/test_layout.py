"""Where titles, numbers and labels are: none leaves its figure, and none lies on another."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from matplotlib.backends.backend_agg import RendererAgg
from places import ROOT

from exfit import workflows
from exfit.case.load import load_case
from exfit.output import figures as plots
from exfit.output import run_folder

ROUNDING = 1.5  # dots: letters begin at whole ones
# the starts of a search in one, two signals and ten parameters in the other
CASES = {"first_order": "global", "field_record": "local"}


@pytest.fixture
def noted(monkeypatch):
    """Return a function that draws a figure and returns what is written on it, and its size.

    Of each text the least and greatest place, in dots, and whether it is level or upright.
    """
    texts, draw_text = [], RendererAgg.draw_text

    def noting(renderer, gc, x, y, s, prop, angle, *others, **more):
        width, height, descent = renderer.get_text_width_height_descent(s, prop, False)
        corners = [(u, v) for u in (0.0, width) for v in (-descent, height - descent)]
        cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        places = corners @ np.array([[cos, sin], [-sin, cos]]) + (x, renderer.height - y)
        texts.append((s, places.min(axis=0), places.max(axis=0), angle % 90.0 == 0.0))
        draw_text(renderer, gc, x, y, s, prop, angle, *others, **more)

    monkeypatch.setattr(RendererAgg, "draw_text", noting)

    def draw(figure):
        texts.clear()
        height, width, _ = plots.drawn(figure).shape
        return [*texts], np.array([width, height])

    return draw


@pytest.fixture(scope="module", params=CASES)
def result(request):
    case = load_case(ROOT / "configs" / f"{request.param}.yaml")
    return workflows.fit(case, search=CASES[request.param])


def with_long_names(result):
    """Return a result whose parameters have names as long as those of a user's own model."""
    names = {name: f"machine.{name}_of_the_second_unit" for name in result.parameters}
    return replace(
        result,
        parameters={names[name]: value for name, value in result.parameters.items()},
        history=tuple(
            replace(line, values={names[name]: value for name, value in line.values.items()})
            for line in result.history
        ),
    )


def faults(texts, size):
    """Yield the texts that leave a figure, and those that lie on each other."""
    for text, low, high, _ in texts:
        if np.any(low < -ROUNDING) or np.any(high > size + ROUNDING):
            yield f"{text!r} leaves the figure"
    upright = [(text, low, high) for text, low, high, straight in texts if straight]
    for (one, low, high), (other, bottom, top) in combinations(upright, 2):
        if np.all(np.minimum(high, top) - np.maximum(low, bottom) > ROUNDING):
            yield f"{one!r} and {other!r} lie on each other"


@pytest.mark.long
def test_no_text_leaves_its_figure_or_lies_on_another(result, noted):
    figures = run_folder.figures_of_fit(result)
    figures |= {"long.png": run_folder.figures_of_fit(with_long_names(result))["trajectories.png"]}
    for name, figure in figures.items():
        texts, size = noted(figure.draw())
        assert len(texts) > 5, name
        assert [*faults(texts, size)] == [], name


def test_texts_that_lie_on_each_other_or_leave_their_figure_are_found(noted):
    figure = plots.style.new_figure(2.0, width=3.0)
    for place in (0.5, 0.52, 0.98):
        figure.text(place, 0.5, f"at {place}")
    figure.set_layout_engine(None)
    assert [*faults(*noted(figure))] == [
        "'at 0.98' leaves the figure",
        "'at 0.5' and 'at 0.52' lie on each other",
    ]


def test_a_title_that_is_too_long_is_made_to_fit(noted):
    figure = plots.style.new_figure(3.0)
    plots.style.panels(figure, 1)
    figure.suptitle("a title " * 16)
    texts, size = noted(figure)
    assert [*faults(texts, size)] == []


def test_the_axes_of_a_column_and_their_labels_are_in_line(noted):
    """Their numbers are of different lengths."""
    figure = plots.style.new_figure(4.0)
    upper, lower = plots.style.panels(figure, 2)[:, 0]
    for axes, scale in ((upper, 1.0), (lower, 1e-3)):
        axes.plot([0.0, scale])
        axes.set_ylabel("label")
    texts, _ = noted(figure)
    first, second = (low[0] for text, low, _, _ in texts if text == "label")
    assert first == pytest.approx(second, abs=ROUNDING)
    assert upper.get_position().x0 == pytest.approx(lower.get_position().x0)
    assert upper.get_position().x1 == pytest.approx(lower.get_position().x1)


def test_the_numbers_of_an_axis_follow_its_limits():
    figure = plots.style.new_figure(4.0)
    axes = plots.style.panels(figure, 1)[0, 0]
    axes.plot([0.0, 1.0])
    axes.set_ylim(5.0, 7.0)
    numbers = [float(label.get_text()) for label in axes.get_yticklabels()]
    assert numbers[0] == 5.0
    assert numbers[-1] == 7.0
