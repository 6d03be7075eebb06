"""A case that travels with the contents of its files: fitted elsewhere, it gives the same bytes."""

import os
from dataclasses import replace
from pathlib import Path
from struct import pack

import numpy as np
import pytest
import yaml
from cases import FIRST_ORDER, TIME, TRUTH
from tiers import few_of

import exfit
from exfit.case.peek import files_of
from exfit.errors import CaseError, ExfitError
from exfit.features.fleet.remote import bundle_of, laid_out
from exfit.models.exciters import first_order
from exfit.results.io import result_text
from exfit.util.files import ROOT

NOISE = 1e-3
SAMPLES = TRUTH + NOISE * np.random.default_rng(3).standard_normal(len(TIME))
TEXT = "\n".join(["t,v", *(f"{t:.6g},{v:.9g}" for t, v in zip(TIME, SAMPLES, strict=True))])


@pytest.fixture
def user(tmp_path, monkeypatch):
    """Work in the folder of a user, beside one with records."""
    for name in ("fleet", "records", "elsewhere"):
        (tmp_path / name).mkdir()
    (tmp_path / "records" / "bump.csv").write_text(TEXT)
    monkeypatch.chdir(tmp_path / "fleet")
    return tmp_path


def case_file(path, file="../records/bump.csv", columns=("t", "v"), **changes):
    time, column = columns
    record = {"file": str(file), "time": time, "channels": {"vt": {"column": column}}}
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump({**FIRST_ORDER, "record": record, **changes}))
    return path


def bundle_of_case(case):
    return bundle_of(files_of(case))


def fitted(case):
    """Return the file of a fit without its times."""
    return result_text(replace(exfit.fit(case), seconds=0.0))


def travelled(user, case, run):
    """Return what ``run`` gives for a case in another folder, where none of its files is left."""
    bundle = bundle_of_case(case)
    for folder in ("fleet", "records"):
        (user / folder).rename(user / f"{folder}-gone")
    try:
        os.chdir(user / "elsewhere")
        with laid_out(bundle, user) as path:
            assert str(path) == str(case)
            return run(path)
    finally:
        for folder in ("fleet", "records"):
            (user / f"{folder}-gone").rename(user / folder)
        os.chdir(user / "fleet")


@pytest.mark.parametrize(
    ("case", "file"),
    few_of(
        [
            ("a.yaml", "../records/bump.csv"),
            ("units/1/a.yaml", "../../../records/bump.csv"),
            ("../fleet/units/../a.yaml", "units/../../records/bump.csv"),
            ("a.yaml", "{user}/records/bump.csv"),
            ("{user}/fleet/a.yaml", "{user}/records/../records/bump.csv"),
            ("{user}/fleet/a.yaml", "../records/bump.csv"),
        ],
        3,
    ),
)
def test_a_case_gives_the_same_bytes_wherever_its_files_are(user, case, file):
    (user / "fleet" / "units").mkdir()
    path = case_file(case.format(user=user), file.format(user=user))
    assert travelled(user, path, fitted) == fitted(path)


def comtrade(folder):
    """Write the record in two files, the second in capitals."""
    lines = [
        "Plant,Recorder,1999", "1,1A,0D", "1,v,,,pu,0.0001,0,0,-32767,32767,1,1,S", "50", "1",
        "20,61", "01/01/2020,00:00:00.0", "01/01/2020,00:00:00.5", "BINARY", "1", "",
    ]  # fmt: skip
    (folder / "bump.cfg").write_text("\r\n".join(lines), newline="")
    counts = np.round(SAMPLES * 1e4).astype(int)
    rows = (pack("<LLh", at + 1, at * 50_000, count) for at, count in enumerate(counts))
    (folder / "bump.DAT").write_bytes(b"".join(rows))


def test_a_record_in_two_files_travels_whole(user):
    comtrade(user / "records")
    for file in ("bump.cfg", "bump.DAT"):
        path = case_file(f"{file}.yaml", f"../records/{file}", ("time", "v"))
        assert len(bundle_of_case(path).files) == 3
        assert travelled(user, path, fitted) == fitted(path)


def test_a_model_and_the_reference_of_a_file_travel(user):
    code = Path(first_order.__file__).read_text()
    (user / "records" / "own.py").write_text(code)
    steps = "\n".join(["t,r", *(f"{t:.6g},{float(t >= 0.5):g}" for t in TIME)])
    (user / "records" / "reference.csv").write_text(steps)
    reference = {"file": "../records/reference.csv", "time": "t", "column": "r"}
    test = {"vt0": 0.0, "vref": reference}
    path = case_file("a.yaml", model="../records/own.py", test=test)
    assert len(bundle_of_case(path).files) == 4
    assert travelled(user, path, fitted) == fitted(path)


