"""The report: all that a fit found is on the page, and nothing that it is not of."""

import json
import re
import shutil
import sys
from dataclasses import replace
from functools import partial
from itertools import groupby
from operator import itemgetter
from pathlib import Path

import numpy as np
import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH, with_local_search
from pages import Page
from places import ROOT
from records import TEST, config, found_in, recording, several, synthetic, write
from records import TIME as OF_UNIT
from records import one as ac1a
from tiers import few_of

from exfit import cli, workflows
from exfit.case.load import load_case
from exfit.errors import ExfitError
from exfit.features.planner.export import export
from exfit.features.report import writing
from exfit.features.report.charts import Axis, drawing, ticks
from exfit.features.report.matches import live_data
from exfit.features.report.page import headline, html, is_page, summary
from exfit.features.report.writing import write_report
from exfit.models import from_file
from exfit.output import run_folder
from exfit.output.blocks import Chart, Panel, Series
from exfit.results.comparisons import AsFound
from exfit.results.io import load_result, result_file
from exfit.util.text import rounded, rounded_value

MOST = 3_000_000  # bytes of a page
ABOUT = {"Plant": "Höllental", "Unit": 2, "Rated": "120 MVA, 13.8 kV", "Tested by": "A & B"}
HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(1)>"
NOISE = 1e-3  # of the records of the first-order system


def noisy(truth, seed):
    return truth + NOISE * np.random.default_rng(seed).standard_normal(len(truth))


def made(folder, content, strategy=None, watch=lambda _: None):
    """Fit a case in a folder; return the folder that the fit left."""
    folder.mkdir(exist_ok=True)
    path = folder / "case.yaml"
    content = with_local_search(content)
    path.write_text(yaml.safe_dump(content, sort_keys=False, allow_unicode=True), encoding="utf-8")
    result = workflows.fit(load_case(path), strategy, watch)
    run_folder.write_fit(result, folder / "run")
    return folder / "run"


def first_order(folder, **sections):
    """Fit the first-order system in a folder, validated on a step down."""
    folder.mkdir(exist_ok=True)
    for name, values in (("up", noisy(TRUTH, 1)), ("down", noisy(2.0 - TRUTH, 2))):
        rows = "\n".join(f"{t:.9g},{v:.9g}" for t, v in zip(TIME, values, strict=True))
        (folder / f"{name}.csv").write_text(f"t,v\n{rows}\n")
    down = {"vt0": 2.0, "vref": [{"at": 0.5, "step": -1.0}]}
    content = {
        **FIRST_ORDER,
        "record": {"file": "up.csv", "time": "t", "channels": {"vt": "v"}},
        "validate": [
            {
                "name": "down",
                "test": down,
                "record": {"file": "down.csv", "time": "t", "channels": {"vt": "v"}},
            }
        ],
        **sections,
    }
    return made(folder, {key: value for key, value in content.items() if value is not None})


def page_of(run):
    """Return the page of the fit in a folder."""
    return html(load_result(run), result_file(run).parent)


@pytest.fixture(scope="module")
def fits(tmp_path_factory):
    """The folders that several fits left, made when they are asked for."""
    room = tmp_path_factory.mktemp("fits")

    def on_load():
        content = config("ac8b_on_line")
        content["test"]["network"] = [{"at": 3.0, "R": 0.0}]  # as it was
        return made(room / "on-load", content)

    makers = {
        "first order": lambda: first_order(room / "first", about=ABOUT),
        "ac1a": lambda: made(room / "ac1a", config("ac1a_typical")),
        "ac8b": lambda: made(room / "ac8b", config("ac8b_unit1")),
        "searched": lambda: made(
            room / "searched", {**config("ac8b_unit1"), "estimate": {"search": "global"}}
        ),
        "machine alone": lambda: made(room / "machine", config("machine_playback")),
        "playback": lambda: made(room / "playback", config("exciter_playback")),
        "on load": on_load,
        "several": lambda: made(room / "several", several(*both(), free=FEW)),
    }
    known = {}

    def fit(name):
        if name not in known:
            known[name] = makers[name]()
        return known[name]

    return fit


