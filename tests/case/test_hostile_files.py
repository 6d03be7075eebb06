"""Case files that someone made to do harm, or that are none: refused at once, in few words."""

import os
from pathlib import Path

import pytest
from cases import FIRST_ORDER
from yaml import safe_dump

from exfit.case import peek
from exfit.case.load import load_case
from exfit.errors import CaseError, ExfitError
from exfit.features.programme.programme import load_programme
from exfit.features.start.tables import read_test_table
from exfit.util.text import MOST_TEXTS
from exfit.workflows.given_values import read_parameters

TEST = {**FIRST_ORDER["test"], "duration": 3.0}
BASE = safe_dump({**FIRST_ORDER, "test": TEST}, sort_keys=False)
MANY = 20_000
LONGEST_MESSAGE = 25_000  # characters


def refused(path, load=load_case):
    """Return the message with which a file is refused."""
    with pytest.raises(CaseError) as refusal:
        load(path)
    message = str(refusal.value)
    assert len(message) < LONGEST_MESSAGE
    return message


@pytest.fixture
def case_file(tmp_path):
    def write(text):
        path = tmp_path / "case.yaml"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def with_fixed(entries):
    return BASE.replace("parameters:\n", f"parameters:\n  fixed: {{{', '.join(entries)}}}\n")


@pytest.mark.long
@pytest.mark.parametrize(
    "text",
    [
        BASE + "".join(f"key{k}: 1\n" for k in range(MANY)),
        BASE + "about: {" + ", ".join(f"k{k}: [1]" for k in range(MANY)) + "}\n",
        with_fixed(f"h{k}: '= z{k}'" for k in range(2000)),
        with_fixed(f"h{k}: '= h{(k + 1) % 2000}'" for k in range(2000)),
    ],
    ids=["unknown keys", "wrong values", "ties to nothing", "a circle of ties"],
)
def test_of_thousands_of_faults_the_first_are_reported_with_their_number(case_file, text):
    with pytest.raises(CaseError) as refusal:
        load_case(case_file(text))
    lines = str(refusal.value).splitlines()
    more = len(refusal.value.faults) - MOST_TEXTS
    if more > 0:
        assert lines[-1] == f"... and {more:,} more"
    assert len(lines) == min(MOST_TEXTS, len(refusal.value.faults)) + (more > 0)
    assert len(str(refusal.value)) < LONGEST_MESSAGE


@pytest.mark.parametrize("key", ["[bold red]markup[/]", "[steps]"])
def test_a_key_in_brackets_is_a_key(case_file, key):
    assert f": {key}: unknown key" in refused(case_file(BASE + f"'{key}': 1\n"), load_case)


@pytest.mark.long
def test_the_same_holds_for_a_programme(case_file):
    tests = "".join(f"  - {{name: t{k}, kind: steady, key: 1}}\n" for k in range(2000))
    shared = BASE.partition("test:")[0]
    message = refused(case_file(f"{shared}tests:\n{tests}"), load_programme)
    assert message.splitlines()[-1].startswith("... and ")


ALIASES = "".join(f"  b{k}: &b{k} [{', '.join([f'*b{k - 1}'] * 9)}]\n" for k in range(1, 10))


@pytest.mark.parametrize(
    "text",
    [
        f"{BASE}about:\n  b0: &b0 [1, 1, 1, 1, 1, 1, 1, 1, 1]\n{ALIASES}",
        f"{BASE}about: &a {{x: *a}}\n",
        f"{BASE}about: {'[' * 100_000}",
        f"{BASE}about: {'{a: ' * 100_000}",
        BASE + "about:\n" + "".join(f"{' ' * k}a:\n" for k in range(1, 1000)),
        f"{BASE}about: {'- ' * 10_000}",
        f"{BASE}about: {{Unit: {'x' * 5_000_000}}}",
        f"{BASE}? {'x' * 2000}\n: 1\n",
        f"{BASE}about: {{{', '.join(f'k{k}: 1' for k in range(60_000))}}}",
        f"{BASE}about: !!python/object/apply:os.system ['touch harm']\n",
        f"{BASE}about: {{<<: {{Unit: 1}}}}\n",
        BASE.replace("start: 1.0", f"start: {'9' * 400}"),
        BASE.replace("start: 1.0", "start: 017"),
        BASE.replace("start: 1.0", "start: 1:30"),
        BASE.replace("start: 1.0", "start: 2020-01-01"),
        BASE.replace("start: 1.0", "start: 1_000"),
        BASE.replace("start: 1.0", "start: !!float '1.0'"),
        BASE.replace("start: 1.0", "start: .nan"),
        BASE.replace("model: FIRST_ORDER", f"model: {'x' * 5000}.py"),
        BASE.replace("model: FIRST_ORDER", 'model: "a\\0.py"'),
        BASE.replace("model:", "\tmodel:"),
        BASE.replace("model:", "mod\x01el:"),
        BASE.encode("utf-16"),
        f"# é\n{BASE}".encode("latin-1"),
        b"\0" * 1000,
    ],
    ids=lambda text: repr(text[-30:]),
)
def test_what_could_do_harm_is_refused_in_few_words(case_file, monkeypatch, tmp_path, text):
    monkeypatch.chdir(tmp_path)
    path = case_file(text)
    assert refused(path).startswith(str(path))
    assert not Path("harm").exists()
    peek.files_of(path)  # as the shell's completion reads it


