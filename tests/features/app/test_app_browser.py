"""The page of exfit app in a real browser: from a slider to a saved report, and what goes wrong."""

import re
import shutil
import urllib.error
import urllib.request
from pathlib import Path
from threading import Thread

import pytest
from app_server import served
from browsers import WIDTHS, barriers, chromium, html_errors, listened_to
from places import ROOT

import exfit
from exfit.features.app.server import PAGE, page_server
from exfit.output import run_folder

pytestmark = pytest.mark.long  # a browser, and a server of its own for each test

FIT = 180_000  # ms, of a fit on a busy machine


@pytest.fixture(scope="module")
def browser():
    """Start the browser once."""
    with chromium() as started:
        yield started


@pytest.fixture
def case(tmp_path):
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    shutil.copytree(ROOT / "sample_data", tmp_path / "sample_data")
    return tmp_path / "configs" / "ac1a_good.yaml"


@pytest.fixture
def server(case):
    with served("configs/ac1a_good.yaml", case.parents[1]) as (process, address):
        yield process, address


@pytest.fixture
def opened(browser, server):
    """Open the page."""
    contexts = []

    def page(width=1280):
        contexts.append(browser.new_context(viewport={"width": width, "height": 900}))
        new = listened_to(contexts[-1])
        new.goto(server[1])
        new.locator(".parameter").first.wait_for()
        return new

    yield page
    for context in contexts:
        context.close()


def test_from_a_slider_moved_by_keys_to_a_saved_report(opened, case, server):
    page = opened()
    page.get_by_label("KA slider").focus()
    before = page.inner_text("#cost")
    page.keyboard.press("ArrowRight")
    page.locator("#draft", has_text="ac1a_good-draft.yaml").wait_for()
    page.locator(f"#cost:not(:has-text('{before}'))").wait_for()
    page.get_by_role("button", name="Fit", exact=True).press("Enter")
    page.locator("#iterations tr").nth(3).wait_for(timeout=FIT)
    page.locator("#save-report:enabled").wait_for(timeout=FIT)
    assert page.inner_text("#verdict").startswith("matches, not all determined")
    assert page.locator(".band:visible").count() == 7
    assert page.inner_text("#command") == "exfit fit configs/ac1a_good-draft.yaml"
    page.click("#save-case")
    page.locator("#message", has_text="saved: configs/ac1a_good.yaml").wait_for()
    page.click("#save-report")
    page.locator("#message", has_text="report.html").wait_for(timeout=FIT)
    folder = case.parents[1] / "runs" / "ac1a_good-fit"
    assert "AC1A" in (folder / "report.html").read_text(encoding="utf-8")
    result = exfit.load_result(folder)
    assert result.inputs["case"] == exfit.fit(case).inputs["case"]
    assert page.faults == []
    assert {*page.asked} == {server[1] + name for name in ("", "app.js", "plot.js", "style.css")}


def drop(page, name, text):
    """Drop a file on the page."""
    files = page.evaluate_handle(
        """([name, text]) => {
            const moved = new DataTransfer();
            moved.items.add(new File([text], name));
            return moved;
        }""",
        [name, text],
    )
    page.dispatch_event("body", "drop", {"dataTransfer": files})


def test_from_a_dropped_record_to_a_saved_report(opened, case, tmp_path):
    page = opened()
    drop(page, "bump.csv", (tmp_path / "sample_data" / "ac1a_up.csv").read_text())
    page.locator("#drawing img").wait_for()
    assert barriers(page) == ""
    assert page.get_by_label("signal of vt").input_value() == "vt"
    page.fill("#step", "0.05")
    page.click("summary")
    page.fill("#m-Tpd0", "6")
    page.click("#make")
    page.locator("#message", has_text="written: bump.yaml").wait_for()
    assert exfit.load_case(tmp_path / "bump.yaml").values()["machine.Tpd0"] == 6.0
    page.click("#fit")
    page.locator("#save-report:enabled").wait_for(timeout=FIT)
    page.click("#save-report")
    page.locator("#message", has_text="report.html").wait_for(timeout=FIT)
    assert (tmp_path / "runs" / "bump-fit" / "report.html").is_file()
    assert page.faults == []


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("bump.exe", "t,vt\n", "not the name of a file to show"),
        ("bump.csv", "t,vt\n", "bump.csv"),
        ("../bump.csv", "t,vt\n", "not the name"),
    ],
)
def test_a_bad_file_is_refused_with_its_name_and_the_page_goes_on(
    opened, tmp_path, name, text, words
):
    page = opened()
    drop(page, name, text)
    page.locator("#message.bad", has_text=words).wait_for()
    assert "Traceback" not in page.inner_text("#message")
    page.get_by_label("KA slider").press("ArrowRight")
    page.locator("#draft", has_text="draft").wait_for()
    assert not (tmp_path.parent / "bump.csv").exists()


