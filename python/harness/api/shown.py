# SPDX-License-Identifier: MIT
"""How results show themselves: in a line, in a notebook, and at length."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from html import escape

from ..base.text import printable
from ..show.text_table import TextTable


class Shown(ABC):
    """A result with a line, sentences and tables; what they hold comes from the harness."""

    @abstractmethod
    def _line(self) -> str:
        """Returns the main figures with their units, for one line."""

    @abstractmethod
    def _sentences(self) -> Sequence[str]:
        """Returns what is to be known beside the tables."""

    @abstractmethod
    def _tables(self) -> Sequence[TextTable]:
        """Returns the tables; a notebook shows the first one."""

    def __repr__(self) -> str:
        # A name may have a line end; this is one line whatever it has. The spaces between numbers
        # and units, which keep them together on a page, are plain ones here.
        line = printable(self._line()).replace("\n", "\\n").replace("\N{NO-BREAK SPACE}", " ")
        return f"<ehsid.{type(self).__name__}: {line}>"

    def _repr_html_(self) -> str:
        """Returns the line and the first table for a notebook, in the colours of its page."""
        name = type(self).__name__
        line = escape(printable(self._line()))
        tables = "".join(table.html() for table in self._tables()[:1])
        return f"<div><p><strong>{name}</strong> {line}</p>{tables}</div>"

    def summary(self) -> str:
        """Returns the result at length as plain text: tables and sentences, as the command does."""
        tables = [table.text() for table in self._tables()]
        sentences = printable("\n".join(self._sentences()))
        return "\n\n".join(part for part in (*tables, sentences) if part)
