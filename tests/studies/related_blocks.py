"""Show what ARMA models of each block come to, alone and as start values.

    python tests/studies/related_blocks.py [STARTS [DRAWS [RECORD ...]]]

Without further arguments: 64 starts within the bounds, 200 drawn records, the sample record ac1a_up
and one with coloured noise. The columns are those of docs/methods.md.
No such unit has the records that it needs: docs/methods.md says which are simulated.
"""

import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from block_models import blocks, equation_error, errors_of_all, output_error
from related_work import asked, show_heads, show_rows, subject

FITS = {"ARMA per block": equation_error, "output error per block": output_error}

if __name__ == "__main__":
    scope = asked()
    show_heads()
    for name in scope.records:
        of = subject(name)
        methods = {title: blocks(of, fit) for title, fit in FITS.items()}
        show_rows(of, methods, scope, then_descent=True)
        errors = " ".join(f"{error:.3f}" for error in errors_of_all(of))
        print(f"least squares of all these records at once, {name}: spread {errors}")
