# SPDX-License-Identifier: MIT
"""Files for controllers: CSV, Structured Text, TwinCAT, a C header, TOML, and the same as JSON."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import jinja2
import tomli_w

import ehsid

from ..base.encoding import json_text, to_plain
from ..base.files import write_text
from ..firmware import check_name
from ..firmware.header import comment
from .design import Commissioning

# The page comes from `show`.
FILES = (
    "apply.json",
    "apply.toml",
    "constants.csv",
    "valve_*.csv",
    "inverse_*.csv",
    "feed_forward_*.csv",
    "apply.st",
    "apply_twincat.st",
    "apply.h",
    "apply.html",
)
TEMPLATES = {
    "apply.st": "apply.st.j2",
    "apply_twincat.st": "apply_twincat.st.j2",
    "apply.h": "apply.h.j2",
}


def number(value: float) -> str:
    """Returns a number as C and IEC 61131-3 read it: with a point or an exponent with a point."""
    text = f"{value:.9g}"
    mantissa, e, exponent = text.partition("e")
    return (mantissa if "." in mantissa else f"{mantissa}.0") + e + exponent


def _plain(text: str) -> str:
    """Returns a text that ends no comment of C or Structured Text."""
    return comment(text).replace("*/", "*_").replace("*)", "*_")


def _wrapped(values: list[float], ending: str = "") -> list[str]:
    """Returns numbers as lines of five, with commas between them."""
    texts = [number(value) + ending for value in values]
    rows = [", ".join(texts[i : i + 5]) for i in range(0, len(texts), 5)]
    return [row + ("," if i < len(rows) - 1 else "") for i, row in enumerate(rows)]


def _rows(*columns: list[float]) -> list[str]:
    """Returns pairs, one a line, for a table of n x 2."""
    pairs = [", ".join(map(number, pair)) for pair in zip(*columns, strict=True)]
    return [pair + ("," if i < len(pairs) - 1 else "") for i, pair in enumerate(pairs)]


def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ehsid.harness.commissioning"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # C and Structured Text, not HTML
    )
    environment.filters |= {
        "number": number,
        "plain": _plain,
        "wrapped": _wrapped,
        "interval": lambda one: (
            "" if one.low is None else f", 90 %: {one.low:.4g} to {one.high:.4g}"
        ),
    }
    environment.globals["rows"] = _rows
    return environment


def _csv(header: list[str], rows: list[list[object]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue()


def write_commissioning(folder: Path, result: Commissioning, *, name: str = "axis") -> None:
    """Writes all files but the page into a folder that exists.

    Parameters
    ----------
    folder
        where to.
    result
        what to write.
    name
        prefix of the names in C and Structured Text.

    Raises
    ------
    ValueError
        the name is none of C.
    """
    check_name(name)
    write_text(folder / "apply.json", json_text(result))
    write_text(folder / "apply.toml", _toml(result))
    rows: list[list[object]] = [
        [one.name, one.value, one.low, one.high, one.unit, one.meaning, one.source]
        for one in result.constants
    ]
    header = ["name", "value", "low_90", "high_90", "unit", "meaning", "source"]
    write_text(folder / "constants.csv", _csv(header, rows))
    for table in result.tables:
        body: list[list[object]] = [list(row) for row in zip(*table.columns.values(), strict=True)]
        write_text(folder / f"{table.name}.csv", _csv(list(table.columns), body))
    environment = _environment()
    for file, template in TEMPLATES.items():
        text = environment.get_template(template).render(
            result=result, name=name, version=ehsid.__version__
        )
        write_text(folder / file, text)


def _toml(result: Commissioning) -> str:
    """The same as the JSON; TOML has no null, so that a missing interval is left out."""
    plain = to_plain(result)
    plain["constants"] = {
        one.pop("name"): {key: value for key, value in one.items() if value is not None}
        for one in plain["constants"]
    }
    plain["tables"] = {one.pop("name"): one for one in plain["tables"]}
    return tomli_w.dumps(plain)
