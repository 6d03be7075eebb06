"""Where values come from: what a case states, what is typical, and what contradicts that."""

import pytest
import yaml
from places import ROOT

from exfit.case.case import Case
from exfit.case.json_schema import json_schema
from exfit.errors import CaseError
from exfit.util.vocabulary import LEAST_CERTAIN_FIRST, NOT_STATED, SOURCES, least_certain

NETWORK = {"f0": 60, "X": 0.3, "P": 0.5, "Q": 0.1}
CONTENT = {
    "model": "AC1A",
    "plant": {
        "type": "infinite-bus",
        "machine": "GENROU",
        "parameters": {"Tpd0": 6.0, "Xd": 1.8, "S10": 0.1, "S12": 0.4, "Xq": "=0.95*machine.Xd"},
        "free": {"H": {"start": 3.0, "min": 1.0, "max": 9.0}},
        "network": NETWORK,
        "sources": {"Tpd0": "nameplate", "S10": "measured", "X": "test report", "H": "typical"},
    },
    "stabiliser": {
        "model": "STAB1",
        "parameters": {"K_T": 10.0, "T3": 0.1},
        "sources": {"K_T": "maker"},
    },
    "test": {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}], "duration": 3.0},
    "parameters": {
        "fixed": {
            "KE": 1.0, "VRMAX": 14.0, "VRMIN": "=-VRMAX", "TE": "=0.9*TE0", "TE0": 1.0,
            "KF": "=KA/1e4", "TF": "=TE+KC",
        },
        "free": {"KA": {"start": 400, "min": 10, "max": 5000}},
        "sources": {"VRMAX": "typical", "TE0": "fitted", "KE": "measured"},
    },
}  # fmt: skip


def changed(**sections):
    return {**CONTENT, **{key: {**CONTENT[key], **value} for key, value in sections.items()}}


def test_every_value_has_a_source():
    case = Case.from_dict(CONTENT)
    sources = case.sources()
    assert sources.keys() == case.values().keys()
    assert {*sources.values()} <= {*SOURCES, NOT_STATED}
    stated = {
        "machine.Tpd0": "nameplate", "machine.S10": "measured", "machine.H": "typical",
        "network.X": "test report", "stabiliser.K_T": "maker", "VRMAX": "typical",
        "TE0": "fitted", "KE": "measured",
    }  # fmt: skip
    assert {name: sources[name] for name in stated} == stated
    for given in ("machine.Xd", "network.P", "stabiliser.T3", "KA"):
        assert sources[given] == NOT_STATED
    for left_out in ("machine.Tppd0", "network.Rc", "stabiliser.T4", "KC", "SE1"):
        assert sources[left_out] == "typical"


def test_what_follows_others_is_as_certain_as_the_least_certain_of_them():
    sources = Case.from_dict(CONTENT).sources()
    assert sources["VRMIN"] == sources["VRMAX"] == "typical"
    assert sources["TE"] == sources["TE0"] == "fitted"
    assert sources["TF"] == sources["KC"] == "typical"
    assert sources["machine.Xq"] == NOT_STATED
    assert {*LEAST_CERTAIN_FIRST} == {*SOURCES, NOT_STATED}
    for k, word in enumerate(LEAST_CERTAIN_FIRST):
        assert least_certain(reversed(LEAST_CERTAIN_FIRST[k:])) == word
    assert least_certain([]) == NOT_STATED


def test_a_fitted_value_passes_its_source_on():
    case = Case.from_dict(CONTENT)
    assert case.sources()["KF"] == NOT_STATED
    sources = case.sources(fitted=["KA", "machine.H"])
    assert sources["KA"] == sources["KF"] == sources["machine.H"] == "fitted"


def test_typical_are_the_values_that_neither_a_fit_nor_another_value_gives():
    typical = Case.from_dict(CONTENT).typical()
    assert {"VRMAX", "KC", "machine.Tppd0", "network.Rc"} <= {*typical}
    assert not {"VRMIN", "TF", "machine.H", "KA", "KE", "machine.Xd"} & {*typical}


