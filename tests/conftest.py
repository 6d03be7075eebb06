"""What all tests share: the models that they run over, and the folder of machine code."""

import contextlib
import gc
import os
import shutil
import signal
import sys
import tempfile
import zlib
from collections import defaultdict
from pathlib import Path

import hypothesis
import injected
import numpy as np
import pytest
from commands import Ran
from oracle import EXCITERS, SATURATED, SURROUNDED
from settings import LINEAR_ALGEBRA
from writers import prepare, prepare_every

from exfit import cli
from exfit.models import GOVERNORS, LIMITERS, LOAD_CONTROLLERS, MODELS, STABILISERS
from exfit.models.machines import MACHINES
from exfit.output import figures
from exfit.util import trust
from exfit.util.interrupts import ENDING

TESTS = Path(__file__).parent
CATALOGUE = {*MODELS, *MACHINES, *STABILISERS, *GOVERNORS, *LOAD_CONTROLLERS, *LIMITERS}
# one of each family: without a plant; commutators; rotating rectifiers; static; compound; a round
# rotor and salient poles; a stabiliser of one input, one of two; two governors; limiters of each
# side
FEW = (
    "FIRST_ORDER", "DC1A", "AC1A", "ST1A", "ST4B", "GENROU", "GENSAE", "STAB1", "PSS2B", "TGOV1",
    "HYGOV", "OEL2C", "UEL1",
)  # fmt: skip

# folders whose tests are of the models themselves; elsewhere a law takes a model as an example
OF_MODELS = {"models", "planner"}
PART = 3  # one in so many examples of a law runs as on another processor

hypothesis.settings.register_profile("few", max_examples=30, deadline=None, derandomize=True)
hypothesis.settings.register_profile("all", max_examples=100, deadline=None, derandomize=True)


def pytest_addoption(parser):
    parser.addoption(
        "--models",
        choices=("few", "others", "numerical", "long", "all"),
        default="few",
        help="few: one model of each family; others: the laws of models over all the others; "
        "numerical: a third of the examples of these laws and of the linear algebra; long: what "
        "takes long; all: every law over every model",
    )


def pytest_configure(config):
    """Let all workers, and the next session, share one folder of machine code.

    Its names are hashes of what the code is made from. A worker has one thread of OpenBLAS, as the
    command line has: there are as many workers as processors.
    """
    config.addinivalue_line("markers", "long: runs with --models=long or all only")
    config.addinivalue_line("markers", "every_example: runs with --models=all only")
    config.addinivalue_line("markers", "each_model: a law of each model, in whichever folder")
    config.addinivalue_line("markers", "pixels: its commands draw their figures in pixels")
    few = config.getoption("models") in ("few", "numerical")
    hypothesis.settings.load_profile("few" if few else "all")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    _keep_bytecode(str(config.cache.mkdir("bytecode")))
    os.environ["COLUMNS"] = "80"  # whether or not there is a terminal
    # the tests' own models and programs are trusted
    os.environ["EXFIT_CONFIG"] = str(config.cache.mkdir("configuration"))
    for place in (Path(__file__), Path(tempfile.gettempdir())):
        trust.trust(trust.Code.of_folder(Path(place.anchor)))
    if "EXFIT_CACHE" not in os.environ:
        os.environ["EXFIT_CACHE"] = str(config.cache.mkdir("machine_code"))


def _keep_bytecode(folder):
    """Let the next session have what this one compiled, also where Python is told to write none.

    The tests themselves are half of what a session compiles before its first test.
    """
    if sys.dont_write_bytecode and sys.pycache_prefix is None:
        sys.dont_write_bytecode, sys.pycache_prefix = False, folder


def pytest_ignore_collect(collection_path, config):
    """Pass over the files without a numerical test: to collect is a tenth of a session."""
    if config.getoption("models") != "numerical" or collection_path.suffix != ".py":
        return None
    of_models = "models" in collection_path.parts or _is_of_algebra(collection_path)
    return None if of_models or "each_model" in collection_path.read_text("utf-8") else True


def _is_of_algebra(path):
    """Return whether the tests of a file compute by more than the models themselves.

    Those of a command are of its files and words.
    """
    folders = (TESTS / folder for folder in LINEAR_ALGEBRA)
    of_command = path.name.startswith("test_cli_")
    return path.name == "test_settings.py" or (
        not of_command and any(map(path.is_relative_to, folders))
    )


def pytest_collection():
    """Collect no garbage while tests are collected: they all stay."""
    gc.disable()


def pytest_collection_finish():
    """Spare the garbage collector what the tests are made of: it would go through it each time."""
    gc.enable()
    gc.freeze()


