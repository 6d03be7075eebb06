"""The report in a browser: it opens from disk, can be zoomed, read without scripts, printed."""

import json
import re
from io import BytesIO

import numpy as np
import pytest
from browsers import WIDTHS, barriers, chromium, html_errors, listened_to
from matplotlib.image import imread
from payloads import HOSTILE, with_texts
from records import config, recording, several

from exfit import workflows
from exfit.case.load import parse_case
from exfit.features.report.writing import write_report
from exfit.output import run_folder

pytestmark = pytest.mark.long  # a browser is started for each page

CASES = (
    "ac1a_typical",
    "ac8b_unit1",
    "ac8b_on_line",
    "several",
)
READABLE = 10.0  # px: the least size of a text
BLANK = 0.02  # spread of the pixels, of white: a page of text and lines has ten times that
WHEEL = -400.0  # towards the reader


@pytest.fixture(scope="module")
def browser():
    """Start the browser once."""
    with chromium() as started:
        yield started


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """Make the reports of a few cases when they are asked for."""
    room = tmp_path_factory.mktemp("reports")
    known = {}

    def made(name):
        if name not in known:
            text = json.dumps(content(name))
            path = room / f"{name}.yaml"
            path.write_text(text)
            folder = room / name
            run_folder.write_fit(workflows.fit(parse_case(text, path)), folder)
            (known[name],) = write_report(folder)
        return known[name]

    return made


def content(name):
    """Return a case; the last one has two records, a limit, and says which unit it is of."""
    if name != "several":
        return config(name)
    about = {"Plant": "Höllental", "Unit": 2, "Rated": "120 MVA, 13.8 kV", "Tested by": "N. N."}
    free = {"KA": {"start": 300.0, "min": 76.6, "max": 7660.0}}
    content = several(recording("up"), recording("down"), free=free)
    validate = [recording("up"), recording("down")]
    validate = [{**one, "name": f"{one['name']}-again"} for one in validate]
    return {
        **content,
        "about": about,
        "validate": validate,
        "criteria": {"limits": [{"quantity": "rms", "limit": 1e-3}]},
    }


@pytest.fixture
def opened(browser, report):
    """Open a report; what the page says to the console, and what it asks for, is kept."""
    rooms = []

    def page(name, width=1280, scripts=True, colours="light"):
        rooms.append(
            browser.new_context(
                viewport={"width": width, "height": 900},
                java_script_enabled=scripts,
                color_scheme=colours,
            )
        )
        found = listened_to(rooms[-1])
        address = report(name).as_uri()
        found.goto(address)
        if scripts:
            found.wait_for_selector("html[data-ready]", timeout=60_000)
        found.address = address
        return found

    yield page
    for room in rooms:
        room.close()


def spread(png):
    """Return the standard deviation of the pixels of a picture, white as 1."""
    return float(np.std(imread(BytesIO(png))[:, :, :3]))


def brightness(png):
    """Return the mean of the pixels of a picture, white as 1."""
    return float(np.mean(imread(BytesIO(png))[:, :, :3]))


def ranges(page):
    """Return the ends of the axes of time of the interactive overlays."""
    return page.evaluate(
        "[...document.querySelectorAll('.alive .panel')]"
        ".map((panel) => [Number(panel.dataset.start), Number(panel.dataset.end)])"
    )


def middle(page, number=0):
    """Return where the middle of the first panel of an overlay is, scrolled into sight."""
    place = page.locator(".alive .static").nth(number)
    place.scroll_into_view_if_needed()
    box = place.bounding_box()
    return box["x"] + 0.5 * box["width"], box["y"] + 150.0


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("width", WIDTHS)
def test_a_report_opens_from_disk_without_a_fault_or_a_question_to_the_network(opened, name, width):
    page = opened(name, width)
    assert page.faults == []
    assert [url for url in page.asked if not url.startswith(("data:", "blob:"))] == [page.address]
    figures = page.locator("figure").count()
    overlays = page.locator("figure.alive").count()
    assert figures > overlays == page.locator(".alive .readout").count() > 0
    for number in range(overlays):
        box = page.locator(".alive .static").nth(number).bounding_box()
        assert box["height"] > 0.5 * box["width"]
    wide, seen = page.evaluate(
        "[document.documentElement.scrollWidth, document.documentElement.clientWidth]"
    )
    assert wide <= seen


@pytest.mark.parametrize("width", WIDTHS)
def test_no_part_of_a_report_is_blank(opened, width):
    page = opened("ac1a_typical", width)
    for section in page.locator("section").all():
        assert spread(section.screenshot()) > BLANK
    for overlay in page.locator(".alive").all():
        assert spread(overlay.screenshot()) > BLANK


def test_dragging_zooms_all_panels_of_a_record_alike(opened):
    page = opened("ac1a_typical")
    before = ranges(page)
    x, y = middle(page)
    page.mouse.move(x - 100, y - 50)
    page.mouse.down()
    page.mouse.move(x + 100, y + 50, steps=5)
    page.mouse.up()
    after = ranges(page)
    assert after[0] == after[1] != before[0]
    assert after[0][1] - after[0][0] < 0.5 * (before[0][1] - before[0][0])
    assert after[2:] == before[2:]


def test_the_signals_of_a_record_are_zoomed_together(opened):
    page = opened("ac8b_on_line")
    before = ranges(page)
    x, y = middle(page, 1)
    page.mouse.move(x - 100, y - 50)
    page.mouse.down()
    page.mouse.move(x + 100, y + 50, steps=5)
    page.mouse.up()
    after = ranges(page)
    assert len(after) == 8
    assert all(one == after[0] for one in after)
    assert after[0] != before[0]


