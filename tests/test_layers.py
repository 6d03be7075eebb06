"""Who may import whom: each module only what stands above it."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

import exfit

ROOT = Path(exfit.__file__).parent
ORDER = (
    "exfit",
    "exfit.errors",
    "exfit.atomic",
    "exfit.envelope",
    "exfit.siblings",
    "exfit.engine",
    "exfit.engine.trace",
    "exfit.engine.system",
    "exfit.engine.writer",
    "exfit.engine.functions",
    "exfit.engine.emit",
    "exfit.engine.kernel",
    "exfit.models.sheet",
    "exfit.models.phasors",
    "exfit.models.blocks",
    "exfit.models.machines.machine",
    "exfit.models.machines.d_axis",
    "exfit.models.machines.round_rotor",
    "exfit.models.machines.salient_pole",
    "exfit.models.machines.one_axis",
    "exfit.models.machines",
    "exfit.models.*",
    "exfit.models",
    "exfit.plant.parts",
    "exfit.plant.open_circuit",
    "exfit.plant.infinite_bus",
    "exfit.plant.playback",
    "exfit.plant.alone",
    "exfit.plant",
    "exfit.readers.table",
    "exfit.readers.units",
    "exfit.readers.clock",
    "exfit.readers.cells",
    "exfit.readers.heads",
    "exfit.readers.columns",
    "exfit.readers.comtrade.files",
    "exfit.readers.comtrade.configuration",
    "exfit.readers.comtrade.data",
    "exfit.readers.comtrade.channels",
    "exfit.readers.comtrade",
    "exfit.readers.mat5",
    "exfit.readers.matlab",
    "exfit.readers.excel",
    "exfit.readers.parquet",
    "exfit.readers.timestamps",
    "exfit.readers.decoding",
    "exfit.readers.dialect",
    "exfit.readers.text",
    "exfit.readers",
    "exfit.three_phase",
    "exfit.resampling",
    "exfit.record",
    "exfit.noise",
    "exfit.onset",
    "exfit.conditioning",
    "exfit.sampling",
    "exfit.quality",
    "exfit.steps",
    "exfit.naming",
    "exfit.inspection",
    "exfit.loss",
    "exfit.yaml_lines",
    "exfit.glance",
    "exfit.watching",
    "exfit.ties",
    "exfit.case_form",
    "exfit.case_parts",
    "exfit.psse.fields",
    "exfit.psse.records",
    "exfit.psse.unit",
    "exfit.psse",
    "exfit.case_data",
    "exfit.record_faults",
    "exfit.case_faults",
    "exfit.case_schema",
    "exfit.case",
    "exfit.limiters",
    "exfit.course",
    "exfit.simulate",
    "exfit.small_signal",
    "exfit.limits",
    "exfit.experiment",
    "exfit.residuals",
    "exfit.condensed",
    "exfit.estimate.arrays",
    "exfit.estimate.answer",
    "exfit.estimate.box",
    "exfit.estimate.problem",
    "exfit.estimate.bounded",
    "exfit.estimate.linear",
    "exfit.estimate.search",
    "exfit.estimate.gauss_newton",
    "exfit.estimate.trust_region",
    "exfit.estimate.stopping",
    "exfit.estimate.run",
    "exfit.estimate.strategies",
    "exfit.estimate.solver",
    "exfit.estimate.threads",
    "exfit.estimate.starts",
    "exfit.estimate.profile",
    "exfit.estimate",
    "exfit.inference.linear",
    "exfit.inference.wording",
    "exfit.inference.factors",
    "exfit.inference.noise",
    "exfit.inference.combinations",
    "exfit.inference.fixings",
    "exfit.inference.confidence",
    "exfit.inference.identifiability",
    "exfit.inference",
    "exfit.knowledge",
    "exfit.straightness",
    "exfit.features",
    "exfit.result",
    "exfit.compare",
    "exfit.case_writer",
    "exfit.suggestion",
    "exfit.starting_case",
    "exfit.saved",
    "exfit.export",
    "exfit.unknowns",
    "exfit.trial",
    "exfit.courses",
    "exfit.changes",
    "exfit.notes",
    "exfit.study",
    "exfit.profiles",
    "exfit.design",
    "exfit.check",
    "exfit.report.sources",
    "exfit.report.simulated",
    "exfit.report.content",
    "exfit.report.charts",
    "exfit.report.figures",
    "exfit.report.page",
    "exfit.report",
    "exfit.plots.style",
    "exfit.plots.overlays",
    "exfit.plots.search",
    "exfit.plots.iterations",
    "exfit.plots.knowledge",
    "exfit.plots.responses",
    "exfit.plots.agreement",
    "exfit.plots.records",
    "exfit.plots",
    "exfit.overview",
    "exfit.files",
    "exfit.show.terminal",
    "exfit.show.sketch",
    "exfit.show.progress",
    "exfit.show.matches",
    "exfit.show.agreement",
    "exfit.show.fits",
    "exfit.show.knowledge",
    "exfit.show.checks",
    "exfit.show.sheets",
    "exfit.show.records",
    "exfit.show",
    "exfit.cli.completion",
    "exfit.cli.options",
    "exfit.cli.watched",
    "exfit.cli.fitting",
    "exfit.cli.knowing",
    "exfit.cli.comparing",
    "exfit.cli.exchange",
    "exfit.cli.records",
    "exfit.cli.catalogue",
    "exfit.cli.reporting",
    "exfit.cli",
)
FORBIDDEN_ABOVE_CASE = {"yaml", "click", "rich", "matplotlib", "pydantic"}
MAY_READ_YAML = {"exfit.yaml_lines"}
AT_ONCE = {"numpy", "matplotlib", "scipy", "pydantic", "rich", "llvmlite", "yaml"}


def module_name(path):
    parts = path.relative_to(ROOT.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path): path for path in sorted(ROOT.rglob("*.py"))}


def place(name):
    """Return where a module stands; a model's file stands where all of them do."""
    if name in ORDER:
        return ORDER.index(name)
    if name.startswith("exfit.models."):
        return ORDER.index("exfit.models.*")
    return len(ORDER)


