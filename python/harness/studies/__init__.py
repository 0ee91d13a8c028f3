# SPDX-License-Identifier: MIT
"""Repeats the published experiment: its figures, its model as a known plant, the comparison."""

from ehsid.harness.studies.comparison import Contender, Outcome, Setting, compare
from ehsid.harness.studies.known_plant import KnownPlant
from ehsid.harness.studies.published import MODEL_16, ORDERS, RECURSIVE

__all__ = [
    "MODEL_16",
    "ORDERS",
    "RECURSIVE",
    "Contender",
    "KnownPlant",
    "Outcome",
    "Setting",
    "compare",
]