def test_a_record_with_a_network_of_its_own_states_its_sources():
    of_record = {"type": "infinite-bus", "network": NETWORK, "sources": {"X": "measured"}}
    content = {key: value for key, value in CONTENT.items() if key != "test"}
    record = {"file": "none.csv", "time": "t", "channels": {"vt": "vt"}}
    test = {key: value for key, value in CONTENT["test"].items() if key != "duration"}
    content["records"] = [{"name": "one", "test": test, "record": record}]
    content["records"][0]["plant"] = of_record
    case = Case.from_dict(content)
    view = case.seen_from(case.records[0]).sources()
    assert view["network.X"] == "measured"
    assert view["machine.Tpd0"] == "nameplate"
    of_record["sources"] = {"Y": "measured", "Rc": "maker"}
    with pytest.raises(CaseError) as caught:
        Case.from_dict(content)
    assert [fault.split(": ")[1] for fault in str(caught.value).splitlines()] == [
        "records[0].plant.sources.Y", "records[0].plant.sources.Rc"
    ]  # fmt: skip


def test_all_faults_of_sources_are_reported_together():
    plant = {"Tpd0": "plate", "Xl": "maker", "Xq": "maker", "Xpp": "maker", "Rc": "maker"}
    exciter = {"VRMIN": "maker", "KC": "maker", "KFF": "maker", "KE": 3}
    with pytest.raises(CaseError) as caught:
        Case.from_dict(changed(plant={"sources": plant}, parameters={"sources": exciter}))
    faults = dict(line.split(": ", 2)[1:] for line in str(caught.value).splitlines())
    assert faults == {
        "plant.sources.Tpd0": "'plate' is not possible; did you mean nameplate?",
        "plant.sources.Xl": "source of a value that the case does not give: it is typical",
        "plant.sources.Xq": "follows others by =0.95*machine.Xd: give no source",
        "plant.sources.Xpp": "not given; did you mean Xppd?",
        "plant.sources.Rc": "source of a value that the case does not give: it is typical",
        "parameters.sources.VRMIN": "follows others by =-VRMAX: give no source",
        "parameters.sources.KC": "source of a value that the case does not give: it is typical",
        "parameters.sources.KFF": "not given; did you mean KF?",
        "parameters.sources.KE": f"3 is not possible; known: {', '.join(SOURCES)}",
    }


def test_standard_errors_are_those_of_given_values():
    errors = {
        "plant": {"Tpd0": 0.1, "S10": 0.004, "X": 0.01},
        "parameters": {"VRMAX": 0.2, "TE0": 0.1},
    }
    errors["stabiliser"] = {"K_T": 0.5}
    case = Case.from_dict(changed(**{key: {"std_errors": own} for key, own in errors.items()}))
    assert case.std_errors() == {
        "machine.Tpd0": 0.1, "machine.S10": 0.004, "network.X": 0.01, "VRMAX": 0.2, "TE0": 0.1,
        "stabiliser.K_T": 0.5,
    }  # fmt: skip
    other = case.with_values({"machine.Tpd0": 6.5, "VRMAX": 14.0}, "file").std_errors()
    assert "machine.Tpd0" not in other  # another value, of whose error nothing is said
    assert other["VRMAX"] == 0.2  # the same value


