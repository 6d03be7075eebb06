"""The README and the pages of docs/ are true: commands, output, cases, models, tables, links."""

import ast
import importlib.util
import json
import re
import shutil
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import click
import jsonschema
import numpy as np
import pytest
import yaml
from commands import COMMANDS
from places import REFERENCE, ROOT
from test_layers import IN_ORDER

import exfit
from exfit import workflows
from exfit.case.json_schema import json_schema
from exfit.case.load import load_case
from exfit.cli import OF_CORE, main
from exfit.cli.options import NOT_CONVERGED
from exfit.errors import CaseError
from exfit.fitting.recordings import phasors_of, record_of
from exfit.models import GOVERNORS, LIMITERS, LOAD_CONTROLLERS, MODELS, STABILISERS
from exfit.models.machines import MACHINES
from exfit.output import figures, run_folder
from exfit.registry import commands as of_features
from exfit.util.vocabulary import STRATEGIES

DOCS = ROOT / "docs"
PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in [
        ROOT / "README.md",
        *DOCS.glob("*.md"),
        *DOCS.glob("case_file/*.md"),
        DOCS / "models" / "index.md",
    ]
}
README = PAGES["README.md"]
NOTEBOOK = DOCS / "tutorial.ipynb"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
WITH_SESSIONS = [name for name, page in PAGES.items() if "```console" in page]
OF_OTHERS = {  # options of mypy, of the tests and studies, of SLURM and of Dask
    "--array", "--strict", "--models", "--kinds", "--seed", "--one", "--port", "--nthreads",
    "--nworkers", "--memory-limit",
}  # fmt: skip
WIDTH = 120  # of the terminal: no table of a page is cut off

MACHINE = "model: AC1A\nplant: {type: open-circuit, machine: GENROU}\n"
FAULTY_CASE = """\
model: AC1A
plant:
  type: open-circuit
  machine: GENROU
  parameters: {Xd: 0.25, Xpd: 0.3, Xppd: 0.25, Xl: 0.2}
test:
  vref:
    - {at: 1.0, step: 0.05}
record:
  file: record.csv
  time: t
  channels: {vt: vt}
parameters:
  fixed: {KEE: 1.0}
  free:
    # of a data sheet
    KA: {start: 9000, min: 10, max: 5000}
"""


def block(page: str, language: str, number: int = 0) -> str:
    """Return a block of a page in a language, by default the first."""
    blocks = [body for name, body in BLOCK.findall(PAGES[f"docs/{page}"]) if name == language]
    return blocks[number]


def column_of(page: str, after: str, number: int = 1) -> list[str]:
    """Return a column of the first table behind some words, without its head."""
    rows = re.search(r"(?:^\|.*\n)+", page.partition(after)[2], re.MULTILINE)[0].splitlines()
    return [row.split("|")[number].strip() for row in rows[2:]]


def one_line(text: str) -> str:
    return " ".join(text.split())


