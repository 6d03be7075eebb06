"""The text of a case that rows of a table, or records found by their names, describe."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from exfit.case.case_draft import CaseDraft, OpenValue
from exfit.case.suggestion import Base
from exfit.errors import ExfitError
from exfit.features.start.starting_case import starting_case
from exfit.features.start.starting_tests import (
    StartingTest,
    doubtful_bases,
    refuse_other_size,
    sizes_in_use,
    starting_tests,
)
from exfit.features.start.starting_unit import UnitData
from exfit.features.start.tables import CaseOfTable, TableRow, tests_of_table
from exfit.records.inspection import Inspection
from exfit.records.recorded_tests import tests_of


class MadeCase(NamedTuple):
    """A new case, what is doubtful in it, and the sizes of steps that it uses."""

    draft: CaseDraft
    doubts: tuple[str, ...]
    sizes: tuple[str, ...] = ()


def case_of_records(
    inspections: Sequence[Inspection],
    unit: UnitData,
    folder: Path,
    sizes: Sequence[str],
    bases: Mapping[str, Base],
) -> MadeCase:
    """Return the case of a unit with all tests of its records, to be written into a folder.

    Of ``sizes``, texts as 0.05 or up=0.05, those are used that are of one of its tests. Raises
    ExfitError where a record contradicts them.
    """
    own = sizes_in_use(sizes, inspections)
    tests = starting_tests(inspections, own, bases)
    return MadeCase(starting_case(unit, tests, folder), tuple(doubtful_bases(tests)), tuple(own))


def case_of_plan(
    case: CaseOfTable, unit: UnitData, folder: Path, bases: Mapping[str, Base]
) -> MadeCase:
    """Return the case that a table describes, to be written into a folder.

    ``bases`` are by signal; those of the table count more. What neither the records nor the table
    says is to be filled in. Raises ExfitError where a record cannot be read or contradicts its row.
    """
    inspections = {file: settings.inspect(file) for file, settings in case.settings.items()}
    tests = _tests(case.tests, inspections, bases)
    draft = starting_case(unit, tests, folder, case.about)
    given = dict(_given_values(case, draft.open_values()))
    return MadeCase(draft.filled(given), tuple(doubtful_bases(tests)))


def _tests(
    rows: Sequence[TableRow], inspections: Mapping[Path, Inspection], bases: Mapping[str, Base]
) -> tuple[StartingTest, ...]:
    """Return the tests of rows; one without an instant is of all the tests of its record."""
    only = inspections[rows[0].file] if len(rows) == 1 and rows[0].file is not None else None
    if only is not None and not tests_of(only) and rows[0].at is None and rows[0].step is None:
        base = rows[0].base
        return starting_tests([only], (), bases if base is None else {**bases, "vt": base})
    return tests_of_table([*_of_each_test(rows, inspections)], inspections, bases)


def _of_each_test(
    rows: Sequence[TableRow], inspections: Mapping[Path, Inspection]
) -> Iterator[TableRow]:
    """Yield a row for each test; one without an instant is of all tests of a record of its own."""
    files = [row.file for row in rows]
    for row in rows:
        assert row.file is not None
        inspection = inspections[row.file]
        tests = tests_of(inspection)
        if row.at is not None or len(tests) < 2 or files.count(row.file) > 1:
            yield row
            continue
        for test in tests:
            if row.step is not None:
                try:
                    refuse_other_size(inspection, test, row.step)
                except ExfitError as fault:
                    raise ExfitError(f"{row.place}: step: {fault}") from None
            yield row._replace(at=test.at)


def _given_values(
    case: CaseOfTable, values: Sequence[OpenValue]
) -> Iterator[tuple[OpenValue, str | float]]:
    """Yield the open values of a case that its table gives, as a case has them."""
    voltages = {settings.voltage for settings in case.settings.values() if settings.voltage}
    for value in values:
        *_, section, key = ("", *value.place)
        if section == "network" and key in case.network:
            yield value, case.network[str(key)]
        elif value.place[-3:] == ("channels", "vt", "column") and len(voltages) == 1:
            yield value, next(iter(voltages))