def test_words_that_look_like_numbers_stay_the_words_that_they_are(case_file):
    facts = {"Unit": "007", "Serial": "0x1F", "Test date": "2020-01-01", "Tested at": "12:30"}
    text = "".join(f"  {name}: {word}\n" for name, word in facts.items())
    assert load_case(case_file(f"{BASE}about:\n{text}")).about == facts


def test_a_serial_number_that_would_lose_digits_is_refused(case_file):
    assert "more than 15 digits" in refused(case_file(f"{BASE}about: {{Serial: {'12345' * 4}}}\n"))
    quoted = load_case(case_file(f"{BASE}about: {{Serial: '{'12345' * 4}'}}\n"))
    assert quoted.about == {"Serial": "12345" * 4}


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no such file here")
def test_a_file_without_an_end_is_refused(case_file):
    path = Path("/dev/zero")
    case = load_case(case_file(BASE))
    for load in (load_case, load_programme, lambda path: read_parameters(case, path)):
        assert "a pipe or a device, not a file" in refused(path, load)


def test_a_huge_file_is_not_read(case_file):
    path = case_file(BASE)
    os.truncate(path, 10**12)  # sparse: it takes no room
    assert "larger than 4 MB" in refused(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("parameters: {k: " + "9" * 400 + "}", "k: inf lies outside 1e-06 ... 1e+06"),
        ("parameters: {k: 017}", "'017' is not a number"),
        ("parameters: {" + ", ".join(f"k{k}: 1" for k in range(10**5)) + "}", "more than 50,000"),
        ("parameters: {" + ", ".join(f"k{k}: x" for k in range(MANY)) + "}", "... and 19,980 more"),
        ("parameters: " + "{a: " * 10_000, "levels deep"),
        ("parameters: [1]", "parameters: missing"),
        ("parameters: {k: {a: 1}}", "{'a': 1} is not a number"),
        ("parameters: {k: 1}\nparameters: {k: 2}", "duplicate key"),
        ("model: [1]\nparameters: {k: 1}", "model: "),
        ("sources: {k: [1]}\nparameters: {k: 1}", "sources.k: [1] is not a source"),
    ],
    ids=lambda text: text[:20],
)
def test_a_file_of_parameters_is_read_with_the_same_care(case_file, tmp_path, text, words):
    case = load_case(case_file(BASE))
    path = tmp_path / "parameters.yaml"
    path.write_text(text)
    message = refused(path, lambda path: read_parameters(case, path))
    assert message.startswith(str(path))
    assert words in message


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (",".join(f"column{k}" for k in range(MANY)) + "\n1\n", "20,000 columns; at most 1,000"),
        (",".join(["file"] * 900) + "\n1\n", "... and 879 more"),
        ("file\n" + "a,b,c\n" * MANY, "... and 19,980 more"),
        ("file\n" + "x" * 200_000 + "\n", "field larger than field limit"),
    ],
    ids=lambda text: text[:20],
)
def test_a_table_is_refused_in_few_words(tmp_path, text, words):
    path = tmp_path / "tests.csv"
    path.write_text(text)
    with pytest.raises(ExfitError) as refusal:
        read_test_table(path)
    assert words in str(refusal.value)
    assert len(str(refusal.value)) < LONGEST_MESSAGE


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"test": {"vref": [{"at": 1e-320, "step": 0.05}]}}, "test.vref[0].at: "),
        ({"test": {"vref": [{"at": 1.0, "step": -1e308}]}}, "test.vref[0].step: -1e+308 exceeds"),
        ({"simulation": {"step": 1e300}}, "simulation.step: 1e+300 exceeds 1e+100"),
        ({"simulation": {"step": 1e-300}}, "simulation.step: 1e-300 is not 0, but below 1e-100"),
        (
            {"parameters": {"fixed": {"k": "=1e60*1e60", "a": 1.0}}},
            "parameters.fixed.k: 1e+120 lies outside",
        ),
    ],
)
def test_numbers_that_nothing_can_be_computed_with_are_refused_in_their_place(
    case_file, change, says
):
    content = {
        "model": "FIRST_ORDER",
        "plant": {"type": "none"},
        "test": {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}]},
        "parameters": {"fixed": {"k": 1.0, "a": 1.0}},
    }
    assert says in refused(case_file(safe_dump(content | change)), load_case)