def imports(path, everywhere):
    """Yield the modules a file imports; only those at its top unless ``everywhere``."""
    tree = ast.parse(path.read_text())
    for node in ast.walk(tree) if everywhere else at_the_top(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            members = [f"{node.module}.{alias.name}" for alias in node.names]
            found = [member for member in members if member in MODULES]
            yield from found or [node.module]


def at_the_top(tree):
    """Yield the statements that run when a module is imported."""
    for node in tree.body:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        if not isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield from ast.walk(node)


@pytest.mark.parametrize("name", MODULES)
def test_every_module_has_its_place_in_the_order(name):
    assert place(name) < len(ORDER), f"say in ORDER where {name} stands"


def test_the_order_names_only_modules_that_exist():
    assert set(ORDER) - {"exfit.models.*"} <= MODULES.keys()


@pytest.mark.parametrize("name", MODULES)
def test_a_module_imports_only_what_stands_above_it(name):
    for imported in imports(MODULES[name], everywhere=True):
        if imported.split(".")[0] == "exfit":
            assert place(imported) < place(name), f"{name} imports {imported}"


@pytest.mark.parametrize("name", [m for m in MODULES if place(m) < ORDER.index("exfit.case_form")])
def test_nothing_above_the_case_knows_files_or_screens(name):
    roots = {imported.split(".")[0] for imported in imports(MODULES[name], everywhere=True)}
    allowed = {"yaml"} if name in MAY_READ_YAML else set()
    assert not roots & (FORBIDDEN_ABOVE_CASE - allowed)


@pytest.mark.parametrize("name", MODULES)
def test_nothing_waits_for_scipy(name):
    roots = {imported.split(".")[0] for imported in imports(MODULES[name], everywhere=False)}
    assert "scipy" not in roots


@pytest.mark.parametrize("name", MODULES)
def test_only_the_engine_knows_machine_code(name):
    roots = {imported.split(".")[0] for imported in imports(MODULES[name], everywhere=True)}
    assert "llvmlite" not in roots or name.startswith("exfit.engine.")


@pytest.mark.skipif("exfit.cli" not in MODULES, reason="there is no command yet")
def test_the_command_starts_without_the_heavy_packages():
    code = "import exfit.cli, sys; print(*{name.partition('.')[0] for name in sys.modules})"
    environment = {**os.environ, "PYTHONPATH": str(ROOT.parent)}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment
    )
    assert not AT_ONCE & set(done.stdout.split())


ALONE = ("exfit.estimate", "exfit.inference")


@pytest.mark.parametrize("name", [m for m in MODULES if m.startswith(ALONE)])
def test_the_estimator_and_the_inference_can_be_used_without_the_rest(name):
    own = [m for m in imports(MODULES[name], True) if m.split(".")[0] == "exfit"]
    home = ".".join(name.split(".")[:2]) + "."
    assert [m for m in own if not m.startswith(home)] == []
