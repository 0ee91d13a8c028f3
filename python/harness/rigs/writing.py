# SPDX-License-Identifier: MIT
"""Writes a rig as TOML.

Writes a rig as TOML in which each value has a comment on what it is and where it comes from.

What differs between two rigs: values that moved, and values that were added or left out.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from ..base.error_words import printable
from ..base.files import write_text
from ..catalogue.parameters import plant_parameters
from .errors import RigError
from .new import Entry
from .rig import Rig


def rig_text(rig: Rig) -> str:
    """Returns the rig as TOML text; reading this text gives exactly the same rig."""
    document: dict[str, Any] = {"name": rig.name, "plant": rig.plant}
    for name, value in rig.values.items():
        *sections, key = name.split(".")
        table = document
        for section in sections:
            table = table.setdefault(section, {})
        table[key] = value
    for name, law in rig.tables.items():
        tables = document.setdefault("effects", {}).setdefault("table", {})
        tables[name] = {
            "adds_to": law.adds_to,
            "of": law.of,
            "knots": list(law.knots),
            "values": list(law.values),
        }
    if rig.uncertainty:
        document["uncertainty"] = dict(rig.uncertainty)
    if rig.sensors:
        document["sensors"] = dict(rig.sensors)
    if rig.columns:
        document["columns"] = {
            key: {"name": column.name} | ({"unit": column.unit} if column.unit else {})
            for key, column in rig.columns.items()
        }
    return tomli_w.dumps(document)


def write_rig(rig: Rig, path: str | os.PathLike[str]) -> None:
    """Writes the rig to a file under a temporary name, then renames the file.

    Raises
    ------
    RigError
        the file cannot be written.
    """
    path = Path(path)
    try:
        write_text(path, rig_text(rig))
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the path
        reason = error.strerror if isinstance(error, OSError) else error
        raise RigError(path, [f"cannot be written ({reason})"]) from None


WIDTH = 43


def commented_text(name: str, plant: str, entries: Sequence[Entry]) -> str:
    """Returns the rig as TOML text with comments; reading it gives exactly these values."""
    lines = [
        "# Made by `ehsid rig new`. Pressures are absolute, and everything is in SI units.",
        "# Each value says whether it was given or is typical; better values make a better rig.",
        tomli_w.dumps({"name": name, "plant": plant}).rstrip("\n"),
    ]
    section = ""
    for entry in sorted(entries, key=lambda entry: _place(entry.key)):
        *sections, key = entry.key.split(".")
        if ".".join(sections) != section:
            section = ".".join(sections)
            lines += ["", f"[{section}]"]
            if section == "sensors":
                lines[-1] += "  # standard deviations of the noise"
        lines.append(f"{f'{key} = {entry.value!r}':<{WIDTH}} # {_comment(entry)}")
    lines += ["", "[uncertainty]  # relative 1-sigma"]
    for entry in entries:
        if entry.sigma is not None:
            reason = entry.why if entry.given else "typical value"
            text = f'"{entry.key}" = {entry.sigma!r}'
            lines.append(f"{text:<{WIDTH}} # {printable(reason)}")
    return "\n".join(lines) + "\n"


def _place(key: str) -> tuple[int, str]:
    """Order of the sections in the file."""
    order = ("cylinder", "load", "valve", "supply", "fluid", "axis", "effects", "sensors")
    section = key.rpartition(".")[0]
    return order.index(section.split(".")[0]), section


def _comment(entry: Entry) -> str:
    parameter = plant_parameters().get(entry.key)
    meaning = "" if parameter is None else f"{parameter.meaning}: "
    origin = f"given as {entry.shown}" if entry.given else f"{entry.shown}, typical: {entry.why}"
    if entry.given and entry.sigma is not None and " has this area" in entry.why:
        origin = f"{entry.shown}: {entry.why}"
    return printable(meaning + origin)


@dataclass(frozen=True)
class Change:
    """A value that differs, by its full name, in SI; None where a rig does not have it."""

    key: str
    before: float | None
    after: float | None

    @property
    def share(self) -> float | None:
        """Change as a share of the value before; None where there is no such share."""
        if self.before is None or self.after is None or self.before == 0.0:
            return None
        return (self.after - self.before) / abs(self.before)


def changes(before: Rig, after: Rig, *, least: float = 0.0) -> list[Change]:
    """Returns what differs: first the values of `before` in their order, then those added.

    Parameters
    ----------
    before, after
        the two rigs.
    least
        share of a value below which its change is left out.
    """
    found = [
        Change(key, before.values.get(key), after.values.get(key))
        for key in {**before.values, **after.values}
    ]
    return [one for one in found if not _same(one, least)]


def _same(change: Change, least: float) -> bool:
    if change.before is None or change.after is None:
        return False
    return math.isclose(change.before, change.after, rel_tol=least)
