# SPDX-License-Identifier: MIT
"""Stand-ins for the diagnosis that a worker process can be handed, and tiny checks."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from made_diagnoses import VERDICTS, made_diagnosis

from ehsid.harness.gap.interim import Begun
from ehsid.harness.gap.schema import Diagnosis
from ehsid.harness.parallel import Progress, worker_count
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig
from ehsid.harness.validation.blind.making import make_check
from ehsid.harness.validation.blind.seal import Seal
from ehsid.harness.validation.blind.settings import Settings

TINY = Settings(seed=7, count=5, seconds=2.0)  # one case of each grade


def tiny_check(out: Path, settings: Settings = TINY) -> Seal:
    return make_check(out, settings)


@dataclass(frozen=True)
class StandIn:
    """Answers at once; fails or is killed for rigs of these names. Its settings tell what it saw.

    The verdict is "effects", or what stands in the rig's name before a hyphen.
    """

    fails: tuple[str, ...] = ()
    kills: tuple[str, ...] = ()
    seconds: float = 0.0

    def __call__(
        self,
        records: Sequence[Record],
        rig: Rig,
        *,
        validate: Sequence[Record] = (),
        exclude: Sequence[str] = (),
        progress: Progress | None = None,
        begun: Begun | None = None,
    ) -> Diagnosis:
        if rig.name in self.fails:
            raise ArithmeticError(f"no root for {rig.name}")
        time.sleep(self.seconds)
        if rig.name in self.kills:
            os.kill(os.getpid(), signal.SIGKILL)
        saw = {
            "rig": rig.name,
            "fitted": [one.name for one in records],
            "held_out": [one.name for one in validate],
            "exclude": list(exclude),
            "workers": worker_count(),
            "process": os.getpid(),
        }
        roles = {one.name: "fit" for one in records} | {one.name: "held out" for one in validate}
        wanted = rig.name.split("-")[0]
        made = made_diagnosis(next((one for one in VERDICTS if one == wanted), "effects"))
        return replace(made, settings={**made.settings, **saw}, records=roles, runs=())
