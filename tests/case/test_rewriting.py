"""Case files whose sources are moved beside their values: the same case, with all comments."""

import re

import pytest
import yaml
from places import CONFIGS

from exfit.case.load import load_case, parse_case
from exfit.case.rewriting import rewrite, with_changes, with_freed
from exfit.case.stated_values import taken_apart
from exfit.case.yaml import read_yaml
from exfit.errors import CaseError

TEXT = """\
# a unit
model: AC1A   # its exciter
plant:
  type: infinite-bus
  machine: GENROU
  parameters:   # from two places
    Tpd0: 6.0   # s, of the plate
    Xd: 1.8
    S10: 0.1
    S12: 0.4                                   # far to the right
  free:
    H: {start: 3.0, min: 1.0, max: 9.0}   # s
    Xq:
      start: 1.7   # pu
      min: 1.0
      max: 3.0
  network: {f0: 60, X: 0.3, P: 0.5,   # per unit
            Q: 0.1}
  # each is from: nameplate, maker, test report, measured, typical, fitted
  sources:
    {Tpd0: nameplate, S10: measured,   # of last year
     X: test report, H: typical, Xq: maker}   # of the grid
  std_errors:
    Tpd0: 0.10   # rounded
    S12: 0
stabiliser: {model: STAB1, sources: {K_T: maker, T3: maker}, parameters: {K_T: 10.0, T3: 0.1}}
limiters:
  - model: OEL2C
    parameters: {ITFPU: 1.9, ILIM: 1.9, IINST: 4.0, KPOEL: 20.0, K2: 20.0, KACT: 1.0, ITHOFF: 0.1}
    sources: {ITFPU: maker, ILIM: maker, IINST: maker, KPOEL: maker}
test: {vt0: 1.0, vref: [{at: 1.0, step: 0.05}], duration: 3.0}   # the end
"""
MOVED = """\
# a unit
model: AC1A   # its exciter
plant:
  type: infinite-bus
  machine: GENROU
  parameters:   # from two places
    Tpd0: {value: 6.0, source: nameplate, std_error: 0.10}  # s, of the plate
    Xd: 1.8
    S10: {value: 0.1, source: measured}
    S12: {value: 0.4, std_error: 0}            # far to the right
  free:
    H: {start: 3.0, min: 1.0, max: 9.0, source: typical}   # s
    Xq:
      source: maker
      start: 1.7   # pu
      min: 1.0
      max: 3.0
  network: {f0: 60, X: {value: 0.3, source: test report}, P: 0.5,   # per unit
            Q: 0.1}
  # of last year
  # of the grid
  # rounded
stabiliser: {model: STAB1, parameters: {K_T: {value: 10.0, source: maker},
    T3: {value: 0.1, source: maker}}}
limiters:
  - model: OEL2C
    parameters: {ITFPU: {value: 1.9, source: maker}, ILIM: {value: 1.9, source: maker},
                 IINST: {value: 4.0, source: maker}, KPOEL: {value: 20.0, source: maker}, K2: 20.0,
                 KACT: 1.0, ITHOFF: 0.1}
test: {vt0: 1.0, vref: [{at: 1.0, step: 0.05}], duration: 3.0}   # the end
"""


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_the_case_stays_the_same_and_keeps_its_comments_and_order(tmp_path, ending):
    path = tmp_path / "case.yaml"
    text = TEXT.replace("\n", ending)
    path.write_bytes(text.encode())
    moved = rewrite(path)
    new = path.read_bytes().decode()
    assert new.splitlines() == MOVED.splitlines()
    assert new.count("\n") == new.count(ending)
    assert parse_case(new, path) == parse_case(text, path)
    assert "plant.sources (Tpd0, S10, X, H, Xq)" in moved
    stamp = path.stat().st_mtime_ns
    assert rewrite(path) == []
    assert path.stat().st_mtime_ns == stamp


def by_name(text, path):
    """Return a text with what stands beside its values by name, as content of YAML."""
    return yaml.safe_dump(taken_apart(read_yaml(text, path)[0].value).content)


