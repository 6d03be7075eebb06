"""`exfit.app`: the page in a cell of a notebook, for as long as its object is there."""

import gc
import shutil
import urllib.error
import urllib.request
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread

import pytest
from browsers import chromium, listened_to
from places import ROOT

import exfit


@pytest.fixture
def case(empty_folder):
    shutil.copytree(ROOT / "configs", empty_folder / "configs")
    shutil.copytree(ROOT / "sample_data", empty_folder / "sample_data")
    return "configs/ac1a_good.yaml"


def ended(thread):
    thread.join(timeout=60.0)
    return not thread.is_alive()


@pytest.mark.parametrize("given", [str, exfit.load_case])
def test_a_page_is_served_until_it_is_closed(case, given):
    view = exfit.app(given(case), height=400)
    assert view._repr_html_().startswith(f'<iframe src="{view.address}" title="exfit app"')
    with urllib.request.urlopen(view.address) as answer:
        assert answer.headers["Content-Security-Policy"].endswith("vscode-webview:")
    view.close()
    assert view._repr_html_() == "&lt;exfit app: closed&gt;"
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(view.address)
    view.close()


def test_a_page_ends_with_its_object(case):
    view = exfit.app(case)
    thread = view.thread
    del view
    gc.collect()
    assert ended(thread)


def test_what_is_no_case_is_refused_in_the_cell(tmp_path):
    bad = tmp_path / "bad.yaml"
    bad.write_text("plant: {type: nothing}\n")
    with pytest.raises(exfit.ExfitError, match=r"bad\.yaml:1: plant\.type"):
        exfit.app(bad)


@pytest.mark.long
def test_a_notebook_shows_the_page_in_its_frame(case):
    view = exfit.app(case)
    cell = f"<!DOCTYPE html><title>notebook</title>{view._repr_html_()}".encode()

    class Notebook(BaseHTTPRequestHandler):
        """A page of another origin on this computer."""

        def do_GET(self):
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(cell)

        def log_message(self, *_):
            pass

    with ThreadingHTTPServer(("localhost", 0), Notebook) as notebook, chromium() as browser:
        Thread(target=notebook.serve_forever, daemon=True).start()
        page = listened_to(browser.new_context())
        page.goto(f"http://localhost:{notebook.server_port}/")
        frame = page.frame_locator("iframe")
        frame.get_by_label("KA slider").press("ArrowRight")
        frame.locator("#draft", has_text="ac1a_good-draft.yaml").wait_for()
        assert page.faults == []
        page.close()
        notebook.shutdown()
    view.close()
