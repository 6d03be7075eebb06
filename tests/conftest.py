"""What all tests share: the models that they run over, and the folder of their machine code."""

import os

from oracle import EXCITERS, SATURATED, SURROUNDED

from exfit.models import MODELS

# a few of each family: without a plant; commutators; rotating rectifiers; static; compound;
# names of PSS/E
FEW = ("FIRST_ORDER", "DC1A", "IEEET1", "AC1A", "AC8B", "ST1A", "ST4B", "SEXS")

# the arguments of tests that run over the catalogue, and all that each stands for
OVER = {
    "model": MODELS,  # every model
    "exciter": EXCITERS,  # every model that stands on a machine
    "surrounded": SURROUNDED,  # an exciter, a machine and a form of saturation
    "saturated": SATURATED,  # a model and a form of saturation
}


def pytest_addoption(parser):
    parser.addoption(
        "--models",
        choices=("few", "all"),
        default="few",
        help="run over a few models of each family, or over all models, with what else takes long",
    )


def pytest_configure(config):
    """Let all workers, and the next session, share one folder of machine code.

    Its names are hashes of what the code is made from.
    """
    config.addinivalue_line("markers", "long: runs with --models=all only")
    if "EXFIT_CACHE" not in os.environ:
        os.environ["EXFIT_CACHE"] = str(config.cache.mkdir("machine_code"))


def pytest_generate_tests(metafunc):
    for argument in OVER.keys() & set(metafunc.fixturenames):
        entries = [entry for entry in OVER[argument] if _runs(metafunc.config, entry)]
        names = [entry if isinstance(entry, str) else "-".join(entry) for entry in entries]
        metafunc.parametrize(argument, entries, ids=names, scope="session")


def _runs(config, entry):
    name = entry if isinstance(entry, str) else entry[0]
    return config.getoption("models") == "all" or name in FEW


def pytest_collection_modifyitems(config, items):
    if config.getoption("models") == "all":
        return
    left_out = [item for item in items if item.get_closest_marker("long")]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not item.get_closest_marker("long")]
