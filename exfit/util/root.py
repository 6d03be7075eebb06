"""Where the files of a case lie: at their own paths, or below a folder that stands for the root.

A worker of a cluster lays the files of a case out in a folder of its own. It reads them there by
the paths that the user gave, so that no result and no message names another.
"""

import os
import re
from pathlib import Path

ROOT = "EXFIT_LAID_OUT"  # the variable of the environment that names the folder; its real path


def on_disk(path: Path) -> Path:
    """Find the place of a file that a case names: the path itself by default."""
    root = os.environ.get(ROOT)
    return below(Path(root), path) if root else path


def below(root: Path, path: Path) -> Path:
    """Return the place of a path below a root.

    A relative one begins in the current folder, as far as this lies below the root. A path above
    the root is one at the root, as everywhere. Drives become folders.
    """
    working = Path(os.sep, os.path.relpath(Path.cwd(), root))
    drive, rest = os.path.splitdrive(os.path.normpath(working / path))
    return root / re.sub(r"[^\w.-]+", "_", drive).strip("_") / rest.lstrip(os.sep)
