"""Records are joined to units by their names, or refused where a name can be read in two ways."""

import pytest

from exfit.errors import ExfitError
from exfit.features.start.record_files import UnitKey, records_in

UNITS = [UnitKey(101, "1"), UnitKey(102, "1"), UnitKey(102, "G2"), UnitKey(1, "1")]


def joined(folder, *names):
    """Return what becomes of files of these names."""
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("t,vt\n0,1\n")
    return records_in(folder, UNITS)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("101_1.csv", "bus 101, machine 1"),
        ("101-1.CSV", "bus 101, machine 1"),
        ("101_1_up 5%.csv", "bus 101, machine 1"),
        ("bus-101-1-up.csv", "bus 101, machine 1"),
        ("Bus 102_g2.xlsx", "bus 102, machine G2"),
        ("101.csv", "bus 101, machine 1"),
        ("101-2024-05-03.csv", "bus 101, machine 1"),
        ("101_test of May.csv", "bus 101, machine 1"),
        ("102_1/first.csv", "bus 102, machine 1"),
        ("101/first.csv", "bus 101, machine 1"),
        ("101/102_1.csv", "bus 101, machine 1"),
    ],
)
def test_a_name_that_begins_with_bus_and_id_is_of_that_unit(tmp_path, name, unit):
    records = joined(tmp_path, name)
    assert (records.faults, records.others) == ((), ())
    assert {str(key): files for key, files in records.of_unit.items()} == {unit: (tmp_path / name,)}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("102.csv", "2 machines, 1, G2; which one is not said"),
        ("102/first.csv", "2 machines, 1, G2; which one is not said"),
        ("101_up.csv", "machine up: not one of its machines: 1"),
        ("101_2.csv", "machine 2: not one of its machines: 1"),
        ("103_1.csv", "bus 103: no such unit"),
    ],
)
def test_what_can_be_read_in_two_ways_or_has_no_unit_is_refused(tmp_path, name, words):
    records = joined(tmp_path, name)
    assert records.of_unit == {}
    (fault,) = records.faults
    assert words in fault
    assert str(tmp_path / name.split("/")[0]) in fault


def test_several_files_of_a_unit_come_in_the_order_of_their_names(tmp_path):
    records = joined(tmp_path, "101_1_b.csv", "101_1_a.csv", "101/c.csv")
    assert [path.name for path in records.of_unit[UNITS[0]]] == [
        "c.csv",
        "101_1_a.csv",
        "101_1_b.csv",
    ]


def test_a_recorder_s_files_of_one_record_count_once_and_others_not_at_all(tmp_path):
    records = joined(tmp_path, "101_1.cfg", "101_1.dat", "101_1.hdr", "101_1.pdf", ".101_1.csv")
    assert [path.name for path in records.of_unit[UNITS[0]]] == ["101_1.cfg"]
    assert joined(tmp_path, "notes.csv", "1011x.csv").others == (
        tmp_path / "1011x.csv",
        tmp_path / "notes.csv",
    )


def test_a_folder_that_cannot_be_read_is_reported(tmp_path):
    with pytest.raises(ExfitError, match="cannot be read"):
        records_in(tmp_path / "none", UNITS)
