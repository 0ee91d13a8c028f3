# SPDX-License-Identifier: MIT
"""Plain text of sources as Markdown: helps of commands, comments of headers, docstrings."""

from __future__ import annotations

import re
from pathlib import Path

DOCS = Path(__file__).resolve().parents[1]
# Code in backquotes stays as it is.
MARKUP = re.compile(r"(`[^`\n]+`)|([*_<>\[\]$`\\|#])")
# The underscore of a name may be escaped already.
PAGE = re.compile(r"\bdocs/((?:[a-z0-9/]|\\?_)+)\.md\b")


def as_markdown(text: str) -> list[str]:
    """Returns the text as lines of Markdown.

    Nothing in it is taken for markup but code in backquotes. Equations and programs, which are
    indented, become a block of code. The name of a page, such as docs/gap.md, becomes a link.
    """
    made: list[str] = []
    code = False
    before = ""
    for line in text.splitlines():
        indented = line.startswith(" ") and (code or begins_code(line, before))
        if indented != code and (indented or line.strip()):
            made += ["", "```text"] if indented else ["```", ""]
            code = indented
        made.append(line if code else linked(escaped(line.strip())))
        before = line
    return [*made, "```"] if code else made


def begins_code(line: str, before: str) -> bool:
    """Returns whether an indented line begins a block, and does not go on with a sentence."""
    return not before.strip() or before.endswith(":") or bool(re.search(r"=|<-", line))


def escaped(line: str) -> str:
    """Returns a line with its special characters as themselves."""
    return MARKUP.sub(lambda found: found[1] or "\\" + found[2], line)


def linked(line: str) -> str:
    """Returns a line of Markdown in which the names of pages are links."""

    def link(found: re.Match[str]) -> str:
        name = found[1].replace("\\", "")
        return f"[{found[0]}](/{name}.md)" if page_exists(name) else found[0]

    return PAGE.sub(link, line)


def page_exists(name: str) -> bool:
    """Returns whether there is a page of this name, such as gap/decision."""
    return (DOCS / f"{name}.md").is_file()
