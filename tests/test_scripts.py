"""What runs by hand, the benchmarks and studies, keeps up with the package."""

import ast
from importlib import import_module

import pytest
from places import ROOT

SCRIPTS = sorted(
    path for room in ("benchmarks", "studies") for path in (ROOT / "tests" / room).glob("*.py")
)


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_imports_what_the_package_has(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] == "exfit":
            module = import_module(node.module)
            assert [alias.name for alias in node.names if not hasattr(module, alias.name)] == []
