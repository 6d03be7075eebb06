"""A case with another exciter: the same tests and records, and a case that loads."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from places import ROOT

from exfit.case.load import parse_case
from exfit.features.translate.files import responses_table, translated_case
from exfit.features.translate.result import TranslatedParameter
from exfit.models import MODELS
from exfit.models.sheet import typical

CASE = ROOT / "configs" / "ac1a_typical.yaml"
EXAC1 = MODELS["EXAC1"]
VALUES = typical(EXAC1.sheet) | {"KA": 333.0, "TF": 0.0123}
SOURCES = {"KC": "not stated", "KD": "without effect"}
PLANT = {"type": "open-circuit", "machine": "GENROU", "parameters": {"Tpd0": 6.5, "Xd": 1.7}}


def translated(text, case=CASE, folder=ROOT / "configs", **values):
    own = VALUES | values
    entries = {
        row.symbol: TranslatedParameter(
            value=own[row.symbol],
            unit=row.unit,
            meaning=row.meaning,
            origin="copied",
            source="AC1A",
            of={row.symbol: "fitted"},
            value_source=SOURCES.get(row.symbol, "fitted"),
        )
        for row in EXAC1.sheet
    }
    return translated_case(text, case, folder, ("EXAC1", EXAC1), entries, PLANT, "AC1A\nas EXAC1")


def test_it_is_the_case_with_another_exciter():
    text = translated(CASE.read_text(encoding="utf-8"))
    case = parse_case(text, CASE)
    before = parse_case(CASE.read_text(encoding="utf-8"), CASE)
    assert case.model == "EXAC1"
    assert (case.plant, case.test, case.record) == (before.plant, before.test, before.record)
    assert (case.validations, case.estimate) == (before.validations, before.estimate)
    assert {name: case.values()[name] for name in VALUES} == VALUES
    assert [*case.free()] == [row.symbol for row in EXAC1.sheet if row.free]
    assert text.startswith("# AC1A\n# as EXAC1\nmodel: EXAC1\n")
    assert "regulator gain; translated from AC1A: KA (fitted)" in text
    assert {name: case.sources()[name] for name in ("KA", "TR", "KC", "KD")} == {
        "KA": "fitted", "TR": "fitted", "KC": "not stated", "KD": "not stated"
    }  # fmt: skip


def test_its_records_are_named_from_its_own_folder(tmp_path):
    case = parse_case(translated(CASE.read_text(encoding="utf-8"), folder=tmp_path), tmp_path / "c")
    files = [case.record.file, case.validations[0].record.file]
    names = ["ac1a_up.csv", "ac1a_down.csv"]
    assert [(tmp_path / file).resolve() for file in files] == [
        (ROOT / "sample_data" / name).resolve() for name in names
    ]


def test_what_was_found_of_the_machine_is_where_its_fit_starts():
    content = yaml.safe_load(CASE.read_text(encoding="utf-8"))
    content["plant"]["free"] = {"Tpd0": {"start": 5.0, "min": 1.0, "max": 20.0}}
    del content["plant"]["parameters"]["Tpd0"]
    content["plant"]["parameters"]["Xd"] = "=6 * machine.Xpd"
    case = parse_case(translated(yaml.safe_dump(content)), CASE)
    assert case.free()["machine.Tpd0"].start == 6.5
    assert case.values()["machine.Xd"] == 1.7
    assert case.sources()["machine.Tpd0"] == "fitted"


def test_a_gain_of_zero_stays_fixed():
    case = parse_case(translated(CASE.read_text(encoding="utf-8"), KF=0.0), CASE)
    assert "KF" not in case.free()
    assert case.values()["KF"] == 0.0


def test_a_value_that_is_not_physical_can_be_fitted_again():
    case = parse_case(translated(CASE.read_text(encoding="utf-8"), KD=-0.1), CASE)
    free = case.free()["KD"]
    assert (free.start, free.min, free.max) == (-0.1, -1.0, pytest.approx(-0.01))


def test_without_a_case_file_it_is_a_case_to_simulate():
    case = parse_case(translated(""), Path("made.yaml"))
    assert case.record is None
    assert case.values()["machine.Tpd0"] == 6.5
    assert case.test.duration == 10.0


def test_responses_of_two_models_of_one_name_stand_beside_each_other():
    signals = {"vt": np.ones(3), "efd": np.full(3, 2.0)}
    others = {name: 2.0 * samples for name, samples in signals.items()}
    step = SimpleNamespace(label="+1 % open circuit", source=signals, target=others)
    both = SimpleNamespace(source="DC1A", target="DC1A", time=np.arange(3.0), steps=[step])
    head, first, *_ = responses_table(both).splitlines()
    names = [f"{name} DC1A {step.label}" for name in ("vt", "efd")]
    assert head.split(",") == ["t", *names, *names]
    assert [*map(float, first.split(","))] == [0.0, 1.0, 2.0, 2.0, 4.0]
