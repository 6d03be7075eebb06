"""Files that need more memory than they may take are refused before they are read."""

import oversized_files
import pytest
from limited_memory import inspected_in_a_process

from exfit.records.formats.memory import GIGABYTE

pytest.importorskip("resource", reason="the system limits no memory")
pytestmark = pytest.mark.long

FARTHEST = "1048576 rows of 16384 columns, up to its farthest cell: reading needs about 2.23e+03 GB"
TOO_LARGE = {
    "xlsx_of_one_far_cell.xlsx": FARTHEST,
    "xlsx_of_rows_without_cell_names.xlsx": FARTHEST,
    "xlsx_of_a_far_cell_behind_others.xlsx": "1048576 rows of 16384 columns",
    "xlsx_of_repeated_text.xlsx": "sheet1.xml: 3071 rows of 3 columns",
    "xlsx_that_declares.xlsx": "'xl/worksheets/sheet1.xml' of 3221225472 bytes, unpacked",
    "ods_of_repeats.ods": "content.xml: 1048576 rows of 16384 columns",
    "ods_of_blank_repeats.ods": "content.xml: 1048576 rows of 16384 columns",
    "xls_of_one_far_cell.xls": "its sheets: reading needs about 558 GB",
    "xls_of_dimensions.xls": "its sheets",
    "mat_of_zeros.mat": "134217728 samples in 1 column",
    "mat_of_text.mat": "its arrays: reading needs about 43.1 GB",
    "mat_of_empty_structs.mat": "its arrays",
    "parquet_of_zeros.parquet": "134217728 samples in 1 column",
    "parquet_that_lies.parquet": "1000 samples in 1 column: reading needs about 2.3 GB",
    "text_of_columns.csv": "5999998 cells in its first lines",
    "text_of_one_line.csv": "4000001 cells in its first lines",
}
REFUSED = {
    "xlsx_that_lies.xlsx": "not an Excel workbook, or damaged: Bad CRC-32",
    "mat_of_sparse.mat": "not a MATLAB file, or damaged",
    "mat4_of_dimensions.mat": "not a MATLAB file, or damaged: a matrix of 36893488113059364872",
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
    assert message.endswith(
        "GB of memory, the limit is 1 GB; memory, in GB, raises it: of the record in a case, "
        "--memory of a command"
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
