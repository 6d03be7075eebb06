"""Models of the same records: the responses of the best beside each record, and their errors."""

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from exfit.show.figures.fit_series import responses_beside
from exfit.show.figures.style import new_figure

if TYPE_CHECKING:
    from exfit.features.rank.ranked_cases import Ranking


MOST_MODELS = 4  # in one figure
FARTHEST = 10.0  # times the error of the best: beside a larger one no other is seen
RECORD_HEIGHT = 3.8  # inches


def ranking(ranked: "Ranking") -> Figure:
    """Return the first fitted record and the first unseen one with the responses of the best."""
    least = min(result.rmse for result in ranked.results.values())
    near = {k: fit for k, fit in ranked.results.items() if fit.rmse <= FARTHEST * least}
    best = dict([*near.items()][:MOST_MODELS])
    panels = {
        "fitted": {name: result.comparison for name, result in best.items()},
        "not fitted": {
            name: result.validation[0] for name, result in best.items() if result.validation
        },
    }
    drawn = {kind: responses for kind, responses in panels.items() if responses}
    figure = new_figure(0.6 + RECORD_HEIGHT * len(drawn))
    grid = figure.add_gridspec(2 * len(drawn), 1, height_ratios=[2.6, 1.0] * len(drawn))
    for k, (kind, responses) in enumerate(drawn.items()):
        overlay = figure.add_subplot(grid[2 * k, 0])
        errors = figure.add_subplot(grid[2 * k + 1, 0], sharex=overlay)
        overlay.tick_params(labelbottom=False)
        record = next(iter(responses.values())).record
        overlay.set_title(f"{record}, {kind}", fontsize=10, loc="left")
        responses_beside(overlay, errors, responses)
    return figure
