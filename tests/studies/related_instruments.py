"""Show what a linear model by instrumental variables comes to, alone and as start values.

    python tests/studies/related_instruments.py [STARTS [DRAWS [RECORD ...]]]

Without further arguments: 64 starts within the bounds, 200 drawn records, the sample record ac1a_up
and one with coloured noise. The columns are those of docs/methods.md.
"""

import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from discrete_models import instrumental, transferred
from related_work import show

METHODS = {
    "instrumental variables": transferred(instrumental),
}

if __name__ == "__main__":
    show(METHODS, then_descent=True)