@pytest.mark.parametrize("width", [*WIDTHS, 2560])
def test_the_page_is_open_to_all_readers_and_no_wider_than_its_window(opened, width):
    page = opened(width)
    wide, room = page.evaluate(
        "[document.documentElement.scrollWidth, document.documentElement.clientWidth]"
    )
    assert wide <= room
    for colours in ("light", "dark"):
        page.emulate_media(color_scheme=colours)
        assert barriers(page) == ""
    assert page.faults == []


def test_the_page_is_html(tmp_path):
    page = tmp_path / "page.html"
    shutil.copy(PAGE / "index.jinja", page)
    assert html_errors(page) == []


def test_values_under_the_pointer_and_the_arrow_keys_are_read_out(opened):
    page = opened()
    page.locator("canvas").first.hover()
    values = re.compile(r"^[\d.]+ s: measured [\d.]+, start [\d.]+, current [\d.]+$")
    readout = page.locator(".readout").first
    assert values.match(readout.inner_text())
    page.locator("canvas").first.press("ArrowLeft")
    assert values.match(readout.inner_text())


def test_a_profile_is_shown_on_a_click(opened):
    page = opened()
    page.get_by_role("button", name="Profile of TA").click()
    page.locator("#profile h3", has_text="Profile of TA").wait_for(timeout=FIT)
    assert page.faults == []


def test_a_killed_server_is_noticed_and_the_draft_is_there(opened, server, case):
    page = opened()
    page.get_by_label("KA slider").press("ArrowRight")
    page.locator("#draft", has_text="draft").wait_for()
    server[0].kill()
    page.locator("#message", has_text="The server has ended").wait_for()
    assert page.locator("button:enabled, input:enabled").count() == 0
    assert exfit.load_case(case.with_name("ac1a_good-draft.yaml"))


def test_of_two_pages_the_second_writes_nothing_over_what_the_first_has_stored(opened, case):
    first, second = opened(), opened()
    first.get_by_label("KA slider").press("ArrowRight")
    first.locator("#draft", has_text="draft").wait_for()
    stored = case.with_name("ac1a_good-draft.yaml").read_text()
    second.get_by_label("TE slider").press("ArrowLeft")
    second.locator("#message", has_text="was changed by another page").wait_for()
    assert case.with_name("ac1a_good-draft.yaml").read_text() == stored


def test_a_case_that_an_editor_has_changed_is_not_written_over(opened, case):
    page = opened()
    case.write_text(case.read_text() + "# mine\n")
    page.get_by_label("KA slider").press("ArrowRight")
    page.locator("#message", has_text="was changed by another page or program").wait_for()
    assert case.read_text().endswith("# mine\n")
    assert not case.with_name("ac1a_good-draft.yaml").exists()


def test_the_result_of_a_fit_is_shown(browser, case, monkeypatch):
    monkeypatch.chdir(case.parents[1])
    result = exfit.fit(case, search="local")
    run_folder.write_fit(result, Path("runs/one"))
    with served("runs/one", case.parents[1]) as (_, address):
        page = listened_to(browser.new_context())
        page.goto(address)
        page.locator("#verdict", has_text=result.verdict.verdict).wait_for()
        assert page.locator("#found tbody tr").count() == len(result.parameters)
        assert page.locator("#save-report").is_enabled()
        assert page.faults == []


def test_the_server_ends_a_while_after_its_last_page(browser, case, monkeypatch):
    monkeypatch.chdir(case.parents[1])
    server, address = page_server(case, linger=0.5)
    thread = Thread(target=server.serve_pages, daemon=True)
    thread.start()
    first, second = browser.new_page(), browser.new_page()
    for page in (first, second):
        page.goto(address)
        page.locator(".parameter").first.wait_for()
    first.close()
    thread.join(2.0)  # longer than it lingers without any page
    assert thread.is_alive()
    second.reload()
    second.locator(".parameter").first.wait_for()
    second.close()
    thread.join(60.0)
    assert not thread.is_alive()


@pytest.fixture
def started(browser, case):
    """Open the page of no file."""
    with served(None, case.parents[1]) as (_, address):
        page = listened_to(browser.new_context())
        page.goto(address)
        page.locator("#start").wait_for()
        yield page


def test_from_nothing_by_a_planner_s_file_and_a_record_to_the_case_of_a_unit(started, case):
    page, folder = started, case.parents[1]
    assert barriers(page) == ""
    drop(page, "plant.dyr", (folder / "sample_data" / "unit.dyr").read_text())
    page.locator("#message", has_text="bus 101, id 1").wait_for()
    page.set_input_files("#file", folder / "sample_data" / "ac1a_up.csv")
    page.locator("#drawing img").wait_for()
    assert page.locator("#model").is_disabled()
    assert page.input_value("#model") == "AC1A"
    page.fill("#step", "0.05")
    page.click("#make")
    page.locator("#message", has_text="written: ac1a_up.yaml").wait_for()
    words = "exfit new --record ac1a_up.csv --dyr plant.dyr --bus 101 --id 1 -o ac1a_up.yaml"
    assert page.inner_text("#command") == f"{words} --step 0.05"
    made = exfit.load_case(folder / "ac1a_up.yaml").values()
    assert (made["KA"], made["machine.Tpd0"]) == (766.0, 6.0)
    assert page.faults == []


