"""The iterations of a stored fit, as `exfit show --history` prints them by the thesis' names."""

import csv
import re
from itertools import pairwise
from pathlib import Path

import pytest
from places import CONFIGS

from exfit.util.vocabulary import HISTORY_PHASES

# by the words of the headings: the keys in history.csv
KEYS = {
    "iteration": "iteration",
    "cost f": "f",
    "gradient norm": "gradient_norm",
    "step": "step_norm",
    "damping": "damping",
    "Armijo halvings": "inner",
    "phase": "phase",
    "rejected trials": "inner",
    "capped": "capped",
    "evaluations": "nfev",
}
NARROW = 80
OF_A_TERMINAL = [*KEYS][:8]  # what 80 columns have room for
COUNTED_AS = {"gn": "rejected trials", "dgn": "Armijo halvings", "lm": "rejected trials"}
WORDS = re.compile(r"\S+(?: \S+)*")
EMPTY = {"": "-", "nan": "-"}


@pytest.fixture
def printed(run, empty_folder, monkeypatch):
    """Return a function that fits, and gives the table as printed, and history.csv."""

    def command(case, *options, columns=NARROW):
        if not Path("fit").exists():
            fit = run("fit", CONFIGS / f"{case}.yaml", "--no-plots", "-q", "-o", "fit", *options)
            assert fit.code != 1
        monkeypatch.setenv("COLUMNS", str(columns))
        ran = run("show", "fit", "--history")
        assert (ran.code, ran.err) == (0, "")
        assert max(map(len, ran.out.splitlines())) <= columns
        table, _, legend = ran.out.partition("\n\n")
        upper, lower, *rows = table.splitlines()
        ends = [0, *(word.end() for word in WORDS.finditer(lower))]
        heads = [
            f"{upper[begin:end].strip()} {lower[begin:end].strip()}".strip()
            for begin, end in pairwise(ends)
        ]
        rows = [dict(zip(heads, re.split(r" {2,}", row.strip()), strict=True)) for row in rows]
        with Path("fit/history.csv").open() as file:
            return rows, [*csv.DictReader(file)], legend

    return command


def same(text, stored):
    """Tell whether a printed number is the stored one to the digits that it has."""
    digits = len(text.partition("e")[0].replace(".", "")) - 1
    return text == stored or ("e" in text and text == f"{float(stored):.{digits}e}")


@pytest.mark.parametrize(
    ("case", "options"),
    [
        pytest.param(
            "ac1a_typical", ("--strategy", "gn", "--search", "local"), marks=pytest.mark.long
        ),
        ("ac1a_typical", ("--strategy", "lm-then-dgn", "--search", "local")),
        pytest.param("thesis/ac1a_table_1", (), marks=pytest.mark.long),
        pytest.param("ac1a_typical", ("--strategy", "gn"), marks=pytest.mark.long),
        pytest.param("ac1a_low", (), marks=pytest.mark.long),
    ],
)
def test_the_table_is_that_of_history_csv_by_the_names_of_the_thesis(printed, case, options):
    rows, stored, legend = printed(case, *options)
    assert [*rows[0]] == OF_A_TERMINAL
    assert len(rows) == len(stored) > 1
    for row, line in zip(rows, stored, strict=True):
        counted = COUNTED_AS.get(line["phase"])
        for title, text in row.items():
            if title in COUNTED_AS.values() and title != counted:
                assert text == ("0" if line["phase"] == "gn" else "-")
            else:
                value = EMPTY.get(line[KEYS[title]], line[KEYS[title]])
                assert same(text, value), (title, text, value)
    for phase in {line["phase"] for line in stored}:
        assert f"{phase}: {HISTORY_PHASES[phase]}" in legend
    wide, _, _ = printed(case, *options, columns=120)
    assert [*wide[0]] == [*KEYS]
    assert [row["evaluations"] for row in wide] == [line["nfev"] for line in stored]
    assert [row["capped"] for row in wide] == [line["capped"] or "-" for line in stored]


@pytest.mark.long
def test_the_history_of_a_search_leads_to_its_result(printed):
    """From Gauss-Newton, which ends early here, further starts find the lowest cost."""
    rows, _, _ = printed("ac1a_typical", "--strategy", "gn")
    assert "search" in [row["phase"] for row in rows]
    assert float(rows[-1]["cost f"]) == min(float(row["cost f"]) for row in rows)
    numbers = [int(row["iteration"]) for row in rows]
    assert numbers == [*range(len(rows))]


def test_a_validation_has_no_iterations(run, empty_folder):
    Path("validation.json").write_text("{}")
    ran = run("show", "validation.json", "--history")
    assert ran.code == 1
    assert "no iterations" in ran.err
