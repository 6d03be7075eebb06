"""An interruption at any stage of a command reaches its message and its exit code."""

import contextlib
import json
import random
import signal
from pathlib import Path

import injected
import pytest
from ended_commands import contents
from writers import INTERRUPTED

from exfit.cli.options import Interruption
from exfit.output import events, run_folder
from exfit.util import files

COMMANDS = {  # that announce their stages
    "profile": ("profile", "case.yaml"),
    "fit": ("fit", "case.yaml"),
    "fit without a match": ("fit", "misfit.yaml"),
    "several fits": ("fit", "case.yaml", "other.yaml"),
    "run": ("run", "case.yaml", "--again"),
    "rank": ("rank", "unit.yaml", "--models", "AC1A,SEXS", "--search", "local"),
}
FEW = ("profile", "fit")  # the others take longer
OPTIONS = ("--no-plots", "--progress", "json", "-q", "-o", "folder")

GAPS = (0, 1, 10, 40, 200)  # entries until the second one; 0: none
QUICK = ("app", "simulate", "check", "show", "import", "trust", "new", "export --plb")
DRAWN = {"verify": 2, "rank": 4}  # which take seconds for each

pytestmark = pytest.mark.usefixtures("in_prepared_folder")


@pytest.fixture
def stages(monkeypatch):
    """Return a function that sends SIGINT when a command announces something for the n-th time."""
    real, announced = events.Events.write, []

    def interrupting(at, times):
        def write(self, event, **content):
            real(self, event, **content)
            announced.append(
                (event, content.get("run"), content.get("stage", content.get("phase")))
            )
            if at is not None and at < len(announced) <= at + times and event != "end":
                signal.raise_signal(signal.SIGINT)

        announced.clear()
        monkeypatch.setattr(events.Events, "write", write)
        return announced

    return interrupting


@pytest.mark.parametrize(
    "name",
    [name if name in FEW else pytest.param(name, marks=pytest.mark.long) for name in COMMANDS],
)
def test_an_interruption_at_each_stage_is_never_swallowed(run, prepared_folder, stages, name):
    """At the last time that a command announces each stage; of few at the first, too, and two."""
    case = (prepared_folder / "case.yaml").read_text(encoding="utf-8")
    misfit = case.replace("step: 1.0", "step: 0.6")
    assert misfit != case
    (prepared_folder / "misfit.yaml").write_text(misfit, encoding="utf-8")
    announced = stages(None, 0)
    assert run(*COMMANDS[name], *OPTIONS).code in (0, 3)
    before = {*contents(prepared_folder)}
    first = {stage: at for at, stage in reversed([*enumerate(announced)])}
    last = {stage: at for at, stage in enumerate(announced)}
    if name not in FEW:  # their iterations are those of a fit
        first, last = {}, {stage: at for stage, at in last.items() if stage[0] != "iteration"}
    met = {*last.values(), *first.values()} - {len(announced) - 1}
    for at in sorted(met):
        for times in (1, 2) if name in FEW else (1,):
            stages(at, times)
            ran = run(*COMMANDS[name], *OPTIONS)
            assert ran.code in (3, 130), (at, times, ran)
            assert "nterrupted" in ran.err, (at, times, ran)
            assert "Traceback" not in ran.err
            end = [json.loads(line) for line in ran.err.splitlines() if line.startswith("{")][-1]
            assert end["exit_code"] == ran.code
            assert {*contents(prepared_folder)} <= before  # whole, and nothing temporary


def test_an_interruption_that_something_swallows_is_an_exit_code(run, monkeypatch):
    real = files._write_new

    def swallowing(path, data):
        real(path, data)
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(files, "deferred_interrupts", contextlib.nullcontext)
    monkeypatch.setattr(files, "_write_new", swallowing)
    ran = run("simulate", "case.yaml", "--no-plots", "-q", "-o", "folder")
    assert ran.code == 3
    assert ran.err == "Interrupted: what was done until then is kept\n"


def test_figures_are_drawn_after_one_interruption_and_none_after_two(run, monkeypatch):
    for times, drawn in ((1, True), (2, False)):
        real = run_folder.write_simulation

        def interrupting(*arguments, times=times, real=real):
            written = real(*arguments)
            for _ in range(times):
                with contextlib.suppress(KeyboardInterrupt):
                    signal.raise_signal(signal.SIGINT)
            return written

        with monkeypatch.context() as patched:
            patched.setattr(run_folder, "write_simulation", interrupting)
            assert run("simulate", "case.yaml", "-q", "-o", f"met{times}").code == 3
        assert any(Path(f"met{times}").glob("*.png")) is drawn


def test_an_interruption_is_said_where_another_meets_its_message(monkeypatch):
    monkeypatch.setattr(Interruption, "show", lambda _: signal.raise_signal(signal.SIGINT))
    first = injected.Injection(injected.Entry("case/load.py", 1))
    ran = injected.run(("check", "case.yaml"), first)
    assert (ran.code, ran.err) == (130, "Interrupted\n")


@pytest.mark.parametrize(
    "name",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.long) for name in INTERRUPTED],
)
def test_an_interruption_at_any_module_of_any_command_is_never_swallowed(
    folder_of_all, tmp_path, monkeypatch, name
):
    """One or two at some of the entries; tests/studies/interrupts.py has them at all."""
    monkeypatch.chdir(folder_of_all)
    monkeypatch.setenv("EXFIT_CONFIG", str(tmp_path))
    if name == "app":
        pytest.importorskip("uvicorn")
    entries = injected.entries(INTERRUPTED[name])
    whole, rng = {*contents(folder_of_all)}, random.Random(name)
    for at in rng.sample(entries, min(DRAWN.get(name, 8), len(entries))):
        gap = rng.choice(GAPS)
        ended = injected.interrupted(INTERRUPTED[name], at, gap, whole, folder_of_all)
        assert ended.faults == [], (at, gap)