FEW = {"KA": {"start": 300.0, "min": 76.6, "max": 7660.0}}
EVERY = ("first order", "ac1a", "ac8b", "machine alone", "playback", "on load", "several")


def both():
    """Return two records, of which one leaves its instant open."""
    instant = {"start": 1.02, "min": 0.9, "max": 1.1}
    return recording("up"), recording("down", at=instant)


@pytest.fixture(scope="module")
def pages(fits):
    """The pages of several fits, as they are read."""
    known = {}

    def page(name):
        if name not in known:
            known[name] = Page(page_of(fits(name)))
        return known[name]

    return page


@pytest.fixture
def own(fits, tmp_path):
    """A copy of the fit of the first-order system, with its case and records, to be spoilt."""
    shutil.copytree(fits("first order").parent, tmp_path / "own")
    run = tmp_path / "own" / "run"
    saved = json.loads((run / "result.json").read_text(encoding="utf-8"))
    change(run, case=str(tmp_path / "own" / "case.yaml"))
    assert Path(saved["case"]).name == "case.yaml"
    return run


def change(run, **entries):
    """Write other entries into a result."""
    path = run / "result.json"
    saved = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps({**saved, **entries}), encoding="utf-8")


def saved_of(run):
    return json.loads((run / "result.json").read_text(encoding="utf-8"))


def rounding_error(parameter):
    """Return the standard error that a stored parameter is rounded to."""
    low, high = parameter["interval"] or (None, None)
    if parameter["interval_method"] == "linear" or low is None or high is None:
        return parameter["std_error"]
    return (high - low) / 3.92


@pytest.mark.long
@pytest.mark.parametrize("name", [*EVERY, "searched"])
def test_every_fitted_parameter_is_reported_with_its_interval_or_the_reason_why_there_is_none(
    fits, pages, name
):
    rows = {row[0].split()[0]: row for row in pages(name).tables["Fitted parameters"][1:]}
    fitted = saved_of(fits(name))["parameters"]
    assert rows.keys() == fitted.keys()
    for symbol, one in fitted.items():
        row = rows[symbol]
        of_value = partial(
            rounded_value, error=rounding_error(one), low=one["min"], high=one["max"]
        )
        assert row[1:3] == [f"{one['start']:.5g}", of_value(one["value"])]
        if one["interval"] is None:
            assert row[3] == one["why"].replace("`", "")
        else:
            low, high = (None if x is None else of_value(x) for x in one["interval"])
            limits = f"below {high}" if low is None else f"above {low}"
            limits = f"{low} … {high}" if low and high else limits
            method = "" if one["interval_method"] == "linear" else one["interval_method"]
            assert row[3] == " ".join(filter(None, [limits, method, one["why"]]))
        linear = one["interval"] is not None and one["interval_method"] == "linear"
        assert row[4] == (f"{one['std_error']:.2g}" if linear else "–")
        assert row[5] == f"{one['min']:.5g} … {one['max']:.5g}"


@pytest.mark.parametrize("name", few_of(EVERY, 3))
def test_every_parameter_that_was_not_fitted_is_reported_with_its_value_and_source(
    fits, pages, name
):
    saved = saved_of(fits(name))
    told = {}
    for caption, rows in pages(name).tables.items():
        if caption.endswith(", not fitted"):
            told[caption.split()[0].rstrip(",").lower()] = {row[0]: row for row in rows[1:]}
    for kind, key in (
        ("exciter", "fixed"),
        *((k, k) for k in ("machine", "network", "stabiliser")),
    ):
        prefix = "" if key == "fixed" else f"{kind}."
        for symbol, value in saved[key].items():
            if prefix + symbol in saved["parameters"]:
                continue
            row = told[kind][symbol]
            assert row[1] == f"{value:.6g}"
            assert row[3] == (saved["sources"][prefix + symbol])