# ---- commands and what they print


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with a copy of the cases and records, as a user has it."""
    folder = tmp_path_factory.mktemp("exfit")
    for name in ("configs", "sample_data"):
        shutil.copytree(ROOT / name, folder / name)
    return folder


@pytest.fixture
def run(folder, monkeypatch, capsys):
    """Return a function that runs a command there: its exit code, and what it prints on one line.

    Figures are drawn, but not in pixels.
    """
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    for name in ("FORCE_COLOR", "TTY_COMPATIBLE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(figures, "drawn", lambda _: np.zeros((1, 1, 4), np.uint8))

    def command(line: str) -> tuple[int, str]:
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            main(line.split()[1:], prog_name="exfit")
        captured = capsys.readouterr()
        return int(ended.value.code or 0), one_line(captured.err + captured.out)

    return command


def session(body: str) -> Iterator[tuple[str, str]]:
    """Yield each command of exfit in a console block, with what the page says that it prints."""
    for part in re.split(r"^\$ ", body, flags=re.MULTILINE)[1:]:
        line, _, output = part.partition("\n")
        command = line.rpartition("&& ")[2]
        if command.startswith("exfit "):
            yield command, one_line(output)


@pytest.mark.parametrize(
    "name",
    [
        name if name == "README.md" else pytest.param(name, marks=pytest.mark.long)
        for name in WITH_SESSIONS
    ],
)
def test_the_commands_of_a_page_print_what_it_says(name, run):
    printed = ""
    for (language, body), (_, following) in pairwise([*BLOCK.findall(PAGES[name]), ("", "")]):
        if language == "console":
            expected = NOT_CONVERGED if "\nnot accepted:" in f"\n{following}" else 0
            for command, output in session(body):
                code, printed = run(command)
                assert (printed == output) if output else (code == expected), (command, printed)
        elif language == "text" and printed:
            missing = [line for line in body.splitlines() if one_line(line) not in printed]
            assert missing == [], printed


def test_the_answers_of_the_page_are_those_of_the_sample():
    answers = (ROOT / "sample_data" / "field_answers.yaml").read_text(encoding="utf-8")
    assert block("own_record.md", "yaml") == answers


def test_two_commands_install_and_run_and_test():
    lines = [line for line in README.splitlines() if line.startswith("$ pip install")]
    assert len(lines) == 2


def options_of(command: click.Command) -> set[str]:
    return {name for it in command.params for name in (*it.opts, *it.secondary_opts)}


def test_every_option_that_a_page_names_is_one_of_a_command():
    commands = [main, *COMMANDS.values()]
    options = {name for command in commands for name in options_of(command)}
    for name, page in PAGES.items():
        words = set(re.findall(r"(?<![\w-])--[a-z]+(?:-[a-z]+)*", page))
        assert words - options <= {"--help"} | OF_OTHERS, name


def test_every_command_that_a_page_names_is_one_of_exfit():
    for name, page in PAGES.items():
        assert set(re.findall(r"(?:`|^\$ |&& )exfit ([a-z]+)", page)) <= set(COMMANDS), name


def test_the_table_of_commands_names_every_command_in_its_group_as_the_help_does():
    groups, cells = (column_of(README, "## Commands", number) for number in (1, 2))
    named = [re.match(r"`exfit (\w+)", cell)[1] for cell in cells]
    known, group, listed = {**OF_CORE, **of_features()}, "", []
    for word, name in zip(groups, named, strict=True):
        group = word or group
        listed.append((group, name))
    assert listed == [(known[name].group, name) for name in main.list_commands(None)]


def test_the_readme_is_read_in_minutes():
    assert len(README.splitlines()) <= 120


QUESTIONS = {
    "What is it for, and for whom?": r"finds the parameters .* excitation system .* bump test",
    "Who uses it?": r"test engineers .* verify models",
    "What goes in?": r"input is that record and a case file",
    "What comes out?": r"output is a table of fitted values .* verdict",
    "How sure is it?": r"95 % interval contains the true value in 95 % of such tests",
    "Which strategies are there?": r"Gauss-Newton .* damped Gauss-Newton .* Levenberg-Marquardt",
    "How is it scripted?": r"script branches on the exit code .* 0, .* 3, .* 1, ",
}


@pytest.mark.parametrize("question", QUESTIONS)
def test_one_sentence_of_the_readme_answers(question):
    prose = re.sub(r"^(?:#|\||!).*$", "", BLOCK.sub("", README), flags=re.MULTILINE)
    sentences = [sentence for part in prose.split("\n\n")
                 for sentence in re.split(r"(?<=[.!?])\s+", one_line(part))]  # fmt: skip
    assert len([each for each in sentences if re.search(QUESTIONS[question], each)]) == 1


def test_the_options_in_common_are_those_of_a_fit():
    cells = column_of(PAGES["docs/commands.md"], "## Options")
    assert {cell.strip("`").split()[0] for cell in cells} <= options_of(COMMANDS["fit"])


# a command up to what the shell reads: in a block at the start of a line, in a line in backticks
IN_BLOCK = re.compile(r"(?:^|&& |\| )\$? ?(exfit [^|;>&#\n]+)", re.MULTILINE)
INLINE = re.compile(r"`(exfit [^`|;>&#]+)")


def commands_of(page: str) -> Iterator[str]:
    """Yield each command that a page shows, in blocks of any shell and in lines."""
    for language, body in BLOCK.findall(page):
        if language in ("console", "sh", "bash", "powershell", "yaml"):
            yield from IN_BLOCK.findall(body.replace("\\\n", " "))
    yield from INLINE.findall(re.sub(r"^```.*?^```$", "", page, flags=re.DOTALL | re.MULTILINE))


def fault_of(line: str) -> str:
    """Return what is wrong with a command: its name, an option, a choice, a file; or nothing."""
    words = [word.strip("[]'\"") for word in line.split()[1:] if word not in ("...", "…")]
    if not words or words[0].startswith("--"):
        return "" if set(words) <= options_of(main) | {"--help"} else "an option"
    if words[0] == "COMMAND":
        return ""
    command = COMMANDS.get(words[0])
    if command is None:
        return "a command"
    context = click.Context(command, info_name=words[0], **main.context_settings)
    try:
        values, _, _ = command.make_parser(context).parse_args([*words[1:], "VALUE"])
    except click.UsageError as fault:
        return fault.format_message()
    for option in command.params:
        given = values.get(option.name)
        if isinstance(option.type, click.Choice):
            for value in given if isinstance(given, list) else [given]:
                if isinstance(value, str) and value.islower() and value not in option.type.choices:
                    return f"{value} is no choice of {option.name}"
    files = [
        word for word in words if re.match(r"(configs|sample_data|examples)/[^*]*\.\w+$", word)
    ]
    return " ".join(f"{name} is missing" for name in files if not (ROOT / name).exists())


def test_every_command_that_a_page_shows_is_one_that_exfit_reads():
    shown = {(name, line) for name, page in PAGES.items() for line in commands_of(page)}
    assert len(shown) > 100
    faults = {(name, line): fault_of(line) for name, line in shown}
    assert {place: fault for place, fault in faults.items() if fault} == {}


@pytest.mark.parametrize(
    "line",
    ["exfit fits a.yaml", "exfit fit --serch local", "exfit fit a.yaml --search loca",
     "exfit check configs/none.yaml", "exfit --versions"],
)  # fmt: skip
def test_a_command_that_exfit_does_not_read_is_found(line):
    assert fault_of(line)


# ---- length and language

MOST_WORDS, MOST_OF_A_PAGE = 45_000, 3_000
GENERATED = re.compile(r"<!-- (\w+) -->.*?<!-- /\1 -->", re.DOTALL)  # see docs/architecture.md


def words_of(path: Path) -> int:
    """Count the words of a page, code and tables included, without its generated parts."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        text = "\n".join("".join(it["source"]) for it in cells if it["cell_type"] == "markdown")
    return len(GENERATED.sub("", text).split())


