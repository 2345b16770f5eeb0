"""Builds the documentation: `make docs`."""

import re
from pathlib import Path

from sphinx.application import Sphinx

_manifest = (Path(__file__).parents[1] / "Cargo.toml").read_text(encoding="utf-8")

project = "servoid"
author = "the servoid developers"
copyright = "2026, the servoid developers"
release = re.findall(r'^version = "(.*)"$', _manifest, flags=re.MULTILINE)[0]

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx-mathjax-offline",  # formulas are drawn without a network
]
exclude_patterns = ["_build"]
nitpicky = False

myst_enable_extensions = ["amsmath", "deflist", "dollarmath"]
myst_heading_anchors = 3
# Equations carry numbers of their own, which the sources refer to.
myst_dmath_allow_labels = False

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True

html_theme = "furo"
html_title = f"servoid {release}"
html_static_path = ["_static"]
html_css_files = ["words.css"]


def _shorten_arrays(*event: object) -> tuple[str | None, str | None]:
    """Write `NDArray[uint8]` where Python writes out what that stands for."""
    written = [part if isinstance(part, str) else None for part in event[-2:]]
    long = re.compile(
        r"~?[\w.]*ndarray\[tuple\[~?[\w.]*Any, \.\.\.\], ~?[\w.]*dtype\[~?[\w.]*?(\w+)\]\]"
    )
    signature, answer = (part and long.sub(r"NDArray[\1]", part) for part in written)
    return signature, answer


def setup(app: Sphinx) -> None:
    """Let Sphinx call `_shorten_arrays` for each signature."""
    app.connect("autodoc-process-signature", _shorten_arrays)
