# SPDX-License-Identifier: MIT
"""Writes a rig as TOML."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import tomli_w

from ..base.files import write_text
from .errors import RigError
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
