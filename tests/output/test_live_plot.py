"""The live plot: what a terminal shows of a fit while it runs."""

import re
import unicodedata
from io import StringIO
from threading import Event

import numpy as np
import pytest
from records import case_of, config
from rich.cells import cell_len
from rich.console import Console
from rich.text import Text

from exfit import workflows
from exfit.fitting.experiment import Experiment
from exfit.output import live
from exfit.output.iterations import COLUMNS
from exfit.results.model import Iteration
from exfit.workflows.responses import LiveResponse

TIME = np.linspace(0.0, 10.0, 1001)
RISE = np.where(TIME < 1.0, 1.0, 1.05 - 0.05 * np.exp(1.0 - TIME))
SKETCH = LiveResponse("vt", TIME, RISE, RISE + 0.002)
SIZES = [(30, 8), (60, 15), (80, 24), (100, 30), (120, 15), (120, 40), (250, 70)]
# where Unicode puts the dots of a braille pattern, as (row, column)
PLACES = {1: (0, 0), 2: (1, 0), 3: (2, 0), 4: (0, 1), 5: (1, 1), 6: (2, 1), 7: (3, 0), 8: (3, 1)}


def screen(width, height, encoding="utf-8"):
    class Screen(StringIO):
        pass

    Screen.encoding = encoding
    return Console(file=Screen(), force_terminal=True, width=width, height=height)


def line(number):
    return Iteration(number, "dgn", 10.0**-number, 1e-10, 1e-10, 1e-10, 3, 99, 99, 0.5, {})


def watching(console, iterations=30, sketch=SKETCH):
    watch = live.LiveIterations(console, "case: AC1A", 100)
    watch.lines = [line(number) for number in range(iterations)]
    if sketch is not None:
        watch.live(sketch)
    return watch


def dots_of(code):
    """Return the dots of a braille character by its name in Unicode."""
    name = unicodedata.name(chr(code))
    numbers = name.removeprefix("BRAILLE PATTERN DOTS-") if "DOTS-" in name else ""
    found = np.zeros((4, 2), dtype=bool)
    for number in numbers:
        found[PLACES[int(number)]] = True
    return found


def test_every_dot_stands_where_unicode_has_it():
    rng = np.random.default_rng(0)
    dots = rng.random((12, 10)) < 0.5
    shown = np.block([[dots_of(code) for code in row] for row in live.cells(dots).tolist()])
    np.testing.assert_array_equal(shown, dots)


def test_a_line_has_no_gap_however_steep():
    rng = np.random.default_rng(1)
    dots = live.joined(TIME, rng.standard_normal(len(TIME)), (-4.0, 4.0), 30, 8)
    assert dots.any(axis=0).all()
    for left, right in zip(dots.T[:-1], dots.T[1:], strict=True):
        one, other = np.flatnonzero(left), np.flatnonzero(right)
        for column in (one, other):
            assert np.all(np.diff(column) == 1)
        assert other[0] <= one[-1] + 1
        assert one[0] <= other[-1] + 1


def test_a_level_lies_as_high_as_its_share_of_the_range():
    for level, row in ((1.0, 0), (0.0, 31), (0.5, 16)):
        dots = live.scattered(TIME, np.full(len(TIME), level), (0.0, 1.0), 20, 8)
        assert np.flatnonzero(dots.any(axis=1)).tolist() == [row]


def test_samples_that_are_no_numbers_are_left_out():
    gappy = np.where((TIME > 4.0) & (TIME < 6.0), np.nan, RISE)
    dots = live.scattered(TIME, gappy, (0.9, 1.1), 50, 8)
    seen = dots.any(axis=0)
    assert seen[:40].all()
    assert not seen[41:59].any()
    assert live.sketched(LiveResponse("vt", TIME, gappy, gappy), 60, 12)


@pytest.mark.parametrize(("width", "height"), [(45, 9), (72, 14), (100, 20)])
def test_a_plot_is_as_large_as_requested(width, height):
    lines = live.sketched(SKETCH, width, height)
    assert len(lines) == height
    assert max(cell_len(text.plain) for text in lines) == width
    assert "measured" in lines[0].plain
    assert lines[-1].plain.split()[-2:] == ["10", "s"]


def test_a_flat_signal_has_different_levels_at_its_axis():
    flat = LiveResponse("vt", TIME, np.ones(len(TIME)), np.ones(len(TIME)))
    labels = [text.plain.partition("┤")[0] for text in live.sketched(flat, 60, 12)]
    assert any(label.strip() for label in labels)


@pytest.mark.parametrize(("width", "height"), SIZES)
@pytest.mark.parametrize("iterations", [1, 30])
def test_a_picture_is_smaller_than_its_terminal(width, height, iterations):
    watch = watching(screen(width, height), iterations)
    lines = watch.picture().plain.splitlines()
    # beside it there is the title, and the line that the cursor stands on
    assert len(lines) <= height - 2
    shown = watch.console.render_lines(watch.picture(), pad=False)
    assert len(shown) == len(lines)
    assert str(iterations - 1) in watch.picture().plain


