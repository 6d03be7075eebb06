"""The formats of planners' files."""

from pathlib import Path

from exfit.features.planner.file_format import FileFormat
from exfit.features.planner.pslf import PSLF_FILES
from exfit.features.planner.psse import PSSE_FILES

FORMATS = {files.suffix.removeprefix("."): files for files in (PSSE_FILES, PSLF_FILES)}


def format_of(file: str | Path) -> FileFormat:
    """Return the format of a file by its name: PSS/E's, unless it ends as another's."""
    return FORMATS.get(Path(file).suffix.lower().removeprefix("."), PSSE_FILES)
