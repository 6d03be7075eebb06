"""Which package may import which, and where the heavy libraries may stand."""

import ast
import os
import subprocess
import sys
from collections import Counter, defaultdict
from pathlib import Path

import pytest
from sources import MODULES, ROOT, nodes_of, tree_of, trees

BASE = {"util", "errors", "registry"}  # what every package may import
IN_ORDER = (  # each of the core may import those above it, the leaves nothing
    "signals", "dsp", "estimate", "inference", "engine", "models", "plants", "simulation",
    "records",
    "case", "fitting", "results", "verdict", "workflows", "runs", "output", "cli", "__main__",
)  # fmt: skip
LEAVES = {"signals", "dsp", "estimate", "inference", "engine"}
# beside the core, and another feature only as here
OTHER_FEATURES = {
    "app": {"drawings", "planner", "report", "start"},
    "fleet": {"planner", "programme", "report", "start"},
    "planner": {"start", "fleet", "translate"},
    "programme": {"report"},
    "rank": set(),
    "report": {"drawings", "planner", "programme"},
    "start": {"planner", "report"},  # verify ends with a report
    "translate": {"planner"},
}
# a result draws itself: inside the call, so that nothing is imported before
EXCEPTIONS = {("exfit.results.model", "exfit.output.notebook")}

ONLY_IN = {  # where a library may be imported, inside functions too
    "yaml": {"case"},
    "pydantic": {"app", "case", "programme", "start"},
    "matplotlib": {"output", "compare", "design", "programme", "rank", "translate"},
    "rich": {"output", "cli", "compare", "design", "fleet", "programme", "rank", "translate"},
    "jinja2": {"report", "drawings"},
    "weasyprint": {"report"},
    "click": {
        "app", "cli", "compare", "design", "fleet", "planner", "programme", "rank", "report",
        "start", "translate",
    },
    "llvmlite": {"engine"},
    "distributed": {"fleet"},
    "dask": {"fleet"},
    "fmpy": {"external"},
    "starlette": {"app"},
    "uvicorn": {"app"},
}  # fmt: skip
AT_ONCE = {"numpy", "matplotlib", "scipy", "pydantic", "rich", "llvmlite", "yaml"}

# what costs a short fit much of its time: NumPy's own parts among them
SLOW_TO_IMPORT = {
    "scipy", "matplotlib", "rich", "jinja2", "pandas", "numpy.ma", "numpy.random",
    "numpy.testing",
}  # fmt: skip
# what a process loads of exfit, at most: files, and the lines in them
SIMULATE, LOCAL_FIT = (118, 18_900), (186, 34_300)


def package(name):
    """Return the room of a module: a package of the core, or a feature; "" for exfit itself."""
    parts = [*name.split("."), "", ""]
    return parts[2] if parts[1] == "features" else parts[1]


def is_of_feature(name):
    return name.startswith("exfit.features.")


