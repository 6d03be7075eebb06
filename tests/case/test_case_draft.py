"""Names from files in the text of a case: each is read back as it was, none is taken for more."""

from pathlib import Path

import yaml
from hypothesis import given
from hypothesis import strategies as st

from exfit.case.case_draft import CaseDraft, Noted, plain_text
from exfit.case.yaml import read_yaml

NAMES = st.text(
    st.one_of(
        st.characters(exclude_categories=["Cs"]),
        st.sampled_from("\x1b\x9b\x85\u2028\u202e\ufeff\ufffe\n\r\t\"'\\#:{}[],&*!|>%@`- ?~"),
    ),
    max_size=30,
)


@given(NAMES)
def test_a_name_in_quotes_is_read_back_as_it_was(name):
    line = f"{{column: {plain_text(name)}, unit: kV}}"
    assert yaml.safe_load(line) == {"column": name, "unit": "kV"}
    assert read_yaml(line, Path("case.yaml"))[0].value == {"column": name, "unit": "kV"}
    assert line.isprintable()


@given(NAMES)
def test_a_name_in_a_comment_stays_in_it(name):
    draft = CaseDraft({"model": Noted("AC1A", name, above=name), "plant": "x"}, (name,))
    assert yaml.safe_load(draft.text) == {"model": "AC1A", "plant": "x"}
    assert all(line.isprintable() for line in draft.lines())


SECTIONS = st.recursive(
    NAMES | st.floats(allow_nan=False, allow_infinity=False) | st.integers(-9, 9) | st.booleans(),
    lambda inner: (
        st.lists(NAMES, max_size=12)
        | st.dictionaries(NAMES, inner, max_size=4)
        | st.lists(st.dictionaries(NAMES, inner, min_size=1, max_size=3), max_size=3)
        | st.builds(Noted, inner.filter(lambda value: not isinstance(value, Noted)), NAMES, NAMES)
    ),
    max_leaves=12,
)


def plain(value):
    if isinstance(value, Noted):
        return plain(value.value)
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    return [plain(entry) for entry in value] if isinstance(value, list) else value


@given(st.dictionaries(NAMES, SECTIONS, max_size=4))
def test_what_is_drafted_is_read_back_whatever_its_layout(sections):
    assert yaml.safe_load(CaseDraft(sections).text or "{}") == plain(sections)


def test_a_section_in_two_places_stands_once_and_is_filled_in_once():
    shared = {"vt": Noted({"column": "?", "unit": "kV"}, above="which?")}
    sections = {"records": [{"name": name, "channels": shared} for name in ("up", "down")]}
    draft = CaseDraft(sections)
    assert draft.text.count("which?") == 1
    (value,) = draft.open_values()
    assert (value.place, value.hint) == (("records", 0, "channels", "vt", "column"), "which?")
    assert draft.text.splitlines()[value.line - 1].strip() == 'vt: {column: "?", unit: kV}'
    read = yaml.safe_load(draft.filled({value: "Ugen"}).text)
    assert [each["channels"]["vt"]["column"] for each in read["records"]] == ["Ugen", "Ugen"]
