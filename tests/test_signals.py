"""The table of signals, and that whoever uses it covers every row."""

import ast

import pytest
from on_load import ALL_INPUTS, system
from sources import MODULES, ROOT, nodes

from exfit import registry
from exfit.case.schema import RecordFile
from exfit.cli.completion import noises
from exfit.features.events.grid_playback import grid_playback
from exfit.models import GOVERNORS, MODELS
from exfit.models.machines import MACHINES
from exfit.plants import BREAKER, FAULT, OF_GOVERNOR, SATURATION, SPEED
from exfit.plants.alone import alone
from exfit.plants.machine_on_load import machine_on_load
from exfit.plants.open_circuit import open_circuit
from exfit.plants.playback import DRIVING, machine_playback, playback
from exfit.plants.unit import UnitOnLoad
from exfit.records.channel_names import guess_signals
from exfit.signals import COMPARED, NOISE, RECORDED, ROWS, SIGNALS, label_of

MACHINE, EXCITER, QUADRATIC = MACHINES["GENROU"], MODELS["AC8B"], SATURATION["quadratic"]
SYSTEMS = {
    "infinite-bus": system(
        MACHINE, inputs=(*ALL_INPUTS, *FAULT, *OF_GOVERNOR), governor=GOVERNORS["TGOV1"]
    ),
    "grid-playback": grid_playback(UnitOnLoad(EXCITER, MACHINE, QUADRATIC)),
    "open-circuit": open_circuit(EXCITER, MACHINE, QUADRATIC, ("vref", "vs")),
    "machine-on-load": machine_on_load(MACHINE, (BREAKER, "efd", SPEED)),
    "playback": playback(EXCITER, QUADRATIC, DRIVING),
    "machine-playback": machine_playback(MACHINE),
    "none": alone(MODELS["FIRST_ORDER"]),
}


@pytest.mark.parametrize("plant", SYSTEMS)
def test_all_that_a_plant_puts_out_or_takes_has_a_row(plant):
    system = SYSTEMS[plant]
    signals = {*system.inputs, *system.outputs} - {*system.states}
    assert signals <= SIGNALS.keys()


def test_every_row_is_a_signal_of_some_plant():
    signals = {name for one in SYSTEMS.values() for name in (*one.inputs, *one.outputs)}
    # vc1 is added where the loop is opened; a frequency drives as the angle that it makes
    assert SIGNALS.keys() - {"vc1", "frequency"} <= signals


def test_a_signal_stands_once():
    assert len(SIGNALS) == len(ROWS)
    assert len({row.label for row in ROWS}) == len(ROWS)


def test_what_is_compared_can_be_recorded():
    assert {*COMPARED} <= {*RECORDED}
    assert NOISE.keys() == {*COMPARED}
    assert all(noise > 0.0 for noise in NOISE.values())


@pytest.mark.parametrize("signal", RECORDED)
def test_each_word_of_a_signal_identifies_it(signal):
    for word in (*SIGNALS[signal].words, *SIGNALS[signal].vague_words):
        guess = guess_signals((word,), {})
        assert guess[word].signal == signal, word


def test_no_signal_takes_the_column_of_another():
    """All signals side by side, each under the word that identifies it best."""
    columns = {SIGNALS[one].words[0]: one for one in RECORDED}
    guesses = guess_signals(tuple(columns), {})
    assert {name: guess.signal for name, guess in guesses.items()} == columns


def test_no_two_signals_are_recognised_in_the_same_turn():
    turns = [row.turn for row in ROWS if row.words]
    assert len({*turns}) == len(turns)


def test_a_case_may_name_each_signal_that_can_be_recorded():
    schema = RecordFile.model_json_schema()
    assert {*schema["properties"]["channels"]["propertyNames"]["enum"]} == {*RECORDED}


def test_the_shell_completes_each_signal_that_is_compared():
    assert noises(None, None, "") == [f"{signal}=" for signal in COMPARED]


PLANTS_OF_FEATURES = {
    MODULES[part.path.partition(":")[0]] for part in registry.parts("PLANTS").values()
}


def names_many_signals(text):
    return sum(f'"{signal}"' in text for signal in COMPARED) > 2


def test_no_other_room_has_a_table_of_signals():
    """Three signals side by side are a table, unless they are those of a plant."""
    tables = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path, node in nodes(names_many_signals)
        if path != ROOT / "signals.py" and path.parent != ROOT / "plants"
        if path not in PLANTS_OF_FEATURES
        if isinstance(node, ast.Tuple | ast.List | ast.Set | ast.Dict)
        for entries in [node.keys if isinstance(node, ast.Dict) else node.elts]
        if len({*COMPARED} & {one.value for one in entries if isinstance(one, ast.Constant)}) > 2
    ]
    assert tables == []


def test_a_label_names_symbol_and_unit():
    assert label_of("vt") == "terminal voltage vt (pu)"
    assert label_of("delta") == "rotor angle delta (rad)"
    assert label_of("VA") == "VA (pu)"  # a state of a model
