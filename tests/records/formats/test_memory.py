"""Files that need more memory than they may take are refused before they are read."""

import oversized_files
import pytest
from limited_memory import inspected_in_a_process

from exfit.records.formats.table import GIGABYTE

pytest.importorskip("resource", reason="the system limits no memory")
pytestmark = pytest.mark.long

REACHED = "reading needs more than 1 GB of memory, the limit; "
TOO_LARGE = {
    "xlsx_of_one_far_cell.xlsx": REACHED,
    "xlsx_of_rows_without_cell_names.xlsx": REACHED,
    "xlsx_of_a_far_cell_behind_others.xlsx": REACHED,
    "xlsx_of_repeated_text.xlsx": REACHED,
    "xlsx_of_blanks.xlsx": "3221229791 bytes, unpacked: reading needs about 3.37 GB",
    "xlsx_that_declares.xlsx": "3221226250 bytes, unpacked: reading needs about 3.37 GB",
    "ods_of_repeats.ods": REACHED,
    "xls_of_one_far_cell.xls": REACHED,
    "xls_of_dimensions.xls": REACHED,
    "mat_of_zeros.mat": "134217728 samples in 1 column: reading needs about 12 GB",
    "mat_of_text.mat": REACHED,
    "mat_of_empty_structs.mat": REACHED,
    "parquet_of_zeros.parquet": "134217728 samples in 1 column: reading needs about 12 GB",
    "parquet_that_lies.parquet": REACHED,
    "text_of_columns.csv": "5999998 cells in its first lines",
    "text_of_one_line.csv": "4000001 cells in its first lines",
}
REFUSED = {
    "xlsx_that_lies.xlsx": "not an Excel workbook, or damaged: I/O error: File is larger than its",
    "ods_of_blank_repeats.ods": "not an Excel workbook, or damaged",
    "mat_of_sparse.mat": "not a MATLAB file, or damaged",
    "mat4_of_dimensions.mat": "not a MATLAB file, or damaged: Not enough bytes to read matrix",
    "text_of_a_huge_cell.csv": ":2: cannot be read: field larger than field limit",
}
SOUND = ("xlsx.xlsx",)


@pytest.fixture(scope="module")
def inspected(tmp_path_factory):
    """Return what one process of limited memory says of all files, and the folder of these."""
    folder = tmp_path_factory.mktemp("oversized")
    for name in (*SOUND, *REFUSED, *TOO_LARGE):
        made = getattr(oversized_files, name.partition(".")[0])
        (folder / name).write_bytes(made())
    results, errors = inspected_in_a_process(
        [folder / name for name in (*SOUND, *REFUSED, *TOO_LARGE)]
    )
    return folder, results, errors


@pytest.mark.parametrize("name", TOO_LARGE)
def test_a_file_that_would_fill_the_memory_is_refused_with_size_and_limit(inspected, name):
    folder, results, errors = inspected
    assert name in results, errors[-2000:]
    message, peak = results[name]
    assert message.startswith(f"{folder / name}: ")
    assert TOO_LARGE[name] in message
    assert "the limit" in message
    assert message.endswith(
        "; memory, in GB, raises it: of the record in a case, --memory of a command"
    )
    assert peak < GIGABYTE


@pytest.mark.parametrize("name", REFUSED)
def test_a_file_that_holds_less_than_it_declares_is_refused(inspected, name):
    folder, results, errors = inspected
    assert name in results, errors[-2000:]
    message, peak = results[name]
    assert message.startswith(f"{folder / name}")
    assert REFUSED[name] in message
    assert peak < GIGABYTE


@pytest.mark.parametrize("name", SOUND)
def test_a_sound_file_of_the_same_make_is_read(inspected, name):
    _, results, errors = inspected
    assert results.get(name, (errors, 0))[0] == ""
