"""The figure of fits of several cases with several strategies."""

from dataclasses import replace

import pytest
from cases import FIRST_ORDER, TIME, TRUTH

import exfit
from exfit.output import figures as plots
from exfit.output.figures.responses import MOST_CASES

STRATEGIES = ["dgn", "lm", "gn"]


@pytest.fixture(scope="module")
def series():
    record = exfit.Record.from_arrays(TIME, {"vt": TRUTH})
    cases = [exfit.Case.from_dict(FIRST_ORDER, record, name=name) for name in ("one", "other")]
    return exfit.fit_all(cases, STRATEGIES)


@pytest.mark.long
def test_each_case_has_an_overlay_errors_and_costs_with_a_line_for_each_fit(series):
    figure = plots.fit_series(series)
    assert plots.png(figure)
    assert len(figure.axes) == 3 * 2
    for k, name in enumerate(("one", "other")):
        overlay, errors, costs = figure.axes[3 * k : 3 * k + 3]
        assert overlay.get_title(loc="left").startswith(f"{name}: FIRST_ORDER")
        labels = [text.get_text() for text in overlay.get_legend().get_texts()]
        assert [label.split(",")[0] for label in labels] == ["measured", *STRATEGIES]
        assert len(errors.lines) == 1 + len(STRATEGIES)  # with zero
        lines = [line for line in costs.lines if len(line.get_ydata()) > 1]
        assert [line.get_ydata()[0] for line in lines] == pytest.approx(
            [run.result.start_cost for run in series.by_case[name]]
        )
        widths = [line.get_linewidth() for line in lines]
        assert widths == sorted(widths, reverse=True)  # what lies on top hides nothing


@pytest.mark.long
def test_more_cases_than_a_figure_has_room_for_are_named(series):
    runs = [
        replace(series.runs[0], case_name=f"case {k}", name=f"case {k}-dgn")
        for k in range(MOST_CASES + 2)
    ]
    figure = plots.fit_series(replace(series, runs=tuple(runs)))
    assert len(figure.axes) == 3 * MOST_CASES
    assert figure.get_supxlabel() == f"not drawn: case {MOST_CASES}, case {MOST_CASES + 1}"
