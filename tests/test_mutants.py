"""Damaged files are used or refused: neither a traceback nor a warning, nothing written by halves.

Fifty of each kind, a few of those that a process of their own reads; ``tests/studies/fuzz.py`` runs
a hundred thousand, with a limit of memory.
"""

import copy

import pytest
from mutant_files import KINDS, mutant
from mutant_runs import CODES, MOST_BYTES, MOST_LINES, Ran, judged, tried, written
from mutants import VALUES, json_bytes, mutated_tree, randomness

SEED = 11
IN_A_PROCESS, FEWER = {"workbook", "mat", "parquet"}, 8  # each mutant takes half a second more
NUMBERS = (range(1), pytest.param(range(1, 50), marks=pytest.mark.long))


@pytest.fixture
def workplace(tmp_path, monkeypatch):
    """Work in a folder of the test, in no terminal, 80 columns wide."""
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("numbers", NUMBERS, ids=["first", "more"])
def test_a_mutant_is_used_or_refused(workplace, kind, numbers):
    used = 0
    for number in numbers[:FEWER] if kind in IN_A_PROCESS else numbers:
        one = mutant(kind, SEED, number)
        result = tried(one, workplace)
        wrong = [f"{finding.kind}: {finding.text}" for finding in result.wrong]
        assert not wrong, "\n".join([str(one), *wrong])
        used += not result.refused
    # else what they are made from is wrong; of the first few all may be refused
    assert used > 0 or numbers.start == 0


@pytest.mark.parametrize("kind", KINDS)
def test_kind_seed_and_number_determine_a_mutant(kind):
    numbers = range(2)
    first, again = ([mutant(kind, SEED, number) for number in numbers] for _ in range(2))
    assert first == again
    assert [mutant(kind, SEED + 1, number) for number in numbers] != first


def test_values_that_a_tree_has_from_a_list_do_not_change_with_it():
    before = copy.deepcopy(VALUES)
    for number in range(300):
        tree = mutated_tree(randomness("tree", SEED, number), {"a": {"b": 1}}, {}, [], ["c", "d"])
        json_bytes(tree)  # it does not hold itself
    assert repr(before) == repr(VALUES)


def ran(code=1, out="", err="Error: x\n", fault=None, seconds=0.1):
    return Ran(("fit", "case.yaml"), code, out, err, fault, seconds)


@pytest.mark.parametrize(
    ("ended", "kind"),
    [
        (ran(fault=ZeroDivisionError()), "traceback"),
        (ran(fault=RuntimeWarning()), "warning"),
        (ran(code=max(CODES) + 1), "exit code"),
        (ran(err=""), "no message"),
        (ran(err="Error:\n" * MOST_LINES), "long message"),
        (ran(err="Error: " + "x" * MOST_BYTES), "long message"),
        (ran(err="Error: x.py:1: RuntimeWarning: overflow"), "leak"),
        (ran(code=0, out="Traceback (most recent call last):"), "leak"),
        (ran(code=0, out="title \x1b]0;x"), "control character"),
        (ran(seconds=100.0), "slow"),
    ],
)
def test_what_is_wrong_with_a_command_is_found(ended, kind):
    assert kind in [finding.kind for finding in judged(ended)]


def test_a_refusal_and_a_success_are_right():
    assert not [*judged(ran())]
    assert not [*judged(ran(code=0, out="done\n", err="Warning: vt: beyond 2 pu\n"))]


def test_files_left_by_halves_are_found(tmp_path):
    (tmp_path / "result.json").write_text('{"cost": NaN}')
    (tmp_path / "a.tmp").write_text("x")
    kinds = [finding.kind for finding in written(ran(), tmp_path, {"case.yaml": 0})]
    assert sorted(kinds) == ["half a file", "no JSON", "removed", "written in spite of a refusal"]
