"""docs/thesis.md: every table and figure of the thesis is there, and is what the study makes."""

import importlib.util
import re
from itertools import pairwise

import numpy as np
import pytest
from gallery import same, same_word
from places import CONFIGS, ROOT
from thesis_numbers import (
    ABSOLUTE,
    APPROXIMATE,
    COSTS,
    CURVES,
    DGN,
    INSTANTS,
    LM,
    LM_DGN,
    RELATIVE,
    RESULTS,
    STARTS,
    TABLES,
    TRUE,
    A,
    K,
)
from thesis_runs import thesis_case

from exfit.case.load import load_case
from exfit.workflows import fit

PAGE = (ROOT / "docs" / "thesis.md").read_text(encoding="utf-8")
IMAGES = ROOT / "docs" / "img"
FIGURES = ["3.1", *(f"4.{number}" for number in range(1, 40))]
NOT_REPRODUCED = {"4.5", "4.13", "4.26", "4.29"}  # screens of the toolbox
HALF_DIGIT = 0.5e-4 + 1e-12  # of the four decimals that the thesis prints
LARGEST = 40_000  # bytes of a picture


def columns(texts):
    """Return two columns of the thesis' 3.3 (16, 2)."""
    return np.column_stack([np.array(text.split(), dtype=float) for text in texts])


def figures_in(text):
    """Return the figures that a text names."""
    return set(re.findall(r"(?<![\d.])[34]\.\d+(?![\d.])", text))


@pytest.fixture(scope="module")
def study():
    """Return the module of the study."""
    path = ROOT / "tests" / "studies" / "thesis.py"
    spec = importlib.util.spec_from_file_location("thesis", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


# ---- the page


def test_the_page_has_all_ten_tables_in_their_order():
    assert re.findall(r"^### Table (\d+):", PAGE, re.MULTILINE) == [str(k) for k in range(1, 11)]


def test_the_page_says_of_every_figure_where_it_is():
    rows = [
        line.split("|")[1:3] for line in PAGE.partition("## Figures")[2].splitlines() if "|" in line
    ]
    named = [number for figures, _ in rows for number in sorted(figures_in(figures))]
    assert sorted(named) == sorted(FIGURES)
    missing = {number for figures, place in rows if "not reproduced" in place
               for number in figures_in(figures)}  # fmt: skip
    assert missing == NOT_REPRODUCED


def test_every_reproduced_figure_is_a_picture_or_a_diagram():
    drawn = figures_in(" ".join(re.findall(r"!\[(figures? .*?)\]", PAGE)))
    diagrams = figures_in(" ".join(re.findall(r"Figure 3\.1|Figure 4\.\d+", PAGE)))
    assert set(FIGURES) - NOT_REPRODUCED <= drawn | diagrams


def test_the_page_shows_every_picture_of_the_thesis_and_they_are_small():
    pictures = sorted(IMAGES.glob("thesis_*.svg"))
    assert sorted(re.findall(r"img/(thesis_\w+\.svg)", PAGE)) == [path.name for path in pictures]
    assert max(path.stat().st_size for path in pictures) < LARGEST


# ---- what is typed from the thesis agrees with itself


def test_the_true_jacobian_of_the_thesis_is_the_closed_form_at_four_and_two():
    time = np.array(INSTANTS)
    fading = np.exp(-A * time)
    closed = np.column_stack([(1.0 - fading) / A, K * (time * fading / A - (1.0 - fading) / A**2)])
    assert columns(TRUE) == pytest.approx(closed, abs=HALF_DIGIT)


def test_the_errors_of_the_thesis_are_those_of_its_columns():
    true, absolute, relative = columns(TRUE), columns(ABSOLUTE), columns(RELATIVE)
    # three numbers rounded to four decimals
    assert absolute == pytest.approx(true - columns(APPROXIMATE), abs=3 * HALF_DIGIT)
    inside = np.isfinite(relative)
    bound = 2 * HALF_DIGIT / np.abs(true[inside]) + HALF_DIGIT
    assert np.all(np.abs(relative[inside] - absolute[inside] / true[inside]) <= bound)


def test_a_table_of_the_thesis_has_a_start_and_twenty_iterations_at_most():
    assert [table.number for table in TABLES] == list(range(1, 11))
    for table in TABLES:
        assert table.rows[0][2] == "0"
        assert 1 < len(table.rows) <= 21
        assert set(RESULTS[table.case, table.method]) == set(STARTS[table.case])


def test_levenberg_marquardt_of_the_thesis_stands_still_after_one_trial():
    """What the page says of tables 2 and 5, and that table 7 has the f and trials of table 5."""
    second, fifth, seventh = (table.rows for table in TABLES if table.method == LM)
    for rows in (second, fifth):
        for before, (gradient, cost, trials) in pairwise(rows):
            assert ((gradient, cost) == before[:2]) == (trials == "1")
    assert [row[1:] for row in seventh] == [row[1:] for row in fifth]


@pytest.mark.parametrize("name", CURVES)
def test_a_curve_of_andes_begins_at_rest_and_makes_its_step(name):
    time, vt = np.loadtxt(
        ROOT / "sample_data" / "andes" / f"{name}.csv", delimiter=",", skiprows=1
    ).T
    assert vt[time <= 1.0] == pytest.approx(1.0, abs=1e-7)
    assert vt[-1] == pytest.approx(1.05, abs=1e-3)


# ---- the cases that come with exfit


@pytest.mark.parametrize("name", ["ac1a_table_1", "ac8b_table_9"])
def test_a_case_of_the_thesis_is_the_one_that_the_study_fits(name):
    case = load_case(CONFIGS / "thesis" / f"{name}.yaml")
    studied = "ac1a_typical" if name == "ac1a_table_1" else "ac8b_unit1"
    own = thesis_case(studied, STARTS[studied], "dgn")
    assert case.values() == own.values()
    for section in ("free", "held"):
        assert getattr(case, section)() == getattr(own, section)()
    for section in ("estimate", "test", "simulation", "plant"):
        assert getattr(case, section) == getattr(own, section)
    files = [one.recordings[0].record.file for one in (case, own)]
    assert files[0].removeprefix("../") == files[1]


@pytest.mark.long
@pytest.mark.parametrize(("name", "number"), [("ac1a_table_1", 1), ("ac8b_table_9", 9)])
def test_its_fit_goes_through_the_table_of_the_page(name, number):
    (heading,) = re.findall(rf"^### Table {number}: .*", PAGE, re.MULTILINE)
    rows = [row[4:] for row in table_below(heading)[2:] if row[4]]
    history = fit(CONFIGS / "thesis" / f"{name}.yaml").history
    assert len(rows) == len(history)
    for (norm, cost, halvings), line in zip(rows, history, strict=True):
        assert same_word(norm, f"{line.gradient_norm:.6f}")
        assert same_word(cost, f"{line.cost:.7f}")
        assert line.inner == int(halvings)


def test_a_cost_of_the_text_is_that_of_the_table_with_more_digits():
    """Where the row is that of the search: case 1's second and case 3's are other ones."""
    last = {(table.case, table.method): table.rows[-1][1] for table in TABLES}
    for search in (("ac1a_typical", DGN), ("ac1a_typical", LM_DGN), ("ac1a_good", DGN),
                   ("ac1a_low", LM_DGN), ("ac8b_unit1", DGN), ("ac8b_unit2", DGN)):  # fmt: skip
        digits = len(last[search].partition(".")[2])
        assert f"{float(COSTS[search]):.{digits}f}" == last[search]
        assert COSTS[search] in PAGE


# ---- the study


def table_below(heading):
    """Return the rows of cells of the first table below a heading of the page."""
    below = PAGE.partition(f"{heading}\n")[2]
    return cells_of(re.search(r"(?:^\|.*\n)+", below, re.MULTILINE)[0])


def table_with(cell):
    """Return the rows of cells of the table that begins with a cell."""
    return cells_of(re.search(rf"^\| {re.escape(cell)} .*\n(?:\|.*\n)+", PAGE, re.MULTILINE)[0])


def cells_of(table):
    """Return the cells of the rows; marks around the table are none."""
    rows = [line for line in table.splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in row.split("|")[1:-1]] for row in rows]


