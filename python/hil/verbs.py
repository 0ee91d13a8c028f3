# SPDX-License-Identifier: MIT
"""The command `ehsid hil`, which the product finds by the entry point of this module."""

from __future__ import annotations

from ehsid.harness.cli.lazy import Verb

VERBS = (
    Verb(
        "hil",
        "Simulate the servo here, control it and estimate it on the target, in lock step.",
        package="ehsid.hil.cli",
        needs="serial",
        extra="hil",
    ),
)
