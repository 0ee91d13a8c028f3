# SPDX-License-Identifier: MIT
"""Writes formulas as MathML, which browsers draw themselves: no script, no font, no network."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util import logging

LOGGER = logging.getLogger(__name__)
# What the converter does not know, in what it knows. Sphinx numbers the formulas itself.
REWRITTEN = (
    (r"\\(begin|end)\{equation\*?\}", ""),
    (r"\\(begin|end)\{(?:aligned|align|align\*|gather|gathered)\}", r"\\\1{split}"),
    (r"\\(arg|sgn|diag|tr|cov|var)(?![a-zA-Z])", r"\\operatorname{\1}"),
)


def mathml(node: Any, display: str) -> str:
    """Returns the formula of a node; what could not be read is a warning."""
    latex = node.astext()
    for pattern, replacement in REWRITTEN:
        latex = re.sub(pattern, replacement, latex)
    made = convert(latex, display=display)
    left = re.search(r">\\\w+<", made)
    if left:
        LOGGER.warning("math: %s is not known as LaTeX", left[0][1:-1], location=node)
    return made


def inline(writer: Any, node: nodes.math) -> None:
    """Writes a formula in a line."""
    writer.body.append(mathml(node, "inline"))
    raise nodes.SkipNode


def block(writer: Any, node: nodes.math_block) -> None:
    """Writes a formula of its own, with its number where it has one."""
    writer.body.append(writer.starttag(node, "div", CLASS="formula"))
    writer.body.append(f"<div>{mathml(node, 'block')}</div>")
    if node.get("number"):
        writer.body.append(f'<span class="eqno">({node["number"]})')
        writer.add_permalink_ref(node, "Link to this equation")
        writer.body.append("</span>")
    writer.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Makes this the way of writing formulas in pages."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
