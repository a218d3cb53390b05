"""The manual as a site: `make docs`.

Formulas become MathML when the site is built, with the converter of docutils, on which Sphinx itself stands. Browsers
draw it themselves, so no script and no font is fetched. Notebooks are run. A cell that fails, a broken link and a
warning end the build. It is not parallel: Sphinx then loses errors of the process that writes pages.
"""

import os
import sys
from pathlib import Path

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent), str(HERE.parent / "src")]
os.environ["PYTHONPATH"] = os.pathsep.join(sys.path[:3])  # of the notebooks

import api_pages  # noqa: E402
import generated  # noqa: E402

import roughslip  # noqa: E402

project, author, copyright, language = "roughslip", "", "", "en"
version = release = roughslip.__version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.viewcode"]
# Measurements are for developers; snippets stand on the pages of their functions.
exclude_patterns = ["_build", "notebook", "reference/snippets.md"]
html_theme, html_title = "furo", f"roughslip {version}"
html_static_path, html_css_files = ["_static"], ["manual.css"]
html_show_copyright = html_show_sphinx = html_copy_source = False
html_theme_options = {"top_of_page_buttons": []}

myst_enable_extensions = ["amsmath", "attrs_inline", "deflist", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode, nb_execution_raise_on_error, nb_execution_timeout = "force", True, 300
nb_merge_streams, nb_output_stderr = True, "remove"  # stderr: that code is compiled

autodoc_member_order, autodoc_typehints_format = "bysource", "short"
# Types of other packages: their manuals are on the network, which the build does not ask.
nitpick_ignore_regex = [("py:.*", ".*")]


def mathml(node: nodes.Element, *, as_block: bool) -> str:
    """A formula for browsers. One that the converter does not understand is a warning, and so ends the build."""
    try:
        return tex2mathml(node.astext(), as_block=as_block)
    except MathError as error:
        logging.getLogger(__name__).warning("%s in %s", error, node.astext(), location=node)
        return ""


def inline_formula(translator: nodes.NodeVisitor, node: nodes.Element) -> None:
    """A formula in a line."""
    translator.body.append(mathml(node, as_block=False))
    raise nodes.SkipNode


def displayed_formula(translator: nodes.NodeVisitor, node: nodes.Element) -> None:
    """A formula on lines of its own, with its number."""
    number = f'<span class="eqno">({node["number"]})</span>' if node.get("number") else ""
    anchor = f' id="{node["ids"][0]}"' if node.get("ids") else ""
    translator.body.append(f'<div class="math"{anchor}>{number}{mathml(node, as_block=True)}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Formulas, and the parts of pages that follow from the source."""
    app.add_html_math_renderer("mathml", (inline_formula, None), (displayed_formula, None))
    app.config.html_math_renderer = "mathml"
    app.connect("source-read", generated.fill)
    app.connect("autodoc-process-docstring", api_pages.as_restructured_text)
    api_pages.write(HERE / "reference" / "api")
