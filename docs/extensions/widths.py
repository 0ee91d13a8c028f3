# SPDX-License-Identifier: MIT
"""Tells the style sheet what is wide: cells with long names or much text, prose in a block.

No word of a table is broken, so that a short column stays whole beside a long text, and no short
word of code, such as an option at its hyphens. Only a name that is longer than a telephone can show
is broken where it must. A block of code keeps its lines, but for what a command says in whole
sentences.
"""

from __future__ import annotations

from docutils import nodes
from sphinx.application import Sphinx

# A longer word may be broken; a cell with more text than this is not narrow.
LONGEST_WORD, MUCH_TEXT = 24, 60
# A longer line of what was printed is prose, and not a row of a table.
LONGEST_ROW = 120
# Blocks with what was printed, on pages and in notebooks.
PRINTED = ("text", "myst-ansi")


def mark_wide(app: Sphinx, doctree: nodes.document) -> None:
    """Gives classes to cells and blocks of a page."""
    for cell in doctree.findall(nodes.entry):
        text = cell.astext()
        if any(len(word) > LONGEST_WORD for word in text.split()):
            cell["classes"].append("long")
        elif len(text) > MUCH_TEXT:
            cell["classes"].append("much")
    for code in doctree.findall(nodes.literal):
        if all(len(word) <= LONGEST_WORD for word in code.astext().split()):
            code["classes"].append("whole")
    for block in doctree.findall(nodes.literal_block):
        lines = block.astext().splitlines()
        if block.get("language") in PRINTED and any(len(line) > LONGEST_ROW for line in lines):
            block["classes"].append("prose")


def setup(app: Sphinx) -> dict[str, bool]:
    """Marks what is wide on each page after it was read."""
    app.connect("doctree-read", mark_wide)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