@pytest.mark.parametrize("name", few_of(EVERY, 3))
def test_every_signal_of_every_record_is_drawn_with_its_error(fits, pages, name):
    saved, page = saved_of(fits(name)), pages(name)
    matches = [*saved["records"], *saved["validation"]]
    drawn = [f"overlay-{k}-{signal}" for k, one in enumerate(matches) for signal in one["channels"]]
    assert [one for one in page.ids if one.startswith("overlay-") and one in drawn] == drawn
    for one in matches:
        for signal in one["channels"].values():
            assert f"rmse {signal['rmse']:.3g} pu" in page.text
        if one["features"]["measured"]:
            measured = one["features"]["measured"]
            error = measured["errors"].get("final_value")
            told = rounded(measured["final_value"], error)
            rows = page.tables[f"Features of the first step of the reference, in vt: {one['name']}"]
            assert ["final value", told] in [row[:2] for row in rows]
    data = json.loads(page.scripts[0])
    assert [one["key"] for one in data] == drawn


@pytest.mark.parametrize("name", few_of(EVERY, 3))
def test_a_page_is_whole_self_contained_and_small(pages, name):
    page = pages(name)
    assert len(page.ids) == len(set(page.ids))
    for tag, attrs in page.tags:
        assert "src" not in attrs
        assert attrs.get("href", "#")[0] == "#"
        if tag == "svg" and attrs.get("role") == "img":
            assert set(attrs["aria-labelledby"].split()) <= set(page.ids)
        assert not attrs.get("href") or attrs["href"][1:] in page.ids
    regions = [attrs["aria-label"] for _, attrs in page.tags if attrs.get("role") == "region"]
    assert len(regions) == len(set(regions))  # one who hears the page goes to them by name
    assert page.size < MOST
    heads = "Unit and test, Model, Parameters, Search, Usability, Small-signal view, Reproduction"
    for head in heads.split(", "):
        assert page.text.count(head) >= 2  # among the contents, and above its section


@pytest.mark.parametrize("name", few_of(EVERY, 3))
def test_every_figure_and_table_has_its_number_and_every_section_is_among_the_contents(pages, name):
    page = pages(name)
    hidden = sum(tag == "figcaption" and "class" in attrs for tag, attrs in page.tags)
    for kind, tag in (("Table", "caption"), ("Figure", "figcaption")):
        count = page.count(tag) - (hidden if tag == "figcaption" else 0)
        assert page.numbers[kind] == [*range(1, count + 1)]
    linked = [attrs["href"] for tag, attrs in page.tags if tag == "a"]
    labels = [attrs["aria-labelledby"] for tag, attrs in page.tags if tag == "section"]
    contents = linked[linked.index(f"#{labels[0]}") :][: len(labels)]
    assert contents == [f"#{label}" for label in labels]


@pytest.mark.parametrize("name", few_of(EVERY, 3))
def test_how_the_figures_of_records_are_read_is_said_once_where_they_begin(pages, name):
    tags = pages(name).tags
    (hint,) = [k for k, (_, attrs) in enumerate(tags) if attrs.get("class") == "hint"]
    sections = [attrs["aria-labelledby"] for tag, attrs in tags[:hint] if tag == "section"]
    assert sections[-1] == "result"


def test_what_identifies_unit_and_test_is_reported(pages):
    for name, value in ABOUT.items():
        assert f"{name} {value}" in pages("first order").text
    assert "does not say which unit" in pages("ac1a").text


def test_the_base_of_each_signal_is_reported_and_a_step_that_the_fit_found(tmp_path):
    vt = synthetic(tmp_path, TEST, OF_UNIT)["vt"]
    write(tmp_path / "record.csv", t=OF_UNIT, u=15.75 * vt)
    test = {**TEST, "vref": [{"at": found_in(1.02, 0.9, 1.1), "step": 0.05}]}
    content = ac1a(test, {"vt": {"column": "u", "unit": "kV", "base": 15.75}}, ["KA"])
    words = Page(page_of(made(tmp_path, content))).text
    assert "vt, 1 pu = 15.75 kV" in words
    # the instant is the one found, not the start
    at, half = re.search(r"vref \+0\.05 pu at (\S+) \+- (\S+) s \(fitted\)", words).groups()
    assert float(at) == pytest.approx(1.0, abs=3.0 * float(half))
    assert float(half) < 0.01


