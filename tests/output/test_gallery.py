"""The gallery of the documentation is what the commands draw and print now."""

import re
from html import unescape

import numpy as np
import pytest
import small_svg
from field_record import AT, FILE, QUANTUM, UNIT, VT0, field_record
from film import film
from gallery import (
    BEGIN,
    END,
    FOLDER,
    PAGE,
    ROOT,
    RUNS,
    drawn,
    own_files,
    same,
    same_word,
    with_section,
)
from rich.text import Text

from exfit import workflows
from exfit.case.load import load_case
from exfit.output import figures as plots
from exfit.records.formats import open_table
from exfit.records.inspection import inspect

pytestmark = pytest.mark.long  # every figure of the documentation is drawn

PICTURES = [picture.name for run in RUNS for picture in run.pictures]
LARGEST, TOGETHER = 75_000, 600_000  # bytes: a page that opens at once


def test_every_picture_is_what_its_command_makes():
    """All in one test: parallel workers would draw them once each."""
    pictures = drawn()
    assert sorted(pictures) == sorted(PICTURES)
    changed = [name for name in PICTURES if not same((FOLDER / name).read_bytes(), pictures[name])]
    assert changed == [], "look at them after python tests/gallery.py"


def test_no_picture_is_left_of_a_command_that_is_gone():
    assert sorted(path.name for path in own_files()) == sorted(PICTURES)


def test_the_page_shows_every_picture_once_with_its_command():
    page = PAGE.read_text(encoding="utf-8")
    assert with_section(page) == page
    gallery = page.partition(BEGIN)[2].partition(END)[0]
    assert sorted(re.findall(r"\(img/(.+?)\)", gallery)) == sorted(PICTURES)
    for run in RUNS:
        assert gallery.count(f"`{run.command}`") == len(run.pictures)


def test_the_pictures_are_small():
    sizes = {path: path.stat().st_size for path in FOLDER.iterdir()}
    assert max(sizes.values()) < LARGEST
    drawn = [size for path, size in sizes.items() if path.suffix == ".svg"]
    assert sum(drawn) < TOGETHER  # two photographs of the page are beside them


def test_the_field_record_is_what_its_script_makes():
    """A sample may be rounded to the other side: simulations differ in their last digits."""
    text = FILE.read_text(encoding="utf-8")
    made = field_record()
    (ours, theirs) = ([line.split(";") for line in one.splitlines()] for one in (text, made))
    assert [line[:2] for line in ours] == [line[:2] for line in theirs]
    for column, quantum in zip((2, 3), QUANTUM.values(), strict=True):
        one, other = (
            np.array([float(line[column].replace(",", ".")) for line in lines[4:]])
            for lines in (ours, theirs)
        )
        assert np.max(np.abs(one - other)) < 1.5 * quantum


def test_the_field_record_identifies_its_unit():
    """Of nine values, each within its 95 % interval, as sample_data/README.md says."""
    result = workflows.fit(load_case(ROOT / "configs" / "field_record.yaml"))
    assert result.success
    known = result.knowledge.confidence.parameters
    for name, value in {**UNIT, "vref.at": AT, "vt0": VT0}.items():
        low, high = known[name].interval
        assert low <= value <= high, name


# ---- a terminal as it goes on


FRAMES = [  # lines, and seconds
    (["$ exfit fit"], 1.0),
    (["$ exfit fit", "0 1.7e-03"], 2.0),
    (["$ exfit fit", "0 1.7e-03", "1 <4.4e-04>"], 1.0),
    (["0 1.7e-03", "1 <4.4e-04>", "verdict: good"], 4.0),
]


