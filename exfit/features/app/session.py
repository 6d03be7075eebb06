"""What a page looks at: a case, its draft, its responses and its fit; what it asks is done here.

Everything is computed and written by the workflows and the writers of the commands.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from shlex import quote
from typing import Any

from exfit import workflows
from exfit.case.case import Case
from exfit.case.changes import Changes, between, freed, number_text, part_of
from exfit.case.load import load_case, parse_case
from exfit.case.rewriting import with_changes
from exfit.case.yaml import read_text
from exfit.cli.given_files import DYNAMICS_FILES, RECORDS
from exfit.cli.options import Output
from exfit.dsp.features import LABELS
from exfit.errors import ExfitError
from exfit.estimate import Progress
from exfit.features.app import messages
from exfit.features.app.beginning import (
    PlannersFile,
    channels_content,
    corrected,
    drawn,
    made,
    planned,
    planner_content,
    record_content,
)
from exfit.features.app.packing import thinned
from exfit.fitting.program import program_of
from exfit.output import run_folder
from exfit.output.live import STAGES
from exfit.records.inspection import Inspection
from exfit.results.comparisons import Comparison
from exfit.results.io import load_result
from exfit.results.model import FitResult, Iteration
from exfit.signals import label_of
from exfit.util.files import on_disk, within, write
from exfit.util.text import dotted, near, percentage
from exfit.workflows.applied_causes import write_applied
from exfit.workflows.exploring import Explorer, explorer
from exfit.workflows.responses import LiveResponse

Content = dict[str, Any]
Given = Path | FitResult | None
Send = Callable[[Content], None]

WITHOUT_CASE = ("open", "look", "correct", "drawing", "make", "stop")
DRAFT = "-draft"  # behind the name of a case: the file of its draft
BETWEEN_SKETCHES = 0.05  # s, of the responses that a fit shows


@dataclass
class Shown:
    """What a page shows: a case, the result of a fit, or a record, of which there is no case yet.

    ``seen`` are the texts of the case and its draft as the page knows them, None for one that is
    not there: a file that another page or program has changed is not written over. ``bounds`` are
    those of the parameters that the page holds.
    """

    case_path: Path
    result: FitResult | None = None
    record: Path | None = None
    seen: dict[Path, str | None] = field(default_factory=dict)
    bounds: dict[str, tuple[float, float]] = field(default_factory=dict)
    explorer: Explorer | None = None
    found: Inspection | None = None
    corrected: bool = False
    stack: ExitStack = field(default_factory=ExitStack)


def view_of(given: Given) -> Shown:
    """Begin with a case, a result or a record; raises ExfitError for a result that is none."""
    if isinstance(given, Path) and (given.is_dir() or given.suffix == ".json"):
        given = load_result(given)
    if isinstance(given, FitResult):
        return Shown(given.case, given)
    if given is None or given.suffix.lower() in RECORDS:
        return Shown(Path(), record=given)
    return Shown(given)


class Session:
    """One page: its case as it is on disk or in its draft, and what was made of it."""

    def __init__(self, given: Given = None) -> None:
        self.view = view_of(given)
        self.begun: Content | None = None
        self.stopped = self.fitting = False
        self.planner: PlannersFile | None = None

    def _turn_to(self, given: Given) -> Content:
        """Read another case, result or record; where that fails, what was there stays."""
        if self.fitting:
            raise ExfitError("fit: one runs; stop it first")
        former, self.view = self.view, view_of(given)
        try:
            content = self.read()
        except BaseException:
            self.view = former
            raise
        former.stack.close()
        return content

    @property
    def draft(self) -> Path:
        """The file that changes go to until the case is saved."""
        name = f"{self.view.case_path.stem}{DRAFT}{self.view.case_path.suffix}"
        return within(self.view.case_path.parent, name)

    @property
    def path(self) -> Path:
        """The file that describes what the page shows: the draft where there is one."""
        return self.view.case_path if self.view.seen.get(self.draft) is None else self.draft

    @property
    def explorer(self) -> Explorer:
        """The case as it is simulated."""
        assert self.view.explorer is not None  # what needs a case was refused without one
        return self.view.explorer

    @property
    def case(self) -> Case:
        """The case as it was read last."""
        return self.explorer.case

    # ---- the case and its draft

    def prepare(self) -> None:
        """Read all that the page begins with, before it is opened; raises what ``read`` does."""
        self.begun = self.read()

    def _open(self) -> Content:
        """Describe what the page begins with: as it was read, where it is still so on disk."""
        begun, self.begun = self.begun, None
        same = all(_text(path) == text for path, text in self.view.seen.items())
        return begun if begun is not None and same else self.read()

    def read(self) -> Content:
        """Read the case, or its draft, and describe all that the page shows of it."""
        if self.view.record is not None:
            self.view.found, self.view.corrected = workflows.inspect(self.view.record), False
            units = None if self.planner is None else planner_content(self.planner)
            return {**record_content(self.view.found), "planner": units}
        if not self.view.case_path.name:
            return {"of": "start", "command": "exfit app"}
        files = (self.view.case_path, self.draft)
        self.view.seen = {path: _text(path) for path in files}
        if self.view.seen[self.view.case_path] is None:
            read_text(self.view.case_path)  # says why
        self._look_at(load_case(self.path))
        return self.shown()

    def _look_at(self, case: Case) -> None:
        stack = ExitStack()
        try:
            made = explorer(case, stack.enter_context(program_of(case)))
        except BaseException:
            stack.close()
            raise
        self.view.stack.close()
        self.view.stack, self.view.explorer = stack, made

    def close(self) -> None:
        """End what simulates for this page, and its fit."""
        self.stopped = True
        self.view.stack.close()

    def change(self, changes: Changes) -> Case:
        """Store changes in the draft, whole before the former one goes; return the new case.

        Raises ExfitError where the case would be none, or a file was changed by others.
        """
        self._refuse_changed()
        text = with_changes(self.path, changes)
        case = parse_case(text, self.draft)
        if not case.free():
            raise ExfitError(f"{self.path.name}: the last free parameter: a fit needs one")
        write(self.draft, text)
        self.view.seen[self.draft] = text
        return case

    def _refuse_changed(self) -> None:
        for path, text in self.view.seen.items():
            if _text(path) != text:
                raise ExfitError(
                    f"{path}: was changed by another page or program since this page read it; "
                    "nothing was written: read it again"
                )

    def _place(self, name: str) -> str:
        """Return the place of a free parameter in the file."""
        if name not in self.case.free():
            raise ExfitError(f"{name}: not a free parameter; {near(name, self.case.free())}")
        part = part_of(self.case, name)
        if part is None or part.free is None:
            return dotted(("parameters", "free", name))
        return dotted((*part.free, name.removeprefix(part.prefix)))

    def shown(self) -> Content:
        """Describe the case with its parameters and the responses to its start values."""
        case, start = self.case, self.explorer.start
        parameters = list(self._parameters())
        known = {each["name"] for each in parameters}
        return {
            "of": "open",
            "name": self.view.case_path.stem,
            "title": f"{case.subject}, {case.plant.type}",
            "draft": self.path == self.draft and self.draft.name,
            "parameters": parameters,
            "given": [name for name in self._given() if name not in known],
            "records": [_record(each, whole=True) for each in start],
            "cost": sum(each.cost for each in start),
            "command": self.command,
            "result": None if self.view.result is None else self._result(self.view.result),
        }

    def _parameters(self) -> Iterator[Content]:
        """Yield the free parameters, and those that this page holds, with their bounds."""
        values, rows = self.case.values(), self.case.rows()
        free = {each.name: each for each in self.explorer.free}
        limits = {name: (each.low, each.high) for name, each in free.items()}
        for name, (low, high) in {**self.view.bounds, **limits}.items():
            yield {
                "name": name,
                "unit": rows[name].unit if name in rows else "",
                "meaning": rows[name].meaning if name in rows else "used by ties",
                "value": values[name],
                "low": low,
                "high": high,
                "logarithmic": name in free and free[name].logarithmic,
                "locked": name not in free,
            }

    def _given(self) -> Iterator[str]:
        """Yield the given values that a fit can find, too."""
        taken = {*self.case.ties.by_name, *self.case.free()}
        for name, value in self.case.values().items():
            part = part_of(self.case, name)
            if value and name not in taken and part is not None and part.free is not None:
                yield name

    @property
    def command(self) -> str:
        """The command that fits what the page shows."""
        return f"exfit fit {quote(str(self.path))}"

    # ---- what a page asks for

    def answer(self, asked: "messages.Message", send: Send) -> Content:
        """Do what a message asks for; raises ExfitError where it cannot be done."""
        self._refuse_without_case(asked.do)
        match asked:
            case messages.Try():
                return self.response(asked.values, asked.moving)
            case messages.Chosen():
                choose = self._store if asked.do == "store" else self._validate
                return choose(asked.values)
            case messages.Bound():
                place = self._place(asked.name)
                ends = {"min": number_text(asked.low), "max": number_text(asked.high)}
                changed = self.change({f"{place}.{key}": end for key, end in ends.items()})
                return self._rebuilt(changed)
            case messages.Lock():
                return self._lock(asked.name, asked.value)
            case messages.Named():
                look = self._free if asked.do == "free" else self._profile
                return look(asked.name)
            case messages.Apply():
                return self._apply(asked.cause)
            case messages.Look():
                return self._look(asked.file)
            case messages.Correct():
                return self._correct(asked)
            case messages.Draw():
                return drawn(asked.model)
            case messages.Make():
                return self._make(asked)
        plain: Mapping[str, Callable[[], Content]] = {
            "open": self._open,
            "stop": self._stop,
            "save case": self._save_case,
            "save result": self._save_result,
            "save report": self._save_report,
            "discard": self._discard,
            "fit": lambda: self._fit(send),
        }
        return plain[asked.do]()

    def response(self, values: Mapping[str, float], moving: bool = False) -> Content:
        """Simulate the tests at values of free parameters; roughly while a slider is ``moving``."""
        unknown = [name for name in values if name not in self.case.free()]
        if unknown:
            raise ExfitError(f"{unknown[0]}: {near(unknown[0], self.case.free())}")
        of_record = {} if self.view.result is None else self.view.result.of_records
        of_record = {
            each.name: of_record[each.name]
            for each in self.explorer.residuals.free
            if each.name in of_record
        }
        compared = self.explorer.at({**of_record, **values}, quick=moving)
        records = [_record(each) for each in compared]
        return {"of": "try", "records": records, "cost": sum(each.cost for each in compared)}

    def _store(self, values: Mapping[str, float]) -> Content:
        self.change({f"{self._place(n)}.start": number_text(v) for n, v in values.items()})
        return self._changed()

    def _changed(self) -> Content:
        return {"of": "store", "draft": self.draft.name, "command": self.command}

    def _rebuilt(self, case: Case) -> Content:
        self._look_at(case)
        return self.shown()

    def _lock(self, name: str, value: float) -> Content:
        place, part = self._place(name), part_of(self.case, name)
        section = ("parameters", "fixed") if part is None else part.fixed
        symbol = name if part is None else name.removeprefix(part.prefix)
        own = next(each for each in self.explorer.free if each.name == name)
        case = self.change({place: "", dotted((*section, symbol)): number_text(value)})
        self.view.bounds[name] = (own.low, own.high)
        return self._rebuilt(case)

    def _free(self, name: str) -> Content:
        values, part = self.case.values(), part_of(self.case, name)
        if part is None or part.free is None or name not in self._given():
            raise ExfitError(f"{name}: not a given value that a fit can find")
        changes = dict(freed(self.case, {name: values[name]}))
        low, high = self.view.bounds.get(name, (0.0, 0.0))
        if low < values[name] < high and isfinite(high - low):
            found = between(values[name], low, high)
            place = dotted((*part.free, name.removeprefix(part.prefix)))
            changes[place] = found if low > 0.0 else f"{found[:-1]}, scale: linear}}"
        case = self.change(changes)
        self.view.bounds.pop(name, None)
        return self._rebuilt(case)

    def _discard(self) -> Content:
        self._refuse_changed()
        self.draft.unlink(missing_ok=True)
        self.view.result, self.view.bounds = None, {}
        return self.read()

    # ---- from a record

    def _refuse_without_case(self, do: str) -> None:
        if self.view.explorer is None and do not in WITHOUT_CASE:
            raise ExfitError(f"{do}: there is no case yet: make one of a record")

    def _look(self, file: str) -> Content:
        place = Path(file)
        if place.name != file or "\\" in file:
            raise ExfitError(f"{file}: not the name of a file in the working folder")
        if place.suffix.lower() in DYNAMICS_FILES:
            self.planner = planned(place)
            return planner_content(self.planner)
        return self._turn_to(place)

    def _shown_record(self) -> Inspection:
        if self.view.record is None or self.view.found is None:
            raise ExfitError("record: there is none: drop one on the page")
        return self.view.found

    def _correct(self, asked: "messages.Correct") -> Content:
        self.view.found, self.view.corrected = corrected(self._shown_record(), asked), True
        return channels_content(self.view.found)

    def _make(self, asked: "messages.Make") -> Content:
        path, command = made(self._shown_record(), self.planner, asked)
        # no option gives machine data or a channel: the case that is there has them
        known = {} if asked.machine or self.view.corrected else {"command": command}
        return {**self._turn_to(path), "words": f"written: {path}", **known}

    # ---- fit, profile, validation

    def _fit(self, send: Send) -> Content:
        if self.fitting:
            raise ExfitError("fit: one runs already; stop it first")
        self._refuse_changed()
        self.fitting, self.stopped, shown = True, False, 0.0

        def iterated(line: Iteration) -> None:
            self._end_if_stopped()
            number = {"number": line.number, "phase": line.phase, "cost": line.cost}
            send({"of": "iteration", **number, "values": dict(line.values)})

        def advanced(progress: Progress) -> None:
            self._end_if_stopped()
            stage, counted = STAGES[progress.stage]
            words = f"{stage}: {progress.done} of {progress.total} {counted}"
            send({"of": "stage", "words": words})

        def live(sketch: LiveResponse) -> None:
            nonlocal shown
            now = time.monotonic()
            if now - shown > BETWEEN_SKETCHES:
                shown = now
                at, (current,) = thinned(sketch.time, [sketch.simulated])
                send({"of": "live", "signal": sketch.signal, "time": at, "current": current})

        try:
            case = load_case(self.path)
            self.view.result = workflows.fit(case, None, iterated, advanced, live)
        finally:
            self.fitting = False
        return {**self._result(self.view.result), "of": "fit", "command": self.command}

    def _end_if_stopped(self) -> None:
        if self.stopped:
            raise KeyboardInterrupt

    def _stop(self) -> Content:
        self.stopped = True
        return {"of": "stop"}

    def _result(self, result: FitResult) -> Content:
        """Describe a fit: its verdict, its values with their intervals, its causes."""
        path = quote(str(self.path))
        return {
            "verdict": result.verdict.verdict,
            "reason": result.verdict.reason,
            "holds": result.holds,
            "outcome": f"{result.outcome}, {result.nit} iterations, {result.seconds:.2f} s",
            "parameters": [
                {
                    "name": name,
                    "value": each.value,
                    "text": each.rounded(each.value),
                    "unit": each.unit,
                    "interval": each.interval,
                    "words": _interval(result, name),
                    "of_record": each.of_record,
                }
                for name, each in result.parameters.items()
            ],
            "causes": [
                {
                    "sentence": cause.sentence,
                    "command": f"exfit fit {path} --apply {number}" if cause.changes else "",
                    "number": number,
                }
                for number, cause in enumerate(result.verdict.causes, 1)
            ],
            "validation": [_judged(each) for each in result.validation],
            "notes": list(result.notes),
        }

    def _profile(self, name: str) -> Content:
        self._place(name)
        self.stopped = False
        found = workflows.profile(load_case(self.path), name, lambda _: self._end_if_stopped())
        (profile,) = found.profiles
        command = f"exfit profile {quote(str(self.path))} {name}"
        return {
            "of": "profile",
            "name": name,
            "unit": profile.unit,
            "at": profile.at,
            "rise": profile.costs - min(profile.costs),
            "limit": profile.rise,
            "low": profile.low,
            "high": profile.high,
            "words": f"{profile.rounded(profile.low)} ... {profile.rounded(profile.high)}",
            "ends": list(profile.ends),
            "command": command,
        }

    def _validate(self, values: Mapping[str, float]) -> Content:
        given = self.view.result if self.view.result is not None and not values else values
        matches = workflows.validate(load_case(self.path), given)
        places = "".join(f" --set {name}={value:g}" for name, value in values.items())
        return {
            "of": "validate",
            "records": [{**_record(each, whole=True), **_judged(each)} for each in matches],
            "command": f"exfit validate {quote(str(self.path))}{places}",
        }

    # ---- files

    def _fitted(self) -> FitResult:
        if self.view.result is None:
            raise ExfitError("result: there is none yet: fit first")
        return self.view.result

    def _folder(self) -> Path:
        output = Output(None, figures=True, quiet=True, as_json=False)
        return output.folder_of(load_case(self.path), "fit", run_folder.OF_FIT, after_records=True)

    def _save_case(self) -> Content:
        self._refuse_changed()
        text = self.view.seen[self.draft]
        if text is None:
            return {"of": "saved", "words": f"{self.view.case_path} is as the page shows it"}
        parse_case(text, self.view.case_path)
        write(self.view.case_path, text)
        former, draft = self.path, self.draft
        draft.unlink(missing_ok=True)
        self.view.seen = {self.view.case_path: text, draft: None}
        if (
            self.view.result is not None and self.view.result.case == former
        ):  # the same text, byte by byte
            self.view.result = replace(self.view.result, case=self.view.case_path)
        return {**self._changed(), "of": "saved", "draft": False, "words": str(self.view.case_path)}

    def _save_result(self) -> Content:
        result, folder = self._fitted(), self._folder()
        run_folder.write_fit(result, folder).draw()
        return {"of": "saved", "words": str(folder), "command": self.command}

    def _save_report(self) -> Content:
        from exfit.features.report.writing import write_report

        result, folder = self._fitted(), self._folder()
        run_folder.write_fit(result, folder)
        places = write_report(folder)
        command = f"{self.command} && exfit report {quote(str(folder))}"
        return {"of": "saved", "words": ", ".join(map(str, places)), "command": command}

    def _apply(self, number: int) -> Content:
        path, folder = self.path, self._folder()
        run_folder.write_fit(self._fitted(), folder)
        applied = write_applied(path, str(number), folder)
        said = self._turn_to(applied.path)
        return {**said, "words": f"written: {applied.path}: {applied.sentence}"}


def _text(path: Path) -> str | None:
    """Return the text of a file as it is on disk, None where there is none."""
    return read_text(path) if on_disk(path).exists() else None


def _interval(result: FitResult, name: str) -> str:
    """Write the interval of a parameter, or why it has none."""
    each = result.parameters[name]
    if each.interval is None:
        return each.why or ""
    ends = [end if end is None else each.rounded(end) for end in each.interval]
    return f"{ends[0] or 'open'} ... {ends[1] or 'open'}"


def _judged(match: Comparison) -> Content:
    return {
        "name": match.name,
        "validation": match.validation,
        "accepted": match.accepted,
        "reason": match.reason,
        "match": f"rmse {match.rmse:.3g} pu, fit {percentage(match.fit_percent)} %"
        if match.overlays
        else "no response",
    }


def _record(match: Comparison, whole: bool = False) -> Content:
    """Describe the response beside a record; ``whole`` with what does not move with the values."""
    signals = []
    for signal, overlay in match.overlays.items():
        moving = {"current": overlay.simulated, "residual": overlay.error}
        still = {"measured": overlay.measured, "start": overlay.simulated} if whole else {}
        time, curves = thinned(match.time, [*moving.values(), *still.values()])
        named = dict(zip([*moving, *still], curves, strict=True))
        own = match.channels[signal]
        figures = {"rmse": f"{own.rmse:.4g}", "fit": percentage(own.fit_percent)}
        label = {"label": label_of(signal), "time": time} if whole else {}
        signals.append({"signal": signal, **figures, **label, **named})
    cells = [(label, unit, match.features.cells(key)) for label, key, unit in LABELS]
    has = match.features.measured is not None or match.features.simulated is not None
    features = [
        {"label": label, "unit": unit, "measured": measured, "simulated": simulated}
        for label, unit, (measured, _, simulated) in cells
        if has
    ]
    content = {"name": match.name, "file": match.record, "signals": signals, "features": features}
    return {**content, "notes": list(match.notes)} if whole else content