def test_the_documentation_stays_short():
    counts = {path: words_of(path) for path in [*(ROOT / name for name in PAGES), NOTEBOOK]}
    long = {path.name: count for path, count in counts.items() if count > MOST_OF_A_PAGE}
    assert long == {}
    assert sum(counts.values()) - counts[ROOT / "README.md"] <= MOST_WORDS


# what readers stumbled over: none of it returns
PHRASES = (
    "every other one validates", "the linear model sees nothing beyond it",
    "the noise of its mean counts", "that nothing stops for good",
    "those that linear theory does not serve have none", "a STAB1 that hears the speed",
    "what drove the fit", "what each came to", "spikes that it bears", "the true course",
    "foretell", "since the others hold with it only", "changes for good", "files that are whole",
    "what is made least", "otherwise than in the case", "a sway", "20 % of it is nothing",
    "sees what is fitted",
)  # fmt: skip
# a local optimisation or run; reject; similar units; a time or step; predict
WORDS = re.compile(r"\b(descents?|refut(?:e[sd]?|ing)|sisters?|instants?)\b", re.IGNORECASE)
TEXTS = [*PAGES.items(), *((name, (ROOT / name).read_text("utf-8"))
         for name in ("SECURITY.md", "CONTRIBUTING.md", "docs/tutorial.ipynb"))]  # fmt: skip