@pytest.mark.long
def test_a_signal_with_a_wrong_base_stands_in_the_verdict(tmp_path):
    shown = synthetic(tmp_path, TEST, OF_UNIT, signals=("vt", "ifd"))
    write(tmp_path / "record.csv", t=OF_UNIT, vt=shown["vt"], i=550.0 * shown["ifd"])
    for base, told in ((550.0, False), (0.55, True)):
        ifd = {"column": "i", "unit": "A", "base": base, "weight": 1e-9}
        content = ac1a(TEST, {"vt": "vt", "ifd": ifd}, ["KA"])
        sentence = headline(load_result(made(tmp_path, content))).sentence
        assert (
            "the response matches ifd no better than a constant would" in sentence.lower()
        ) == told


def test_hashes_versions_case_and_commands_are_reported(fits, pages):
    run, page = fits("first order"), pages("first order")
    for sha256 in saved_of(run)["inputs"].values():
        assert sha256 in page.text
    for version in saved_of(run)["versions"].values():
        assert version in page.text
    case = (run.parent / "case.yaml").read_text(encoding="utf-8")
    assert " ".join(case.split()) in page.text
    assert f"exfit fit {run.parent / 'case.yaml'} -o {run}" in page.text


def test_findings_and_notes_are_reported_word_by_word(fits, pages):
    saved = saved_of(fits("ac1a"))
    told = [*saved["notes"], *saved["knowledge"]["sentences"]]
    assert len(told) > 1
    for sentence in told:
        assert " ".join(sentence.replace("`", " ").split()) in pages("ac1a").text.replace(" ,", ",")


def test_the_dynamics_record_is_reported_with_its_warnings_or_why_there_is_none(fits, pages):
    found = export(load_result(fits("ac8b")), 1, "1")
    assert " ".join(found.text.split()) in pages("ac8b").text
    for warning in found.warnings:
        assert warning in pages("ac8b").text
    assert "FIRST_ORDER has no PSS/E record" in pages("first order").text


def test_the_dynamics_record_is_at_the_place_where_the_unit_was_found(fits, pages):
    result = load_result(fits("ac8b"))
    assert "Bus 1 and machine 1 stand for those of the unit" in pages("ac8b").text
    found = AsFound(
        "unit.dyr", result.model, result.values, why="made up", bus=101, machine_id="G1"
    )
    page = Page(html(replace(result, as_found=found), "run"))
    assert "Bus 101 and machine G1 are those of the planner's file" in page.text
    assert " ".join(export(result, 101, "G1").text.split()) in page.text


def test_a_playback_shows_what_was_played_in_and_no_features_of_a_step(pages):
    page = pages("playback")
    title = "Simulated minus recorded, and the largest departures of both from rest: fit"
    heads, *rows = page.tables[title]
    assert [row[:2] for row in rows] == [
        ["vt", "played in"], ["ifd", "played in"], ["efd", "compared"]
    ]  # fmt: skip
    assert heads[2:6] == ["rms", "largest", "at (s)", "at rest"]
    assert "played-0" in page.ids
    assert (
        "recorded vt and ifd played in; at rest until 1 s with vt 1 pu, efd 1.121 pu" in page.text
    )
    assert "features" not in page.text


def test_a_machine_alone_has_no_drawing_and_no_loop(pages):
    page = pages("machine alone")
    assert "a machine without an exciter" in page.text
    assert "there is no closed loop" in page.text