def test_all_faults_of_standard_errors_are_reported_together():
    plant = {"Tpd0": -0.1, "Xl": 0.01, "Xq": 0.1, "Xpp": 0.1, "H": 0.2, "Xd": "5 %"}
    exciter = {"VRMIN": 0.1, "KC": 0.1, "KFF": 0.1, "KA": 5.0}
    with pytest.raises(CaseError) as caught:
        Case.from_dict(changed(plant={"std_errors": plant}, parameters={"std_errors": exciter}))
    faults = dict(line.split(": ", 2)[1:] for line in str(caught.value).splitlines())
    assert faults == {
        "plant.std_errors.Tpd0": "-0.1 is below 0",
        "plant.std_errors.Xl": "standard error of a value that the case does not give",
        "plant.std_errors.Xq": "follows others by =0.95*machine.Xd: give no error",
        "plant.std_errors.Xpp": "not given; did you mean Xppd?",
        "plant.std_errors.H": "is free: the fit finds its standard error; see prior",
        "plant.std_errors.Xd": "'5 %' is not a number",
        "parameters.std_errors.VRMIN": "follows others by =-VRMAX: give no error",
        "parameters.std_errors.KC": "standard error of a value that the case does not give",
        "parameters.std_errors.KFF": "not given; did you mean KF?",
        "parameters.std_errors.KA": "is free: the fit finds its standard error; see prior",
    }


def test_values_given_beside_the_case_bring_their_sources():
    case = Case.from_dict(CONTENT)
    values = {"KE": 1.0, "KC": 0.3, "machine.Tpd0": 6.5, "VRMAX": 14.0}
    given = case.with_values(values, "file", {"KC": "fitted", "VRMAX": "nameplate"}).sources()
    assert given["KC"] == given["TF"] == "fitted"
    assert given["VRMAX"] == given["VRMIN"] == "nameplate"
    assert given["machine.Tpd0"] == NOT_STATED  # another value than that of the nameplate
    assert given["KE"] == "measured"  # the value of the case, of which no one says more


def test_the_schema_offers_the_words():
    sections = json_schema()["$defs"]
    for section in ("Parameters", "OpenCircuit", "InfiniteBus", "MachinePlayback", "Stabiliser"):
        stated = sections[section]["properties"]["sources"]
        assert stated["additionalProperties"]["enum"] == list(SOURCES)
    assert sections["StatedNumber"]["properties"]["source"]["enum"] == list(SOURCES)


def test_the_sources_of_a_case_file_are_read(tmp_path):
    from exfit.case.load import load_case

    content = yaml.safe_load((ROOT / "configs" / "ac1a_typical.yaml").read_text())
    content["plant"]["sources"] = {"Tpd0": "test report"}
    content["record"]["file"] = str(ROOT / "sample_data" / "ac1a_up.csv")
    content.pop("validate", None)
    (tmp_path / "case.yaml").write_text(yaml.safe_dump(content))
    assert load_case(tmp_path / "case.yaml").sources()["machine.Tpd0"] == "test report"


BESIDE = {
    "plant": {
        **CONTENT["plant"],
        "parameters": {
            "Tpd0": {"value": 6.0, "source": "nameplate", "std_error": "2 %"},
            "Xd": {"value": 1.8, "std_error": 0},
            "S10": {"value": 0.1, "source": "measured"}, "S12": 0.4, "Xq": "=0.95*machine.Xd",
        },
        "free": {"H": {"start": 3.0, "min": 1.0, "max": 9.0, "source": "typical"}},
        "network": {**NETWORK, "X": {"value": 0.3, "source": "test report"}},
    },
    "stabiliser": {
        "model": "STAB1", "parameters": {"K_T": {"value": 10.0, "source": "maker"}, "T3": 0.1}
    },
}  # fmt: skip


def beside(**sections):
    """Return the content with what is stated of the plant and the stabiliser at their values."""
    own = {
        key: {name: value for name, value in section.items() if name != "sources"}
        for key, section in BESIDE.items()
    }
    return {**CONTENT, **own, **sections}


def faults_of(content):
    with pytest.raises(CaseError) as caught:
        Case.from_dict(content)
    return dict(line.split(": ", 2)[1:] for line in str(caught.value).splitlines())