def shown_at(svg, seconds):
    """Return the texts that CSS shows after so many seconds; None: without animation."""
    total = float(re.search(r"animation:([\d.]+)s step-end infinite", svg)[1])
    hidden = {*re.findall(r"^\.([\w-]+)\{visibility:hidden\}$", svg, re.MULTILINE)}
    texts = []
    for name, group in re.findall(r'(?:<g class="([\w-]+)">)?((?:<text.*?</text>)+)', svg):
        visible = name not in hidden
        if seconds is not None and name:
            (steps,) = re.findall(rf"@keyframes {name}\{{(.*)\}}$", svg, re.MULTILINE)
            for percent, state in re.findall(r"([\d.]+)%\{visibility:(\w+)\}", steps):
                if float(percent) / 100.0 * total <= seconds + 1e-3:
                    visible = state == "visible"
        if visible:
            texts += re.findall(r'y="([\d.]+)".*?>(.*?)</text>', group)
    texts.sort(key=lambda text: float(text[0]))
    return [unescape(text).replace("\N{NO-BREAK SPACE}", " ") for _, text in texts]


def test_a_film_shows_each_frame_for_its_time_and_the_last_one_without_motion():
    svg = film([([Text(line) for line in lines], long) for lines, long in FRAMES], 30, 3)
    begin = 0.0
    for lines, long in FRAMES:
        for at in (begin, begin + 0.9 * long):
            assert shown_at(svg, at) == lines
        begin += long
    assert shown_at(svg, None) == FRAMES[-1][0]
    assert svg.count("prefers-reduced-motion") == 1
    assert svg.count("$\N{NO-BREAK SPACE}exfit") == 1  # written once for three frames


def test_the_picture_of_the_readme_ends_with_the_verdict():
    svg = (FOLDER / "fit.svg").read_text(encoding="utf-8")
    assert "](docs/img/fit.svg)" in (ROOT / "README.md").read_text(encoding="utf-8")
    lines = " ".join(shown_at(svg, None))
    assert "verdict:" in lines
    assert "exfit fit" not in lines
    assert "exfit fit" in " ".join(shown_at(svg, 0.0))


# ---- what counts as changed


FOUND = inspect(open_table(FILE))


def figure():
    return plots.inspection(FOUND, "title")


picture = small_svg.small_svg


@pytest.fixture(scope="module")
def unchanged():
    """Return a figure as it is drawn now."""
    return picture(figure())


def test_a_figure_is_the_same_when_it_is_drawn_again(unchanged):
    assert same(unchanged, picture(figure()))


def test_axes_of_another_version_change_a_figure_only_of_the_same_version(unchanged, monkeypatch):
    def moved():
        one = figure()
        one.get_layout_engine().set(w_pad=7.0 / 72.0)  # of 5: as wider letters of the ticks do
        return picture(one)

    assert not same(unchanged, moved())
    monkeypatch.setattr(small_svg, "DRAWN_BY", "Matplotlib 99.0")
    assert same(unchanged, moved())
    other = figure()
    other.axes[0].set_title("another title")
    assert not same(unchanged, picture(other))


@pytest.mark.parametrize(
    "change",
    [
        lambda one: one.axes[0].lines[0].set_linewidth(0.5),
        lambda one: one.axes[0].lines[0].set_ydata(1.001 * one.axes[0].lines[0].get_ydata()),
        lambda one: one.axes[1].lines[0].set_color("#9d174d"),
        lambda one: one.axes[0].set_ylabel("Ugen\nvt\n(MV)", fontsize=8),
        lambda one: one.suptitle("titel", fontsize=11),
        lambda one: one.set_figheight(one.get_figheight() + 0.1),
    ],
)
def test_a_changed_figure_is_not_the_same(change, unchanged):
    changed = figure()
    change(changed)
    assert not same(unchanged, picture(changed))


@pytest.mark.parametrize(
    ("one", "other", "alike"),
    [
        ("5.0575e-06", "5.0576e-06", True), ("332.83", "332.84", True), ("1.0e-11", "9e-9", True),
        ("5.0575e-03", "5.0577e-03", False), ("332.83", "332.85", False), ("13", "15", False),
        ("KA", "KB", False), ("converged:", "converged:", True), ("0.1", "-", False),
    ],
)  # fmt: skip
def test_numbers_are_the_same_up_to_one_of_their_last_digit(one, other, alike):
    assert same_word(one, other) is alike
