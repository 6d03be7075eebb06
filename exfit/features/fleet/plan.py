"""The cases of a batch before they are fitted: which of them are to be, under which keys."""

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

from exfit.case.named_code import code_in
from exfit.case.peek import content_of, files_in
from exfit.case.yaml import decoded, open_places
from exfit.errors import CaseError, ExfitError, FileError
from exfit.features.fleet.folder import IndexEntry, case_name, facts_of
from exfit.features.fleet.task import CaseTask, FurtherFiles, key_of
from exfit.runs.runner import FitSettings
from exfit.util.files import read_regular, refuse_bytes
from exfit.util.gate import refuse_untrusted
from exfit.util.text import dotted

SUFFIXES = (".yaml", ".yml")
# what a case has at its top, or a programme; a file of a folder without any of these is neither
KEYS_OF_CASES = frozenset({"plant", "test", "record", "records", "tests"})
WITH_RECORD = frozenset({"record", "records", "tests"})
NO_RECORD = "nothing to fit: the case has no record"


@dataclass(frozen=True)
class BatchSettings:
    """Settings of a batch: how it fits, and what it tries again.

    ``retry_failed``: cases that failed are fitted again.
    ``further`` are functions that make files beside those of every fit.
    """

    fit: FitSettings = field(default_factory=FitSettings)
    retry_failed: bool = False
    further: tuple[FurtherFiles, ...] = ()


class PlannedCase(NamedTuple):
    """A case that has a key, with its entry of the index and its task."""

    entry: IndexEntry
    task: CaseTask


def case_files(given: Sequence[Path], folder: Path) -> tuple[Path, ...]:
    """Return the case files that are given, and those below the folders that are given.

    Of a folder they are the files *.yaml and *.yml that are cases, faulty or not. Folders whose
    name begins with a dot are left out, and ``folder``, where the batch writes, unless what is
    given lies in it. Raises ExfitError for what does not exist or has a name that is no text, and
    where there is no case at all.
    """
    paths: dict[str, Path] = {}
    missing = []
    for path in given:
        if not path.exists():
            missing.append(f"{path}: cannot be read: No such file or folder")
        for file in _cases_below(path, folder) if path.is_dir() else [path]:
            refuse_bytes(file)
            paths.setdefault(case_name(folder, file), file)
    if missing:
        raise FileError(missing)
    if not paths:
        raise ExfitError(f"{', '.join(map(str, given))}: no case (*.yaml) there")
    return tuple(paths.values())


def _cases_below(top: Path, written: Path) -> Iterator[Path]:
    for place, folders, files in os.walk(top):
        here = Path(place)
        visible = (name for name in folders if not name.startswith("."))
        folders[:] = sorted(
            name for name in visible if not (written.exists() and written.samefile(here / name))
        )
        yaml = (here / name for name in sorted(files) if Path(name).suffix.lower() in SUFFIXES)
        yield from filter(_may_be_case, yaml)


def _may_be_case(file: Path) -> bool:
    """Accept a file of YAML that is a case, a programme, or nothing that can be read."""
    try:
        content = content_of(decoded(read_regular(file), file), file)
    except (OSError, CaseError):
        return True
    return not content or bool(KEYS_OF_CASES & content.keys())


def share_of(cases: Sequence[Path], part: tuple[int, int], folder: Path) -> tuple[Path, ...]:
    """Return the share of a part, (number, of): all parts together have every case once.

    The cases are counted in the order of a hash of their paths, so that no part has more of some
    models than chance gives it, whatever they are called.
    """

    def place(case: Path) -> tuple[bytes, str]:
        name = case_name(folder, case)
        return hashlib.sha256(name.encode()).digest(), name

    number, of = part
    own = {*sorted(cases, key=place)[number - 1 :: of]}
    return tuple(case for case in cases if case in own)


def planned_case(
    case: Path, folder: Path, settings: BatchSettings, why_not_made: str = ""
) -> PlannedCase | IndexEntry:
    """Return a case with its key, and the task that its fit is; or why it has none."""
    entry = IndexEntry(case_name(folder, case))
    try:
        data = b"" if why_not_made else read_regular(case)
    except OSError as fault:
        why_not_made = f"{case}: cannot be read: {fault.strerror}"
    if why_not_made:
        return replace(entry, status="refused", reason=why_not_made)
    try:
        content = content_of(decoded(data, case), case)
    except CaseError:  # which its fit will report
        content = {}
    entry = replace(entry, facts=facts_of(content))
    files = (case, *(file for file in files_in(content, case.parent) if file != case))
    reason = _why_refused(content, case)
    if reason:
        return replace(entry, status="refused", reason=reason)
    if content and not WITH_RECORD & content.keys():
        return replace(entry, status="no record", reason=NO_RECORD)
    key = key_of(files, settings.fit, data)
    task = CaseTask(files, key, folder / key, settings.fit, _group(content), settings.further)
    return PlannedCase(replace(entry, key=key), task)


def _why_refused(content: Mapping[str, Any], case: Path) -> str:
    """Find a reason not to try a case, or "": open values, code that is not trusted."""
    missing = [dotted(place) for place in open_places(content)]
    if missing:
        return f"{case}: to be filled in: {', '.join(missing)}"
    try:
        for code in code_in(content, case.parent):
            refuse_untrusted(code)
    except ExfitError as fault:
        return str(fault)
    return ""


def _group(content: Mapping[str, Any]) -> str:
    parts = map(content.get, ("plant", "stabiliser", "governor"))
    limiters, parameters = content.get("limiters"), content.get("parameters")
    several = limiters if isinstance(limiters, list) else []
    free = parameters.get("free") if isinstance(parameters, Mapping) else None
    models = [
        *map(content.get, ("model", "saturation", "efd_times_speed")),
        *(_picked(part, ("type", "machine", "model")) for part in parts),
        *(_picked(limiter, ("model", "place")) for limiter in several),
        sorted(map(str, free)) if isinstance(free, Mapping) else [],
    ]
    return json.dumps(models, default=str, sort_keys=True)


def _picked(section: Any, keys: Sequence[str]) -> Any:
    return [section.get(key) for key in keys] if isinstance(section, Mapping) else None
