"""Ratings of units from power flow files: each is an answer that a case then does not ask for."""

import csv
from pathlib import Path

import numpy as np
import pytest
import yaml
from dynamics import THREE
from pmu_records import F0, KV, MVA, degrees, phasors_of, smooth_course, stamps, write_table
from power_flow_files import HIGH_KV, SBASE, X, power_flow

from exfit.case.load import load_case
from exfit.errors import DynamicsError
from exfit.features.planner.power_flow import read_buses, read_power_flow
from exfit.features.planner.psse import record_text
from exfit.features.planner.records import definition_of
from exfit.models.sheet import typical


@pytest.fixture(autouse=True)
def workplace(empty_folder):
    """Work in a folder with a file of three units."""
    Path("units.dyr").write_text(THREE)
    Path("records").mkdir()
    return empty_folder


def event(
    kv=KV, angle="V Angle (deg)", power=True, frequency="Freq (Hz)", name="9_1.csv", share=1.0
):
    """Write the record of a swing of the unit at bus 9, its voltage at a side with this kV.

    Q moves by a share of its swing, with noise.
    """
    course = smooth_course()
    noise = 1e-5 * np.random.default_rng(9).standard_normal(len(course.time))
    course = course.with_(q=course.q[0] + share * (course.q - course.q[0]) + noise)
    voltage, current = phasors_of(course, kv)
    columns = {
        "Time (UTC)": stamps(course.time),
        "V Mag (kV)": np.abs(voltage),
        angle: degrees(voltage),
        "I Mag (A)": np.abs(current),
        "I Angle (deg)": degrees(current),
    }
    columns |= {frequency: course.frequency} if frequency else {}
    columns |= {"Gen P (MW)": course.p * MVA, "Gen Q (Mvar)": course.q * MVA} if power else {}
    write_table(Path("records", name), columns)


def imported(run, *options, records="records"):
    ran = run("import", "--all", "units.dyr", "-o", "cases", "--records", records, *options,
              "--force")  # fmt: skip
    assert ran.code == 0, ran.err
    return Path("cases", "bus-9-1.yaml")


@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize("version", [32, 33, 34, 35, 36])
def test_each_version_gives_the_ratings_of_its_machines(version, named):
    for cz in (1, 2):
        text = power_flow(version, cz=cz, named=named)
        Path("net.raw").write_text(text)
        ratings = read_power_flow(Path("net.raw"))
        assert [*ratings] == [(1, "1"), (9, "1")]
        for own in ratings.values():
            assert (own.kv, own.mva, own.f0) == (KV, MVA, F0)  # X has six decimals
            r = 0.002 * MVA / (SBASE if cz == 1 else 50.0)
            assert own.step_up == pytest.approx((r, X, HIGH_KV), rel=1e-4)
    Path("net.raw").write_text(power_flow(version, named=named, own_x=0.12))
    assert {own.step_up for own in read_power_flow(Path("net.raw")).values()} == {(0.0, 0.12, None)}
    with_tap = power_flow(version, named=named, own_x=0.12).replace("0.12,1.0,", "0.12,1.05,", 1)
    Path("net.raw").write_text(with_tap)
    assert [*read_power_flow(Path("net.raw"))] == [(9, "1")]


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (", 33,", ", 31,", "net.raw:1: REV: 31 lies outside 32 ... 36"),
        ("100.0, 33", "1oo, 33", "net.raw:1: SBASE: '1oo' is not a number"),
        ("120.000", "12O.000", "net.raw:11: MBASE: '12O.000' is not a number"),
        ("18.0000", "x", "net.raw:4: BASKV: 'x' is not a number"),
    ],
)
def test_all_faults_of_a_file_are_named_with_line_value_and_limit(old, new, says):
    text = power_flow()
    assert old in text
    Path("net.raw").write_text(text.replace(old, new))
    with pytest.raises(DynamicsError) as raised:
        read_power_flow(Path("net.raw"))
    assert says in str(raised.value)
    assert len(str(raised.value).splitlines()) == text.count(old)


@pytest.mark.parametrize("number", ["1" * 5000, "\N{SUPERSCRIPT TWO}"])
def test_a_bus_whose_number_is_none_has_no_name(number):
    text = power_flow(34)
    line = next(each for each in text.splitlines() if each.lstrip().startswith("9,"))
    Path("net.raw").write_text(text.replace(line, line.replace("9,", f"{number},", 1)), "utf-8")
    assert [*read_buses(Path("net.raw"))] == [1, 900]


def test_a_heading_may_end_before_the_frequency():
    Path("net.raw").write_text(power_flow().replace(", 0, 0, 60.00", ""))
    assert {own.f0 for own in read_power_flow(Path("net.raw")).values()} == {None}