def test_a_case_is_the_same_whether_sources_stand_beside_values_or_by_name():
    by_name = Case.from_dict(changed(plant={"std_errors": {"Tpd0": 0.12, "Xd": 0}}))
    assert Case.from_dict(beside()) == by_name
    assert by_name.std_errors() == {"machine.Tpd0": 0.12}
    assert by_name.exact() == ("machine.Xd",)
    assert by_name.with_values({"machine.Xd": 1.9}, "file").exact() == ()


def test_all_faults_of_values_with_sources_are_reported_where_they_stand():
    fixed = {
        "KE": {"value": 1.0, "source": "guessed"},
        "VRMAX": {"value": 14.0, "std_error": -1.0},
        "VRMIN": {"value": "=-VRMAX", "source": "maker"},
        "TA": {"source": "maker"},
        "TB": {"value": 1.0, "soruce": "maker"},
        "TC": {"value": 0.0, "std_error": "5 %"},
        "KC": {"value": 1e9, "source": "maker"},
        "KF": {"value": 0.03, "std_error": "much"},
        "KFF": {"value": 1.0, "source": "maker"},
        "TF": {"start": 1.0},
    }
    assert faults_of(beside(parameters={"fixed": fixed})) == {
        "parameters.fixed.KE.source": "'guessed' is not possible; known: " + ", ".join(SOURCES),
        "parameters.fixed.VRMAX.std_error": "-1 is below 0",
        "parameters.fixed.VRMIN.value": "follows others by =-VRMAX: give neither source nor error",
        "parameters.fixed.VRMIN.source": "follows others by =-VRMAX: give no source",
        "parameters.fixed.TA.value": "is missing",
        "parameters.fixed.TB.soruce": "unknown key; did you mean source?",
        "parameters.fixed.TC.std_error": "a share of value = 0 is 0: give a number",
        "parameters.fixed.KC": "1000000000 lies outside 0 ... 100 pu, its data sheet's range",
        "parameters.fixed.KF.std_error": "'much' is neither a number nor a percentage such as 20 %",
        "parameters.fixed.KFF": "not a parameter of AC1A; did you mean KF?",
        "parameters.fixed.TF.value": "is missing",
        "parameters.fixed.TF.start": "unknown key; known: value, source, std_error",
    }


def test_what_is_stated_twice_of_a_value_is_refused_with_both_places():
    content = beside()
    content["plant"] = {**content["plant"], "sources": {"Tpd0": "maker", "X": "measured"}}
    assert faults_of(content) == {
        "plant.sources.Tpd0": "plant.parameters.Tpd0 states it as well: leave this one out",
        "plant.sources.X": "plant.network.X states it as well: leave this one out",
    }


def test_the_network_of_a_record_has_sources_and_no_standard_errors():
    network = {**NETWORK, "X": {"value": 0.3, "source": "measured", "std_error": 0.1}}
    content = {key: value for key, value in beside().items() if key != "test"}
    record = {"file": "none.csv", "time": "t", "channels": {"vt": "vt"}}
    test = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}]}
    own = {"type": "infinite-bus", "network": network}
    content["records"] = [{"name": "one", "test": test, "record": record, "plant": own}]
    faults = faults_of(content)
    assert [*faults] == ["records[0].plant.network.X.std_error"]
    del network["X"]["std_error"]
    case = Case.from_dict(content)
    assert case.seen_from(case.records[0]).sources()["network.X"] == "measured"


def test_a_fault_has_the_line_of_its_value(tmp_path):
    from exfit.case.load import parse_case

    text = (ROOT / "configs" / "models" / "sexs.yaml").read_text()
    text += "stabiliser:\n  model: STAB1\n  parameters:\n    K_T: {value: 5.0, std_error: x}\n"
    line = len(text.splitlines())
    with pytest.raises(CaseError, match=rf":{line}: stabiliser.parameters.K_T.std_error: 'x'"):
        parse_case(text, tmp_path / "case.yaml")
