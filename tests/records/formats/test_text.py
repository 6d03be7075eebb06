"""Delimited text as recorders, spreadsheets and simulators write it: the right numbers, or why not.

The files are written by hand in the form of each program; what stands in them was typed twice.
"""

import math
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tables import refused

from exfit.errors import RecordError
from exfit.records.formats import open_table
from exfit.records.formats.text import read_text_table


class Seen(NamedTuple):
    """A file and what must be read of it."""

    text: str | bytes
    clock: tuple[str, ...]
    time: list[float]
    columns: dict[str, list[float]]
    units: dict[str, str]
    asked: str | None = None


def form(*lines, end="\n"):
    return end.join(lines) + end


FILES = {
    "plain, comma": Seen(
        form("t,vt,efd", "0.00,1.0002,1.118", "0.01,0.9998,1.120", "0.02,1.0001,1.119"),
        ("t",),
        [0.0, 0.01, 0.02],
        {"vt": [1.0002, 0.9998, 1.0001], "efd": [1.118, 1.12, 1.119]},
        {},
    ),
    "German spreadsheet": Seen(
        form("Zeit [s];Ug [kV];If [A]", "0,00;15,751;812,5", "0,02;15,748;813", "0,04;15,75;811,75")
        .replace("\n", "\r\n")
        .encode("cp1252"),
        ("Zeit [s]",),
        [0.0, 0.02, 0.04],
        {"Ug [kV]": [15.751, 15.748, 15.75], "If [A]": [812.5, 813.0, 811.75]},
        {"Zeit [s]": "s", "Ug [kV]": "kV", "If [A]": "A"},
    ),
    "Spanish spreadsheet, titles, latin-1": Seen(
        (
            "Prueba de escalón en la excitación\r\nUnidad 2;Central Río Hondo\r\n\r\n"
            "Tiempo (s);Tensión (kV);Corriente de campo (A)\r\n"
            "-1;13,78;402\r\n-0,5;13,81;403,5\r\n0;14,44;451,25\r\n"
        ).encode("latin-1"),
        ("Tiempo (s)",),
        [-1.0, -0.5, 0.0],
        {"Tensión (kV)": [13.78, 13.81, 14.44], "Corriente de campo (A)": [402, 403.5, 451.25]},
        {"Tiempo (s)": "s", "Tensión (kV)": "kV", "Corriente de campo (A)": "A"},
    ),
    "spreadsheet, decimal comma in quotes": Seen(
        form(
            "Time,Ut,Uf", '"0,5","1,05","2,25"', '"0,6","1,04",2', "0.7,1,2".replace("0.7", '"0,7"')
        ),
        ("Time",),
        [0.5, 0.6, 0.7],
        {"Ut": [1.05, 1.04, 1.0], "Uf": [2.25, 2.0, 2.0]},
        {},
    ),
    "UTF-8 with a mark, units in a row": Seen(
        ("\ufeff" + form("Zeit;Uerr;Ierr;P", "s;V;A;MW", "0;102,4;655;0,1", "1;104,9;660,5;0,2")),
        ("Zeit",),
        [0.0, 1.0],
        {"Uerr": [102.4, 104.9], "Ierr": [655.0, 660.5], "P": [0.1, 0.2]},
        {"Zeit": "s", "Uerr": "V", "Ierr": "A", "P": "MW"},
    ),
    "UTF-16 spreadsheet text, tabs": Seen(
        form(
            "Time (ms)\tVT (pu)\tIFD (pu)", "0\t1.001\t0.521", "5\t1.002\t0.524", end="\r\n"
        ).encode("utf-16"),
        ("Time (ms)",),
        [0.0, 0.005],
        {"VT (pu)": [1.001, 1.002], "IFD (pu)": [0.521, 0.524]},
        {"Time (ms)": "ms", "VT (pu)": "pu", "IFD (pu)": "pu"},
    ),
    "UTF-16 big endian, semicolons": Seen(
        b"\xfe\xff" + form("t;U", "0;1,5", "2;1,75").encode("utf-16-be"),
        ("t",),
        [0.0, 2.0],
        {"U": [1.5, 1.75]},
        {},
    ),
    "units in brackets in a row": Seen(
        form("t,Ugen,Ifd", "[s],[pu],[pu]", "0.0,1.0,1.1", "0.1,1.01,1.2"),
        ("t",),
        [0.0, 0.1],
        {"Ugen": [1.0, 1.01], "Ifd": [1.1, 1.2]},
        {"t": "s", "Ugen": "pu", "Ifd": "pu"},
    ),
    "units behind a stroke": Seen(
        form("t/ms;U/kV;I_f/A", "0;10,5;100", "20;10,6;101", "40;10,55;100,5"),
        ("t/ms",),
        [0.0, 0.02, 0.04],
        {"U/kV": [10.5, 10.6, 10.55], "I_f/A": [100.0, 101.0, 100.5]},
        {"t/ms": "ms", "U/kV": "kV", "I_f/A": "A"},
    ),
    "field recording, date and time in two columns": Seen(
        form(
            "Date,Time,Ug,If",
            "20.09.2015,10:51:42.8589222,1.000055,0.5201",
            "20.09.2015,10:51:42.8637301,0.999945,0.5199",
            "20.09.2015,10:51:42.8685380,1.000000,0.5203",
        ),
        ("Date", "Time"),
        [0.0, 0.0048079, 0.0096158],
        {"Ug": [1.000055, 0.999945, 1.0], "If": [0.5201, 0.5199, 0.5203]},
        {},
    ),
    "ISO with T and Z": Seen(
        form(
            "timestamp,vt",
            "2021-03-04T23:59:59.9999995Z,1.0",
            "2021-03-05T00:00:00.0000005Z,1.1",
            "2021-03-05T00:00:01Z,1.2",
        ),
        ("timestamp",),
        [0.0, 1e-6, 1.0000005],
        {"vt": [1.0, 1.1, 1.2]},
        {},
    ),
    "ISO with a zone, the clock put back meanwhile": Seen(
        form("Zeitpunkt;U", "2023-10-29 02:59:59+02:00;1,0", "2023-10-29 02:00:00+01:00;1,5"),
        ("Zeitpunkt",),
        [0.0, 1.0],
        {"U": [1.0, 1.5]},
        {},
    ),
    "SCADA export, month first, AM and PM": Seen(
        form(
            "Timestamp,GEN1.KV,GEN1.IFD",
            "09/20/2015 11:59:58 AM,13.79,411.2",
            "09/20/2015 11:59:59 AM,13.80,411.5",
            "09/20/2015 12:00:01 PM,13.82,412.0",
        ),
        ("Timestamp",),
        [0.0, 1.0, 3.0],
        {"GEN1.KV": [13.79, 13.8, 13.82], "GEN1.IFD": [411.2, 411.5, 412.0]},
        {},
    ),
    "SCADA export, short hours": Seen(
        form(
            "Time;Volt", "9/5/2022 9:59:59 PM;1", "9/5/2022 10:00:00 PM;2", "9/5/2022 10:00:01 PM;3"
        ),
        ("Time",),
        [0.0, 1.0, 2.0],
        {"Volt": [1.0, 2.0, 3.0]},
        {},
    ),
    "day first, told by a day above 12, over midnight": Seen(
        form("Fecha;Hora;kV", "12/01/2020;23:59:59,5;13,8", "13/01/2020;00:00:00,25;13,9"),
        ("Fecha", "Hora"),
        [0.0, 0.75],
        {"kV": [13.8, 13.9]},
        {"kV": "kV"},
    ),
    "day first, told by midnight": Seen(
        form("Time,U", "04/09/2020 23:59:59,1", "05/09/2020 00:00:00,2"),
        ("Time",),
        [0.0, 1.0],
        {"U": [1.0, 2.0]},
        {},
    ),
    "dots are day first, over the end of a leap February": Seen(
        form("Datum\tUhrzeit\tU", "29.02.24\t23:59:58,125\t0,5", "01.03.24\t00:00:00,000\t0,75"),
        ("Datum", "Uhrzeit"),
        [0.0, 1.875],
        {"U": [0.5, 0.75]},
        {},
    ),
    "months in letters, over the end of one": Seen(
        form("Time,U", "30-Sep-2015 23:59:59.5,1.5", "01-Oct-2015 00:00:00.25,1.6"),
        ("Time",),
        [0.0, 0.75],
        {"U": [1.5, 1.6]},
        {},
    ),
    "months in capitals, a column for the date": Seen(
        form("Date;Time;U", "9 MAY 15;23:59:59;1,5", "10 MAY 15;00:00:00;1,6"),
        ("Date", "Time"),
        [0.0, 1.0],
        {"U": [1.5, 1.6]},
        {},
    ),
    "time of day alone, decimal comma": Seen(
        form("Uhrzeit;Ust", "10:51:42,858;1,001", "10:51:42,863;1,002", "10:51:43;1,003"),
        ("Uhrzeit",),
        [0.0, 0.005, 0.142],
        {"Ust": [1.001, 1.002, 1.003]},
        {},
    ),
    "hours and minutes": Seen(
        form("Time,P (MW)", "09:58,120.5", "09:59,121.0", "10:00,121.5"),
        ("Time",),
        [0.0, 60.0, 120.0],
        {"P (MW)": [120.5, 121.0, 121.5]},
        {"P (MW)": "MW"},
    ),
    "LabVIEW measurement": Seen(
        form(
            "LabVIEW Measurement\t",
            "Writer_Version\t2",
            "Separator\tTab",
            "Decimal_Separator\t,",
            "Date\t2019/05/14",
            "Time\t13:07:55,4012345",
            "***End_of_Header***\t",
            "\t",
            "Channels\t2\t\t",
            "Samples\t3\t3\t",
            "Y_Unit_Label\tVolts\tVolts\t",
            "X_Dimension\tTime\tTime\t",
            "***End_of_Header***\t\t\t",
            "X_Value\tU_gen\tU_shunt\tComment",
            "0,000000\t5,101250\t0,061200",
            "0,001000\t5,101500\t0,061300",
            "0,002000\t5,101750\t0,061100",
            end="\r\n",
        ),
        ("X_Value",),
        [0.0, 0.001, 0.002],
        {"U_gen": [5.10125, 5.1015, 5.10175], "U_shunt": [0.0612, 0.0613, 0.0611]},
        {},
    ),
    "oscilloscope with a preamble": Seen(
        form(
            "Model,MSO64",
            "Firmware Version,1.26.3",
            "",
            "Point Format,Y,,",
            "Horizontal Units,s,,",
            "Sample Interval,4e-05,,",
            "Record Length,4,,",
            "Vertical Units,V,A,",
            "Label,,,",
            "TIME,CH1,CH2",
            "-4.00e-05,0.124,-1.5e-03",
            "0.00e+00,0.128,-1.6e-03",
            "4.00e-05,0.132,-1.7e-03",
        ),
        ("TIME",),
        [-4e-5, 0.0, 4e-5],
        {"CH1": [0.124, 0.128, 0.132], "CH2": [-1.5e-3, -1.6e-3, -1.7e-3]},
        {},
    ),
    "oscilloscope with numbered channels over units": Seen(
        form("x-axis,1,2", "second,Volt,Ampere", "-0.002,1.5,0.25", "0.000,1.6,0.26"),
        ("x-axis",),
        [-0.002, 0.0],
        {"1": [1.5, 1.6], "2": [0.25, 0.26]},
        {"x-axis": "second", "1": "Volt", "2": "Ampere"},
    ),
    "two rows of names, the lower one with units": Seen(
        form(
            '"All calculations","G 1","G 1"',
            '"Time in s","Terminal Voltage in p.u.","Excitation Current in p.u."',
            "-0.100000,1.000000,1.215340",
            "0.000000,1.000000,1.215340",
            "0.010000,1.000213,1.219999",
        ),
        ("Time in s",),
        [-0.1, 0.0, 0.01],
        {
            "Terminal Voltage in p.u.": [1.0, 1.0, 1.000213],
            "Excitation Current in p.u.": [1.21534, 1.21534, 1.219999],
        },
        {
            "Time in s": "s",
            "Terminal Voltage in p.u.": "p.u.",
            "Excitation Current in p.u.": "p.u.",
        },
    ),
    "simulator, blanks, names in quotes": Seen(
        form(
            ' "Time(s)"   "ETRM 101 [GEN A]"   "EFD 101[GEN A]"',
            "   -0.8333E-02    1.00000     1.87213",
            "    0.0000         1.00000     1.87213",
            "    0.8333E-02     0.99871     2.01342",
        ),
        ("Time(s)",),
        [-0.008333, 0.0, 0.008333],
        {"ETRM 101 [GEN A]": [1.0, 1.0, 0.99871], "EFD 101[GEN A]": [1.87213, 1.87213, 2.01342]},
        {"Time(s)": "s"},
    ),
    "blanks, units apart from the names": Seen(
        form("Time [ms]  Ut [kV]", "0    13,80", "5    13,79", "  10   13,81"),
        ("Time [ms]",),
        [0.0, 0.005, 0.01],
        {"Ut [kV]": [13.8, 13.79, 13.81]},
        {"Time [ms]": "ms", "Ut [kV]": "kV"},
    ),
    "blanks, units in a row": Seen(
        form(
            "# made by the recorder", "t   vt   efd", "s   pu   pu", "0.0 1.0  1.5", "0.5 1.1  1.75"
        ),
        ("t",),
        [0.0, 0.5],
        {"vt": [1.0, 1.1], "efd": [1.5, 1.75]},
        {"t": "s", "vt": "pu", "efd": "pu"},
    ),
    "blanks, date and time": Seen(
        form("Datum Zeit Ug", "20.09.2015 10:51:42 1,05", "20.09.2015 10:51:43 1,06"),
        ("Datum", "Zeit"),
        [0.0, 1.0],
        {"Ug": [1.05, 1.06]},
        {},
    ),
    "names in a comment": Seen(
        form("% bump test of unit 1", "% t, vt, ifd", "0, 1.00, 1.10", "1, 1.05, 1.25"),
        ("t",),
        [0.0, 1.0],
        {"vt": [1.0, 1.05], "ifd": [1.1, 1.25]},
        {},
    ),
    "comments between names and numbers, and below them": Seen(
        form("t,vt", "// 5 % step at 1 s", "0,1.0", "1,1.05", "# trigger", "2,1.04", "! end"),
        ("t",),
        [0.0, 1.0, 2.0],
        {"vt": [1.0, 1.05, 1.04]},
        {},
    ),
    "comments with semicolons": Seen(
        form("; recorder 7, firmware 3.1", "; 4 channels", "time,vt", "0,1", "1,1.5"),
        ("time",),
        [0.0, 1.0],
        {"vt": [1.0, 1.5]},
        {},
    ),
    "no names": Seen(
        form("0.000\t1.0001\t2.25", "0.010\t1.0002\t2.50", "0.020\t1.0003\t2.75"),
        ("1",),
        [0.0, 0.01, 0.02],
        {"2": [1.0001, 1.0002, 1.0003], "3": [2.25, 2.5, 2.75]},
        {},
    ),
    "no names, blanks, a title": Seen(
        form("Versuch 3: Sollwertsprung 5 %", "", "0 1,00", "1 1,05"),
        ("1",),
        [0.0, 1.0],
        {"2": [1.0, 1.05]},
        {},
    ),
    "separators at the end of rows": Seen(
        form("Zeit;Ug;", "0;1,5;", "1;1,6;", "2;1,7;"),
        ("Zeit",),
        [0.0, 1.0, 2.0],
        {"Ug": [1.5, 1.6, 1.7]},
        {},
    ),
    "separators at the end of the rows, not of the names": Seen(
        form("t,vt", "0,1.5,", "1,1.6,", "2,1.7,"),
        ("t",),
        [0.0, 1.0, 2.0],
        {"vt": [1.5, 1.6, 1.7]},
        {},
    ),
    "old Macintosh line ends": Seen(
        form("t,vt", "0,1.5", "1,1.6", end="\r"), ("t",), [0.0, 1.0], {"vt": [1.5, 1.6]}, {}
    ),
    "a first column that counts up": Seen(
        form("N;U1;U2", "1;0,5;7", "2;0,25;6"), ("N",), [1, 2], {"U1": [0.5, 0.25]}, {}
    ),
    "minutes, asked for": Seen(
        form("Zeit;P", "0;1", "0,5;2", "1;3"), ("Zeit",), [0, 30, 60], {"P": [1, 2, 3]}, {}, "min"
    ),
    "timestamps of a name that is not known, beside a count": Seen(
        form("N;Wann;U", "1;10:00:00,5;7", "2;10:00:01,0;8"),
        ("Wann",),
        [0.0, 0.5],
        {"U": [7.0, 8.0]},
        {},
    ),
    "a first column without a name": Seen(
        form(",vt,", "0.5,1.0,7", "1.0,1.1,8"), ("1",), [0.5, 1.0], {"vt": [1.0, 1.1]}, {}
    ),
    "uneven sampling": Seen(
        form("t,vt", "0,1.0", "0.0046,1.1", "0.0096,1.2", "0.0142,1.3", "7.5,1.4"),
        ("t",),
        [0.0, 0.0046, 0.0096, 0.0142, 7.5],
        {"vt": [1.0, 1.1, 1.2, 1.3, 1.4]},
        {},
    ),
    "text beside the numbers": Seen(
        form("t,state,vt", '0,"running, on line",1.0', "1,tripped,1.1"),
        ("t",),
        [0.0, 1.0],
        {"vt": [1.0, 1.1]},
        {},
    ),
    "a micro sign in Windows-1252": Seen(
        form("t [µs];U [V]", "0;1", "250;2").encode("cp1252"),
        ("t [µs]",),
        [0.0, 0.00025],
        {"U [V]": [1.0, 2.0]},
        {"t [µs]": "µs", "U [V]": "V"},
    ),
    "the decimal comma far below": Seen(
        form("t;U", *(f"{at};1" for at in range(400)), "400;1,5"),
        ("t",),
        [float(at) for at in range(401)],
        {"U": [1.0] * 400 + [1.5]},
        {},
    ),
}


