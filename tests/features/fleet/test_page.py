"""The page of a batch: what it shows of each case, what it links to, how large it is."""

import re
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from fleets import MODELS, curve, fleet, parameter, row
from pages import Page
from payloads import HARMLESS, HOSTILE, Structure

from exfit.features.fleet.folder import Fleet, SummaryCurve
from exfit.features.fleet.page import (
    HEIGHT,
    MARGIN,
    MOST_PICTURES,
    MOST_SISTERS,
    WIDTH,
    fleet_page,
    picture,
)
from exfit.features.fleet.sisters import sisters

MOST_BYTES = 2000  # of a case: 5,000 of them are a page of 10 MB


def page_of(batch):
    return fleet_page(batch, sisters(batch.cases))


@pytest.fixture(scope="module")
def batch(tmp_path_factory):
    return fleet(60, tmp_path_factory.mktemp("fleet"))


@pytest.fixture(scope="module")
def page(batch):
    return Page(page_of(batch))


def test_every_case_is_a_row_with_its_outcome_in_words(batch, page):
    text = page.text
    counts = Counter(case.outcome for case in batch.cases)
    for outcome, count in counts.items():
        assert re.search(rf"{outcome} {count}\b", text)
    for case in batch.cases:
        assert case.name in text
        assert case.reason in text


def test_every_case_has_its_first_cause_and_remedy_or_the_next_step(tmp_path):
    cause = "KD is not determined: fix it, or plan a test (`exfit identify`)"
    cases = (
        row("vague", cause=cause),
        row("good", "AC8B"),
        row("late", "ST1A", status="timed out", key=""),
        row("left", "ST4B", verdict="interrupted", holds=False),
    )
    (rows,) = Page(page_of(Fleet(tmp_path, cases))).tables.values()
    place = rows[0].index("cause and remedy")
    told = {line[0].split()[0]: " ".join(line[place].split()) for line in rows[1:]}
    assert "KD is not determined: fix it, or plan a test (exfit identify)" in told["vague"]
    assert told["good"] == "–"
    assert "--time-limit" in told["late"]
    assert "exfit fit" in told["left"]


def test_a_page_says_how_a_missing_report_is_made(tmp_path):
    case = row("u0")
    assert "exfit report" in Page(page_of(Fleet(tmp_path, (case,)))).text
    (tmp_path / case.key).mkdir()
    (tmp_path / case.key / "report.html").write_text("")
    assert "exfit report" not in Page(page_of(Fleet(tmp_path, (case,)))).text


def test_ids_are_distinct_and_nothing_is_asked_of_a_network(page):
    assert len(page.ids) == len(set(page.ids))
    addresses = [attrs[key] for _, attrs in page.tags for key in ("href", "src") if key in attrs]
    assert all(address.startswith("#") for address in addresses)


def test_a_case_leads_to_its_report_else_its_result_else_its_failure(tmp_path):
    keys = [f"{k:032x}" for k in range(4)]
    for key, names in zip(
        keys, (["report.html", "result.json"], ["result.json"], ["failed.json"], []), strict=True
    ):
        (tmp_path / key).mkdir()
        for name in names:
            (tmp_path / key / name).write_text("{}")
    cases = [row(f"u{k}", key=key) for k, key in enumerate(keys)]
    cases += [row("climbs", key=".."), row("none", key="")]
    page = Page(page_of(Fleet(tmp_path, tuple(cases))))
    links = [attrs["href"] for tag, attrs in page.tags if tag == "a"]
    assert [link for link in links if not link.startswith("#")] == [
        f"{keys[0]}/report.html", f"{keys[1]}/result.json", f"{keys[2]}/failed.json",
    ]  # fmt: skip


@pytest.mark.long
def test_a_page_grows_by_less_than_two_kilobytes_a_case():
    small, large = (len(page_of(fleet(count)).encode()) for count in (100, 400))
    assert (large - small) / 300 < MOST_BYTES


