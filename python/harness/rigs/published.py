# SPDX-License-Identifier: MIT
"""Rig of the published experiment, which commands use if no rig file is given."""

from __future__ import annotations

from importlib.resources import files

from ehsid.harness.rigs.reading import parse_rig
from ehsid.harness.rigs.rig import Rig


def published_rig() -> Rig:
    """Returns the rig of the published experiment.

    Values that the paper does not give are chosen, see published.toml beside this file.
    """
    name = "published.toml"
    text = files("ehsid.harness.rigs").joinpath(name).read_text(encoding="utf-8")
    return parse_rig(text, source=name)