def test_every_sample_with_sources_comes_back_from_them_by_name(tmp_path):
    texts = {path: path.read_text("utf-8") for path in CONFIGS.rglob("*.yaml")}
    stated = {
        path: text
        for path, text in texts.items()
        if "source: " in text and path.parent.name != "criteria"
    }
    assert stated
    assert not [path for path, text in texts.items() if "sources:" in text]
    for path, text in stated.items():
        copy = tmp_path / path.name
        copy.write_text(by_name(text, path))
        assert rewrite(copy)
        before, after = (read_yaml(each, path)[0].value for each in (text, copy.read_text()))
        assert taken_apart(after).content == taken_apart(before).content
        assert "sources" not in str(after)


@pytest.mark.parametrize(
    "change",
    [
        ("sources: {ITFPU:", "sources: {NONE: maker, ITFPU:"),
        ("Xd: 1.8\n    S10: 0.1", "Xd: &same 1.8\n    S10: *same"),
    ],
)
def test_a_file_that_cannot_be_written_so_stays_as_it_is(tmp_path, change):
    path = tmp_path / "case.yaml"
    path.write_text(TEXT.replace(*change))
    with pytest.raises(CaseError, match="not written: "):
        rewrite(path)
    assert path.read_text() == TEXT.replace(*change)


def test_check_says_what_it_moved(tmp_path, run, monkeypatch):
    monkeypatch.chdir(tmp_path)
    content = (CONFIGS / "models" / "sexs.yaml").read_text()
    (tmp_path / "case.yaml").write_text(f"{content}  sources: {{K: maker}}\n")
    ran = run("check", "case.yaml", "--write")
    assert ran.out.startswith("case.yaml: written beside the values: parameters.sources (K)\n")
    assert "K: {value: 200, source: maker}" in (tmp_path / "case.yaml").read_text()
    assert run("check", "case.yaml", "--write").out.startswith("case.yaml: as it was\n")


CHANGES = {
    "plant.parameters.Tpd0": "",
    "plant.free.Tpd0": "{start: 3.0, min: 1.0, max: 9.0}",
    "plant.free.Xq.max": "4.0",
    "test.vref[0].step": "-0.05",
    "test.vref[1]": "{at: 2.0, step: 0.01}",
    "record.channels.vt.scale": "1.1",
    "record.mask[0]": "[1.0, 2.0]",
    "estimate.iterations": "100",
    "stabiliser": "",
}
CHANGED = (
    ("    Tpd0: 6.0   # s, of the plate\n", "    # s, of the plate\n"),
    ("      max: 3.0\n", "      max: 4.0\n    Tpd0: {start: 3.0, min: 1.0, max: 9.0}\n"),
    ("step: 0.05}]", "step: -0.05}, {at: 2.0, step: 0.01}]"),
    ("channels: {vt: V}}", "channels: {vt: {column: V, scale: 1.1}}, mask: [[1.0, 2.0]]}"),
)


def test_other_values_leave_comments_and_order_as_they_are(tmp_path):
    text = f"{TEXT}record: {{file: a.csv, time: t, channels: {{vt: V}}}}   # of 2024\n"
    path = tmp_path / "case.yaml"
    path.write_text(text, newline="\n")
    expected = re.sub("stabiliser: .*\n", "", text) + "estimate: {iterations: 100}\n"
    for old, new in CHANGED:
        assert old in expected
        expected = expected.replace(old, new)
    assert with_changes(path, CHANGES) == expected


def test_the_only_value_of_a_section_leaves_it_empty(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text("parameters: {fixed: {TE: 1.0}, free: {KA: 1}}\n")
    assert with_changes(path, {"parameters.fixed.TE": ""}) == (
        "parameters: {fixed: {}, free: {KA: 1}}\n"
    )


def test_what_an_alias_repeats_is_not_changed_in_one_place(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text("a: &one {x: 1}\nb: *one\n")
    with pytest.raises(CaseError, match=r"an alias repeats it; change by hand: b\.x: 2"):
        with_changes(path, {"b.x": "2"})


def test_names_that_cannot_be_freed_are_refused_all_at_once():
    case = load_case(CONFIGS / "ac1a_good.yaml")
    with pytest.raises(CaseError) as refused:
        with_freed(case, ["KA", "machine.Tpdo", "TB"])
    assert str(refused.value).splitlines() == [
        "--free: KA: is fitted already",
        "--free: machine.Tpdo: not a parameter; did you mean machine.Tpd0?",
        "--free: TB: is 0: no bounds follow from it; give parameters.free.TB in the case",
    ]
