"""Where exfit keeps what it can make again."""

import os
from pathlib import Path

CACHE = "EXFIT_CACHE"  # the variable of the environment that names the folder


def cache_folder() -> Path:
    """Return where compiled code is kept: EXFIT_CACHE, or the user's cache folder."""
    chosen = os.environ.get(CACHE)
    if chosen:
        return Path(chosen)
    from platformdirs import user_cache_path

    return user_cache_path("exfit", appauthor=False)
