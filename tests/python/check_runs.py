# SPDX-License-Identifier: MIT
"""Stand-ins for the diagnosis that a worker process can be handed, and tiny checks."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass, replace
from pathlib import Path

from diagnosis_stand_in import Asked, DiagnosisStandIn
from made_diagnoses import VERDICTS, made_diagnosis

from ehsid.harness.diagnosis.result import Diagnosis
from ehsid.lab.blind.making import Seal, Settings, make_check

TINY = Settings(seed=7, count=8, seconds=2.0)  # one case of each grade


def tiny_check(out: Path, settings: Settings = TINY) -> Seal:
    return make_check(out, settings)


@dataclass(frozen=True)
class StandIn(DiagnosisStandIn):
    """Answers at once; fails or is killed for rigs of these names. Its settings tell what it saw.

    The verdict is "effects", or what stands in the rig's name before a hyphen.
    """

    fails: tuple[str, ...] = ()
    kills: tuple[str, ...] = ()
    seconds: float = 0.0

    def answer(self, asked: Asked) -> Diagnosis:
        rig = asked.rig
        if rig.name in self.fails:
            raise ArithmeticError(f"no root for {rig.name}")
        time.sleep(self.seconds)
        if rig.name in self.kills:
            os.kill(os.getpid(), signal.SIGKILL)
        saw = {
            "rig": rig.name,
            "fitted": asked.fitted,
            "held_out": asked.held_out,
            "exclude": list(asked.options.exclude),
            "workers": asked.workers,
            "process": os.getpid(),
        }
        wanted = rig.name.split("-")[0]
        made = made_diagnosis(next((one for one in VERDICTS if one == wanted), "effects"))
        return replace(made, settings={**made.settings, **saw}, records=asked.roles, runs=())
