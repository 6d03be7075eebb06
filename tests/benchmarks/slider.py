"""Time the page of ``exfit app`` from a slider's movement to the redrawn curve, in Chromium.

    python tests/benchmarks/slider.py [--pictures docs/img]

For a step of AC1A over 10 s with 2,000 samples, one with 2 million, and for a grid event of 12 s;
and from the start of the command to the page. With ``--pictures`` it keeps pictures of the page
after a fit: light, and dark on a telephone.
"""

import argparse
import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import yaml
from PIL import Image
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "support"))

from app_server import served
from browsers import chromium

SAMPLES, MANY, MOVES = 2000, 2_000_000, 300
PAUSE = 16  # ms between two movements: a frame
COLOURS = 48  # of a picture: few make it small
FIT = 120_000  # ms, at most
SCREEN = {"width": 1280, "height": 900}
HIGH, FOOT = 3000, 60  # px, of a screen that shows all, of the line below
TELEPHONE = {"width": 390, "height": 844}


def main() -> None:
    """Print median and 95th percentile of each case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pictures", type=Path, help="folder that they are written to")
    folder = parser.parse_args().pictures
    table = Table("case", "shown after, s", "median, ms", "95 %, ms", "largest, ms")
    with tempfile.TemporaryDirectory() as room, chromium() as browser:
        for name in ("configs", "sample_data"):
            shutil.copytree(ROOT / name, Path(room, name))
        for samples in (SAMPLES, MANY):
            resample(Path(room), samples)
        for case in (f"ac1a_{SAMPLES}", f"ac1a_{MANY}", "grid_event"):
            began = time.perf_counter()
            with served(f"configs/{case}.yaml", room) as (_, address):
                shown, took = slid(browser, address)
            figures = (np.median(took), np.quantile(took, 0.95), max(took))
            table.add_row(case, f"{shown - began:.1f}", *(f"{each:.0f}" for each in figures))
        if folder is not None:
            with served("configs/ac1a_good.yaml", room) as (_, address):
                take_pictures(browser, address, folder.resolve())
    Console().print(table)


def resample(room: Path, samples: int) -> None:
    """Make a case with so many samples of ac1a_good, on the default grid."""
    case = yaml.safe_load((room / "configs" / "ac1a_good.yaml").read_text(encoding="utf-8"))
    record = np.genfromtxt(room / "sample_data" / "ac1a_up.csv", delimiter=",", names=True)
    instants = np.linspace(record["t"][0], record["t"][-1], samples)
    rows = np.column_stack([instants, np.interp(instants, record["t"], record["vt"])])
    file = room / "sample_data" / f"dense_{samples}.csv"
    np.savetxt(file, rows, fmt="%.8f", delimiter=",", header="t,vt", comments="")
    case["record"]["file"] = f"../sample_data/{file.name}"
    del case["simulation"], case["validate"]
    (room / "configs" / f"ac1a_{samples}.yaml").write_text(yaml.safe_dump(case), encoding="utf-8")


def slid(browser, address: str) -> tuple[float, list[float]]:
    """Drag the first slider; return when it is there, and the times (ms) from a movement on."""
    page = browser.new_page(viewport=SCREEN)
    page.goto(address)
    page.wait_for_selector(".parameter")
    shown = time.perf_counter()
    box = page.locator(".track input").first.bounding_box()
    height = box["y"] + 0.5 * box["height"]
    page.mouse.move(box["x"] + 0.5 * box["width"], height)
    page.mouse.down()
    for move in range(MOVES):
        page.mouse.move(box["x"] + box["width"] * (0.5 + 0.3 * np.sin(0.1 * move)), height)
        page.wait_for_timeout(PAUSE)
    page.mouse.up()
    page.wait_for_timeout(500)
    took = page.evaluate("performance.getEntriesByName('slider').map(each => each.duration)")
    page.close()
    return shown, took


def take_pictures(browser, address: str, folder: Path) -> None:
    """Fit, and keep pictures of the page."""
    for name, size, scheme in (("light", SCREEN, "light"), ("dark", TELEPHONE, "dark")):
        page = browser.new_page(viewport=size, color_scheme=scheme)
        page.goto(address)
        page.wait_for_selector(".parameter")
        page.get_by_role("button", name="Fit", exact=True).click()
        page.locator("#save-report:enabled").wait_for(timeout=FIT)
        page.wait_for_timeout(500)
        path = folder / f"app_{name}.png"
        if name == "light":  # the whole page, as on a screen so high
            page.set_viewport_size({**size, "height": HIGH})
            content = "document.querySelector('main').getBoundingClientRect().bottom"
            page.set_viewport_size({**size, "height": round(page.evaluate(content)) + FOOT})
            page.wait_for_timeout(500)
        page.screenshot(path=path)
        page.close()
        with Image.open(path) as picture:
            method = Image.Quantize.MAXCOVERAGE
            picture.convert("RGB").quantize(COLOURS, method).save(path, optimize=True)


if __name__ == "__main__":
    main()
