"""Names from files in the text of a case: each is read back as it was, none is taken for more."""

from pathlib import Path

import yaml
from hypothesis import given
from hypothesis import strategies as st

from exfit.case.draft.suggestion import plain_text
from exfit.case.templates import commented, in_comment, quoted
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
    for text in (quoted(name), plain_text(name)):
        line = f"{{column: {text}, unit: kV}}"
        assert yaml.safe_load(line) == {"column": name, "unit": "kV"}
        assert read_yaml(line, Path("case.yaml"))[0].value == {"column": name, "unit": "kV"}
        assert text.isprintable()


@given(NAMES)
def test_a_name_in_a_comment_stays_in_it(name):
    text = commented("model: AC1A", in_comment(name))
    assert len(text.splitlines()) == 1
    assert yaml.safe_load(f"{text}\nplant: x") == {"model": "AC1A", "plant": "x"}
