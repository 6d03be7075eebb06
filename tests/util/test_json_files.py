"""Files of JSON: what is too large is refused before it is parsed, or read whole."""

from pathlib import Path

import pytest

from exfit.errors import ExfitError
from exfit.util import files as json_files
from exfit.util.files import read_json, read_limited


def test_a_file_is_read_up_to_its_limit(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(b"x" * 100)
    assert read_limited(path, 100) == b"x" * 100
    with pytest.raises(ExfitError, match=r"larger than 9\.9e-05 MB, the limit of such a file"):
        read_limited(path, 99)


def test_a_file_that_is_too_large_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(json_files, "LARGEST_FILE", 1_000_000)
    path = tmp_path / "large.json"
    path.write_bytes(b" " * 1_000_001)
    with pytest.raises(ExfitError, match="larger than 1 MB"):
        read_json(path)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="there is no such file here")
def test_a_file_without_an_end_is_refused():
    with pytest.raises(ExfitError, match="a pipe or a device"):
        read_json(Path("/dev/zero"))


@pytest.mark.parametrize("name", ["missing", "a\0b", ""])
def test_a_file_that_cannot_be_read_is_named(tmp_path, name):
    with pytest.raises(ExfitError, match="cannot be read: "):
        read_json(tmp_path / name)


@pytest.mark.parametrize("text", ["[]", "1", '"text"', "null"])
def test_the_top_is_a_mapping(tmp_path, text):
    path = tmp_path / "file.json"
    path.write_text(text)
    with pytest.raises(ExfitError, match="not a mapping"):
        read_json(path)


def test_texts_of_any_language_are_read_with_a_mark_at_the_beginning_or_without(tmp_path):
    path = tmp_path / "file.json"
    for text in ('{"unit": "Höllental 😀"}', '\ufeff{"unit": "H\\u00f6llental \\ud83d\\ude00"}'):
        path.write_text(text, encoding="utf-8")
        assert read_json(path) == {"unit": "Höllental 😀"}
