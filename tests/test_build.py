"""Sdist and wheel: the same bytes wherever and whenever they are built, and nothing but exfit."""

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
from places import ROOT

pytest.importorskip("build")
pytest.importorskip("hatchling")
pytestmark = pytest.mark.long  # builds three times, as processes

BUILT_FROM = ("exfit", "pyproject.toml", "README.md", "LICENSE", "CHANGELOG.md", "SECURITY.md")
LEFTOVERS = (
    "exfit/.DS_Store",
    "exfit/errors.py.orig",
    "exfit/__pycache__/errors.pyc",
    "exfit/a.csv",
)
THEN = 1_000_000_000.0  # s since 1970
KINDS = {".py", ".typed", ".jinja", ".css", ".js"}


def build(place, target, umask=0o022, **environment):
    """Build in a folder; return the sdist and the wheel."""
    subprocess.run(
        [sys.executable, "-m", "build", "--no-isolation", "-o", str(target), str(place)],
        check=True,
        capture_output=True,
        env={**os.environ, **environment},
        umask=umask if os.name == "posix" else -1,
    )
    (sdist,), (wheel,) = target.glob("*.tar.gz"), target.glob("*.whl")
    return sdist, wheel


def checkout(place):
    """Return a copy of all that is built from."""
    place.mkdir()
    for name in BUILT_FROM:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, place / name, ignore=shutil.ignore_patterns("*.pyc"))
        else:
            shutil.copy(ROOT / name, place / name)
    return place


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Return an sdist and a wheel as most people build them."""
    place = tmp_path_factory.mktemp("built")
    return build(checkout(place / "checkout"), place, TZ="UTC", LC_ALL="C.UTF-8")


def test_another_person_s_build_elsewhere_has_the_same_bytes(built, tmp_path):
    copy = checkout(tmp_path / "a copy ä")
    for name in LEFTOVERS:
        (copy / name).parent.mkdir(exist_ok=True)
        (copy / name).write_bytes(b"left over")
    for path in copy.rglob("*"):
        path.chmod(0o700 if path.is_dir() else 0o600)
        os.utime(path, (THEN, THEN))
    other = build(copy, tmp_path, umask=0o077, TZ="Asia/Tokyo", LC_ALL="C", PYTHONHASHSEED="7")
    for path, same in zip(built, other, strict=True):
        assert path.name == same.name
        assert path.read_bytes() == same.read_bytes(), path.name


def test_the_wheel_of_an_sdist_is_that_of_the_checkout(built, tmp_path):
    """`python -m build` makes the wheel of the sdist, `pip install .` that of the checkout."""
    subprocess.run(
        [sys.executable, "-m", "build", "--no-isolation", "--wheel", "-o", str(tmp_path),
         str(checkout(tmp_path / "checkout"))],
        check=True,
        capture_output=True,
    )  # fmt: skip
    (wheel,) = tmp_path.glob("*.whl")
    assert wheel.read_bytes() == built[1].read_bytes()


def test_both_have_every_file_of_the_package_and_none_beside(built):
    package = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "exfit").rglob("*")
        if path.suffix in KINDS
    }
    sdist, wheel = built
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
    assert names == package
    with tarfile.open(sdist) as archive:
        members = archive.getmembers()
    names = {member.name.partition("/")[2] for member in members}
    assert names == package | {*BUILT_FROM[1:], "PKG-INFO"}
    assert {(member.uid, member.gid, member.mode) for member in members} == {(0, 0, 0o644)}


def test_no_file_of_the_package_is_of_a_kind_that_the_wheel_leaves_out():
    listed = subprocess.run(
        ["git", "ls-files", "exfit"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode:
        pytest.skip("not a checkout")
    assert {Path(name).suffix for name in listed.stdout.split()} == KINDS
