"""Texts of a result that a page or a terminal could take for its own do nothing there."""

import io
import json

import pytest
from mutant_runs import CONTROL
from payloads import HARMLESS, HOSTILE, MARKUP, Structure, with_texts
from records import config

from exfit import workflows
from exfit.case.load import load_case
from exfit.features.drawings.diagram import block_diagram
from exfit.features.report.page import html
from exfit.output import fits, terminal
from exfit.output.notebook import fit_html
from exfit.output.terminal import GuardedConsole
from exfit.results.io import load_result, result_text

SHAPES = {"svg", "title", "desc", "path", "g", "text", "tspan"}


def content():
    """Return a case whose result has texts of every kind: facts, a base, a validation, criteria."""
    case = config("ac1a_typical")
    case["about"] = {"Plant": "Höllental", "Unit": 2, "Tested by": "N. N.", "Date": "2026-11-22"}
    case["as_found"] = {"source": "unit.dyr, bus 101", "parameters": {"KA": 700.0}}
    case["criteria"] = {"limits": [{"quantity": "rms", "percent": 5.0, "limit": 1e-3}]}
    case["estimate"] = {"search": "local"}
    return case


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Return a result whose every text holds payloads, and one with harmless words there."""
    folder = tmp_path_factory.mktemp("payloads")
    path = folder / "case.yaml"
    path.write_text(json.dumps(content()))
    case = load_case(path)
    saved = json.loads(result_text(workflows.fit(case)))
    file = folder / "result.json"
    read = []
    for text in (HOSTILE, HARMLESS):
        file.write_text(json.dumps(with_texts(saved, text)))
        read.append(load_result(file))
    return read


@pytest.fixture(scope="module")
def pages(results, tmp_path_factory):
    folder = tmp_path_factory.mktemp("<b>folder")
    return [html(result, folder, result) for result in results]


def test_no_text_of_a_result_becomes_a_tag_or_an_attribute_of_its_report(pages):
    hostile, harmless = map(Structure, pages)
    assert hostile.tags == harmless.tags


def test_no_text_of_a_result_reaches_a_script_of_its_report(pages):
    hostile, harmless = map(Structure, pages)
    assert hostile.scripts[1:] == harmless.scripts[1:]
    for page in (hostile, harmless):
        json.loads(page.scripts[0])
    assert not any(text in hostile.scripts[0] for text in MARKUP if "<" in text)


def test_a_template_evaluates_no_text_of_a_result(pages):
    hostile, _ = pages
    assert "{{7*7}}" in hostile


def test_a_notebook_shows_texts_as_texts(results):
    hostile, harmless = (Structure(fit_html(result)) for result in results)
    assert hostile.tags == harmless.tags


@pytest.mark.parametrize("is_terminal", [True, False], ids=["terminal", "pipe"])
def test_a_terminal_obeys_no_text_of_a_result(results, is_terminal):
    """Its own escape sequences, of colours, are those of harmless words."""
    shown = []
    for result in results:
        stream = io.StringIO()
        console = GuardedConsole(file=stream, force_terminal=is_terminal, width=100)
        terminal.show(console, fits.whole(result))
        shown.append(stream.getvalue())
    hostile, harmless = ({*CONTROL.findall(text)} for text in shown)
    assert hostile == harmless == ({"\x1b"} if is_terminal else set())
    assert "\x1b]" not in shown[0]
    assert r"\x1b]0;" in shown[0]


def test_a_drawing_is_of_shapes_and_letters_whatever_its_text():
    drawing = "\n".join([f"vref ─►[ {text} ]─► efd" for text in MARKUP])
    diagram = block_diagram(drawing, HOSTILE, HOSTILE)
    structure = Structure(diagram)
    assert {tag for tag, *_ in structure.tags if tag[0] != "/"} <= SHAPES
    assert not any(name.startswith("on") for _, *names in structure.tags for name in names)
