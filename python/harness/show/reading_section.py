# SPDX-License-Identifier: MIT
"""What was taken for what in a log of another layout, as a part of any page."""

from __future__ import annotations

from ..records import Origin
from .page import Folded, Items, Section, Table, Told


def origin_table(origin: Origin) -> Table:
    """Returns which column was taken for which channel, and why."""
    return Table("", ("column", "taken for", "unit", "factor", "why"), origin.rows())


def reading_blocks(origin: Origin) -> list[Told]:
    """Returns the table of the columns, and the remarks on what was changed and guessed."""
    blocks: list[Told] = [f"The file was read as {origin.kind}."]
    if origin.taken:
        blocks.append(origin_table(origin))
    if origin.remarks:
        blocks.append(Items(list(origin.remarks)))
    return blocks


def reading_section(origin: Origin) -> Section:
    """Returns the blocks as a section of their own."""
    return Section("How the log was read", reading_blocks(origin))


def reading_folded(name: str, origin: Origin) -> Folded:
    """Returns the blocks under a title with the name of the record, folded."""
    return Folded(f"How the log {name} was read", reading_blocks(origin))
