# SPDX-License-Identifier: MIT
"""Writes a rig as TOML in which each value has a comment on what it is and where it comes from."""

from __future__ import annotations

from collections.abc import Sequence

import tomli_w

from ..base.text import printable
from ..catalogue.parameters import plant_parameters
from .new import Entry

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
