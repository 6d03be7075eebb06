"""Machine code as a new process has it: none of it loaded."""

from typing import ClassVar


class NothingLoaded(dict):
    """Stands for the code that a process has loaded, none of which is found again."""

    kept: ClassVar = []  # it must outlive what calls it

    def __contains__(self, key):
        return False

    def __setitem__(self, key, value):
        self.kept.append(value)
        super().__setitem__(key, value)
