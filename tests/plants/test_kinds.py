"""The table of plants, and that whoever uses it covers every kind."""

import ast
from pathlib import Path

import pytest
from pydantic import TypeAdapter
from sources import ROOT, nodes

from exfit.case import schema
from exfit.models import GOVERNORS, MODELS
from exfit.models.machines import MACHINES
from exfit.plants import EVENTS, KINDS, SATURATION, Equipment
from exfit.registry import parts
from exfit.signals import RECORDED, SIGNALS

EQUIPMENT = Equipment(
    MODELS["AC8B"],
    MACHINES["GENROU"],
    SATURATION["quadratic"],
    recorded=frozenset(RECORDED),
    given=frozenset({"Q", "vref"}),
    governor=GOVERNORS["TGOV1"],
)


@pytest.fixture(params=KINDS)
def kind(request):
    return KINDS[request.param]


def sections():
    """Return the sections of the schema for a plant, by the names that they allow."""
    choices = TypeAdapter(schema.CaseDocument).json_schema()["$defs"]
    return {
        part["properties"]["type"]["const"]: name
        for name, part in choices.items()
        if "const" in part.get("properties", {}).get("type", {})
    }


def test_each_kind_has_a_section_of_the_schema_and_each_section_a_kind():
    assert sections().keys() == KINDS.keys()


def test_what_a_test_may_change_has_a_key_there(kind):
    assert {*kind.events} <= schema.BumpTest.model_fields.keys()


def test_a_kind_is_built_of_what_it_needs_and_shows_its_signals(kind):
    equipment = EQUIPMENT._replace(
        exciter=EQUIPMENT.exciter if kind.has_exciter else None,
        machine=EQUIPMENT.machine if kind.has_machine else None,
        inputs=tuple(event for event in (*kind.events, *kind.driving) if event in SIGNALS),
    )
    system = kind.build(equipment)
    assert {*kind.compared} <= {*system.outputs}
    # of these one is recorded, and any of them turns the angle
    assert {*kind.driving} - {*kind.required_one_of} <= {*system.inputs}


def test_a_record_may_hold_what_drives_and_what_is_compared(kind):
    assert {*kind.driving, *kind.required, *kind.levels} <= {*kind.signals} <= {*RECORDED}
    assert kind.compared
    assert {*kind.required_if_used} <= {*kind.driving}


PLUGS = ("PLANTS", "PROGRAMS")  # by the names of plants


def test_no_room_but_that_of_the_plants_and_the_schema_knows_a_plant_by_its_name():
    names = KINDS.keys() - {"none"}  # which is a word of other things too
    knowing = {
        path.relative_to(ROOT).as_posix()
        for path, node in nodes(lambda text: any(f'"{name}"' in text for name in names))
        if isinstance(node, ast.Constant) and node.value in names
    }
    of_features = {
        str(Path(*path.partition(":")[0].split(".")[1:-1]))
        for path in (part.path for plug in PLUGS for part in parts(plug).values())
    }
    rest = {path for path in knowing if not path.startswith(("plants/", *of_features))}
    assert rest == {"case/schema/plants.py"}


def test_all_events_are_those_of_some_kind():
    assert {*EVENTS} == {event for kind in KINDS.values() for event in kind.events}


def test_a_kind_has_words_for_a_report(kind):
    assert kind.title


def test_the_page_of_the_plants_lists_each_kind_with_its_signals(kind):
    page = (Path(__file__).parents[2] / "docs" / "plants.md").read_text(encoding="utf-8")
    row = next(line for line in page.splitlines() if line.startswith(f"| `{kind.name}` |"))
    assert row.endswith(f"| {', '.join(kind.compared)} |")


def test_each_kind_stands_under_its_name():
    assert all(kind.name == name for name, kind in KINDS.items())