def strings_of(module: Path) -> Iterator[tuple[str, bool]]:
    """Yield the texts of a module, on one line, and whether each is one that users see.

    A docstring is seen where it is the help of a command or the description of a section.
    """
    tree = ast.parse(module.read_text(encoding="utf-8"))
    docstrings = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(
            node
        ):
            outer = [*getattr(node, "decorator_list", ()), *getattr(node, "bases", ())]
            seen = any(re.search("command|Section", ast.unparse(each)) for each in outer)
            docstrings[id(node.body[0].value)] = seen
    for node in ast.walk(tree):
        is_text = isinstance(node, ast.Constant) and isinstance(node.value, str)
        if is_text and " " in node.value and "Callable[" not in node.value:
            yield one_line(node.value), docstrings.get(id(node), True)


def test_no_phrase_that_readers_stumbled_over_returns():
    found = [(name, phrase) for name, text in TEXTS for phrase in PHRASES
             if phrase in one_line(text)]  # fmt: skip
    for name, text in TEXTS:
        prose = re.sub(r"`[^`]*`", "", GENERATED.sub("", text))
        found += [(name, word) for word in WORDS.findall(prose)]
    for module in sorted(Path(exfit.__file__).parent.rglob("*.py")):
        for text, seen in strings_of(module):
            named = [phrase for phrase in PHRASES if phrase in text]
            found += [(module.name, word) for word in (*named, *WORDS.findall(text * seen))]
    assert found == []


# ---- cases and models


@pytest.fixture
def cases(folder, tmp_path):
    """Return a folder for cases, beside a copy of the records."""
    (tmp_path / "sample_data").symlink_to(folder / "sample_data")
    (tmp_path / "cases").mkdir()
    return tmp_path / "cases"


def test_the_case_of_the_page_is_valid_and_its_records_can_be_read(cases):
    path = cases / "case.yaml"
    path.write_text(block("case_file.md", "yaml"), encoding="utf-8")
    case = load_case(path)
    assert record_of(case, case.recordings[0]).time.size > 1
    for recording in case.validations:
        assert record_of(case, recording).time.size > 1


def test_the_faults_of_a_case_are_reported_as_the_page_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("unit3.yaml").write_text(FAULTY_CASE, encoding="utf-8")
    with pytest.raises(CaseError) as refused:
        load_case(Path("unit3.yaml"))
    assert one_line(f"Error: {refused.value}") == one_line(block("case_file.md", "text"))


def test_the_record_of_the_page_is_read_in_the_recorders_units(cases):
    head = block("case_file.md", "yaml").partition("record:")[0]
    (cases / "case.yaml").write_text(head + block("records.md", "yaml"), encoding="utf-8")
    case = load_case(cases / "case.yaml")
    record = record_of(case, case.recordings[0])
    assert record.signals["vt"][0] == pytest.approx(1.0, abs=0.01)
    assert record.signals["ifd"][0] == pytest.approx(1.12, abs=0.01)


def test_the_records_of_the_page_are_a_valid_part_of_a_case(cases):
    (cases / "case.yaml").write_text(MACHINE + block("records.md", "yaml", 2), encoding="utf-8")
    case = load_case(cases / "case.yaml")
    assert [recording.name for recording in case.recordings] == ["up", "on-line"]
    assert case.on_load


def test_the_phasors_of_the_page_are_a_valid_part_of_a_case(cases):
    text = MACHINE + "test: {vref: [{at: 1.0, step: 0.01}]}\n" + block("pmu.md", "yaml")
    # a machine with its breaker open has no power
    shown = text.replace(", p: phasors.p, q: phasors.q", "")
    (cases / "case.yaml").write_text(shown, encoding="utf-8")
    assert phasors_of(load_case(cases / "case.yaml").record.phasors).kv == 18.0


def test_the_forms_of_the_reference_are_read(cases):
    """Each of them in its turn in place of the first, with the record that belongs to it."""
    text = block("records.md", "yaml", 3)
    (first, *others) = re.findall(r"^  (?:# )?(vref: .*)$", text, re.MULTILINE)
    assert len(others) == 4
    for form in (first, *others):
        shown = text.replace(f"  {first}", f"  {form}", 1)
        shown = shown if form == first else shown.replace(", vref: vref}", "}")
        (cases / "case.yaml").write_text(MACHINE + shown, encoding="utf-8")
        assert load_case(cases / "case.yaml").test.vref
        jsonschema.validate(yaml.safe_load(MACHINE + shown), json_schema())