def test_a_power_flow_file_names_the_buses_of_a_dyr_file(run):
    Path("net.raw").write_text(power_flow(34))
    Path("named.dyr").write_text(THREE.replace("9 GENROU", "'UNIT 9' GENROU"))
    alone = run("import", "named.dyr", "--bus", "unit 9", "--raw", "net.raw", "-o", "nine.yaml")
    assert alone.code == 0, alone.err
    assert "# Unit 1 at bus 9 UNIT 9 of named.dyr" in Path("nine.yaml").read_text()
    ran = run("import", "--all", "named.dyr", "-o", "cases", "--raw", "net.raw")
    assert ran.code == 0, ran.err
    assert load_case(Path("cases", "bus-9-1.yaml")).as_found.bus == 9
    with Path("cases", "units.csv").open(newline="") as file:
        assert [row["name"] for row in csv.DictReader(file)] == ["UNIT 1", "UNIT 1", "UNIT 9"]
    assert run("import", "named.dyr", "--bus", "9").code == 1


def test_the_rating_of_a_turbine_becomes_its_share_of_the_machine_s_base(run):
    definition = definition_of("GGOV1")
    record = record_text(definition, {**typical(definition.model.sheet), "Trate": 90.0}, 9, "1")
    Path("units.dyr").write_text(f"{THREE}{record}\n")
    Path("net.raw").write_text(power_flow())
    event()
    alone = run("import", "units.dyr", "--bus", 9, "--raw", "net.raw", "-o", "nine.yaml")
    assert alone.code == 0, alone.err
    for path in (Path("nine.yaml"), imported(run, "--raw", "net.raw")):
        assert load_case(path).values()["governor.Trate_Mbase"] == 90.0 / MVA
        assert "Trate_Mbase in the case" not in path.read_text()


@pytest.mark.parametrize("power", [True, False])
def test_no_value_is_open_in_a_case_that_a_power_flow_file_answers(run, power):
    event(power=power)
    assert '"?"' in imported(run).read_text()
    Path("net.raw").write_text(power_flow())
    path = imported(run, "--raw", "net.raw")
    assert '"?"' not in path.read_text()
    case = load_case(path)
    phasors = case.recordings[0].record.phasors
    assert (phasors.kV, phasors.voltage.connection) == (KV, "phase-to-ground")
    assert case.plant.network["X"] == 0.0
    assert case.plant.network["f0"] == F0


def test_a_voltage_that_was_recorded_behind_the_transformer_has_its_reactance_and_kv(run):
    event(HIGH_KV)
    Path("net.raw").write_text(power_flow(35))
    case = load_case(imported(run, "--raw", "net.raw"))
    assert case.recordings[0].record.phasors.kV == HIGH_KV
    assert case.plant.network["X"] == pytest.approx(X, rel=1e-5)
    assert case.plant.network["R"] == pytest.approx(0.002 * MVA / SBASE, rel=1e-5)
    assert not {"R", "X"} & case.plant.sources.keys()


@pytest.mark.parametrize(
    ("cw", "taps"),
    [
        (1, ("1.05,0.0", "0.98,0.0")),
        (2, (f"{1.05 * HIGH_KV},0.0", f"{0.98 * KV},0.0")),
        (3, (f"1.0,{1.05 * HIGH_KV}", f"1.0,{0.98 * KV}")),
    ],
)
def test_taps_of_the_transformer_change_its_reactance_and_the_kv_behind_it(run, cw, taps):
    """V_low = t_low^2 Z I + (t_low / t_high) V_high, for taps per unit of each side."""
    event(HIGH_KV)
    Path("net.raw").write_text(power_flow(cw=cw, taps=taps))
    case = load_case(imported(run, "--raw", "net.raw"))
    kV = case.recordings[0].record.phasors.kV
    assert kV == pytest.approx(HIGH_KV * 1.05 / 0.98, rel=1e-5)
    assert case.plant.network["X"] == pytest.approx(0.98**2 * X, rel=1e-5)


def test_a_tap_of_zero_is_a_fault_with_its_line(run):
    event(HIGH_KV)
    Path("net.raw").write_text(power_flow(taps=("0.0,0.0", "1.0,0.0")))
    ran = run("import", "--all", "units.dyr", "-o", "cases", "--raw", "net.raw")
    assert ran.code == 1
    assert "WINDV: 0 is not above 0" in ran.err


@pytest.mark.parametrize("version", [33, 35])
def test_the_resistance_of_the_stator_is_that_of_the_power_flow_file(run, version):
    event()
    Path("net.raw").write_text(power_flow(version, ra=0.003))
    network = load_case(imported(run, "--raw", "net.raw")).plant.network
    assert network["Ra"] == 0.003


def test_options_answer_what_they_name(run):
    event(angle="V Angle", frequency="")
    path = imported(run, "--kv", KV, "--mva", MVA, "--connection", "phase-to-ground",
                    "--angle-unit", "deg")  # fmt: skip
    content = path.read_text()
    phasors = yaml.safe_load(content)["record"]["phasors"]
    assert phasors["kV"] == KV
    assert phasors["voltage"]["connection"] == "phase-to-ground"
    assert phasors["voltage"]["angle_unit"] == "deg"
    assert content.count('"?"') == 1  # the frequency, which nothing states
    assert yaml.safe_load(content)["plant"]["network"]["f0"] == "?"