@pytest.mark.parametrize(
    ("size", "where"),
    [((60, 15), None), ((80, 24), "below"), ((120, 40), "beside"), ((120, 15), "beside")],
)
def test_a_plot_stands_where_there_is_room_for_it(size, where):
    text = watching(screen(*size)).picture().plain
    rows = [row for row in text.splitlines() if "dgn" in row]
    heads = [row for row in text.splitlines() if "simulated" in row]
    assert len(heads) == (0 if where is None else 1)
    assert any("│" in row for row in rows) == (where == "beside")
    assert "iteration 29 (at most 100 a phase)" in text


def test_the_limit_of_iterations_is_shown_for_each_phase():
    watch = watching(screen(100, 24), sketch=None)
    watch.most = {"lm": 20, "dgn": 15}
    assert "iteration 29 (at most 20 lm, 15 dgn): cost" in watch.picture().plain


def test_no_column_of_the_history_is_cut_in_two():
    for width in range(20, 80):
        text = watching(screen(width, 12), sketch=None).picture().plain
        lines = text.splitlines()
        place = next(k for k, row in enumerate(lines) if row.startswith("iteration"))
        assert max(map(len, lines[place - 1 : place + 2])) <= max(width, 20)
        heads = [column.heading.splitlines()[-1] for column in COLUMNS]
        words = re.findall(r"\S+(?: f)?", lines[place])
        assert words == heads[: len(words)]


def test_a_file_and_a_terminal_without_such_characters_ask_for_no_plot():
    assert live.LiveIterations(Console(file=StringIO()), "case").live is None
    assert live.LiveIterations(screen(80, 24, "ascii"), "case").live is None
    assert live.LiveIterations(screen(80, 24), "case").live is not None


@pytest.mark.parametrize("begun", [False, True])
@pytest.mark.parametrize("is_terminal", [False, True])
def test_a_fit_that_is_silent_says_how_far_it_is(monkeypatch, is_terminal, begun):
    """Whatever it is doing: nothing is announced between the lines, nor before the first."""
    monkeypatch.setattr(live, "QUIET", 0.01)
    console = Console(file=StringIO(), width=80, height=24, force_terminal=is_terminal)
    said = Event()
    monkeypatch.setattr(live.LiveIterations, "_progress", lambda _: said.set() or Text("here"))
    with live.LiveIterations(console, "title", 30).running() as shown:
        if begun:
            shown(line(0))
        said.clear()
        assert said.wait(60.0)
        shown(line(1))
    assert "here" in console.file.getvalue()
    assert console.file.getvalue().count("title") == 1


def test_drawing_takes_no_more_than_its_share_of_the_time(monkeypatch):
    """A drawing takes 10 ms, an iteration 1 ms: all but 3 % is left to the fit."""
    now = {"at": 0.0, "drawn": 0.0}
    monkeypatch.setattr(live.time, "perf_counter", lambda: now["at"])
    whole = live.LiveIterations.picture

    def slow(self):
        now["at"] += 0.01
        now["drawn"] += 0.01
        return whole(self)

    monkeypatch.setattr(live.LiveIterations, "picture", slow)
    with live.LiveIterations(screen(80, 24), "case", 100).running() as watch:
        for number in range(900):
            now["at"] += 0.001
            watch(line(number))
        within = now["drawn"]
    # the first drawing is not yet paid for by the time after it
    assert within - 0.01 <= live.SHARE_OF_TIME * now["at"]
    assert within > 0.01
    assert "iteration 899" in watch.picture().plain


@pytest.mark.long
@pytest.mark.parametrize(
    "jacobian", ["exact", pytest.param("central", marks=pytest.mark.every_example)]
)
def test_a_look_sees_what_each_iteration_led_to_and_is_not_counted(monkeypatch, tmp_path, jacobian):
    content = config("ac1a_typical")
    content["estimate"] |= {"jacobian": jacobian, "search": "local"}
    channel = {"column": "vt", "weight": 3.0, "scale": 2.0, "offset": -1.0}
    content["record"]["channels"] = {"vt": channel}
    content["test"]["vt0"] = 1.0
    del content["validate"]
    case = case_of(content, tmp_path)
    runs = []
    whole = Experiment.errors

    def errors(self, values):
        runs.append(values)
        return whole(self, values)

    monkeypatch.setattr(Experiment, "errors", errors)
    plain = workflows.fit(case)
    simulated = len(runs)
    seen, lines = [], []
    looked = workflows.fit(case, progress=lines.append, live=seen.append)
    assert looked.simulations == plain.simulations
    assert len(runs) - 2 * simulated == len(lines)  # each look
    costs = [0.5 * np.sum((3.0 * (one.simulated - one.measured)) ** 2) for one in seen]
    np.testing.assert_allclose(costs, [one.cost for one in lines], rtol=1e-9)


def test_a_look_at_a_record_with_gaps_leaves_them_out(tmp_path):
    content = config("ac1a_typical")
    content["record"]["mask"] = [[3.0, 4.0]]
    seen = []
    workflows.fit(case_of(content, tmp_path), live=seen.append)
    assert not np.any((seen[0].time >= 3.0) & (seen[0].time <= 4.0))
    assert len(seen[0].time) == len(seen[0].measured) == len(seen[0].simulated)
