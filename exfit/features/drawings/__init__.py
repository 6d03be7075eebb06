"""Block diagrams of models as vector graphics, made from their drawings with letters."""

PICTURES = {"overview": "catalogue_page:write_overview"}
