"""Files that belong together by their names: a record in two parts."""

from pathlib import Path


def siblings(path: Path, suffix: str) -> list[Path]:
    """Return the files beside one that are called like it but for the suffix, in capitals or not.

    Those whose name is the same to the letter count before others.
    """
    if not path.parent.is_dir():
        return []
    wanted = (path.stem + suffix).lower()
    found = [one for one in sorted(path.parent.iterdir()) if one.name.lower() == wanted]
    return [one for one in found if one.stem == path.stem] or found
