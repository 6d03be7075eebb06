"""How Sphinx builds the site: sphinx-build -W docs build/docs."""

import sys
from pathlib import Path

from exfit import __version__

sys.path.insert(0, str(Path(__file__).parent))  # generate.py

project = "exfit"
author = "the authors of exfit"
release = version = __version__
copyright = author

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "generate"]
exclude_patterns = ["build", "_build", "**.ipynb_checkpoints"]

html_theme = "furo"
html_title = "exfit"
html_theme_options = {"navigation_with_keys": True}
html_static_path = ["static"]
html_css_files = ["exfit.css"]

highlight_language = "none"
myst_heading_anchors = 3
nb_execution_mode = "force"  # the notebook has no outputs stored
nb_execution_raise_on_error = True
nb_execution_timeout = 120  # s, for each cell
nb_merge_streams = True

autodoc_typehints = "none"  # the docstrings say it shorter
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
