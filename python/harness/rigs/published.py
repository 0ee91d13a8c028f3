# SPDX-License-Identifier: MIT
"""The rig of the published experiment, which commands take where no rig file is given."""

from __future__ import annotations

from importlib.resources import files

from ehsid.harness.rigs.reading import parse_rig
from ehsid.harness.rigs.rig import Rig


def published_rig() -> Rig:
    """The rig as far as the paper tells, the rest chosen: see published.toml beside this file."""
    name = "published.toml"
    text = files("ehsid.harness.rigs").joinpath(name).read_text(encoding="utf-8")
    return parse_rig(text, source=name)
