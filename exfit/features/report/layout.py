"""What the charts of a report share: sizes, how finely lines are drawn, the titles of axes."""

from exfit.show.blocks import Rule

MILLI = 1e3
TALL, HALF, LOW = 170.0, 120.0, 72.0  # of panels: of signals, of gain and phase, of errors
BINS = 600  # segments of a line: about as many as a print or a screen shows
TIME = "time (s)"
LEVEL = Rule(0.0, style="level")
COLOURS, DASHES = 7, 3  # of lines in the style sheet


def line_style(k: int) -> str:
    """Return the class of the style sheet for the k-th line of a panel."""
    return f"p{k % COLOURS} dash{k // COLOURS % DASHES}"
