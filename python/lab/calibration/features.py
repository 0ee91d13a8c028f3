# SPDX-License-Identifier: MIT
"""The file of features, from which constants can be fitted again without any diagnosis.

It has one machine as JSON in each line. The machines are in the order of their names.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import msgspec

from ehsid.harness.base.encoding import from_json
from ehsid.harness.base.files import write_text

from .machines import Machine

FEATURES = "features.jsonl"


def write_features(path: Path, machines: Iterable[Machine]) -> None:
    """Writes the file, whole or not at all."""
    lines = [
        msgspec.json.encode(machine).decode()
        for machine in sorted(machines, key=lambda machine: machine.name)
    ]
    write_text(path, "".join(f"{line}\n" for line in lines))


def read_features(path: Path) -> list[Machine]:
    """Reads the machines of a file; empty lines are ignored.

    Raises
    ------
    ValueError
        the file cannot be read, or a line is no machine; the message names the line.
    """
    try:
        lines = path.read_bytes().splitlines()
    except FileNotFoundError:
        raise ValueError(
            f"{path}: there is no such file; expected a {FEATURES} of ehsid gap-calibrate"
        ) from None
    machines = []
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        try:
            machines.append(from_json(line, Machine))
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise ValueError(
                f"{path}: line {number}: not a machine of {FEATURES}: {error}; restore the line, "
                "or make the file again from its checks"
            ) from None
    return machines