@pytest.mark.long
@pytest.mark.parametrize("number", [4, 5])
def test_a_table_of_the_page_is_what_the_study_makes(study, number):
    """Up to one of the last digit of each number, as another processor rounds."""
    (heading,) = re.findall(rf"^### Table {number}: .*", PAGE, re.MULTILINE)
    page, ours = table_below(heading), cells_of(study.tables.history_table(number))
    assert len(page) == len(ours)
    for row, own in zip(page, ours, strict=True):
        assert all(map(same_word, row, own)), (row, own)


@pytest.mark.long
def test_the_jacobian_of_the_page_is_what_the_study_makes(study):
    ours = study.jacobians_at(K, A)
    assert ours.exact == pytest.approx(ours.closed, abs=1e-11)
    # eps^(2/3) is what central differences leave
    assert ours.differences == pytest.approx(ours.closed, abs=1e-8)
    for column, name in enumerate(("dv/dk", "dv/da")):
        rows, page = cells_of(study.tables.jacobian_table(column)), table_with(f"{name} at t (s)")
        # the last column is what rounding leaves, which no two machines share
        assert [row[:-1] for row in page] == [row[:-1] for row in rows]


@pytest.mark.long
def test_a_picture_of_the_page_is_what_the_study_draws(study):
    assert same((IMAGES / "thesis_jacobian.svg").read_bytes(), study.drawn("jacobian"))


@pytest.mark.long
def test_the_stale_search_stands_still_as_the_tables_of_the_thesis_do(study):
    rows = study.tables.stale_levenberg_marquardt("ac1a_typical")
    for before, row in pairwise(rows):
        assert (row.cost == before.cost) == (row.trials == 1)
    # it has been where f is a tenth of what it prints, and did not stay
    assert min(row.cost_there for row in rows) < 0.1 * min(row.cost for row in rows)
