"""The page of a batch in a real browser: sorted, searched, read on a telephone, printed."""

import re

import pytest
from browsers import WIDTHS, barriers, chromium, html_errors, listened_to
from fleets import fleet, row
from payloads import HOSTILE

from exfit.features.fleet.folder import Fleet
from exfit.features.fleet.table import PAGE, write_tables

pytestmark = pytest.mark.long  # a browser is started for each page

COUNT, AT_ONCE = 250, 100  # cases of a batch, and rows that are shown at first


@pytest.fixture(scope="module")
def browser():
    """Start the browser once."""
    with chromium() as started:
        yield started


@pytest.fixture(scope="module")
def batch(tmp_path_factory):
    made = fleet(COUNT, tmp_path_factory.mktemp("fleet"))
    write_tables(made)
    return made


@pytest.fixture
def opened(browser, batch):
    """Open the page of a batch, by default that of many cases."""
    contexts = []

    def page(folder=None, width=1280, scripts=True):
        size = {"width": width, "height": 900}
        contexts.append(browser.new_context(viewport=size, java_script_enabled=scripts))
        new = listened_to(contexts[-1])
        new.goto(((folder or batch.folder) / PAGE).as_uri())
        if scripts:
            new.wait_for_selector("html[data-ready]")
        return new

    yield page
    for context in contexts:
        context.close()


def names(page):
    """Return the names of the cases that are shown, from the top."""
    heads = page.locator("#table tbody th")
    return heads.evaluate_all("(all) => all.map((head) => head.firstChild.textContent)")


def counted(page):
    return page.inner_text("#shown")


@pytest.mark.parametrize("width", WIDTHS)
def test_the_page_opens_from_disk_without_a_fault_or_a_question_to_the_network(
    opened, width, batch
):
    page = opened(width=width)
    assert page.faults == []
    assert page.asked == [(batch.folder / PAGE).as_uri()]
    wide, room = page.evaluate(
        "[document.documentElement.scrollWidth, document.documentElement.clientWidth]"
    )
    assert wide <= room
    assert names(page) == [case.name for case in batch.cases[:AT_ONCE]]
    for colours in ("light", "dark"):
        page.emulate_media(color_scheme=colours)
        assert barriers(page) == ""


def test_a_column_sorts_by_its_numbers_from_the_keyboard(opened, batch):
    page = opened()
    head = page.locator("#table thead th", has_text="rmse")
    head.locator("button").focus()
    page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") == "ascending"
    fitted = sorted(case.rmse["vt"] for case in batch.cases if case.rmse)
    by_name = {case.name: case for case in batch.cases}
    assert [by_name[name].rmse["vt"] for name in names(page)] == fitted[:AT_ONCE]
    page.keyboard.press("Enter")
    assert head.get_attribute("aria-sort") == "descending"
    assert [by_name[name].rmse["vt"] for name in names(page)] == fitted[::-1][:AT_ONCE]


def test_search_and_filters_leave_what_matches(opened, batch):
    page = opened()
    page.fill("#search", "crashed signal")
    page.wait_for_selector(f"#shown:has-text('of {COUNT}'):not(:has-text('{COUNT} of'))")
    crashed = [case.name for case in batch.cases if case.status == "crashed"]
    assert names(page) == crashed
    page.click("button[type=reset]")
    page.wait_for_selector(f"#shown:has-text('{COUNT} of {COUNT}')")
    page.select_option("#outcome", "no match")
    page.select_option("#model", "ST1A")
    page.wait_for_selector(f"#shown:has-text('of {COUNT}'):not(:has-text('{COUNT} of'))")
    wanted = [c.name for c in batch.cases if c.verdict == "no match" and c.model == "ST1A"]
    assert names(page) == wanted
    assert counted(page) == f"{len(wanted)} of {COUNT} cases"


def test_more_rows_are_shown_when_asked_for_and_all_are_printed(opened):
    page = opened()
    page.click("#more")
    assert len(names(page)) == 2 * AT_ONCE
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert len(names(page)) == COUNT
    page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert len(names(page)) == 2 * AT_ONCE
    assert len(re.findall(rb"/Type\s*/Page\b", page.pdf(prefer_css_page_size=True))) > 10


def test_without_scripts_all_is_there(opened):
    page = opened(scripts=False)
    assert len(names(page)) == COUNT
    assert page.locator("#controls").is_hidden()
    assert page.locator("#table svg").first.is_visible()


def test_hostile_texts_run_nothing(opened, tmp_path):
    cases = tuple(
        row(
            f"{k}{HOSTILE}",
            unit=HOSTILE,
            reason=HOSTILE,
            model=HOSTILE,
            verdict=HOSTILE,
            key=HOSTILE,
        )
        for k in range(5)
    )
    write_tables(Fleet(tmp_path, cases))
    page = opened(tmp_path)
    page.on("dialog", lambda dialog: page.faults.append(dialog.message))
    page.select_option("#model", index=1)
    page.locator("#table thead button").first.click()
    assert page.faults == []
    assert page.locator("img").count() == 0


def test_the_checker_of_html_finds_no_error(batch):
    assert html_errors(batch.folder / PAGE) == []
