"""The block diagram of a model: its drawing with letters, placed and written as SVG."""

from collections.abc import Sequence

from exfit.features.drawings.layout import picture
from exfit.features.drawings.letters import diagram_and_remarks, read
from exfit.features.drawings.parts import DiagramPart
from exfit.features.drawings.svg import svg

# of a file of its own; on a page a drawing has the page's colours
STYLE = (
    "<style>svg{color:#1d232b;background:#fff}"
    "@media(prefers-color-scheme:dark){svg{color:#e3e6ea;background:#131416}}</style>"
)


def block_diagram(drawing: str, name: str, title: str) -> str:
    """Return the block diagram in a model's text as SVG in the colours of its page.

    It is empty where the text has no diagram. ``name`` begins the ids of its title and of its
    description in words, and must be its alone on a page.
    """
    diagram, _ = diagram_and_remarks(drawing)
    if not diagram:
        return ""
    placed = picture(read(diagram))
    words = _words([part.part for part in placed.placed])
    return svg(placed, f"diagram-{name}", f"Block diagram of {name}: {title}", words)


def document(diagram: str) -> str:
    """Return a block diagram as a file of its own, dark where the reader's screen is."""
    head, end, rest = diagram.partition(">")
    return f"{head}{end}{STYLE}{rest}\n"


def _words(parts: Sequence[DiagramPart]) -> str:
    """Return the inputs, blocks and outputs of a diagram in words, in the order of reading."""
    in_order = sorted(parts, key=lambda part: (part.element.top, part.element.left))
    texts = {
        "Inputs": [_letters(part) for part in in_order if part.role == "input"],
        "Blocks": [_block(part, in_order) for part in in_order if part.role == "block"],
        "Outputs": [_letters(part) for part in in_order if part.role == "output"],
    }
    return " ".join(f"{name}: {'; '.join(words)}." for name, words in texts.items() if words)


def _block(block: DiagramPart, parts: Sequence[DiagramPart]) -> str:
    """Word a block with its limits."""
    limits = [_letters(part) for part in parts if part.owner == block.element]
    return _letters(block) + (f" (limits: {', '.join(limits)})" if limits else "")


def _letters(part: DiagramPart) -> str:
    rows = [row.strip("[]").strip() for row in part.element.rows]
    if len(rows) == 1:
        return rows[0]
    return " ".join(rows) if rows[1].startswith(("+", "-")) else " over ".join(rows)
