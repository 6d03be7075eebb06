"""Files of a case that lie below a folder which stands for the root of all paths."""

from pathlib import Path

from exfit.util.files import ROOT, below, on_disk


def test_without_a_root_a_file_lies_where_its_path_says(monkeypatch):
    monkeypatch.delenv(ROOT, raising=False)
    assert on_disk(Path("../a/../b.csv")) == Path("../a/../b.csv")


def test_with_a_root_every_file_lies_below_it(tmp_path, monkeypatch):
    (tmp_path / "home").mkdir()
    monkeypatch.chdir(tmp_path / "home")
    monkeypatch.setenv(ROOT, str(tmp_path))
    assert on_disk(Path("b.csv")) == tmp_path / "home" / "b.csv"
    assert on_disk(Path("/data/b.csv")) == tmp_path / "data" / "b.csv"


def test_dots_above_the_root_stay_at_the_root(tmp_path, monkeypatch):
    (tmp_path / "home").mkdir()
    monkeypatch.chdir(tmp_path / "home")
    assert below(tmp_path, Path("../../../a.csv")) == tmp_path / "a.csv"
    assert below(tmp_path, Path("a/../b.csv")) == tmp_path / "home" / "b.csv"
    assert below(tmp_path, Path("/data/../a.csv")) == tmp_path / "a.csv"
