# SPDX-License-Identifier: MIT
"""Renders blocks: as an offline page, as HTML of other pages, in a notebook, as text, Markdown."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Iterator, Sequence
from functools import cache
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
from markupsafe import Markup

import ehsid

from ..base.error_words import printable
from ..base.files import write_text
from .page import Block, Items, Note, Page, Picture, Plot, Table, all_blocks, cell_text, whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Coordinates are in points, of which a page shows one and a half pixels at most. Two decimals are
# a hundredth of that; matplotlib writes six.
PATHS = re.compile(r' d="[^"]*"')
DECIMALS = re.compile(r"(\.\d\d)\d+")
# Colours of the reader's notebook, light or dark: a table adds lines and nothing else.
_CELL = "text-align:{};padding:2px 8px;border-bottom:1px solid rgba(128,128,128,0.35)"


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ehsid.harness.show"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_shown,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "embedded": embedded,
        "moving": moving,
        "kind": lambda block: type(block).__name__,
        "whole": whole,
    }
    return environment


def render_page(page: Page) -> str:
    """Returns the HTML of a page, which needs no other files."""
    contents = [*page.lead, *page.summary, *(b for part in page.sections for b in part.blocks)]
    plots = [block for block in all_blocks(contents) if isinstance(block, Plot)]
    library, script, places = _drawn(plots)
    return (
        _environment()
        .get_template("page.html.j2")
        .render(
            page=page,
            version=ehsid.__version__,
            library=library,
            script=script,
            places=dict(zip(plots, places, strict=True)),
        )
    )


def html(blocks: Sequence[Block], heading: int = 3) -> str:
    """Returns blocks without plots as a part of another page; `heading` is the level of theirs."""
    macros = _environment().get_template("blocks.html.j2").make_module({"places": {}})
    return str(macros.show(blocks, heading))  # type: ignore[attr-defined]


def _shown(value: Any) -> Any:
    """Returns what is put into a page: texts without control characters, finished HTML as it is."""
    if isinstance(value, str) and not isinstance(value, Markup):
        return printable(value)
    return value


def _drawn(plots: Sequence[Plot]) -> tuple[str, str, Sequence[str]]:
    """Returns the HTML of the library, of the script that draws, and of the place of each plot."""
    if not plots:
        return "", "", []
    from bokeh.embed import components  # only pages with plots wait for bokeh
    from bokeh.resources import Resources

    script, places = components([plot.figure for plot in plots])
    # Not `render_js`: where Panel is imported, it would name files of Panel as well.
    parts = Resources(mode="inline", components=["bokeh"]).js_raw
    library = "\n".join(f'<script type="text/javascript">\n{part}\n</script>' for part in parts)
    return library, script, places


def write_page(path: Path, page: Page) -> None:
    """Writes the page, whole or not at all; its folder exists."""
    write_text(path, render_page(page))


def write_pictures(folder: Path, page: Page) -> list[Path]:
    """Writes every picture of the page as a PNG file, numbered and named after its section.

    Returns the paths in the order of the page.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    titled = [("summary", page.summary), *((part.title, part.blocks) for part in page.sections)]
    for title, blocks in titled:
        slug = re.sub(r"[^a-z0-9]+", "_", title.lower()).strip("_")
        for block in all_blocks(blocks):
            if isinstance(block, Picture):
                path = folder / f"{len(written) + 1:02d}_{slug}.png"
                block.figure.savefig(path, dpi=110, format="png")
                written.append(path)
    return written


def embedded(figure: Figure) -> str:
    """Returns a figure as a data URI with an SVG image; the same figure gives the same bytes.

    It is sharp at every size, and small.
    """
    import matplotlib as mpl

    text = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "ehsid"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    small = PATHS.sub(lambda path: DECIMALS.sub(r"\1", path[0]), text.getvalue())
    return "data:image/svg+xml;base64," + base64.b64encode(small.encode("utf-8")).decode("ascii")


