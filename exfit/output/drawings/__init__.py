"""Block diagrams of models as vector graphics, made from their drawings with letters."""

from exfit.output.drawings.diagram import block_diagram, document
from exfit.output.drawings.letters import diagram_and_remarks

__all__ = ["block_diagram", "diagram_and_remarks", "document"]
