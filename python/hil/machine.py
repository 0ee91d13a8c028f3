# SPDX-License-Identifier: MIT
"""A machine for `ehsid hunt` whose commands go through a target: an emulated board, or a real one.

The host simulates the machine, as in a run of `ehsid hil`; each command goes to the target first,
which limits and returns it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ehsid.harness.hunt.machines import Machine
from ehsid.harness.rigs import Rig
from ehsid.harness.signals.simulation import suggested_controller

from .messages import Sample
from .plan import THIRD_ORDER, open_plan
from .session import Session

WATCHDOG_MS = 60_000


class TargetMachine:
    """A machine behind a target, for `ehsid.hunt` or as the class of `--machine`.

    Parameters
    ----------
    behind
        the machine that the host simulates, such as `machine_of("secret.toml", ...)`.
    session
        session with the target on an open line.
    rig
        the machine as its rig file tells it, for the limits of the target's controller.
    dt_s
        sampling time, s.
    """

    def __init__(self, behind: Machine, session: Session, rig: Rig, *, dt_s: float) -> None:
        self.name = f"{behind.name} behind a target"
        self._behind, self._session, self._sent = behind, session, 0
        configuration = open_plan(
            rig,
            np.array([-1.0, 1.0]),
            suggested_controller(rig),
            dt_s=dt_s,
            noise=np.zeros((2, 6)),
            orders=THIRD_ORDER,
            values={},
            watchdog_ms=WATCHDOG_MS,
        ).configuration
        session.hello()
        session.configure(configuration)
        session.start()

    def read(self) -> Mapping[str, float]:
        """Returns the outputs now; the position as the target gets it, a float32."""
        shown = dict(self._behind.read())
        shown["position_m"] = float(np.float32(shown["position_m"]))
        return shown

    def step(self, command_v: float) -> None:
        """Sends a command, V, to the target, and holds what it answers for one sampling time.

        Raises
        ------
        HilError, TargetReset
            as of `Session.exchange`.
        """
        position = self.read()["position_m"]
        answer = self._session.exchange(
            Sample(number=self._sent, position_m=position, reference_m=position, direct_v=command_v)
        )
        self._sent += 1
        self._behind.step(answer.command_v)
