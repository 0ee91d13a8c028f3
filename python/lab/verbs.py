# SPDX-License-Identifier: MIT
"""The commands of the lab, which the product finds by the entry point of this module."""

from __future__ import annotations

from ehsid.harness.cli.console import ManyValues
from ehsid.harness.cli.lazy import Verb

PACKAGE = "ehsid.lab.cli"

VERBS = (
    Verb(
        "gap-check",
        "Check the diagnosis on machines whose effect is withheld: make, seal, run, score.",
        package=PACKAGE,
    ),
    Verb(
        "gap-calibrate",
        "Check on machines with known causes whether the probabilities are meant.",
        ManyValues,
        package=PACKAGE,
    ),
    Verb(
        "experiment",
        "Redo the published experiment end to end, and say where its claims hold.",
        package=PACKAGE,
    ),
)
