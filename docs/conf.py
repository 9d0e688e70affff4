"""Sphinx settings of the documentation: ``make docs`` builds it into docs/_build without a network."""

import sys
from importlib.metadata import version as version_of
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import pages

project = "contact-crosscheck"
author = "the contact-crosscheck developers"
version = release = version_of("contact-crosscheck")
extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc", "sphinx_click"]
exclude_patterns = ["_build", "templates"]
myst_heading_anchors = 3
numpydoc_show_class_members = False
autodoc_typehints = "none"
html_theme = "pydata_sphinx_theme"
html_title = "contact-crosscheck"
html_theme_options = {"navigation_with_keys": False, "secondary_sidebar_items": ["page-toc"]}
smartquotes = False  # options begin with two hyphens
lists = ("symptoms", "forces", "numbers", "ports", "tolerances", "references")
html_sidebars = {name: [] for name in ("index", "start", "worked-example", "method", *lists)}
html_static_path = ["static"]
html_css_files = ["wide.css"]
html_js_files = ["tables.js"]
html_show_sourcelink = False
html_extra_path = ["../reports/published"]


def setup(app):
    """Write the pages that are made from scenes, engines and fixes before anything is read."""
    app.connect("builder-inited", lambda app: pages.write(Path(app.srcdir)))