def test_a_channel_is_corrected_by_a_choice(started, case):
    page, folder = started, case.parents[1]
    lines = (folder / "sample_data" / "ac1a_up.csv").read_text().split()
    rows = [line.rsplit(",", 2)[0] for line in lines]
    drop(page, "odd.csv", "\n".join(["t,ifd", *rows[1:]]))
    page.get_by_label("signal of ifd").select_option("vt")
    page.get_by_label("unit of ifd").fill("furlong")
    page.get_by_label("unit of ifd").press("Enter")
    page.locator("#message.bad", has_text="furlong").wait_for()
    page.get_by_label("unit of ifd").fill("pu")
    page.get_by_label("unit of ifd").press("Enter")
    page.locator("#message.bad").wait_for(state="hidden")
    page.fill("#step", "0.05")
    page.click("#make")
    page.locator("#message", has_text="written: odd.yaml").wait_for()
    (recording,) = exfit.load_case(folder / "odd.yaml").recordings
    assert recording.record.channels["vt"].column == "ifd"


@pytest.mark.parametrize(("which", "way"), [("lower", -1), ("upper", 1)])
def test_a_bound_is_dragged_by_the_mouse_and_by_keys(opened, case, which, way):
    page = opened()
    handle = page.get_by_label(f"drag the {which} bound of KA")
    bound = page.get_by_label(f"{which} bound of KA", exact=True)
    before = float(bound.input_value())
    box = handle.bounding_box()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + 20 * way, box["y"] + 5, steps=4)
    page.mouse.up()
    page.locator("#draft", has_text="draft").wait_for()
    dragged = float(bound.input_value())
    assert (dragged - before) * way > 0.0
    handle.focus()
    page.keyboard.press("ArrowLeft" if which == "upper" else "ArrowRight")
    page.wait_for_function(
        "([label, value]) => document.activeElement.getAttribute('aria-label') === label"
        " && Number(document.activeElement.getAttribute('aria-valuenow')) !== value",
        arg=[f"drag the {which} bound of KA", dragged],
    )
    for _ in range(100):  # until it is stored
        free = exfit.load_case(case.with_name("ac1a_good-draft.yaml")).free()["KA"]
        if (free.min if which == "lower" else free.max) == float(bound.input_value()) != dragged:
            break
        page.wait_for_timeout(100)
    else:
        pytest.fail(f"{free}: not stored")
    assert page.faults == []


def test_a_refused_bound_goes_back_to_the_one_in_force_at_once(opened):
    page = opened()
    handle = page.get_by_label("drag the lower bound of KD")
    bound = page.get_by_label("lower bound of KD", exact=True)
    box = handle.bounding_box()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + 2000, box["y"] + 5, steps=4)
    assert float(bound.input_value()) == 0.356  # its value, 0.3556, rounded
    page.mouse.up()
    page.locator("#message.bad", has_text="0.356").wait_for()
    assert float(bound.input_value()) == 0.03556
    assert float(handle.get_attribute("aria-valuenow")) == 0.0356
    assert handle.bounding_box()["x"] == box["x"]
    bound.fill("5")  # above the other one
    bound.press("Enter")
    page.locator("#message.bad", has_text="5 is not below").wait_for()
    assert float(bound.input_value()) == 0.03556
    assert page.faults == []


def answered(address, **headers):
    try:
        with urllib.request.urlopen(urllib.request.Request(address, headers=headers)) as answer:
            return answer.status
    except urllib.error.HTTPError as refusal:
        refusal.close()
        return refusal.code


def test_others_are_refused(server, browser):
    _, address = server
    host = address.split("/")[2]
    assert answered(address) == 200
    assert answered(address + "app.js", Origin=f"http://{host}") == 200
    assert answered(f"http://{host}/") == 403
    assert answered(f"http://{host}/wrong/") == 403
    assert answered(address, Origin="http://example.org") == 403
    assert answered(address, Host="example.org") == 403
    assert answered(address + "session.py") == 404
    page = browser.new_page()
    page.set_content("<p>another origin</p>")
    live = address.replace("http", "ws") + "live"
    ended = page.evaluate(
        "(live) => new Promise((told) => { const socket = new WebSocket(live);"
        "socket.onopen = () => told('open'); socket.onclose = () => told('refused'); })",
        live,
    )
    page.close()
    assert ended == "refused"


def test_a_file_that_is_no_case_is_refused_before_anything_is_served(run, tmp_path):
    bad = Path(tmp_path / "bad.yaml")
    bad.write_text("plant: {type: nothing}\n")
    ran = run("app", str(bad), "--no-browser")
    assert ran.code == 1
    assert "bad.yaml:1: plant.type" in ran.err