def test_columns_of_a_table_count_more_than_a_power_flow_file_and_options(run):
    event()
    Path("net.raw").write_text(power_flow(kv=17.5, mva=110.0))
    Path("records", "table.csv").write_text(
        "bus,id,file,kV,MVA,raw,channel.p,channel.q\n"
        f"9,1,9_1.csv,{KV},,../net.raw,Gen P (MW),Gen Q (Mvar) [Mvar]\n"
    )
    path = imported(run, "--mva", MVA, records="records/table.csv")
    assert '"?"' not in path.read_text()
    record = load_case(path).recordings[0].record
    assert record.phasors.kV == KV
    assert record.phasors.MVA == MVA
    assert (record.channels["p"].column, record.channels["p"].base) == ("Gen P (MW)", MVA)


@pytest.mark.parametrize(
    ("validates", "fitted"),
    [(("", "", ""), ["event1", "event3"]), (("yes", "no", "no"), ["event2", "event3"])],
)
def test_a_table_may_list_several_events_of_a_unit(run, validates, fitted):
    Path("net.raw").write_text(power_flow())
    rows = ["bus,id,file" + (",validates" if any(validates) else "")]
    for name, word in zip(("a.csv", "b.csv", "c.csv"), validates, strict=True):
        event(name=name)
        rows.append(f"9,1,{name}" + (f",{word}" if any(validates) else ""))
    Path("records", "table.csv").write_text("\n".join(rows))
    case = load_case(imported(run, "--raw", "net.raw", records="records/table.csv"))
    assert [recording.name for recording in case.recordings] == fitted
    assert len(case.validations) == 3 - len(fitted)


@pytest.mark.parametrize(
    ("shares", "validating"), [((0.3, 1.0), "9_1.csv"), ((1.0, 0.3), "9_1-b.csv")]
)
def test_of_two_events_the_one_in_which_q_moves_less_validates(run, shares, validating):
    for name, share in zip(("9_1.csv", "9_1-b.csv"), shares, strict=True):
        event(name=name, share=share)
    case = load_case(imported(run, "--kv", KV, "--mva", MVA))
    assert [Path(each.record.file).name for each in case.validations] == [validating]


def test_an_instant_of_an_event_and_an_event_twice_are_refused(run):
    event(name="a.csv")
    Path("records", "table.csv").write_text(
        "bus,id,file,at,step\n9,1,a.csv,2.0,\n9,1,a.csv,,0.05\n"
    )
    ran = run("import", "--all", "units.dyr", "-o", "cases", "--records", "records/table.csv")
    assert ran.code == 1
    for text in ("table.csv:2: at: 2: not allowed: records/a.csv shows a grid event",
                 "table.csv:3: step: 0.05: not allowed", "table.csv:3: file: "):  # fmt: skip
        assert text in ran.err


def test_all_faults_of_ratings_in_a_table_are_named_together(run):
    event()
    Path("records", "table.csv").write_text(
        "bus,id,file,kV,MVA,connection,angle unit,channel.x\n9,1,9_1.csv,-1,x,star,degree,a\n"
    )
    ran = run("import", "--all", "units.dyr", "-o", "cases", "--records", "records/table.csv")
    assert ran.code == 1
    for word in ("kv: -1 is not above 0", "mva: 'x' is not a number", "connection: 'star'",
                 "angle unit: 'degree'", "channel.x: no signal"):  # fmt: skip
        assert f"table.csv:2: {word}" in ran.err


def test_a_channel_that_the_record_does_not_have_is_named(run):
    event()
    ran = run("import", "--all", "units.dyr", "-o", "cases", "--records", "records", "--channel",
              "efd=Field [V]", "--channel", "ifd=Other")  # fmt: skip
    assert ran.code == 1
    assert "efd: Field [V]: no column with a unit of records/9_1.csv" in ran.err
    assert "ifd: Other: no column" in ran.err


@pytest.mark.parametrize("values", ["0.015 0.08", "0.0 -0.05"])
def test_a_load_compensation_is_that_of_the_network(run, values):
    event()
    Path("net.raw").write_text(power_flow(33))
    with Path("units.dyr").open("a") as file:
        file.write(f"\n9 'IEEEVC' 1 {values} /\n")
    network = load_case(imported(run, "--raw", "net.raw")).plant.network
    assert [network["Rc"], network["Xc"]] == [*map(float, values.split())]


def test_a_file_of_pslf_answers_kv_and_mva_itself(run):
    from loose_dyd import PSLF_UNIT

    event()
    Path("records", "9_1.csv").rename(Path("records", "1_1.csv"))
    text = PSLF_UNIT.replace("0.12 0.4 0.0", "0.12 0.4 0.004")
    Path("units.dyd").write_text(text)
    ran = run("import", "--all", "units.dyd", "-o", "cases", "--records", "records")
    assert ran.code == 0, ran.err
    text = Path("cases", "bus-1-1.yaml").read_text()
    assert '"?"' not in text
    content = yaml.safe_load(text)
    assert content["record"]["phasors"]["kV"] == KV
    assert content["plant"]["network"]["Ra"] == 0.004
