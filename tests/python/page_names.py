# SPDX-License-Identifier: MIT
"""Names that are markup, script or template, and what a browser makes of a page with them."""

from __future__ import annotations

import base64
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser

PLAIN = "plain"
EVIL = {
    "element": "<b onmouseover=alert(1)>x</b>",
    "script": "<script>alert(1)</script>",
    "end of script": "</script><script>alert(1)</script>",
    "attribute": '" onmouseover="alert(1)',
    "image": "'><img src=x onerror=alert(1)>",
    "style": "</style><link href=//evil>",
    "comment": "<!-- x --> ]]> */ x",
    "entity": "&lt;b&gt; &amp; &#60;",
    "expression": "{{7*7}} ${7*7} #{7*7}",
    "statement": "{% raw %}{% include 'x' %}{# x #}",
    "console": "[/red][bold]x[/bold] :smile:",
    "formula": "$x_{$ \\frac{1}",
    "direction": "gnp\u202egnp.exe\u2066",
    "control": "x\x1b[2Jy\x07z\x9b",
    "long": "n" * 200,
}


def file_name(name: str) -> str:
    """The name as a file may have it: a slash is none of it, and there are 255 bytes."""
    return name.replace("/", "\u2044")


class Reader(HTMLParser):
    """The elements of a page with the names of their attributes, and its words."""

    def __init__(self) -> None:
        super().__init__()
        self.elements: list[tuple[str, ...]] = []
        self.values: list[str] = []
        self.words: list[str] = []
        self.pictures: list[str] = []
        self._raw = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, *(name for name, _ in attrs)))
        self.values += [value or "" for name, value in attrs if name in ("href", "src", "srcset")]
        self.words += [value or "" for name, value in attrs if name in ("title", "aria-label")]
        self._raw = tag if tag in ("script", "style") else ""

    def handle_endtag(self, tag: str) -> None:
        self.elements.append((f"/{tag}",))
        self._raw = ""

    def handle_comment(self, data: str) -> None:
        self.elements.append(("comment",))

    def handle_data(self, data: str) -> None:
        if not self._raw:
            self.words.append(data)


def read_page(html: str) -> Reader:
    """Reads a page; its pictures must be drawings without scripts, and it must fetch nothing."""
    reader = Reader()
    reader.feed(html)
    reader.close()
    for value in reader.values:
        if value.startswith("data:image/svg+xml;base64,"):
            drawing = ET.fromstring(base64.b64decode(value.partition(",")[2]))
            assert not [one for one in drawing.iter() if one.tag.endswith("}script")]
        elif value.startswith("data:image/png;base64,"):  # a moving picture
            assert base64.b64decode(value.partition(",")[2]).startswith(b"\x89PNG\r\n")
        else:
            assert value.startswith("#"), value[:80]
    return reader


def words(text: str) -> str:
    """The text with single spaces, as a browser shows it."""
    return re.sub(r"\s+", " ", text)
