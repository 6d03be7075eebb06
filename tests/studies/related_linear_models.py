"""Show what linear discrete-time models come to: ARX and output error, alone and as start values.

    python tests/studies/related_linear_models.py [STARTS [DRAWS [RECORD ...]]]

Without further arguments: 64 starts within the bounds, 200 drawn records, the sample record ac1a_up
and one with coloured noise. The columns are those of docs/methods.md.
"""

import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from discrete_models import arx, output_error, transferred
from related_work import show

METHODS = {
    "ARX": transferred(arx),
    "output error": transferred(output_error),
}

if __name__ == "__main__":
    show(METHODS, then_descent=True)
