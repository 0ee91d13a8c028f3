# SPDX-License-Identifier: MIT
"""Pages as a browser would read them: what they fetch, how their tags nest, their words."""

from html.parser import HTMLParser


class References(HTMLParser):
    """Everything a browser would fetch or follow, and how the tags nest."""

    VOID = frozenset({"meta", "img", "link", "br"})

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self.open: list[str] = []
        self.words: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [value or "" for name, value in attrs if name in {"src", "href", "srcset"}]
        assert tag not in {"link", "iframe"}
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open[-1:] != ["script"]:
            self.words.append(data)


def read(html: str) -> References:
    parser = References()
    parser.feed(html)
    parser.close()
    assert parser.open == []
    return parser
