"""What is said of parameters along which the cost hardly rises, and of the minima there."""

import numpy as np
import pytest
from records import case_of, config, write

from exfit import workflows
from exfit.results.intervals.minima import is_way, valleys
from exfit.util.text import rounded_value

NOISE = 1e-2  # pu: a tenth of the step hides in it, and most parameters with it


@pytest.fixture(scope="module")
def vague(tmp_path_factory):
    """A fit to a record that determines one of seven parameters."""
    folder = tmp_path_factory.mktemp("vague")
    content = config("ac1a_good")
    del content["validate"]
    content["estimate"]["search"] = "global"
    record = np.genfromtxt(content["record"]["file"], delimiter=",", names=True)
    noise = NOISE * np.random.default_rng(2).standard_normal(len(record))
    write(folder / "noisy.csv", t=record["t"], vt=record["vt"] + noise)
    content["record"]["file"] = "noisy.csv"
    return workflows.fit(case_of(content, folder))


@pytest.mark.long
def test_nothing_is_said_to_move_to_where_its_profile_or_its_bound_does_not_let_it(vague):
    combinations = vague.knowledge.identifiability.unseen
    assert combinations
    for combination in combinations:
        for name, value in combination.reached.items():
            parameter = vague.parameters[name]
            low, high = parameter.interval or (None, None)
            assert (parameter.min if low is None else low) <= value
            assert value <= (parameter.max if high is None else high)
            assert "orders of magnitude" not in combination.sentence


@pytest.mark.long
def test_minima_in_one_flat_valley_are_named_once_with_what_moves_along_it(vague):
    along = [minimum for minimum in vague.minima.minima if minimum.valley == 0]
    assert len(along) > 1
    assert not any(minimum.refuted for minimum in along)
    (note,) = (note for note in vague.notes if "minim" in note)
    assert "in the same flat valley" in note
    for name in ("KA", "KF", "TF"):  # which differ most
        values = [minimum.values[name] for minimum in along]
        least, most = (rounded_value(end) for end in (min(values), max(values)))
        assert f"{name} {least} ... {most}" in note
    summary = vague.minima.summary(vague.cost)
    assert summary.count("valley") == 1
    assert "not rejected" not in summary


class Plane:
    """Residuals of two parameters whose cost is a function of the plane."""

    def __init__(self, cost):
        self.cost = cost

    def costs(self, points):
        return np.array([self.cost(*point) for point in points])


ONE, OTHER, HIGH = np.array([-1.0, 0.0]), np.array([1.0, 0.0]), 10.0


@pytest.mark.parametrize(
    ("cost", "numbers"),
    [
        (lambda x, y: 0.0, [0, 0, 0]),
        (lambda x, y: HIGH * (abs(x) < 0.5), [0, 0, 1]),
        (lambda x, y: HIGH * (x > 0.5), [0, 0, None]),
    ],
    ids=["flat", "a ridge between them", "refuted"],
)
def test_a_ridge_parts_valleys_and_a_refuted_minimum_lies_in_none(monkeypatch, cost, numbers):
    def where_it_is_low(residuals, point, k, allowed):
        return point if residuals.costs([point])[0] <= allowed else None

    monkeypatch.setattr("exfit.results.intervals.minima._on_floor", where_it_is_low)
    minima = [ONE, 0.9 * ONE, OTHER]
    assert valleys(Plane(cost), minima, 0, 1.0) == numbers


def test_a_way_that_jumps_is_none(monkeypatch):
    """The floor lies far aside at the middle of the way: it belongs to another valley."""

    def aside(residuals, point, k, allowed):
        return np.array([point[0], 2.0 * (abs(point[0]) < 0.3)])

    monkeypatch.setattr("exfit.results.intervals.minima._on_floor", aside)
    assert not is_way(Plane(lambda x, y: 0.0), ONE, OTHER, 1.0)
