"""Equations as MathML, which browsers draw by themselves: no network, no JavaScript."""

import re
from typing import Any, Final

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

logger = logging.getLogger(__name__)

OPERATOR: Final = re.compile(r"<(mi|mo)>([A-Za-z]{2,})</\1>(?=(<mo [^>]*>&#x00028;|<mrow><mo)?)")
"""The name of a function, with the parenthesis after it if present."""

LONE_UPRIGHT: Final = re.compile(r"\\mathrm\{(\w)\}")
"""One upright letter in braces, which latex2mathml would make italic."""


def inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write an equation within a line."""
    translator.body.append(mathml(node, "inline"))
    raise nodes.SkipNode


def block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write a displayed equation."""
    translator.body.append(f'<div class="math-block">{mathml(node, "block")}</div>\n')
    raise nodes.SkipNode


def mathml(node: nodes.Element, display: str) -> str:
    """Write what a node holds; a command of LaTeX that is left is a warning."""
    latex = LONE_UPRIGHT.sub(r"\\mathrm \1 ", node.astext())
    written: str = convert(latex, display=display)
    if "\\" in written:
        logger.warning("equation with an unknown command: %s", node.astext(), location=node)
    return OPERATOR.sub(spaced, written)


def spaced(operator: re.Match[str]) -> str:
    """Write the name of a function with the space that TeX leaves about it."""
    after = "0" if operator[3] else "0.17em"
    return f'<mo lspace="0.17em" rspace="{after}">{operator[2]}</mo>'


def setup(app: Sphinx) -> dict[str, Any]:
    """Tell Sphinx of the renderer."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