def test_no_text_of_a_case_becomes_a_tag(tmp_path):
    def hostile(text):
        cases = [
            row(
                f"{k}{text}", case=text, key=text, reason=text, unit=text, model=text,
                machine_model=text, verdict=text, rmse={text: 1e-3}, unresolved=(text,),
                parameters={text: parameter(1.0 + 9.0 * (k == 5), 0.1, unit=text)},
                curves=(replace(curve(np.random.default_rng(1)), record=text, signal=text),),
                about={"Rated": text, "Excitation maker": text}, holds=k != 7,
            )
            for k in range(8)
        ]  # fmt: skip
        return Structure(page_of(Fleet(tmp_path / "x", tuple(cases))))

    first, second = hostile(HOSTILE), hostile(HARMLESS)
    assert first.tags == second.tags
    assert first.scripts == second.scripts


def test_the_name_of_the_folder_is_a_text():
    assert "<b>bold" not in page_of(fleet(1, fleet(0).folder / "<b>bold"))


def test_many_sisters_are_shown_by_those_that_stand_out():
    count = MOST_SISTERS + 1
    cases = [
        row(f"u{k:02}", parameters={"KA": parameter(400.0 + k % 3, 4.0)}) for k in range(count)
    ]
    cases[7] = row("u07", parameters={"KA": parameter(900.0, 4.0)})
    page = Page(page_of(Fleet(fleet(0).folder, tuple(cases))))
    sister_rows = [cells[0] for table in page.tables.values() for cells in table if len(cells) == 2]
    assert sister_rows == ["case", "u07", "mean", "spread"]
    assert f"{count - 1} units without a mark are in parameters.csv" in page.text
    assert f"AC1A on GENROU: {count} units, 1 outlier" in page.text


# ---- pictures


def points(path):
    """Return the points of a path, of all its strokes."""
    places = []
    for stroke in path.split("M")[1:]:
        first, _, steps = stroke.partition("l")
        numbers = [int(n) for n in re.findall(r"-?\d+", f"{first.removesuffix('h0')} {steps}")]
        places += np.cumsum(np.reshape(numbers, (-1, 2)), axis=0).tolist()
    return np.array(places)


def test_a_picture_has_the_extremes_of_its_lines():
    line = curve(np.random.default_rng(2), misfit=0.5)
    drawn = picture(line, "vt")
    for path, samples in ((drawn.measured, line.measured), (drawn.simulated, line.simulated)):
        low = min(line.measured.min(), line.simulated.min())
        high = max(line.measured.max(), line.simulated.max())
        scale = (HEIGHT - 2 * MARGIN) / (high - low)
        x, y = points(path).T
        assert (x[0], x[-1]) == (0, WIDTH)
        assert y.min() == pytest.approx(HEIGHT - MARGIN - scale * (samples.max() - low), abs=0.51)
        assert y.max() == pytest.approx(HEIGHT - MARGIN - scale * (samples.min() - low), abs=0.51)


def test_points_on_a_straight_line_are_left_out_and_gaps_stay():
    time = np.arange(11.0)
    gap = np.where(time == 5.0, np.nan, 1.0)
    drawn = picture(SummaryCurve("up", "vt", time, gap, time), "vt")
    assert drawn.simulated == f"M0 {HEIGHT - MARGIN}l{WIDTH} {-(HEIGHT - 2 * MARGIN)}"
    assert drawn.measured.count("M") == 2


@pytest.mark.parametrize("samples", [[], [1.0], [np.nan, np.nan], [2.0, 2.0]])
def test_a_line_of_hardly_anything_is_drawn(samples):
    line = np.array(samples, dtype=float)
    drawn = picture(SummaryCurve("up", "vt", np.arange(float(len(line))), line, line), "vt")
    assert "nan" not in drawn.measured + drawn.simulated


def test_a_case_has_a_few_pictures():
    rng = np.random.default_rng(1)
    case = row("u", curves=tuple(curve(rng, signal) for signal in "abcde"))
    page = Page(page_of(Fleet(fleet(0).folder, (case,))))
    assert sum(tag == "title" for tag, _ in page.tags) == 1 + MOST_PICTURES
    assert set(MODELS) >= {case.model}
