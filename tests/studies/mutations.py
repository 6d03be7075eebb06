"""How many small faults the tests find: mutants of modules, each run against the tests.

A mutant is a copy of the tree with one operator, constant, condition or argument changed. With
``--against`` only those are made that another tree has as well, wherever its modules stand, so
that the tests of two trees can be compared on the same faults:

    python tests/studies/mutations.py NEW --against OLD --count 20 -- --models=few
    python tests/studies/mutations.py OLD --against NEW --count 20 --json old.json

What follows ``--`` goes to pytest. The last lines count what was killed; a mutant that outlasts
ten times the tests without a fault counts as killed.
"""

import argparse
import ast
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

# a module: where trees have it, newest first, and the tests that read it, in the same order
MODULES = {
    "confidence": (
        ("exfit/inference/confidence.py",),
        ("tests/inference", "tests/test_inference_confidence.py"),
    ),
    "trust_region": (
        ("exfit/estimate/searches.py",),
        ("tests/estimate", "tests/test_estimate.py tests/test_estimate_runs.py"),
    ),
    "trace": (
        ("exfit/engine/trace.py",),
        ("tests/engine", "tests/test_trace.py tests/test_kernel.py"),
    ),
    "blocks": (
        ("exfit/models/blocks.py",),
        (
            "tests/models",
            "tests/test_blocks.py tests/test_models.py tests/test_ac.py tests/test_ac_rotating.py"
            " tests/test_compound.py tests/test_stabilisers.py tests/test_static.py",
        ),
    ),
    "ac8b": (
        ("exfit/models/exciters/ac8.py", "exfit/models/exciters/ac8b.py"),
        ("tests/models", "tests/test_models.py tests/test_ac.py tests/test_ac_rotating.py"),
    ),
    "small_signal": (
        ("exfit/simulation/small_signal.py", "exfit/small_signal.py"),
        ("tests/simulation", "tests/test_small_signal.py"),
    ),
    "three_phase": (
        ("exfit/dsp/three_phase.py", "exfit/three_phase.py"),
        ("tests/dsp", "tests/test_three_phase.py"),
    ),
    "step_detection": (
        ("exfit/dsp/step_detection.py", "exfit/onset.py"),
        ("tests/dsp", "tests/test_onset.py"),
    ),
    "ties": (
        ("exfit/case/ties.py", "exfit/ties.py"),
        ("tests/case", "tests/test_ties.py tests/test_case.py"),
    ),
    "residuals": (
        ("exfit/fitting/residuals.py", "exfit/residuals.py"),
        ("tests/fitting", "tests/test_residuals.py tests/test_trial.py tests/test_unknowns.py"),
    ),
}

FLIPPED = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}  # fmt: skip
SWAPPED = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.And: ast.Or,
    ast.Or: ast.And, ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd,
}  # fmt: skip


