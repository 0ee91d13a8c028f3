# SPDX-License-Identifier: MIT
r"""Lets the links of pages out of docs/ lead somewhere on the site.

On a code host `[README](../README.md)` leads to a file of the repository. On the site some files
and folders of the repository are pages of their own, listed in PAGES, and a folder of docs/ is its
index. Any other file becomes a download. A link to what does not exist stays, and MyST warns of it.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parents[2]
# File or folder of the repository -> the page that shows it.
PAGES = {
    "CHANGELOG.md": "reference/changelog",
    "CONTRIBUTING.md": "reference/contributing",
    "README.md": "readme",
    "SECURITY.md": "reference/security",
    "docs/notebooks": "tutorials/index",
    "docs/schemas": "reference/files",
    "examples/data/README.md": "reference/example_records",
    "examples/firmware/servo": "reference/examples#firmware",
    "examples/rigs": "reference/examples#rig-files",
}
# A link of Markdown: its text may have a link or picture inside, its target has no space.
LINK = re.compile(r"\]\((?!https?:|mailto:|#|/)([^)\s#]+)(#[^)\s]*|)\)")


def adapt(app: Sphinx, docname: str, source: list[str]) -> None:
    """Shows a file of the repository in place of its page, and changes links out of docs/."""
    folder = posixpath.join("docs", posixpath.dirname(docname))
    shown = next(
        (name for name, page in PAGES.items() if page == docname and name.endswith(".md")), ""
    )
    if shown:
        path = ROOT / shown
        app.env.note_dependency(str(path), docname=docname)
        source[0] = path.read_text(encoding="utf-8")
        folder = posixpath.dirname(shown)

    def adapted(link: re.Match[str]) -> str:
        name = posixpath.normpath(posixpath.join(folder, link[1]))
        at = posixpath.relpath(name, posixpath.dirname(f"docs/{docname}"))
        if page_of(name):
            page, _, own = page_of(name).partition("#")
            return f"](/{page}.md{link[2] or (own and '#' + own)})"
        if not name.startswith("docs/") and (ROOT / name).is_file():
            return f"](path:{at})"
        return f"]({at}{link[2]})" if shown and (ROOT / name).exists() else link[0]

    source[0] = LINK.sub(adapted, source[0])


def page_of(name: str) -> str:
    """Returns the page that shows a file or folder of the repository, "" where none does."""
    if (ROOT / name / "index.md").is_file():
        return name.removeprefix("docs/") + "/index"
    return PAGES.get(name, "") if (ROOT / name).exists() else ""


def without_file() -> list[str]:
    """Returns the pages whose file is not in the repository."""
    return [page + ".md" for name, page in PAGES.items() if not (ROOT / name).exists()]


def setup(app: Sphinx) -> dict[str, bool]:
    """Changes each page before it is read."""
    app.connect("source-read", adapt)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
