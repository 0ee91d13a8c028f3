# SPDX-License-Identifier: MIT
"""Functions that several commands share: reading of signals, errors, writing of results."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NoReturn

import typer
from rich.table import Table

from ehsid.harness.cli.console import printable
from ehsid.harness.files import write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ehsid.harness.identification import IoData
    from ehsid.harness.records import Hints, Origin


# Beyond these a search over orders and delays takes hours, and its models have no meaning.
MOST_ORDER, MOST_DELAY = 50, 1000


def refuse(message: str) -> NoReturn:
    """Prints an error message on stderr and ends the program with exit code 2."""
    typer.echo(f"ehsid: {printable(message)}", err=True)
    raise typer.Exit(2)


def parse_range(text: str, option: str, most: int) -> range:
    """Returns the range that a text such as "2-5" or "3" names, upper end included.

    Raises
    ------
    ValueError
        the text is no range of whole numbers from 0 to `most`.
    """
    match = re.fullmatch(r"([0-9]{1,9})(?:-([0-9]{1,9}))?", text.strip())
    low, high = (int(match[1]), int(match[2] or match[1])) if match else (0, -1)
    if not low <= high <= most:
        raise ValueError(
            f"{option} {text!r}: expected a number or a range such as 2-5, at most {most}"
        )
    return range(low, high + 1)


def read_io(
    path: Path, input_name: str, output_name: str, hints: Hints
) -> tuple[IoData, Origin | None]:
    """Reads the input column and the output column of a record.

    What was taken for what in a log of another layout is shown on stderr, and returned.
    """
    from ehsid.harness.cli.log_options import read_shown
    from ehsid.harness.identification import IoData

    record = read_shown(path, hints, columns=[input_name, output_name])
    return IoData.from_record(record, input_name, output_name), record.origin


def with_reading(results: dict[str, Any], origin: Origin | None) -> dict[str, Any]:
    """Returns results as JSON has them, with what was taken for what in a log as "reading"."""
    return results if origin is None else {**results, "reading": origin.to_dict()}


def write_results(folder: Path, stem: str, results: dict[str, Any], figure: Figure) -> None:
    """Writes STEM.json and STEM.png into a folder."""
    write_text(folder / f"{stem}.json", json.dumps(results, indent=2, allow_nan=False) + "\n")
    write_figure(folder / f"{stem}.png", figure)


def write_figure(path: Path, figure: Figure) -> None:
    """Writes a figure as PNG."""
    figure.savefig(path, dpi=120, format="png")


def make_table(
    headings: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    justify: Literal["left", "right"] = "right",
    **settings: Any,
) -> Table:
    """Returns a table for the terminal: the first column to the left, the others as `justify`."""
    table = Table(**settings)
    for i, heading in enumerate(headings):
        table.add_column(heading, justify=justify if i else "left")
    for row in rows:
        table.add_row(*row)
    return table