def test_the_wheel_zooms_with_ctrl_and_scrolls_without(opened):
    page = opened("ac1a_typical")
    before = ranges(page)[0]
    page.mouse.move(*middle(page))
    page.mouse.wheel(0, 50.0)
    page.wait_for_timeout(200)
    assert ranges(page)[0] == before
    page.mouse.move(*middle(page))
    page.keyboard.down("Control")
    page.mouse.wheel(0, WHEEL)
    page.wait_for_timeout(200)
    page.keyboard.up("Control")
    after = ranges(page)[0]
    assert after[1] - after[0] < before[1] - before[0]


def test_pointing_at_an_overlay_shows_its_values(opened):
    page = opened("ac1a_typical")
    x, y = middle(page)
    page.mouse.move(x - 3, y)
    page.mouse.move(x, y)
    page.locator(".readout dd").first.wait_for(timeout=5_000)
    names, values = (page.locator(f".readout {tag}").all_inner_texts() for tag in ("dt", "dd"))
    told = dict(zip(names, values, strict=True))
    assert [*told] == ["time", "measured", "start values", "fitted", "difference (1e-3 pu)"]
    # in the middle of ten seconds, beside the labels of the axis
    assert 4.0 < float(told["time"].removesuffix(" s")) < 6.0
    assert 1.04 < float(told["measured"]) < 1.06


def test_keys_reach_what_the_pointer_does_and_the_whole_record_again(opened):
    page = opened("ac1a_typical")
    drawn = page.locator(".alive .static").first.inner_html()
    before = ranges(page)
    page.locator(".tools button").first.focus()
    for _ in range(2):
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
    after = ranges(page)
    assert after[0] == after[1] != before[0]
    assert after[0][0] >= before[0][0]
    page.locator(".tools button").nth(4).press("Enter")
    assert ranges(page) == before
    assert page.locator(".alive .static").first.inner_html() == drawn


def test_a_zoomed_drawing_is_printed_whole(opened):
    page = opened("ac1a_typical")
    before = ranges(page)
    page.get_by_label("zoom in").first.click()
    zoomed = ranges(page)
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert ranges(page) == before
    page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert ranges(page) == zoomed != before


@pytest.mark.parametrize("width", WIDTHS)
def test_the_text_of_every_figure_can_be_read(opened, width):
    page = opened("ac1a_typical", width, scripts=False)
    for text in page.locator("figure svg text").all():
        size = text.evaluate(
            "(text) => parseFloat(getComputedStyle(text).fontSize) * text.getScreenCTM().a"
        )
        assert size >= READABLE, text.text_content()


@pytest.mark.parametrize("name", CASES)
def test_without_scripts_every_drawing_is_seen(opened, name):
    page = opened(name, scripts=False)
    drawings = page.locator("svg[role=img]").all()
    # the small multiples of the search lie in a figure of their own
    assert len(drawings) == page.locator("figure:not(:has(figure))").count() > 5
    for one in drawings:
        assert one.is_visible()
        assert spread(one.screenshot()) > BLANK
    assert page.locator(".tools, .readout").count() == 0
    assert page.locator(".hint").first.is_hidden()


def test_a_report_prints_to_pages_with_its_drawings_and_whole_history(opened, tmp_path):
    page = opened("ac1a_typical")
    assert page.locator(".history").is_hidden()
    page.emulate_media(media="print")
    assert page.locator("figure.alive svg[role=img]").first.is_visible()
    assert page.locator(".tools").first.is_hidden()
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert page.locator(".history").is_visible()
    page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert page.locator(".tools").first.is_hidden()
    printed = page.pdf(prefer_css_page_size=True)
    assert 4 <= len(re.findall(rb"/Type\s*/Page\b", printed)) <= 20
    # A4 between its margins is 180 mm wide
    page.set_viewport_size({"width": 680, "height": 1000})
    wide = page.evaluate("document.documentElement.scrollWidth")
    assert wide <= 680


def test_no_text_of_a_result_acts_in_a_browser(browser, report, tmp_path):
    saved = json.loads((report("several").parent / "result.json").read_text(encoding="utf-8"))
    (tmp_path / "result.json").write_text(json.dumps(with_texts(saved, HOSTILE)))
    page = browser.new_page()
    acts = []
    page.on("dialog", lambda dialog: (acts.append(dialog.message), dialog.dismiss()))
    page.on("pageerror", lambda fault: acts.append(str(fault)))
    page.on("request", lambda request: acts.append(request.url))
    page.goto(write_report(tmp_path)[0].as_uri())
    page.wait_for_selector("html[data-ready]", timeout=60_000)
    page.mouse.move(*middle(page))
    page.wait_for_timeout(200)
    page.close()
    assert acts == [(tmp_path / "report.html").as_uri()]


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("width", [WIDTHS[0], WIDTHS[-1]])
@pytest.mark.parametrize("colours", ["light", "dark"])
def test_axe_finds_no_barrier(opened, name, width, colours):
    assert barriers(opened(name, width, colours=colours)) == ""


DARK, BRIGHT = 0.3, 0.9  # mean of the pixels, white as 1


def test_a_page_is_dark_where_the_reader_asks_for_it_and_printed_on_white(opened):
    page = opened("ac1a_typical", colours="dark")
    assert brightness(page.screenshot()) < DARK
    assert brightness(page.locator(".alive .static").first.screenshot()) < DARK
    page.emulate_media(media="print", color_scheme="dark")
    assert brightness(page.screenshot()) > BRIGHT


@pytest.mark.parametrize("name", CASES)
def test_the_checker_of_html_finds_no_error(report, name):
    assert html_errors(report(name)) == []