def test_what_is_not_settled_about_a_diagram_stands_below_it(own):
    saved = json.loads((own / "result.json").read_text(encoding="utf-8"))
    assert saved["parts"][0]["doubt"] == ""
    assert "Note: FIRST_ORDER" not in Page(page_of(own)).text
    part = saved["parts"][0] | {"doubt": "rests on one public diagram"}
    change(own, parts=[part, *saved["parts"][1:]])
    assert "Note: FIRST_ORDER rests on one public diagram." in Page(page_of(own)).text


def test_a_pole_of_the_first_order_system_is_what_was_fitted(fits, pages):
    """k / (s + a) has its pole at -a, and falls by 3 dB at a / 2 pi."""
    a = saved_of(fits("first order"))["parameters"]["a"]["value"]
    (row,) = pages("first order").tables["Poles of the closed loop, fit"][1:]
    assert row[:2] == [f"{-a:.5g}", "0"]
    assert f"{a / (2 * np.pi):.4g} Hz" in pages("first order").text


def test_a_search_that_ended_at_a_tolerance_is_not_called_converged(tmp_path):
    run = first_order(tmp_path / "case", estimate={"stop": {"rmse": 0.1}}, validate=None)
    judged = headline(load_result(run))
    assert judged.word == "Misses the record"
    assert "converged" not in judged.sentence
    assert "standard errors away" in Page(page_of(run)).text


@pytest.mark.parametrize(
    ("accept", "down", "word"),
    [
        (None, True, "Good"),
        (None, False, "Good"),
        (10 * NOISE, True, "Good"),
        (NOISE / 10, True, "Not accepted"),
    ],
)
def test_the_verdict_is_that_of_the_validation(tmp_path, accept, down, word):
    limits = {"limits": [{"quantity": "rms", "limit": accept}]}
    sections = {"criteria": None if accept is None else limits}
    run = first_order(tmp_path / "case", **sections, **({} if down else {"validate": None}))
    judged = headline(load_result(run))
    assert judged.word == word
    assert judged.good is (word == "Good")
    if not down:
        assert "no record for a validation" in Page(page_of(run)).text


def test_the_iterations_begin_with_the_start_and_end_with_the_fit_as_they_are_compared(tmp_path):
    """The recorder's average is in them, and what is left out of the comparison is missing."""
    channel = {"column": "v", "averaged": 0.3, "filter": {"median": 3}}
    record = {"file": "up.csv", "time": "t", "channels": {"vt": channel}, "mask": [[1.0, 1.2]]}
    match = load_result(first_order(tmp_path / "case", record=record)).comparison
    found, fitted = match.iteration_responses, match.overlays["vt"]
    assert np.isnan(fitted.measured).any()
    for ours, theirs in (
        (found.measured, fitted.measured),
        (found.samples[0], fitted.start),
        (found.samples[-1], fitted.simulated),
    ):
        # the file has nine digits
        np.testing.assert_allclose(ours, theirs, rtol=1e-8, atol=1e-8)


@pytest.mark.long
def test_a_switch_is_reported_though_it_sets_nothing_but_a_zero(pages):
    assert "network switched at 3 s: R 0 pu" in pages("on load").text


def test_an_interrupted_fit_is_no_converged_one(tmp_path):
    def stop(line):
        if line.number == 1:
            raise KeyboardInterrupt

    run = made(tmp_path / "case", config("ac1a_typical"), watch=stop)
    page, judged = Page(page_of(run)), headline(load_result(run))
    assert judged.word == "Interrupted"
    assert judged.good is False
    for row in page.tables["Fitted parameters"][1:]:
        assert row[3] == "the search was interrupted"
    assert "Not known: the search did not end at a minimum" in page.text


def test_a_search_that_ended_early_is_not_converged(own):
    change(own, success=False, verdict={**saved_of(own)["verdict"], "verdict": "not converged"})
    assert headline(load_result(own)).word == "Not converged"


