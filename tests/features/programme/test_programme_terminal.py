"""A programme in the terminal, while it runs."""

import io

from rich.console import Console

from exfit.features.programme.programme_terminal import ProgrammeProgress
from exfit.features.programme.result import ProgrammeStep


def test_a_test_that_failed_is_counted_among_those_before():
    """What fails is not announced as finished."""
    stream = io.StringIO()
    console = Console(file=stream, force_terminal=True, color_system=None, width=80)
    steps = [ProgrammeStep(name, "steady", (name,)) for name in ("first", "second", "third")]
    with ProgrammeProgress(console, steps).running() as shown:
        for step in steps:
            shown(step, None)
    for number, step in enumerate(steps, 1):
        assert f"{number} of 3: {step.name}, begins" in stream.getvalue()
