# SPDX-License-Identifier: MIT
"""The rigs that the playground offers: examples, and the machines of the workbench."""

from __future__ import annotations

from dataclasses import replace

from ehsid.harness.rigs import Rig, parse_rig, read_rig
from ehsid.harness.rigs.questions import EXAMPLES, answered, rig_file_text

from .workbench import Workbench

TYPICAL = {
    "ehs": ("bore", "rod", "stroke", "supply", "rated-flow", "rated-drop", "mass"),
    "axis": ("mass", "force-gain"),
}
TITLES = {"ehs": "a servo of usual size", "axis": "a motor-driven axis of usual size"}
OF = "rig of "


def rig_titles(workbench: Workbench) -> list[str]:
    """Returns what can be chosen as a rig: the examples, and the machines that have one."""
    names = [name for name in workbench.names() if (workbench.folder / name / "rig.toml").exists()]
    return [*TITLES.values(), *(OF + name for name in names)]


def chosen_rig(workbench: Workbench, title: str) -> Rig:
    """Returns the rig of a title; logs of the playground have the columns of the schema.

    Raises
    ------
    RigError
        the rig file cannot be read.
    """
    for plant, own in TITLES.items():
        if title == own:
            entries = answered(plant, {name: EXAMPLES[name] for name in TYPICAL[plant]})
            return parse_rig(rig_file_text(own, plant, entries))
    return replace(read_rig(workbench.opened(title.removeprefix(OF)).rig_file), columns={})