def test_text_from_outside_stays_text(tmp_path):
    run = first_order(tmp_path / "<b>case", about={HOSTILE: HOSTILE, "Unit": HOSTILE})
    page = Page(page_of(run))
    plain = Page(page_of(first_order(tmp_path / "plain", about={"Unit": "1"})))
    assert page.count("script") == plain.count("script")
    assert page.count("img") == page.count("b") == 0
    assert HOSTILE in page.text
    assert json.loads(page.scripts[0])


HOSTILE_MODEL = """
from pathlib import Path

Path({folder!r}, "executed").touch()
raise SystemExit("executed")
"""


@pytest.fixture
def of_own_model(tmp_path):
    """The folder of a fit of a user's own model, with its case and record beside it."""
    folder = tmp_path / "stranger"
    folder.mkdir()
    shutil.copy(ROOT / "exfit" / "models" / "exciters" / "first_order.py", folder / "mine.py")
    return first_order(folder, model="mine.py")


def test_a_page_needs_the_result_alone(of_own_model, capsys):
    """Without case, records, tables and model, and with a hostile model in its place."""
    page = page_of(of_own_model)
    folder = of_own_model.parent
    for path in folder.rglob("*"):
        if path.is_file() and path.name != "result.json":
            path.unlink()
    assert page_of(of_own_model) == page
    (folder / "mine.py").write_text(HOSTILE_MODEL.format(folder=str(folder)))
    write_report(of_own_model)
    assert (of_own_model / "report.html").read_text(encoding="utf-8") == page
    for command in (["export"], ["report"]):
        with pytest.raises(SystemExit):
            cli.main([*command, str(of_own_model)], prog_name="exfit")
    assert "executed" not in capsys.readouterr().err
    assert not (folder / "executed").exists()
    with pytest.raises(ExfitError, match="executed"):
        from_file(folder / "mine.py")  # it would have
    assert (folder / "executed").exists()


def test_what_was_changed_since_the_fit_leaves_the_page_as_it_was(own):
    page = page_of(own)
    for file in ("up.csv", "down.csv", "case.yaml"):
        (own.parent / file).write_text("changed")
    assert page_of(own) == page


@pytest.mark.parametrize("key", ["message", "history", "knowledge", "parameters", "behaviour"])
def test_a_result_with_a_hole_is_refused_with_its_place(own, key):
    saved = saved_of(own)
    del saved[key]
    (own / "result.json").write_text(json.dumps(saved))
    with pytest.raises(ExfitError, match=key):
        write_report(own)


def test_a_report_is_replaced_and_another_file_is_not(own):
    (path,) = write_report(own)
    assert path == own / "report.html"
    first = path.read_text(encoding="utf-8")
    assert write_report(own / "result.json")[0].read_text(encoding="utf-8") == first
    path.write_text("my own words")
    with pytest.raises(ExfitError, match="exists already"):
        write_report(own)
    assert path.read_text() == "my own words"
    assert write_report(own, force=True)[0].read_text(encoding="utf-8") == first


