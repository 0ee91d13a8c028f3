# SPDX-License-Identifier: MIT
"""Renders a page as Markdown for the documentation; pictures are separate files beside it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from .page import Block, Link, Page, Picture, Table, Tagged


def markdown(page: Page, pictures: Sequence[Path]) -> str:
    """Returns the page as Markdown; `pictures` are its picture files in the order of the page.

    Raises
    ------
    TypeError
        the page has a block that is neither text, table nor picture.
    """
    files = iter(pictures)
    lines = [f"# {page.title}", ""]
    parts = [("", page.lead), ("", page.summary), *((s.title, s.blocks) for s in page.sections)]
    for heading, blocks in parts:
        lines += [f"## {heading}", ""] if heading else []
        for block in blocks:
            lines += [*_lines(block, files), ""]
    return "\n".join(lines).rstrip() + "\n"


def _lines(block: Block, files: Iterator[Path]) -> list[str]:
    if isinstance(block, str):
        return [block]
    if isinstance(block, Picture):
        return [f"![{block.alt}]({next(files).name})", "", block.caption]
    if isinstance(block, Table):
        head = [_row(block.columns), _row(["---"] * len(block.columns))]
        return [block.caption, "", *head, *map(_row, block.rows)]
    raise TypeError(f"{type(block).__name__} has no form in Markdown")


def _row(cells: Sequence[object]) -> str:
    texts = [cell.text if isinstance(cell, Tagged | Link) else str(cell) for cell in cells]
    return "| " + " | ".join(text.replace("|", "\\|") for text in texts) + " |"
