# SPDX-License-Identifier: MIT
"""How results show themselves: in a line, in a notebook, and at length."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from html import escape

from ..base.text import printable
from ..show import rendering
from ..show.page import Table, Told
from .wording import in_python_words


class Shown(ABC):
    """A result with a line and blocks; what they hold comes from the harness."""

    @abstractmethod
    def _line(self) -> str:
        """Returns the main figures with their units, for one line."""

    @abstractmethod
    def _blocks(self) -> Sequence[Told]:
        """Returns tables and sentences; a notebook shows the first table."""

    def __repr__(self) -> str:
        # A name may have a line end; this is one line whatever it has. The spaces between numbers
        # and units, which keep them together on a page, are plain ones here.
        line = printable(self._line()).replace("\n", "\\n").replace("\N{NO-BREAK SPACE}", " ")
        return f"<ehsid.{type(self).__name__}: {line}>"

    def _repr_html_(self) -> str:
        """Returns the line and the first table for a notebook, in the colours of its page."""
        name = type(self).__name__
        line = escape(printable(self._line()))
        tables = [block for block in self._blocks() if isinstance(block, Table)]
        first = "".join(map(rendering.notebook, tables[:1]))
        return f"<div><p><strong>{name}</strong> {line}</p>{first}</div>"

    def summary(self) -> str:
        """Returns the result at length as plain text: the tables, and then the sentences."""
        blocks = sorted(self._blocks(), key=lambda block: not isinstance(block, Table))
        return in_python_words(rendering.text(blocks))
