"""A batch in the terminal: how far it is, the time that is left, what needs attention."""

import io
from dataclasses import replace

import pytest
from fleets import fleet, row

from exfit.features.fleet.terminal import (
    BETWEEN_LINES,
    FIRST_LINE,
    MOST_ATTENTION,
    BatchProgress,
)
from exfit.features.fleet.terminal import batch as show_batch
from exfit.output.terminal import GuardedConsole


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def progress(is_terminal=False, width=80):
    """Return the progress of a batch on a clock of its own, and what it prints to."""
    out, clock = io.StringIO(), Clock()
    console = GuardedConsole(file=out, force_terminal=is_terminal, width=width, highlight=False)
    return BatchProgress(console, clock), clock, out


def fit(shown, clock, name, seconds, **content):
    case = row(name, **content)
    shown.started(case.case)
    clock.now += seconds
    shown.finished(case)


def test_a_file_gets_a_line_now_and_then():
    shown, clock, out = progress()
    with shown.running():
        shown.begun(500, 1)
        for k in range(120):
            fit(shown, clock, f"u{k}", 1.0)
    first, *lines = out.getvalue().splitlines()
    assert first == "500 cases, 1 worker"
    assert lines[0] == "10 of 500 cases, 60/min, 8 min left, good 10"
    assert len(lines) == 1 + int((120.0 - FIRST_LINE) / BETWEEN_LINES)


def test_the_time_left_counts_what_waits_and_what_runs():
    shown, clock, _ = progress()
    shown.begun(14, 2)
    assert shown.seconds_left is None
    for k in range(2):
        shown.kept(f"before{k}")
    for k, seconds in enumerate((1.0, 9.0)):
        fit(shown, clock, f"u{k}", seconds)
    assert shown.seconds_left is None
    fit(shown, clock, "u2", 5.0)
    shown.started("../cases/slow.yaml")
    # eight that wait and one that runs, of 5 s each, by two workers
    assert shown.seconds_left == pytest.approx((8 * 5.0 + 5.0) / 2)
    clock.now += 1000.0
    assert shown.seconds_left == pytest.approx(8 * 5.0 / 2)
    assert shown.done == 5


def test_nothing_is_left_when_all_are_done():
    shown, clock, _ = progress()
    shown.begun(3, 8)
    for k in range(3):
        fit(shown, clock, f"u{k}", 2.0)
    assert (shown.seconds_left, shown.done) == (0.0, 3)


@pytest.mark.parametrize("width", [40, 80, 160])
def test_a_terminal_shows_no_line_that_is_wider(width):
    shown, clock, _ = progress(True, width)
    shown.begun(1000, 4)
    for case in fleet(40).cases:
        shown.started(case.case)
        clock.now += 3.0
        shown.finished(case)
    for k in range(6):
        shown.started(f"../cases/a_long_name_of_a_unit_{k}.yaml")
    picture = GuardedConsole(width=width).render_lines(shown.picture(), pad=False)
    lines = ["".join(segment.text for segment in line).rstrip() for line in picture]
    assert max(map(len, lines)) <= width
    assert lines[0].startswith("40 of 1000 cases")
    assert lines[-1].startswith("now a_long_name")


def summary_of(batch):
    out = io.StringIO()
    show_batch(GuardedConsole(file=out, width=80, highlight=False), batch)
    return out.getvalue()


def test_at_the_end_stand_the_counts_and_what_needs_attention():
    batch = fleet(300)
    text = summary_of(batch)
    bad = [case for case in batch.cases if not case.holds and case.status != "no record"]
    assert len(bad) > MOST_ATTENTION
    for case in bad[:MOST_ATTENTION]:
        assert case.name in text
    assert bad[MOST_ATTENTION].name not in text
    assert f"… and {len(bad) - MOST_ATTENTION} more in fleet.csv" in text
    assert "written to fleet/fleet.html" in text
    assert max(map(len, text.splitlines())) <= 80
    assert "interrupted" not in text
    assert "interrupted: run the same command again" in summary_of(replace(batch, interrupted=True))


def test_a_batch_without_a_fault_has_no_list():
    good = replace(fleet(0), cases=(row("a"), row("[b]", status="no record")))
    assert "reason" not in summary_of(good)


def test_names_and_reasons_are_texts():
    case = row("[red]u[/red]", status="failed", reason="[bold]no\nsuch " + 100 * "thing ")
    text = summary_of(replace(fleet(0), cases=(case,)))
    assert "[red]u[/red]" in text
    assert "[bold]no such thing" in " ".join(text.split())
    assert "…" in text
