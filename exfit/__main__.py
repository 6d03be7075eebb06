"""The program ``exfit``, also ``python -m exfit``: Ctrl-C ends it without a traceback."""

import gc
import sys

FEWEST_NEW = 300_000  # objects between two looks for circles of dead ones: a short fit needs none
INTERRUPTED = 130  # the exit code of exfit.cli.options.Interruption, not imported yet


def main() -> None:
    """Run the command that the arguments of the program name, and raise SystemExit."""
    gc.set_threshold(FEWEST_NEW)
    try:
        from exfit.cli import main as commands

        commands()
    except KeyboardInterrupt:
        print("Interrupted", file=sys.stderr)
        raise SystemExit(INTERRUPTED) from None


if __name__ == "__main__":
    main()