def test_the_unit_on_load_of_the_page_can_be_simulated(cases):
    (cases / "case.yaml").write_text("model: AC1A\n" + block("plants.md", "yaml"), "utf-8")
    response = workflows.simulate(load_case(cases / "case.yaml"), {}).response
    assert response.signals["p"][0] == pytest.approx(0.8, rel=1e-9)
    assert response.signals["vt"][0] == pytest.approx(1.0, rel=1e-9)
    assert np.ptp(response.signals["delta"]) > 0.05


def test_the_model_of_the_page_starts_at_rest_and_follows_a_step(cases):
    (cases / "my_exciter.py").write_text(block("own_model.md", "python"), encoding="utf-8")
    (cases / "case.yaml").write_text(block("own_model.md", "yaml"), encoding="utf-8")
    response = workflows.simulate(load_case(cases / "case.yaml"), {}).response
    vt = response.signals["vt"]
    assert vt[response.time <= 1.0] == pytest.approx(1.0, abs=1e-9)
    assert np.all(np.isfinite(vt))
    # a static exciter, without an integral: the loop leaves 1 / (1 + KA) and saturation
    assert vt[-1] == pytest.approx(1.02, abs=2e-3)


def test_every_model_is_named():
    catalogue = {*MODELS, *MACHINES, *STABILISERS, *GOVERNORS, *LOAD_CONTROLLERS, *LIMITERS}
    assert catalogue <= set(re.findall(r"\w+", PAGES["docs/models/index.md"]))


def test_the_table_of_sources_says_of_each_model_of_2016_what_its_file_does():
    text = PAGES["docs/models/index.md"]
    (listed,) = re.findall(r"^\| DC commutator.*?\n(?=\n)", text, re.DOTALL | re.MULTILINE)
    of_2016 = " ".join(row.split("|")[3] for row in listed.splitlines()).split()
    older = {"DC3A", "PSS1A"}  # which the edition of 2016 did not change
    _, _, table = text.partition("| model | diagrams |")
    rows = [row.split("|")[1:4] for row in table.partition("\n\n")[0].splitlines()[2:]]
    rows = [[cell.strip() for cell in row] for row in rows]
    shelves = {**MODELS, **STABILISERS, **LIMITERS}
    doubts = {name: shelves[name].doubt for name, _, _ in rows}
    assert set(doubts) == {*of_2016} - older
    assert len(rows) == len(doubts)
    for name, diagrams, curve in rows:
        if doubts[name]:
            one = doubts[name].startswith("rests on one public diagram")
            assert diagrams == ("one" if one else "two that differ"), name
        else:  # a curve settles what one diagram, or two that differ, leave open
            assert diagrams == "two" or curve, name
    (others,) = re.findall(r"In doubt among the other models: ([\w ]+)\.", text)
    doubtful = {name for name, model in shelves.items() if model.doubt}
    assert doubtful - set(doubts) == {*others.split()}
    compared = {name: curve.split(", ") for name, _, curve in rows}
    for program, beginning in (("PowerWorld", "powerworld_"), ("PSS/E", "psse_")):
        files = REFERENCE.glob(f"{beginning}*.csv")
        held = {path.stem.split("_")[1].upper().removesuffix("U1") for path in files} & set(doubts)
        assert held == {name for name, by in compared.items() if program in by} - {"OEL2C"}


@pytest.mark.long
def test_a_fit_writes_the_files_of_the_table_and_no_others(tmp_path):
    result = workflows.fit(load_case(ROOT / "configs" / "first_order.yaml"))
    run_folder.write_fit(result, tmp_path / "run").draw()
    cells = column_of(PAGES["docs/reports.md"], "A fit writes these files")
    (validation,) = result.validation
    names = re.findall(r"`([^`]+)`", " ".join(cells))
    assert {path.name for path in (tmp_path / "run").iterdir()} == {
        name.replace("NAME", validation.name) for name in names
    }


