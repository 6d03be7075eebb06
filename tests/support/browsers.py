"""A real browser, the checker of HTML and the one of accessibility, as far as they are there.

Without Chromium (or, for the checker of HTML, Java and the path EXFIT_VNU of its jar) tests are
skipped; with EXFIT_BROWSER=required they fail then.
"""

import json
import os
import shutil
import subprocess
from contextlib import contextmanager

import pytest

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
WIDTHS = (390, 1280)  # of a telephone and of a desk, px


def missing(what):
    """Skip a test, or fail it where the browser is required."""
    if os.environ.get("EXFIT_BROWSER") == "required":
        pytest.fail(f"{what} is missing, and EXFIT_BROWSER says it is required")
    pytest.skip(f"{what} is missing")


@contextmanager
def chromium():
    """Start the browser."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        missing("the package playwright")
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        missing("Chromium")
    with sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=path, args=list(FLAGS))
        yield started
        started.close()


def listened_to(context):
    """Return a new page; what it says to the console, and what it asks for, is kept."""
    page = context.new_page()
    page.faults, page.asked = [], []
    page.on("pageerror", lambda fault: page.faults.append(str(fault)))
    page.on(
        "console",
        lambda said: page.faults.append(said.text) if said.type in ("error", "warning") else 0,
    )
    page.on("request", lambda asked: page.asked.append(asked.url))
    return page


def barriers(page):
    """Return what keeps readers out of a page, as a report of axe; "" for nothing."""
    try:
        from axe_playwright_python.sync_playwright import Axe
    except ImportError:
        missing("the package axe-playwright-python")
    checked = Axe().run(page)
    return checked.generate_report() if checked.violations_count else ""


def html_errors(path):
    """Return the errors that the checker of HTML finds in a file."""
    java, jar = shutil.which("java"), os.environ.get("EXFIT_VNU")
    if java is None or not jar:
        missing("Java, or the path EXFIT_VNU of vnu.jar")
    done = subprocess.run(
        [java, "-jar", jar, "--format", "json", str(path)], capture_output=True, text=True
    )
    messages = json.loads(done.stderr)["messages"]
    return [message["message"] for message in messages if message["type"] == "error"]
