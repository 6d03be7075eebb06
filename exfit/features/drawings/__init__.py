"""Block diagrams of models as vector graphics, made from their drawings with letters."""