def test_messages_name_the_users_paths_and_no_other(user):
    def refusal(path):
        with pytest.raises(ExfitError) as refused:
            exfit.fit(path)
        return str(refused.value)

    own = user / "records" / "own.py"
    own.write_text("raise ValueError('of the model')")
    untraceable = user / "records" / "untraceable.py"
    code = Path(first_order.__file__).read_text().replace("return s.V", "return 1 / 0")
    assert "1 / 0" in code
    untraceable.write_text(code)
    cases = {
        "no-record.yaml": {"file": "../records/none.csv"},
        "no-record-there.yaml": {"file": user / "records" / "none.csv"},
        "no-folder.yaml": {"file": "nowhere/none.cfg"},
        "no-column.yaml": {"columns": ("t", "w")},
        "key.yaml": {"estimat": {}},
        "failing.yaml": {"model": "../records/own.py"},
        "untraceable.yaml": {"model": str(untraceable)},
        "near.yaml": {"model": "../records/untraceable.py"},
    }
    for name, changes in cases.items():
        path = case_file(name, **changes)
        message = refusal(path)
        assert travelled(user, path, refusal) == message
        assert "elsewhere" not in message
        assert name in message or "records/" in message or "nowhere/" in message
    Path("no.yaml").write_text("model: [")
    assert travelled(user, Path("no.yaml"), refusal) == refusal(Path("no.yaml"))


def test_what_lies_at_the_same_path_on_the_workers_own_disk_is_not_read(user):
    there = user / "elsewhere" / "bump.csv"
    path = case_file("a.yaml", there)
    bundle = bundle_of_case(path)  # the record does not exist yet
    there.write_text(TEXT)
    with (
        laid_out(bundle, user) as laid,
        pytest.raises(ExfitError, match=r"bump.csv: cannot be read"),
    ):
        exfit.fit(laid)
    assert ROOT not in os.environ
    exfit.fit(path)


def test_a_case_finds_no_file_of_the_one_before(user):
    path = case_file("a.yaml")
    with laid_out(bundle_of_case(path), user / "worker"):
        Path("left.csv").write_text(TEXT)
        Path("records").symlink_to(user / "records")
        Path("../records/of.csv").symlink_to(user / "records" / "bump.csv")
    (user / "records" / "bump.csv").rename(user / "kept.csv")
    with laid_out(bundle_of_case(path), user / "worker"):
        assert [file.name for file in Path.cwd().rglob("*")] == ["a.yaml"]
        assert not [*Path("../records").iterdir()]
    assert (user / "kept.csv").read_text() == TEXT


def test_bytes_that_change_on_the_way_are_refused(user):
    bundle = bundle_of_case(case_file("a.yaml"))
    for at, file in enumerate(bundle.files):
        others = [*bundle.files]
        for content in (file.content[:-1], b"?" + file.content[1:], b""):
            others[at] = replace(file, content=content)
            with (
                pytest.raises(ExfitError, match=r"damaged on its way"),
                laid_out(replace(bundle, files=tuple(others)), user),
            ):
                pass


def test_files_are_compressed_where_it_pays(user):
    noise = np.random.default_rng(1).bytes(10_000)
    (user / "records" / "bump.csv").write_text(TEXT * 10)
    (user / "records" / "noise.csv").write_bytes(noise)
    unseen = {"name": "x", "test": FIRST_ORDER["test"], "record": {"file": "../records/noise.csv"}}
    bundle = bundle_of_case(case_file("a.yaml", validate=[unseen]))
    sizes = {Path(file.path).name: len(file.content) for file in bundle.files}
    assert sizes["noise.csv"] == len(noise)
    assert sizes["bump.csv"] < 0.5 * len(TEXT * 10)
    assert bundle.size == sum(sizes.values())


def test_a_link_that_makes_one_path_of_two_files_is_refused(user):
    inner = user / "records" / "inner"
    inner.mkdir()
    (user / "fleet" / "link").symlink_to(inner)
    Path("bump.csv").write_text("t,v\n0,0\n1,1\n")
    unseen = {"name": "x", "test": FIRST_ORDER["test"], "record": {"file": "bump.csv"}}
    path = case_file("a.yaml", "link/../bump.csv", validate=[unseen])
    with pytest.raises(ExfitError, match="a link"):
        bundle_of_case(path)


def test_a_file_that_cannot_be_read_is_refused_where_it_lies(user):
    with pytest.raises(ExfitError, match=r"records: cannot be read: Is a directory"):
        bundle_of_case(case_file("a.yaml", "../records"))
    missing = bundle_of_case(Path("none.yaml"))
    with (
        laid_out(missing, user) as path,
        pytest.raises(CaseError, match=r"none.yaml: cannot be read"),
    ):
        exfit.fit(path)
