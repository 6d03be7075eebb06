"""Block diagrams of models as vector graphics, made from their drawings with letters."""

from exfit.features.drawings.diagram import block_diagram, document
from exfit.features.drawings.letters import diagram_and_remarks

__all__ = ["block_diagram", "diagram_and_remarks", "document"]