@pytest.fixture
def file(tmp_path):
    """Return a function that writes a file and returns its path."""

    def write(text: str | bytes, name: str = "record.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return write


@pytest.mark.parametrize("dialect", FILES)
def test_a_file_as_found_in_the_field_is_read_to_the_numbers_in_it(file, dialect):
    expected = FILES[dialect]
    table = read_text_table(file(expected.text))
    assert table.instants(expected.clock, expected.asked).tolist() == expected.time
    columns = table.numbers(expected.columns)
    assert {name: column.tolist() for name, column in columns.items()} == expected.columns
    assert dict(table.units) == expected.units
    assert table.clock == expected.clock
    assert {*expected.clock, *expected.columns} <= {*table.names}


# how a recorder writes that a sample is missing
GAPS = ["", "  ", "nan", "NaN", "-nan", "---", "-", "****"]


@pytest.mark.parametrize("gap", GAPS)
@pytest.mark.parametrize("comma", [False, True])
def test_a_missing_sample_is_nan_where_it_may_be_and_else_refused_or_nan(file, gap, comma):
    text = form("t;vt;ifd", "0;1.5;2.5", f"1;{gap};2.25", "2;1.25;2")
    path = file(text.replace(".", ",") if comma else text)
    table = read_text_table(path)
    column = table.numbers(["vt", "ifd"], frozenset({"vt"}))["vt"]
    assert column[[0, 2]].tolist() == [1.5, 1.25]
    assert math.isnan(column[1])
    if "nan" not in gap.lower():
        with pytest.raises(RecordError, match=r"record\.csv:3: column 'vt'"):
            table.numbers(["vt"])


TWO = form("t,vt,ifd", "0.0,1.0,1.1", "0.1,1.01,1.2", "0.2,1.02,1.3", "0.3,1.03,1.4")
GERMAN = TWO.replace(",", ";").replace(".", ",")
STAMPED = form("Time;vt", *(f"20.09.2015 10:51:4{at}.5;1,{at}" for at in range(4)))
TIMED = form("Date,Time,vt", *(f"2015-09-20,10:51:4{at}.5,1.{at}" for at in range(4)))

# what is wrong -> content, the columns of the clock, then all that the message must name
FAULTS = {
    "a letter in a number": (TWO.replace("1.02", "1.O2"), "t", [":4", "'vt'", "'1.O2'"]),
    "a decimal point beside commas": (
        GERMAN.replace("1,02", "1.02"),
        "t",
        [":4", "'vt'", "'1.02'"],
    ),
    "a decimal comma beside points": (
        TWO.replace("1.02", '"1,02"'),
        "t",
        [":4", "'vt'", "'1,02'"],
    ),
    "a decimal comma that separates too": (
        form("t,vt", "0,0,1,05", "0,1,1,06"),
        "t",
        [":2", "row: 4", "columns: 2"],
    ),
    "thousands with points": (
        GERMAN.replace("1,02", "1.020,5"),
        "t",
        [":4", "'vt'", "'1.020,5'", "thousands"],
    ),
    "thousands with commas": (
        TWO.replace("1.02", '"1,020.5"'),
        "t",
        [":4", "'vt'", "'1,020.5'", "thousands"],
    ),
    "thousands with blanks": (
        GERMAN.replace("1,02", "1 020,5"),
        "t",
        [":4", "'vt'", "'1 020,5'", "thousands"],
    ),
    "a unit in a cell": (TWO.replace("1.02", "1.02 kV"), "t", [":4", "'vt'", "'1.02 kV'"]),
    "an error of a spreadsheet": (TWO.replace("1.02", "#DIV/0!"), "t", [":4", "'vt'", "'#DIV/0!'"]),
    "a word for a missing sample": (TWO.replace("1.02", "Bad"), "t", [":4", "'vt'", "'Bad'"]),
    "a hexadecimal number": (TWO.replace("1.02", "0x1F"), "t", [":4", "'vt'", "'0x1F'"]),
    "an empty cell": (GERMAN.replace("1,02", ""), "t", [":4", "'vt'", "an empty cell"]),
    "a short row": (
        GERMAN.replace("0,2;1,02;1,3", "0,2;1,02"),
        "t",
        [":4", "row: 2", "columns: 3"],
    ),
    "a long row": (GERMAN.replace("1,3", "1,3;7"), "t", [":4", "row: 4", "columns: 3"]),
    "a cell behind the separator at the end": (
        form("t;vt;", "0;1;", "1;2;3", "2;3;"),
        "t",
        [":3", "row: 3", "columns: 2"],
    ),
    "a short row of blanks": (
        form("t vt ifd", "0 1.0 2.0", "1 1.1", "2 1.2 2.2"),
        "t",
        [":3", "row: 2", "columns: 3"],
    ),
    "a row cut off at the end": (TWO.rstrip("\n").removesuffix(",1.4"), "t", [":5", "row: 2"]),
    "a footer": (TWO + "End of record\n", "t", [":6", "row: 1", "columns: 3"]),
    "a row that is commented out": (TWO.replace("0.2,", "#0.2,"), "t", [":4", "'t'", "'#0.2'"]),
    "names again in the midst": (
        TWO.replace("0.2,1.02,1.3", "t,vt,ifd"),
        "t",
        [":4", "'t'", "'t' is not a number"],
    ),
    "fewer names than columns": (
        form("t,vt", "0,1,2", "1,2,3"),
        "t",
        [":2", "row: 3", "columns: 2"],
    ),
    "more names than columns": (
        form("t;vt;ifd;efd", "0;1", "1;2"),
        "t",
        [":2", "row: 2", "columns: 4"],
    ),
    "a first row that is neither": (
        form("t;2;3", "0;1;2", "1;2;3"),
        "t",
        [":1", "neither a row of names", "'t', '2', '3'"],
    ),
    "a number that repeats its separator": (
        form("t;vt", "0;1,5", "1;1,,5"),
        "t",
        [":3", "'vt'", "'1,,5'"],
    ),
    "two separators are possible": (
        form("20.09.2015 10:51:42,5", "20.09.2015 10:51:43,5"),
        "t",
        [":1", "commas or spaces", "'20.09.2015 10:51:42,5'"],
    ),
    "no timestamp": (
        STAMPED.replace("10:51:42.5", "soon"),
        "Time",
        [":4", "'Time'", "'20.09.2015 soon' is not a timestamp"],
    ),
    "an empty timestamp": (
        STAMPED.replace("20.09.2015 10:51:42.5", ""),
        "Time",
        [":4", "'Time'", "an empty cell"],
    ),
    "no such day": (
        STAMPED.replace("20.09.2015 10:51:42", "31.09.2015 10:51:42"),
        "Time",
        [":4", "'Time'", "month 9, day 31 is not a date"],
    ),
    "no such time": (
        STAMPED.replace("10:51:42", "10:61:42"),
        "Time",
        [":4", "'Time'", "'20.09.2015 10:61:42.5' is not a time of day"],
    ),
    "no such hour before noon": (
        form("t,vt", "1:00:00 AM,1", "13:00:00 PM,2"),
        "t",
        [":3", "'t'", "'13:00:00 PM' is not a time of day"],
    ),
    "a month of no name": (
        STAMPED.replace("20.09.2015", "20-Sep-2015").replace("20-Sep-2015 10:51:42", "20-Sop-2015"),
        "Time",
        [":4", "'Time'", "'20-Sop-2015.5' is not a timestamp"],
    ),
    "no such day of a month in letters": (
        form("Time,U", "30-Sep-2015 10:00:00,1", "31-Sep-2015 10:00:01,2"),
        "Time",
        [":3", "'Time'", "month 9, day 31 is not a date"],
    ),
    "minutes and seconds": (
        form("t,vt", "51:42.5,1.0", "51:43.0,1.1"),
        "t",
        [":2", "'t'", "'51:42.5' is not a number", "need their hours, as in 0:51:42.5"],
    ),
    "minutes and whole seconds": (
        form("t,vt", "51:42,1.0", "51:43,1.1"),
        "t",
        [":2", "'t'", "'51:42' is not a time of day", "minutes and seconds"],
    ),
    "another form of timestamp": (
        STAMPED.replace("20.09.2015 10:51:42", "2015-09-20 10:51:42"),
        "Time",
        [":4", "'Time'", "another form than '20.09.2015 10:51:40.5', the first"],
    ),
    "a zone in one cell only": (
        form("t,vt", "2015-09-20T10:51:42Z,1", "2015-09-20T10:51:43,2"),
        "t",
        [":3", "'t'", "another form"],
    ),
    "midnight without a date": (
        form("Uhrzeit;U", "23:59:59,5;1,0", "23:59:59,9;1,1", "00:00:00,3;1,2"),
        "Uhrzeit",
        [":4", "'Uhrzeit'", "passes midnight", "no date"],
    ),
    "day and month that could be swapped": (
        form("Time,U", "04/09/2020 10:00:00,1", "06/09/2020 10:00:00,2"),
        "Time",
        [":3", "'Time'", "6, 9 could be day and month, or month and day"],
    ),
    "a wrong time beside its date": (
        TIMED.replace("10:51:42.5", "10.51.42"),
        "Date+Time",
        [":4", "'Time'", "'10.51.42' has another form"],
    ),
    "a date where the time belongs": (
        TIMED,
        "Time+Date",
        [":2", "'Time'", "'10:51:40.5' is not a date"],
    ),
    "two times": (
        TIMED.replace("2015-09-20,", "2015-09-20 10:00:00,"),
        "Date+Time",
        [":2", "'Date'", "not a date alone"],
    ),
    "a number among timestamps": (
        STAMPED.replace("20.09.2015 10:51:42.5", "3,5"),
        "Time",
        [":4", "'Time'", "'3,5' is not a timestamp"],
    ),
    "a ragged row beside timestamps": (
        STAMPED.replace("42.5;1,2", "42.5"),
        "Time",
        [":4", "row: 1", "columns: 2"],
    ),
    "bytes of no text": (b"t;U\n0;1\n1;\x90\x9d\n", "t", [":3", "0x90"]),
    "UTF-16 cut off": (TWO.encode("utf-16")[:-1], "t", ["UTF-16", ":"]),
    "a quote without end": (TWO.replace("1.02", '"1.02'), "t", [":5", "row: 2", "columns: 3"]),
    "only words": (form("alpha;beta", "gamma;delta", "one;two"), "t", ["no row of numbers"]),
    "not the column": (GERMAN, "time", ["no column 'time'", "'t', 'vt', 'ifd'"]),
}


def read_whole(path, clock, names):
    table = read_text_table(path)
    return table.instants(clock), table.numbers(names)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_damaged_file_is_refused_with_line_and_column(file, fault):
    text, clock, named = FAULTS[fault]
    path = file(text)
    refused(lambda: read_whole(path, clock.split("+"), ["vt"]), "record.csv", *named)


def test_columns_are_read_beside_those_that_hold_no_numbers(file):
    table = open_table(
        file(form("t,a,b,a,c,d", "0,1,2,2,3,4", "1,1,,2,3,4", "2,1,bad,4,x,", "3,7,8,9,y,10"))
    )
    found = dict(table.each(table.names))
    alone = {}
    for name in {*table.names}:
        try:
            alone[name] = table.numbers([name], frozenset([name]))[name]
        except RecordError as fault:
            alone[name] = str(fault)
    assert {*alone} == {*found}
    for name, column in found.items():
        if isinstance(column, RecordError):
            assert str(column) == alone[name]
        else:
            np.testing.assert_array_equal(column, alone[name])
    assert {name for name in found if isinstance(found[name], RecordError)} == {"a", "b", "c"}


def test_a_unit_is_refused_where_the_file_says_another_one_or_has_timestamps(file):
    path = file(form("t/ms,vt", "0,1", "5,2"))
    with pytest.raises(RecordError, match="in ms as the file says, not in s"):
        read_text_table(path).instants(["t/ms"], "s")
    with pytest.raises(RecordError, match="is a timestamp, not a number of ms"):
        read_text_table(file(STAMPED)).instants(["Time"], "ms")


def test_a_place_is_the_line_also_behind_titles_blank_lines_and_comments(file):
    table = read_text_table(file(form("title", "", "t,vt", "0,1", "", "# note", "1,2", "2,3")))
    assert [table.place(row).rpartition(":")[2] for row in range(3)] == ["4", "7", "8"]


def test_a_sheet_of_a_file_without_sheets_is_refused(file):
    with pytest.raises(RecordError, match="'Data', is given, but only workbooks"):
        open_table(file(TWO), "Data")


def test_data_without_a_configuration_beside_it_is_text(file):
    table = open_table(file(TWO, "record.dat"))
    assert table.numbers(["vt"])["vt"].tolist() == [1.0, 1.01, 1.02, 1.03]


def test_no_digit_of_a_timestamp_is_lost(file):
    """A double of seconds since 1970 has steps of 0.24 us."""
    times = [f"2015-09-20 10:51:42.{at:09}" for at in (858_922_201, 858_922_202, 858_922_204)]
    path = file(form("t;vt", *(f"{time};1" for time in times)))
    assert read_text_table(path).instants(["t"]).tolist() == [0.0, 1e-9, 3e-9]


@pytest.mark.parametrize("digits", range(13))
def test_timestamps_of_any_number_of_digits_are_read(file, digits):
    fraction = "." + "0" * (digits - 1) + "1" if digits else ""
    path = file(form("t;vt", "10:51:42;1", f"10:51:43{fraction};2"))
    expected = 1.0 + (float(fraction) if digits else 0.0)
    assert read_text_table(path).instants(["t"]).tolist() == [
        0.0,
        pytest.approx(expected, abs=1e-14),
    ]


def test_a_clock_is_not_suggested_where_there_seems_to_be_none(file):
    table = read_text_table(file(form("vt,ifd", "1.0,2.0", "1.1,1.9", "0.9,2.1")))
    assert table.clock == ()


NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
DIALECTS = [
    (separator, mark)
    for separator in (",", ";", "\t", " ", "   ")
    for mark in (".", ",")
    if separator != mark
]


@given(
    rows=st.integers(1, 4).flatmap(
        lambda width: st.lists(
            st.lists(NUMBERS, min_size=width, max_size=width), min_size=1, max_size=8
        )
    ),
    dialect=st.sampled_from(DIALECTS),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
    units=st.booleans(),
    last=st.booleans(),
)
@example([[1.0]], (";", ","), "\n", "utf-8", False, True)
def test_numbers_written_in_any_dialect_are_read_back(
    tmp_path_factory, rows, dialect, end, encoding, units, last
):
    separator, mark = dialect
    names = ["t", *(f"Ü{at}" for at in range(len(rows[0])))]
    lines = [separator.join(names)]
    if units:
        lines.append(separator.join(["s", *["kV"] * len(rows[0])]))
    for at, row in enumerate(rows):
        lines.append(
            separator.join([str(at), *(repr(number).replace(".", mark) for number in row)])
        )
    path = tmp_path_factory.getbasetemp() / "written.csv"
    path.write_bytes((end.join(lines) + (end if last else "")).encode(encoding))
    table = read_text_table(path)
    assert table.names == tuple(names)
    assert table.units.get(names[-1]) == ("kV" if units else None)
    assert table.instants(["t"]).tolist() == list(range(len(rows)))
    columns = table.numbers(names[1:])
    assert np.array_equal(np.stack([*columns.values()], axis=1), np.array(rows))


@given(
    instants=st.lists(st.integers(0, 10**13), min_size=2, max_size=6, unique=True).map(sorted),
    day_first=st.booleans(),
    columns=st.booleans(),
)
def test_instants_written_as_timestamps_are_read_back(
    tmp_path_factory, instants, day_first, columns
):
    """In units of 100 ns, as recorders under Windows write them: eleven days of them."""
    lines = []
    for at in instants:
        stamp = np.datetime64("2015-09-20T10:51:42", "s") + np.timedelta64(at // 10**7, "s")
        date, clock = str(stamp).split("T")
        if day_first:
            date = ".".join(reversed(date.split("-")))
        lines.append(f"{date}{';' if columns else ' '}{clock},{at % 10**7:07};1,5")
    path = tmp_path_factory.getbasetemp() / "stamped.csv"
    heading = "Date;Time;U" if columns else "Time;U"
    path.write_text("\n".join([heading, *lines]))
    table = read_text_table(path)
    assert table.clock == (("Date", "Time") if columns else ("Time",))
    assert table.instants(table.clock).tolist() == [(at - instants[0]) / 10**7 for at in instants]


LETTERS = st.text(alphabet="0123456789.,;:-/ \t\n\r\"'#%eEnaTZ+[]kVst", max_size=80)


@example(data=b'",.0\n276.875387363.\n",6...-3;77')  # separators within a quoted cell
@example(data=b'--"\n4"Ee569\n76776E6;,315e23e;-0;-.-;"463e2E93862.e,\n\n')  # comments alone
@given(data=st.one_of(st.binary(max_size=80), LETTERS.map(str.encode)))
def test_random_bytes_are_read_or_refused(tmp_path_factory, data):
    path = tmp_path_factory.getbasetemp() / "random.csv"
    path.write_bytes(data)
    try:
        table = read_text_table(path)
    except RecordError:
        return
    assert {*table.clock} <= {*table.names}
    for name in table.names:
        with suppress(RecordError):
            table.numbers([name], frozenset({name}))
        with suppress(RecordError):
            table.instants([name])
        with suppress(RecordError):
            table.instants([name, table.names[-1]])


@given(
    text=st.sampled_from([TWO, GERMAN, STAMPED, TIMED]),
    at=st.integers(0, 120),
    cut=st.integers(0, 12),
    junk=LETTERS.map(lambda text: text[:8]),
)
def test_damaged_files_are_read_or_refused(tmp_path_factory, text, at, cut, junk):
    path = tmp_path_factory.getbasetemp() / "damaged_text.csv"
    path.write_bytes((text[:at] + junk + text[at + cut :]).encode())
    try:
        table = read_text_table(path)
        time = table.instants(table.clock or table.names[:1])
        vt = table.numbers(["vt"], frozenset({"vt"}))["vt"]
    except RecordError:
        return
    assert time.shape == vt.shape
    assert np.isfinite(time[1:] - time[0]).all() or not np.isfinite(time).all()


def test_windows_letters_beyond_latin_1_are_read(file):
    table = read_text_table(file("t;Preis €;U\n0;1;2\n1;2;3\n".encode("cp1252")))
    assert table.names == ("t", "Preis €", "U")


def test_a_jsis_file_has_its_names_above_the_types_and_its_units_below(tmp_path):
    path = tmp_path / "jsis.csv"
    path.write_text(
        "Time,GEN V,GEN VA,GEN F\nT,VMP,VAP,F\nsec,KV,DEG,Hz\nTime,voltage,angle,frequency\n"
        "0.0,18.0,10.0,60.0\n0.1,18.1,11.0,60.0\n"
    )
    table = open_table(path)
    assert table.names == ("Time", "GEN V", "GEN VA", "GEN F")
    assert dict(table.units) == {"Time": "sec", "GEN V": "KV", "GEN VA": "DEG", "GEN F": "Hz"}
    assert [*table.numbers(["GEN V"])["GEN V"]] == [18.0, 18.1]