def test_the_page_of_the_estimate_explains_each_strategy_as_the_help_does():
    page = PAGES["docs/case_file/estimate.md"]
    assert [words for name, words in STRATEGIES.items() if f"{name}: {words}" not in page] == []
    (option,) = (it for it in COMMANDS["fit"].params if it.name == "strategies")
    assert sorted(option.type.choices) == sorted(STRATEGIES)


def test_the_tables_of_keys_are_those_of_the_schema():
    spec = importlib.util.spec_from_file_location("docs_generate", DOCS / "generate.py")
    generate = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = generate
    spec.loader.exec_module(generate)
    pages = generate.key_pages()
    assert set(pages) == {DOCS / "case_file.md", *DOCS.glob("case_file/*.md")}
    old = [path.name for path, page in pages.items() if path.read_text("utf-8") != page]
    assert old == [], "run python docs/generate.py"
    tables = "\n".join(pages.values())
    schema = json_schema()
    for part in (schema, *schema["$defs"].values()):
        keys = part.get("properties", {}).items()
        current = [key for key, value in keys if not value.get("deprecated")]
        assert {f"| `{key}` |" in tables for key in current} <= {True}


# ---- Python


@pytest.mark.long  # and by the build of the documentation
def test_the_notebook_runs(monkeypatch):
    monkeypatch.chdir(DOCS)
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    assert all(not cell.get("outputs") for cell in cells), "Sphinx runs it: store no outputs"
    names: dict[str, object] = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            lines = [line for line in cell["source"] if not line.startswith("%")]
            exec("".join(lines), names)
    low, high = names["k"].interval
    assert low < 200.0 < high


@pytest.mark.parametrize(
    "page", ["estimator.md", pytest.param("python_api.md", marks=pytest.mark.long)]
)
def test_the_python_of_the_page_gives_the_values_that_it_says(page, tmp_path, monkeypatch):
    for folder in ("configs", "sample_data"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for body in re.findall(r"```python\n(.*?)```", PAGES[f"docs/{page}"], re.DOTALL):
        exec(body, names)
        for expression, value in re.findall(r"^(\S+) +# ([\d.]+)$", body, re.MULTILINE):
            assert eval(expression, names) == pytest.approx(float(value), rel=1e-4)


# ---- architecture


def test_the_tree_of_the_architecture_has_every_package_and_every_feature():
    tree = block("architecture.md", "text", 1)
    place = Path(exfit.__file__).parent
    for folder, indent in ((place, "  "), (place / "features", "    ")):
        entries = [path for path in folder.iterdir() if path.suffix != ".typed"]
        names = {f"{path.name}/" if path.is_dir() else path.name for path in entries}
        names -= {"__pycache__/"} | ({"__init__.py"} if folder != place else set())
        assert set(re.findall(rf"^{indent}(\w\S+)", tree, re.MULTILINE)) == names


def test_the_order_of_the_architecture_is_that_which_is_tested():
    page = PAGES["docs/architecture.md"]
    (order,) = re.findall(r"each may import those before it:\n\n((?:`\w+`\s)+)", page)
    assert tuple(re.findall(r"`(\w+)`", order)) == IN_ORDER


# ---- links


@pytest.mark.parametrize("name", [*PAGES, NOTEBOOK.relative_to(ROOT).as_posix()])
def test_every_link_of_a_page_leads_to_a_file(name):
    links = re.findall(r"\]\(([^)#\s]+)[^)]*\)", (ROOT / name).read_text(encoding="utf-8"))
    near = (ROOT / name).parent
    assert [link for link in links if "://" not in link and not (near / link).exists()] == []


def test_the_index_links_every_page_in_one_of_its_groups():
    groups = dict(re.findall(r"^## (.+)\n\n((?:\* .+\n)+)", PAGES["docs/index.md"], re.MULTILINE))
    assert [*groups] == ["Start", "Guides", "Reference", "Theory"]
    links = [DOCS / link for links in groups.values() for link in re.findall(r"\]\((.+)\)", links)]
    assert len(links) == len(set(links))
    pages = {ROOT / name for name in PAGES if not name.startswith("docs/case_file/")} | {NOTEBOOK}
    assert set(links) == pages - {ROOT / "README.md", DOCS / "index.md"}
    assert "](docs/index.md)" in README
