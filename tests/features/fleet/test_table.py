"""The tables of a batch: a line a case and a line a parameter, the same bytes always."""

import csv
import io
import random
from dataclasses import replace
from pathlib import Path

import pytest
from fleets import fleet, parameter, row

from exfit.features.fleet.folder import SummaryValidation
from exfit.features.fleet.sisters import sisters
from exfit.features.fleet.table import (
    BYTE_ORDER_MARK,
    fleet_table,
    parameter_table,
    text_cell,
    write_tables,
)

FIRST = [
    "name", "unit", "bus", "id", "model", "machine", "status", "verdict", "reason", "validation",
    "validation rmse", "criteria", "unresolved", "seconds", "case", "key",
]  # fmt: skip
STARTS = ("=", "+", "-", "@", "＝", "＋", "－", "＠")


def read(table):
    assert table.startswith(BYTE_ORDER_MARK)
    return [*csv.DictReader(io.StringIO(table.removeprefix(BYTE_ORDER_MARK)))]


def test_a_case_is_a_line_with_its_figures():
    case = row(
        "unit1",
        bus=101,
        machine_id="1",
        rmse={"efd": 1e-2, "vt": 4.1e-4},
        validation=SummaryValidation("accepted", 5e-4),
        unresolved=("TA",),
        parameters={"KA": parameter(400.0, 10.0), "TA": parameter(0.02)},
        seconds=1.25,
        cause="KA is not determined: fix it",
    )
    (line,) = read(fleet_table([case]))
    assert [*line][: len(FIRST)] == FIRST
    assert [*line][len(FIRST) :] == [
        "rmse vt", "rmse efd", "KA", "KA low", "KA high", "TA", "TA low", "TA high",
        "cause",
    ]  # fmt: skip
    assert (line["bus"], line["id"], line["model"], line["machine"]) == (
        "101",
        "1",
        "AC1A",
        "GENROU",
    )
    assert (float(line["rmse vt"]), float(line["rmse efd"])) == (4.1e-4, 1e-2)
    assert (line["validation"], float(line["validation rmse"])) == ("accepted", 5e-4)
    assert (line["KA"], line["KA low"], line["KA high"]) == ("400", "380.4", "419.6")
    assert (line["TA"], line["TA low"], line["unresolved"]) == ("0.02", "", "TA")
    assert line["seconds"] == "1.250"
    assert line["cause"] == "KA is not determined: fix it"


def test_the_order_of_the_work_makes_no_difference():
    cases = [*fleet(40).cases]
    before = fleet_table(cases), parameter_table(cases, sisters(cases))
    random.Random(3).shuffle(cases)
    again = fleet_table(cases), parameter_table(cases, sisters(sorted(cases, key=lambda c: c.name)))
    assert again == before
    names = [line["name"] for line in read(before[0])]
    assert names == sorted(names)


def test_times_are_in_one_column():
    cases = [*fleet(20).cases]
    slower = [replace(case, seconds=2.0 * case.seconds + 1.0) for case in cases]
    lines = zip(read(fleet_table(cases)), read(fleet_table(slower)), strict=True)
    assert {column for one, other in lines for column in one if one[column] != other[column]} == {
        "seconds"
    }
    assert parameter_table(cases, ()) == parameter_table(slower, ())


@pytest.mark.parametrize(
    "text",
    [
        "=1+1",
        "+1",
        "-2+3",
        "@SUM(A1)",
        "\t=1+1",
        "\r\n=1+1",
        " =1+1",
        "＝1+1",
        'a;=cmd|"/c calc"!A0',
    ],
)
def test_no_text_is_a_formula(text):
    """Also where semicolons part the cells, as in some countries."""
    case = row(
        text, unit=text, model=text, machine_model=text, verdict=text, reason=text, case=text,
        key=text, machine_id=text, unresolved=(text,), parameters={text: parameter(1.0, 0.1)},
    )  # fmt: skip
    for table in (fleet_table([case]), parameter_table([case], sisters([case]))):
        content = table.removeprefix(BYTE_ORDER_MARK)
        for line in csv.reader(io.StringIO(content)):
            assert not any(cell.lstrip("\t\r\n").startswith(STARTS) for cell in line)
            assert not any(piece.startswith(STARTS) for cell in line for piece in cell.split(";"))


def test_a_text_is_one_line_that_controls_no_terminal():
    assert text_cell("a\nb\tc") == "a b c"
    assert "\x1b" not in text_cell("\x1b[31mred")
    assert text_cell("Höllental") == "Höllental"


def test_a_fitted_parameter_is_a_line_beside_its_sisters():
    cases = [row(f"u{k}", parameters={"KA": parameter(400.0 + k, 4.0)}) for k in range(6)]
    cases[2] = row("u2", parameters={"KA": parameter(700.0, 4.0)})
    lines = {line["name"]: line for line in read(parameter_table(cases, sisters(cases)))}
    assert [*lines] == [f"u{k}" for k in range(6)]
    assert {line["sisters"] for line in lines.values()} == {"6"}
    assert [name for name, line in lines.items() if line["remark"]] == ["u2"]
    assert lines["u2"]["remark"] == "outlier"
    assert float(lines["u2"]["deviation"]) > 10.0 > abs(float(lines["u1"]["deviation"]))
    assert float(lines["u2"]["probability"]) < 0.05 < float(lines["u1"]["probability"])
    (alone,) = read(parameter_table(cases[:1], ()))
    assert (alone["sisters"], alone["centre"], alone["remark"]) == ("", "", "")


def test_tables_and_page_are_written_together(tmp_path):
    write_tables(fleet(3, tmp_path))
    assert {file.name for file in tmp_path.iterdir()} == {
        "fleet.csv", "parameters.csv", "fleet.html",
    }  # fmt: skip
    write_tables(replace(fleet(0, tmp_path), cases=()))
    assert read(Path(tmp_path / "fleet.csv").read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("bus", [999999999, 1234567890, 10**400])
def test_a_bus_keeps_all_of_its_digits(bus):
    (line,) = read(fleet_table([row("unit1", bus=bus)]))
    assert line["bus"] == str(bus)
