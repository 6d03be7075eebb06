"""Programmes in a batch: all tests of a unit in one run, one folder and one row."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from exfit.errors import ExfitError
from exfit.features.fleet.summary import CaseFacts, CaseSummary, SummaryParameter, summary_of
from exfit.util.file_names import WHOLE_PROGRAMME

if TYPE_CHECKING:
    from exfit.features.programme.result import ProgrammeResult

TESTS = "tests"  # the key at the top of a case file that makes it a programme
BASE = ".base"  # how the name of what is no parameter of the unit ends: 1 pu of a channel


def run_programme(
    file: Path, strategy: str | None, search: str | None
) -> "tuple[ProgrammeResult, dict[str, str]]":
    """Run a programme; return its result and its files by name, as `exfit run` writes them.

    Raises ExfitError where one of its tests fails, KeyboardInterrupt where it is interrupted.
    """
    from exfit.features.programme import folder
    from exfit.features.programme.run import run

    with TemporaryDirectory(prefix="exfit-", ignore_cleanup_errors=True) as temporary:
        place = Path(temporary)
        result = run(
            file, place, again=True, keep=folder.write_test, strategy=strategy, search=search
        )
        if result.interrupted:
            raise KeyboardInterrupt
        if result.failed:
            raise ExfitError("\n".join(f"{name}: {why}" for name, why in result.failed.items()))
        folder.write_programme(result, place)
        return result, files_of(place)


def files_of(place: Path) -> dict[str, str]:
    """Read the files of a programme by name, last the one that says that all is done."""
    paths = sorted(path for path in place.rglob("*") if path.is_file())
    paths.sort(key=lambda path: path == place / WHOLE_PROGRAMME)
    return {path.relative_to(place).as_posix(): path.read_text(encoding="utf-8") for path in paths}


def summary_of_programme(result: "ProgrammeResult", key: str, seconds: float) -> CaseSummary:
    """Summarise a programme as a row: its fit of the bump tests, with what all tests gave.

    Verdict and reason are those of the first test that is not matched, or of the last one.
    """
    weakest = next((test for test in result.tests if not test.holds), result.tests[-1])
    if result.fit is not None:
        row = summary_of(result.fit, key, seconds)
    else:
        row = CaseSummary(result.name, result.path.as_posix(), key, "done", seconds=seconds)
        row = replace(row, **_facts(result)._asdict(), about=dict(result.about))
    return replace(
        row,
        verdict=weakest.verdict,
        reason=f"{weakest.name}: {weakest.reason}",
        holds=result.holds,
        parameters={**row.parameters, **_measured(result)},
        notes=(*row.notes, *result.warnings),
    )


def _facts(result: "ProgrammeResult") -> CaseFacts:
    from exfit.results.facts import UNIT, stated

    models = {part.kind: part.name for part in result.unit.parts}
    unit = stated({key: str(fact) for key, fact in result.about.items()}, UNIT) or ""
    return CaseFacts(unit, None, None, models.get("exciter", ""), models.get("machine", ""))


def _measured(result: "ProgrammeResult") -> Mapping[str, SummaryParameter]:
    """Collect the parameters that tests of the machine gave, with their intervals."""
    return {
        value.name: SummaryParameter(
            value.value, *value.interval, value.source, value.unit, True, value.min, value.max
        )
        for value in result.values
        if value.entered and not value.name.endswith(BASE)
    }