def test_the_command_writes_the_page_and_says_where(own, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main(["report", str(own), "-o", str(own / "handed-in.html")], prog_name="exfit")
    assert ended.value.code == 0
    assert capsys.readouterr().out == f"written to {own / 'handed-in.html'}\n"
    with pytest.raises(SystemExit) as ended:
        cli.main(["report", str(own.parent)], prog_name="exfit")
    assert ended.value.code == 1
    assert "cannot be read" in capsys.readouterr().err


@pytest.mark.long
def test_a_long_record_makes_no_long_page(tmp_path):
    folder = tmp_path / "case"
    folder.mkdir()
    time = np.linspace(0.0, 60.0, 20_001)
    truth = np.where(time < 0.5, 0.0, 2.0 - 2.0 * np.exp(-2.0 * (time - 0.5)))
    np.savetxt(
        folder / "up.csv",
        np.column_stack([time, noisy(truth, 3)]),
        fmt="%.7g",
        delimiter=",",
        header="t,v",
        comments="",
    )
    record = {"file": "up.csv", "time": "t", "channels": {"vt": "v"}}
    run = made(folder, {**FIRST_ORDER, "record": record})
    assert len(page_of(run).encode()) < MOST


@pytest.mark.parametrize("low", [-3.0, 0.0, 0.99997, 1e4])
@pytest.mark.parametrize("span", [1e-4, 0.07, 1.0, 9.99, 1e3])
@pytest.mark.parametrize("most", [3, 8])
def test_ticks_are_round_equally_spaced_and_inside(low, span, most):
    axis = Axis(low, low + span, 100.0)
    found = ticks(axis, most)
    places = np.array([tick.at for tick in found])
    assert 1 <= len(found) <= most + 1
    assert np.all((places >= -1e-6) & (places <= 100.0 + 1e-6))
    if len(found) > 1:
        assert np.diff(places) == pytest.approx(np.diff(places)[0])
        step = (places[1] - places[0]) / 100.0 * span
        mantissa = step / 10.0 ** np.floor(np.log10(step) + 1e-9)
        assert min(abs(mantissa - np.array([1.0, 2.0, 5.0, 10.0]))) < 1e-6
        values = [float(tick.label) for tick in found]
        assert values == pytest.approx(list(low + places / 100.0 * span), abs=1e-3 * step)


def test_a_clock_that_began_long_ago_is_drawn_as_finely(tmp_path):
    """Seconds since a day of the recorder's own; those since 1970 count from the first sample."""
    ago = 6e8
    rows = [f"{t + ago:.3f},{v:.9g}" for t, v in zip(TIME, noisy(TRUTH, 1), strict=True)]
    (tmp_path / "ago.csv").write_text("\n".join(["t,v", *rows]) + "\n")
    record = {"file": "../ago.csv", "time": "t", "channels": {"vt": "v"}}
    test = {"vt0": 0.0, "vref": [{"at": ago + 0.5, "step": 1.0}]}
    run = first_order(tmp_path / "case", record=record, test=test, validate=None)
    (chart,) = [each for each in summary(load_result(run)) if isinstance(each, Chart)]
    shown = chart.live.time
    np.testing.assert_allclose(np.diff(shown), np.diff(TIME), atol=1e-6)  # a double is that fine
    (sent,) = live_data([chart])
    np.testing.assert_allclose(np.diff(sent["time"]), np.diff(TIME), atol=1e-6)
    labels = [tick.label for tick in drawing(chart).x_ticks]
    assert len(set(labels)) == len(labels) > 2


def test_a_drawing_has_no_number_that_is_none():
    time = np.linspace(0.0, 1.0, 50)
    lines = {
        "still": np.ones(50),
        "gap": np.where(time < 0.5, np.nan, time),
        "nothing": np.full(50, np.nan),
        "zero": np.zeros(50),
    }
    for logarithmic in (False, True):
        both = {
            name: (Series(name, time, y, "p0"), Series(name, time, y, "p0", dots=True))
            for name, y in lines.items()
        }
        panels = tuple(Panel(name, series, 100.0, logarithmic) for name, series in both.items())
        drawn = drawing(Chart("k", "t", "x", "time (s)", panels))
        paths = [mark.path for panel in drawn.panels for mark in panel.marks]
        assert not any("nan" in path or "inf" in path for path in paths)
        assert all(panel.y_ticks for panel in drawn.panels if panel.title != "nothing")


@pytest.fixture(scope="module")
def printed(fits):
    """A report as PDF, which its maker reads."""
    try:
        import weasyprint  # noqa: F401
    except (ImportError, OSError) as fault:
        pytest.skip(f"WeasyPrint cannot be imported: {fault}")
    from pypdf import PdfReader

    page, place = write_report(fits("first order"), pdf=True)
    assert (page.name, place.name) == ("report.html", "report.pdf")
    return PdfReader(place)


def titles(outline):
    """Return the titles of the bookmarks of the first level."""
    return [entry.title for entry in outline if not isinstance(entry, list)]


@pytest.mark.long
def test_a_pdf_has_a_bookmark_for_each_section_and_its_number_on_each_page(printed, pages):
    page = pages("first order")
    labels = [attrs["aria-labelledby"] for tag, attrs in page.tags if tag == "section"]
    assert [title.split()[0] for title in titles(printed.outline)] == [
        str(number) for number in range(1, len(labels) + 1)
    ]
    texts = [sheet.extract_text() for sheet in printed.pages]
    for number, text in enumerate(texts, start=1):
        assert f"{number} / {len(texts)}" in text
    assert len(texts) <= 20


FOOT = 51.0  # points: the margin below the text


def lines_of(sheet):
    """Return the lines of a page above its foot, from the highest to the lowest."""
    pieces = []

    def visit(text, cm, tm, *_):
        x, y = tm[4:6]
        height = x * cm[1] + y * cm[3] + cm[5]
        if text.strip() and height > FOOT:
            pieces.append((-round(height), x, text.strip()))

    sheet.extract_text(visitor_text=visit)
    pieces.sort(key=lambda piece: piece[:2])
    return [" ".join(piece[2] for piece in line) for _, line in groupby(pieces, itemgetter(0))]


@pytest.mark.long
def test_a_heading_is_on_the_page_of_what_follows_it(fits, printed, pages):
    """No heading is the last line of its page, and a record's is on that of its first figure."""
    headings = {" ".join(words.split()) for words in pages("first order").headings}
    sheets = [lines_of(sheet) for sheet in printed.pages]
    assert sum(line in headings for lines in sheets for line in lines) > 12
    for lines in sheets:
        assert lines[-1] not in headings
    saved = saved_of(fits("first order"))
    for record in saved["validation"]:
        title = f"{record['name']}: terminal voltage vt"
        lines = next(lines for lines in sheets if any(title in line for line in lines))
        assert record["name"] in lines


@pytest.mark.long
def test_the_first_page_is_the_result_with_its_signatures_and_nothing_else(printed, pages):
    first, second = (sheet.extract_text() for sheet in printed.pages[:2])
    for words in ("FIRST_ORDER", "Fitted parameters with", "validation down", "Approved by"):
        assert words.casefold() in first.casefold()
    assert "Contents" in second.splitlines()[0]


@pytest.mark.long
def test_a_pdf_is_replaced_and_another_file_is_not(fits, printed, tmp_path):
    assert write_report(fits("first order"), pdf=True)[1].name == "report.pdf"
    other = tmp_path / "letter.pdf"
    other.write_bytes(b"%PDF-1.7")
    with pytest.raises(ExfitError, match="is no report"):
        write_report(fits("first order"), other, pdf=True)
    assert [*tmp_path.iterdir()] == [other]


@pytest.mark.parametrize(
    ("output", "pdf", "names"),
    [
        ("a.html", False, ["a.html"]),
        ("a.html", True, ["a.html", "a.pdf"]),
        ("a.pdf", False, ["a.html", "a.pdf"]),
        ("a.pdf", True, ["a.html", "a.pdf"]),
        ("a.htm", True, ["a.htm", "a.pdf"]),
        ("a", True, ["a", "a.html"]),
    ],
)
def test_one_call_writes_the_page_and_the_pdf(fits, tmp_path, monkeypatch, output, pdf, names):
    monkeypatch.setattr(writing, "page_pdf", lambda page: writing.MARK)
    result = load_result(fits("first order"))
    paths = write_report(result, tmp_path / output, pdf=pdf)
    assert sorted(paths) == sorted(tmp_path.iterdir()) == [tmp_path / name for name in names]
    assert is_page(paths[0])
    assert all(path.read_bytes() == writing.MARK for path in paths[1:])


def test_what_a_pdf_needs_and_is_missing_is_named(fits, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    with pytest.raises(ExfitError, match=r"pip install 'exfit\[pdf\]'"):
        write_report(fits("first order"), tmp_path / "a.pdf")
    assert is_page(tmp_path / "a.html")