def mutated(node: ast.AST) -> Iterator[tuple[str, ast.AST]]:
    """Yield what may stand in the place of a node, with a word for the change."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in FLIPPED:
        first = FLIPPED[type(node.ops[0])]()
        yield "flip", ast.Compare(node.left, [first, *node.ops[1:]], node.comparators)
    elif isinstance(node, ast.BinOp) and type(node.op) in SWAPPED:
        yield "swap", ast.BinOp(node.left, SWAPPED[type(node.op)](), node.right)
    elif isinstance(node, ast.BoolOp):
        yield "swap", ast.BoolOp(SWAPPED[type(node.op)](), node.values)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        yield "drop", node.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        value = (not node.value) if isinstance(node.value, bool) else node.value * 1.5 + 1
        yield "constant", ast.Constant(type(node.value)(value))
    elif isinstance(node, ast.Call) and len(node.args) > 1:
        yield "argument", ast.Call(node.func, node.args[:-1], node.keywords)
    elif isinstance(node, ast.Call) and node.keywords:
        yield "argument", ast.Call(node.func, node.args, node.keywords[:-1])


class _Replace(ast.NodeTransformer):
    def __init__(self, old: ast.AST, new: ast.AST) -> None:
        self.old, self.new = old, new

    def visit(self, node: ast.AST) -> ast.AST:
        return self.new if node is self.old else self.generic_visit(node)


def sites(parent: ast.AST) -> Iterator[tuple[ast.expr, ast.AST]]:
    """Yield each expression and its parent; not those of annotations and decorators."""
    for field, value in ast.iter_fields(parent):
        if field in ("annotation", "returns", "decorator_list"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.expr):
                yield child, parent
            if isinstance(child, ast.AST):
                yield from sites(child)


def changes(tree: ast.AST) -> Iterator[tuple[ast.expr, ast.AST, str, ast.AST]]:
    """Yield each expression that can be changed, its parent, the kind of change, the new one."""
    for node, parent in sites(tree):
        for kind, new in mutated(node):
            yield node, parent, kind, new


def mutants(source: str) -> dict[str, int]:
    """Return the number of each change by its name: the kind, the text around it, its count."""
    counts: Counter[str] = Counter()
    numbers = {}
    for number, (node, parent, kind, new) in enumerate(changes(ast.parse(source))):
        around = parent if isinstance(node, ast.Constant) else node
        text = f"{kind}: {ast.unparse(around).splitlines()[0]} -> {ast.unparse(new)}"
        counts[text] += 1
        numbers[f"{text} ({counts[text]})"] = number
    return numbers


def mutant(source: str, number: int) -> tuple[str, int]:
    """Return a module with one change, and the line of the change in the module as it was."""
    tree = ast.parse(source)
    node, _, _, new = next(islice(changes(tree), number, None))
    changed = ast.fix_missing_locations(_Replace(node, new).visit(tree))
    return ast.unparse(changed), node.lineno


def module_of(root: Path, name: str) -> tuple[Path, list[str]]:
    """Return where a tree has a module, and its tests of it."""
    places, tests = MODULES[name]
    path = next(root / place for place in places if (root / place).exists())
    chosen = next(group for group in tests if (root / group.split()[0]).exists())
    return path, chosen.split()


def run(tree: Path, tests: list[str], arguments: list[str], limit: float) -> tuple[bool, float]:
    """Return whether the tests of a tree pass, and how long they took."""
    environment = {**os.environ, "PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-m", "pytest", "-x", "-q", *arguments]
    begin = time.monotonic()
    try:
        done = subprocess.run(
            [*command, *tests], cwd=tree, env=environment, capture_output=True, timeout=limit
        )
    except subprocess.TimeoutExpired:
        return False, limit
    return done.returncode == 0, time.monotonic() - begin


def study(options: argparse.Namespace, name: str, tree: Path) -> dict[str, bool]:
    """Return which mutants of a module are killed, by name."""
    path, tests = module_of(tree, name)
    source = path.read_text(encoding="utf-8")
    made = mutants(source)
    names = sorted(made)
    if options.against:
        other, _ = module_of(options.against, name)
        shared = mutants(other.read_text(encoding="utf-8"))
        names = [one for one in names if one in shared]
    random.Random(f"{options.seed} {name}").shuffle(names)
    passes, seconds = run(tree, tests, options.pytest, 3600.0)
    if not passes:
        raise SystemExit(f"{name}: its tests fail without a mutant")
    killed = {}
    for number, one in enumerate(names[: options.count]):
        text, line = mutant(source, made[one])
        path.write_text(text, encoding="utf-8")
        passes, _ = run(tree, tests, options.pytest, 10.0 * seconds + 60.0)
        killed[one] = not passes
        word = "SURVIVED" if passes else "killed"
        print(f"{name} {number + 1}: {word}  line {line}  {one}", flush=True)
    path.write_text(source, encoding="utf-8")
    print(f"{name}: {sum(killed.values())} of {len(killed)} killed, {len(names)} to choose from")
    return killed


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("root", type=Path, help="the tree whose tests are run")
    parser.add_argument("--against", type=Path, help="another tree, which has the same mutants")
    parser.add_argument("--modules", nargs="+", choices=MODULES, default=list(MODULES))
    parser.add_argument("--count", type=int, default=20, help="mutants of a module")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", type=Path, help="where the verdicts are written")
    given = sys.argv[1:]
    split = given.index("--") if "--" in given else len(given)
    options = parser.parse_args(given[:split])
    options.pytest = given[split + 1 :]
    verdicts = {}
    with tempfile.TemporaryDirectory() as room:
        tree = Path(room) / "tree"
        left_out = shutil.ignore_patterns(".git", ".*_cache", "__pycache__")
        shutil.copytree(options.root, tree, ignore=left_out)
        os.environ.setdefault("EXFIT_CACHE", str(Path(room) / "machine_code"))
        for name in options.modules:
            verdicts[name] = study(options, name, tree)
            if options.json:
                options.json.write_text(json.dumps(verdicts, indent=1), encoding="utf-8")
    every = [one for killed in verdicts.values() for one in killed.values()]
    print(f"{sum(every)} of {len(every)} mutants killed")


if __name__ == "__main__":
    main()
