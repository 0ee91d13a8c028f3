# SPDX-License-Identifier: MIT
"""The commands of the workbench, which the product finds by the entry point of this module."""

from __future__ import annotations

from ehsid.harness.cli.lazy import Verb

VERBS = (
    Verb(
        "app",
        "Open the workbench in the browser: from a log to the diagnosis, on this machine only.",
        package="ehsid.workbench.cli",
        needs="panel",
        extra="app",
    ),
)