def imports(name, everywhere=True):
    """Yield the modules a module imports; only those at its top unless ``everywhere``."""
    for node in nodes_of(name) if everywhere else at_the_top(tree_of(name)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            members = [f"{node.module}.{alias.name}" for alias in node.names]
            modules = [member for member in members if member in MODULES]
            yield from modules or [node.module]


def at_the_top(tree):
    """Yield the statements that run when a module is imported."""
    for node in tree.body:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if not isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield from ast.walk(node)


def may_import(name):
    """Return the rooms that a module may import from, beside its own."""
    if is_of_feature(name):
        return {*IN_ORDER} | OTHER_FEATURES.get(package(name), set())
    if package(name) in {*BASE, *LEAVES}:
        return BASE if package(name) in LEAVES else {"util", "errors"}
    return BASE | {*IN_ORDER[: IN_ORDER.index(package(name))]}


def test_every_package_has_its_place_in_the_order():
    rooms = {package(name) for name in MODULES if not is_of_feature(name)}
    assert rooms - {"", "features"} == {*IN_ORDER, *BASE}


def test_a_package_imports_only_what_its_place_allows():
    faults = [
        f"{name} imports {target}"
        for name in MODULES
        for target in imports(name)
        if package(name) and target.split(".")[0] == "exfit" and package(target)
        if not (is_of_feature(target) and not is_of_feature(name))
        if package(target) not in may_import(name) | BASE | {package(name)}
        if (name, target) not in EXCEPTIONS
    ]
    assert faults == []


def test_the_core_imports_no_feature():
    faults = [
        f"{name} imports {target}"
        for name in MODULES
        for target in imports(name)
        if is_of_feature(target) and not is_of_feature(name)
        if name != "exfit"  # for type checkers only
    ]
    assert faults == []


def test_no_package_imports_itself_in_a_circle():
    """A name that a package hands on counts as its own file; a circle has no first module."""
    left = {
        name: {target for target in imports(name, everywhere=False) if target in MODULES} - {name}
        for name in MODULES
    }
    while left:
        free = {name for name, targets in left.items() if not targets & left.keys()}
        assert free, f"a circle among {sorted(left)}"
        left = {name: targets for name, targets in left.items() if name not in free}


def test_libraries_stand_only_where_the_table_says():
    faults = [
        f"{name} imports {target}"
        for name in MODULES
        for target in imports(name)
        if (library := target.split(".")[0]) in ONLY_IN
        if package(name) not in ONLY_IN[library]
    ]
    assert faults == []


def test_no_module_waits_for_scipy_while_it_is_imported():
    waiting = [n for n in MODULES for t in imports(n, False) if "scipy" in t]
    assert waiting == []


def test_no_folder_of_the_package_has_more_than_25_entries():
    """Families of models aside: they grow by a file each."""
    entries = defaultdict(list)
    for path in MODULES.values():
        if path.name == "__init__.py" and path.parent == ROOT:
            continue
        folder = path.parent.parent if path.name == "__init__.py" else path.parent
        entries[folder].append(path)
    crowded = {folder.name: len(found) for folder, found in entries.items() if len(found) > 25}
    assert crowded.keys() <= {"exciters"}


def names_given(statement):
    """Yield the names that a statement at the top of a module gives to something."""
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        yield statement.name
    elif isinstance(statement, ast.Assign | ast.AnnAssign):
        for target in getattr(statement, "targets", None) or [statement.target]:
            names = (node for node in ast.walk(target) if isinstance(node, ast.Name))
            yield from (node.id for node in names if isinstance(node.ctx, ast.Store))


def test_no_module_gives_a_name_twice():
    """The second would change what the first is for."""
    faults = []
    for name, tree in trees():
        given = Counter(each for statement in tree.body for each in names_given(statement))
        faults += [f"{name}: {each}" for each, count in given.items() if count > 1]
    assert faults == []


def test_no_class_is_defined_in_two_modules():
    homes = defaultdict(list)
    for name in MODULES:
        for node in nodes_of(name):
            if isinstance(node, ast.ClassDef):
                homes[node.name].append(name)
    assert {name: modules for name, modules in homes.items() if len(modules) > 1} == {}


def test_no_module_has_more_than_600_lines():
    lengths = {name: len(path.read_bytes().splitlines()) for name, path in MODULES.items()}
    assert {name: length for name, length in lengths.items() if length > 600} == {}


CHANGING = {
    "add", "append", "clear", "discard", "extend", "insert", "pop", "popitem", "remove",
    "setdefault", "update",
}  # fmt: skip


# what a module may remember, and why stands there
REMEMBERED = {
    "exfit.engine.kernel": {"_loaded"},
    "exfit.engine.sampling": {"_scratch"},
    "exfit.util.gate": {"_gates"},
    "exfit.util.interrupts": {"_received"},
}


def changes(function, names):
    """Yield where a function changes what stands at the top of its module under some names."""
    for node in ast.walk(function):
        if isinstance(node, ast.Global):
            yield node
        elif isinstance(node, ast.Subscript | ast.Attribute) and isinstance(node.value, ast.Name):
            stored = not isinstance(node.ctx, ast.Load)
            called = isinstance(node, ast.Attribute) and node.attr in CHANGING
            if node.value.id in names and (stored or called):
                yield node


def test_no_module_remembers_what_it_did():
    """State lies in values that are handed on; what stands at the top of a module is a table."""
    faults = []
    for name, tree in trees():
        assigned = [node for node in tree.body if isinstance(node, ast.Assign | ast.AnnAssign)]
        targets = [t for node in assigned for t in getattr(node, "targets", None) or [node.target]]
        names = {target.id for target in targets if isinstance(target, ast.Name)}
        names -= REMEMBERED.get(name, set())
        functions = [node for node in nodes_of(name) if isinstance(node, ast.FunctionDef)]
        places = {node.lineno for function in functions for node in changes(function, names)}
        faults += [f"{name}:{line}" for line in sorted(places)]
    assert faults == []


def test_the_command_starts_without_the_heavy_packages():
    code = "import exfit.cli, sys; print(*{name.partition('.')[0] for name in sys.modules})"
    environment = {**os.environ, "PYTHONPATH": str(ROOT.parent)}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
    )
    assert not AT_ONCE & set(done.stdout.split())


def modules_loaded(folder, command, *options):
    """Return the modules that a command has imported when it ends."""
    case = Path(__file__).parents[1] / "configs" / "ac1a_typical.yaml"
    arguments = [command, str(case), "-o", str(folder), "--quiet", "--no-plots", *options]
    code = (
        "import sys, atexit; from exfit.cli import main; "
        "atexit.register(lambda: print(*sys.modules)); main()"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT.parent)}
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
    )
    return set(done.stdout.split())


@pytest.mark.parametrize(
    ("limits", "command"), [(SIMULATE, ("simulate",)), (LOCAL_FIT, ("fit", "--search=local"))]
)
def test_a_command_without_figures_imports_little_more_than_it_uses(tmp_path, limits, command):
    modules_loaded(tmp_path, *command)  # keeps the machine code, whose writers only it may load
    loaded = modules_loaded(tmp_path, *command)
    own = [MODULES[name] for name in loaded & MODULES.keys()]
    lines = sum(len(path.read_bytes().splitlines()) for path in own)
    assert sorted(SLOW_TO_IMPORT & loaded) == []
    assert len(own) <= limits[0]
    assert lines <= limits[1]


@pytest.mark.parametrize("room", ["estimate", "inference"])
def test_the_estimator_and_the_inference_can_be_used_without_the_rest(room):
    own = {target for name in MODULES for target in imports(name)
           if package(name) == room and target.split(".")[0] == "exfit"}  # fmt: skip
    assert {package(target) for target in own} <= {room, "util"}
