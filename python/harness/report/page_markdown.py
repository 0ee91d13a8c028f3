# SPDX-License-Identifier: MIT
"""Renders a page as Markdown for the documentation; pictures are separate files beside it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ehsid.harness.report.page import Page, Picture, Table, Words


def markdown(page: Page, pictures: Sequence[Path]) -> str:
    """Returns the page as Markdown; `pictures` are its picture files in the order of the page."""
    files = iter(pictures)
    lines = [f"# {page.title}", ""]
    for text in page.lead:
        lines += [text, ""]
    for section in page.sections:
        lines += [f"## {section.title}", ""]
        for block in section.blocks:
            if isinstance(block, Words):
                lines += [block.text, ""]
            elif isinstance(block, Table):
                lines += [*_table(block), ""]
            elif isinstance(block, Picture):
                lines += [f"![{block.alt}]({next(files).name})", "", block.caption, ""]
    return "\n".join(lines).rstrip() + "\n"


def _table(table: Table) -> list[str]:
    return [
        table.caption,
        "",
        _row(table.columns),
        _row(["---"] * len(table.columns)),
        *(_row(row) for row in table.rows),
    ]


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
