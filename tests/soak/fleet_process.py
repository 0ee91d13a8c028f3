# SPDX-License-Identifier: MIT
"""`ehsid gap-fleet` with a stand-in for the diagnosis that takes half a second.

python tests/soak/fleet_process.py MACHINES OUT WORKERS
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from typing import Any

from check_runs import StandIn

import ehsid.harness.diagnosis
from ehsid.harness.cli import cli
from ehsid.harness.diagnosis.result import Diagnosis

SECONDS = 0.5


@dataclass(frozen=True)
class SameEachTime:
    """The stand-in without what differs from run to run: processes and how many there are."""

    def __call__(self, *arguments: Any, **named: Any) -> Diagnosis:
        found = StandIn(seconds=SECONDS)(*arguments, **named)
        of_the_run = ("process", "workers")
        kept = {name: value for name, value in found.settings.items() if name not in of_the_run}
        return replace(found, settings=kept)


if __name__ == "__main__":
    machines, out, count = sys.argv[1:]
    ehsid.harness.diagnosis.diagnose = SameEachTime()
    cli(["gap-fleet", machines, "--out", out, "--workers", count])