def pytest_collection_modifyitems(config, items):
    models = config.getoption("models")
    if models == "all":
        return
    selected = [item for item in items if _is_selected(item, models)]
    if models == "numerical":
        selected = [*_in_part(selected)]
    config.hook.pytest_deselected(items=[*{*items}.difference(selected)])
    items[:] = selected


def _in_part(items):
    """Yield every third example of each law, and one of a law with fewer; of each law others."""
    laws = defaultdict(list)
    for item in items:
        laws[item.nodeid.partition("[")[0]].append(item)
    for law, examples in laws.items():
        step = min(PART, len(examples))
        yield from examples[zlib.crc32(law.encode()) % step :: step]


def _is_selected(item, models):
    """Return whether a test runs over the few models, or adds to what runs over them.

    Over the others run the laws of the models themselves, and drawn inputs once more, in greater
    number.
    """
    if item.get_closest_marker("every_example"):
        return False
    if (models == "long") != bool(item.get_closest_marker("long")):
        return False
    if _is_given_another_model(item):
        is_law_of_models = item.get_closest_marker("each_model") or OF_MODELS & {*item.path.parts}
        return models != "few" and is_law_of_models
    is_drawn = hypothesis.is_hypothesis_test(getattr(item, "obj", None))
    if models == "numerical":
        return is_drawn or _is_of_algebra(item.path)
    return models != "others" or is_drawn


def _is_given_another_model(item):
    """Return whether a test is given a model that is not one of the few."""
    given = item.callspec.params.values() if hasattr(item, "callspec") else ()
    parts = [part for value in given for part in (value if isinstance(value, tuple) else (value,))]
    names = [name for name in parts if isinstance(name, str) and name in CATALOGUE]
    return any(name not in FEW for name in names)


def joined(names):
    return "-".join(names)


@pytest.fixture(scope="session", params=list(MODELS))
def model(request):
    """Name each model of the catalogue in turn."""
    return request.param


@pytest.fixture(scope="session", params=EXCITERS)
def exciter(request):
    """Name each model of the catalogue that stands on a machine in turn."""
    return request.param


@pytest.fixture(scope="session", params=SURROUNDED, ids=joined)
def surrounded(request):
    """Name an exciter, a machine and a form of saturation in turn."""
    return request.param


@pytest.fixture(scope="session", params=SATURATED, ids=joined)
def saturated(request):
    """Name a model and a form of saturation in turn."""
    return request.param


@pytest.fixture(autouse=True)
def handlers():
    """Handle signals as a program of a shell does, also behind nohup or in a background."""
    defaults = {signal.SIGINT: signal.default_int_handler, **dict.fromkeys(ENDING, signal.SIG_DFL)}
    former = {number: signal.signal(number, handler) for number, handler in defaults.items()}
    yield
    for number, handler in former.items():
        signal.signal(number, handler)


@pytest.fixture
def run(capsys, monkeypatch, request):
    """Return a function that runs a command as the shell does.

    Figures are made, but in pixels only for tests that are marked so.
    """
    if not request.node.get_closest_marker("pixels"):
        monkeypatch.setattr(figures, "drawn", lambda _: np.zeros((1, 1, 4), np.uint8))

    def command(*arguments):
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            cli.main(args=[str(argument) for argument in arguments], prog_name="exfit")
        printed = capsys.readouterr()
        return Ran(int(ended.value.code or 0), printed.out, printed.err)

    return command


@pytest.fixture
def empty_folder(tmp_path, monkeypatch):
    """Work in an empty folder, in no terminal, 80 columns wide."""
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("COLUMNS", "80")
    place = tmp_path / "work"
    place.mkdir()
    monkeypatch.chdir(place)
    return place


@pytest.fixture(scope="module")
def prepared_folder(tmp_path_factory):
    """Return a folder with all that the commands read but for a fit."""
    folder = tmp_path_factory.mktemp("place")
    prepare(folder)
    return folder


@pytest.fixture(scope="session")
def all_made_once(tmp_path_factory):
    """Return a folder with all that any command reads, which no test changes."""
    folder = tmp_path_factory.mktemp("once")
    with contextlib.chdir(folder):
        prepare_every(folder, lambda *arguments: injected.run(arguments, injected.Injection()))
    return folder


@pytest.fixture(scope="module")
def folder_of_all(all_made_once, tmp_path_factory):
    """Return a folder with all that any command reads."""
    return shutil.copytree(all_made_once, tmp_path_factory.mktemp("all") / "place")


@pytest.fixture
def in_prepared_folder(prepared_folder, monkeypatch):
    """Work in that folder."""
    monkeypatch.chdir(prepared_folder)
