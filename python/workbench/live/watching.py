# SPDX-License-Identifier: MIT
"""Watches a run sample by sample: what the page draws, and the estimator of this host beside it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from ehsid.harness.firmware.configuration import EstimatorConfiguration
from ehsid.hil.answers import Result, SampleAnswer
from ehsid.hil.plan import Plan
from ehsid.hil.recording import Recording
from ehsid.hil.session import Counters
from ehsid.hil.snapshot import Snapshot, taken
from ehsid.hil.transport import Line

from .ring import RingWriter
from .told import COLUMNS, RING


class Watch(Recording):
    """Records a run, and puts every sample into the ring with the deviations of the parameters.

    The target does not send the deviations. The estimator of this host gives them: it takes the
    same samples, and its numbers are those of the target bit for bit; `agrees` says whether.

    Attributes
    ----------
    time_s
        time of the last sample, s.
    agrees
        whether all parameters of the target so far were those of the host.
    """

    def __init__(
        self, folder: Path, samples: Path, outputs: Sequence[str], plan: Plan, line: Line
    ) -> None:
        self._plan = plan.configuration.estimator
        super().__init__(samples, outputs, self._plan.orders)
        self.time_s = 0.0
        self.agrees = True
        self._rig = plan.rig.name
        self._line = line
        self._began = time.monotonic()
        self._restarts = 0
        self._begin(self._plan)
        self._ring = RingWriter(folder / RING, len(COLUMNS) + 2 * self._plan.orders.n_parameters)
        self._theta: tuple[float, ...] = ()

    def begin(self, configuration: EstimatorConfiguration) -> None:
        """Lets the estimator of the host begin anew, as that of the target does."""
        self._begin(configuration)

    def _begin(self, configuration: EstimatorConfiguration) -> None:
        self._now, self._estimator = configuration, configuration.estimator()

    def snapshot(self) -> Snapshot:
        """Returns the present estimate; see `taken`."""
        return taken(
            self._estimator, self._now, self._theta, rig=self._rig, time_s=round(self.time_s, 6)
        )

    def add(
        self,
        time_s: float,
        outputs: Mapping[str, float],
        reference_m: float,
        result: SampleAnswer,
        counters: Counters,
        restarts: int,
    ) -> None:
        """Appends one sample."""
        assert isinstance(result, Result)  # this page runs no ServoEstimator
        super().add(time_s, outputs, reference_m, result, counters, restarts)
        if restarts > self._restarts:  # the target was reset, and began with the plan's settings
            self._restarts = restarts
            self._begin(self._plan)
        self._estimator.step(result.command_v, outputs["position_m"])
        ours = np.asarray(self._estimator.theta_hat, dtype=np.float32)
        self.agrees &= ours.tobytes() == np.asarray(result.theta, dtype=np.float32).tobytes()
        self.time_s, self._theta = time_s, result.theta
        values = {
            "time_s": time_s,
            "wall_s": time.monotonic() - self._began,
            "command_v": result.command_v,
            "position_m": outputs["position_m"],
            "reference_m": reference_m,
            "innovation_m": result.innovation_m,
            "forgetting_factor": result.forgetting_factor,
            "fit_percent": result.fit_percent,
            "gain_v_m": result.gain_v_m,
            "status": result.status,
            "converged": result.converged,
            "limited": result.limited,
            "changes": result.resets,
            "sent": self._line.sent,
            "asked_again": counters.asked_again,
            "late": counters.late,
            "bad_here": counters.bad_frames,
            "bad_there": result.bad_frames,
            "resumed": counters.resumed,
            "restarts": restarts,
            "agrees": self.agrees,
        }
        deviation = self._estimator.standard_deviation
        self._ring.add([*(values[name] for name in COLUMNS), *result.theta, *deviation])


def throttled(call: Callable[[float], None], every_s: float) -> Callable[[float], None]:
    """Returns a function that passes a share on at most once in this time."""
    last = 0.0

    def passed(share: float) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= every_s:
            last = now
            call(share)

    return passed
