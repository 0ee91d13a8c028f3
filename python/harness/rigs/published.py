# SPDX-License-Identifier: MIT
"""Rig of the published experiment, which commands use if no rig file is given."""

from __future__ import annotations

from importlib.resources import files

from .reading import parse_rig
from .rig import Rig

NAME = "published.toml"


def published_rig() -> Rig:
    """Returns the rig of the published experiment.

    Values that the paper does not give are chosen, see published.toml beside this file.
    """
    return parse_rig(published_text(), source=NAME)


def published_text() -> str:
    """Returns the rig file of the published experiment."""
    return files("ehsid.harness.rigs").joinpath(NAME).read_text(encoding="utf-8")