# Time that a frame of a moving picture stays, and its last one, ms; and its sharpness.
FRAME_MS, LAST_MS, FRAME_DPI = 250, 4000, 90


def moving(picture: Picture) -> str:
    """Returns the frames of a picture, and then its figure, as a data URI that plays for ever."""
    from PIL import Image

    frames = []
    for figure in (*picture.frames, picture.figure):
        drawn = io.BytesIO()
        figure.savefig(drawn, dpi=FRAME_DPI, format="png")
        frames.append(Image.open(drawn).convert("RGB"))
    data = io.BytesIO()
    lasting = [*[FRAME_MS] * len(picture.frames), LAST_MS]
    first, *others = frames
    first.save(data, "PNG", save_all=True, append_images=others, duration=lasting, loop=0)
    return "data:image/png;base64," + base64.b64encode(data.getvalue()).decode("ascii")


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
        head, *rows = [[text.replace("|", "\\|") for text in row] for row in table_texts(block)]
        cells = [head, ["---"] * len(head), *rows]
        return [block.caption, "", *(f"| {' | '.join(row)} |" for row in cells)]
    raise TypeError(f"{type(block).__name__} has no form in Markdown")


def table_texts(table: Table, mark: str = "") -> list[list[str]]:
    """Returns the texts of the headings and of each row; `mark` is put behind marked names."""
    cells = [[cell_text(cell) for cell in row] for row in table.rows]
    for row in table.marked:
        cells[row][0] += mark
    return [[one if isinstance(one, str) else "" for one in table.columns], *cells]


def text(blocks: Sequence[Block]) -> str:
    """Returns sentences, lists and tables as plain text, with an empty line around each table."""
    parts: list[str] = []
    for block in blocks:
        if isinstance(block, Table):
            parts += ["", *_aligned(block), ""]
        elif isinstance(block, Items):
            parts += [f"- {printable(cell_text(item))}" for item in block.items]
        else:
            assert isinstance(block, str | Note)
            parts.append(printable(block if isinstance(block, str) else block.text))
    return re.sub("\n{3,}", "\n\n", "\n".join(parts)).strip("\n")


def _aligned(table: Table) -> list[str]:
    lines = [list(map(_on_a_line, row)) for row in table_texts(table, " *")]
    shown = []
    for column, cells in enumerate(zip(*lines, strict=True)):
        width = max(map(len, cells))
        left = column == 0 or table.align(column) != "number"
        padded = [cell.ljust(width) if left else cell.rjust(width) for cell in cells]
        shown.append([padded[0], "-" * width, *padded[1:]])
    rows = ["  ".join(row).rstrip() for row in zip(*shown, strict=True)]
    return [one for one in (_on_a_line(table.caption), *rows, _on_a_line(table.note)) if one]


def notebook(table: Table) -> str:
    """Returns a table as HTML without a style sheet; all texts are escaped."""
    tags = ["th", *["td"] * len(table.rows)]
    sides = ["right" if table.align(i) == "number" else "left" for i in range(len(table.columns))]
    styles = [_CELL.format(side) for side in ("left", *sides[1:])]
    head, *body = [
        "<tr>"
        + "".join(
            f'<{tag} style="{style}">{_safe(cell)}</{tag}>'
            for style, cell in zip(styles, row, strict=True)
        )
        + "</tr>"
        for tag, row in zip(tags, table_texts(table, " *"), strict=True)
    ]
    caption = f"<caption>{_safe(table.caption)}</caption>" if table.caption else ""
    below = f"<p>{_safe(table.note)}</p>" if table.note else ""
    return f"<table>{caption}<thead>{head}</thead><tbody>{''.join(body)}</tbody></table>{below}"


def _on_a_line(words: str) -> str:
    return printable(words).replace("\n", " ")


def _safe(words: str) -> str:
    return escape(printable(words))
