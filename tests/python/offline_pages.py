# SPDX-License-Identifier: MIT
"""Pages as a browser would read them: what they fetch, how their tags nest, their words."""

from html.parser import HTMLParser


class References(HTMLParser):
    """Everything a browser would fetch or follow, how the tags nest, and the words outside scripts.

    Attributes
    ----------
    sources, targets
        what is fetched, and what links lead to.
    seen
        names of the tags.
    """

    VOID = frozenset({"meta", "img", "link", "br"})

    def __init__(self) -> None:
        super().__init__()
        self.sources: list[str] = []
        self.targets: list[str] = []
        self.ids: list[str] = []
        self.seen: set[str] = set()
        self.open: list[str] = []
        self.words: list[str] = []

    @property
    def found(self) -> list[str]:
        return [*self.sources, *self.targets]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert tag not in {"link", "iframe"}
        self.seen.add(tag)
        self.sources += [value or "" for name, value in attrs if name in {"src", "srcset"}]
        self.targets += [value or "" for name, value in attrs if name == "href"]
        self.ids += [value or "" for name, value in attrs if name == "id"]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not {"script", "style"} & set(self.open):
            self.words.append(data)


def read(html: str) -> References:
    parser = References()
    parser.feed(html)
    parser.close()
    assert parser.open == []
    return parser
