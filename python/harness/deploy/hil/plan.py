# SPDX-License-Identifier: MIT
"""What a run does, sample by sample, and what the target is told before it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

import ehsid
from ehsid.harness.arrays import FloatArray
from ehsid.harness.deploy.export.configuration import EstimatorConfiguration
from ehsid.harness.deploy.hil.configuration import Configuration, ControllerSettings
from ehsid.harness.identification import ArxOrders
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig
from ehsid.harness.simulation import (
    PositionController,
    simulate,
    simulate_closed_loop,
    velocity_gain,
)

# A third-order model about a working point that is not known beforehand.
THIRD_ORDER = ArxOrders(3, 3, 1, offset=True)
# The gain from the estimate stays between these multiples of the fixed one, and moves at most a
# hundredth of it a sample.
GAIN_RANGE = (0.5, 2.0)
GAIN_STEP = 0.01
# Converged enough for that gain: each parameter to a tenth, not to a twentieth as by default.
CERTAIN_ENOUGH = ehsid.ConvergenceOptions(tolerance=0.1)
WATCHDOG_MS = 500


@dataclass(frozen=True, eq=False)
class Plan:
    """One run.

    Attributes
    ----------
    name
        of the run, for people.
    rig
        the machine that is simulated, and how it is sampled.
    dt_s
        sampling time, s.
    direct_v
        shape (N,), V: added to the controller's command; the command itself in an open loop.
    reference_m
        shape (N,), m; the speed of the reference is its difference.
    noise
        shape (N, 6), see `draw_noise`.
    configuration
        of estimator and controller.
    position0_m
        start, m.
    values
        of the simulated machine in place of those of the rig, by full name: what the controller
        does not know.
    change
        multiples of the rig's values, by full name, from the middle of the run on: the plant
        changes, and nobody tells the target.
    """

    name: str
    rig: Rig
    dt_s: float
    direct_v: FloatArray
    reference_m: FloatArray
    noise: FloatArray
    configuration: Configuration
    position0_m: float | None = None
    values: Mapping[str, float] = field(default_factory=dict)
    change: Mapping[str, float] = field(default_factory=dict)

    @property
    def samples(self) -> int:
        """N."""
        return self.direct_v.size

    @property
    def change_at(self) -> int | None:
        """The sample from which on `change` holds."""
        return self.samples // 2 if self.change else None

    @property
    def reference_speed_m_s(self) -> FloatArray:
        """Shape (N,), of the straight line to the next reference; zero at the last."""
        return np.append(np.diff(self.reference_m), 0.0) / self.dt_s


def _scaled_by(
    record: Record, orders: ArxOrders, forgetting: ehsid.Forgetting
) -> EstimatorConfiguration:
    """Offsets at the means, scales at the deviations of a simulated record: P_0 is then vague."""
    command, position = record.column("command_v"), record.column("position_m")
    for what, signal in (("command", command), ("position", position)):
        if not np.std(signal) > 0.0:
            raise ValueError(f"the {what} does not move: there is nothing to identify from it")
    scaling = ehsid.Scaling(
        command_scale=float(np.std(command)),
        position_scale=float(np.std(position)),
        command_offset=float(np.mean(command)),
        position_offset=float(np.mean(position)),
    )
    made = EstimatorConfiguration(orders, scaling=scaling, forgetting=forgetting)
    made.estimator()  # refuses what is out of its range before anything is sent
    return made


def _limit(limit_v: float) -> float:
    """An axis names no limit; the protocol wants a finite one."""
    return limit_v if math.isfinite(limit_v) else float(np.finfo(np.float32).max)


def controller_settings(
    controller: PositionController, rig: Rig, dt_s: float, *, retune: bool
) -> ControllerSettings:
    """The simulator's P controller as the target takes it.

    Raises
    ------
    ValueError
        an integral, which the target's controller does not have.
    """
    if math.isfinite(controller.integral_time_s):
        raise ValueError("the target's controller has no integral: take a P controller")
    gain = controller.gain_v_m
    return ControllerSettings(
        sample_time_s=dt_s,
        fixed_gain_v_m=gain,
        feed_forward_v_s_m=controller.feed_forward_v_s_m,
        command_limit_v=_limit(controller.limit_v),
        bandwidth_rad_s=gain * velocity_gain(rig),
        gain_min_v_m=GAIN_RANGE[0] * gain,
        gain_max_v_m=GAIN_RANGE[1] * gain,
        gain_step=GAIN_STEP,
        position_control=True,
        retune=retune,
    )


def position_plan(
    rig: Rig,
    reference_m: FloatArray,
    controller: PositionController,
    *,
    dt_s: float,
    noise: FloatArray,
    orders: ArxOrders = THIRD_ORDER,
    forgetting: ehsid.Forgetting | None = None,
    retune: bool = True,
    values: Mapping[str, float] | None = None,
    watchdog_ms: int = WATCHDOG_MS,
) -> Plan:
    """The controller on the target follows a reference.

    The loop is simulated here once before, with the rig as configured: it must be stable, and what
    it does gives the estimator its scales.

    Raises
    ------
    SimulationError, ValueError
        as `simulate_closed_loop`; signals that do not move.
    """
    before = simulate_closed_loop(rig, reference_m, controller, dt_s=dt_s, noise=noise)
    estimator = replace(
        _scaled_by(before.run.record, orders, forgetting or ehsid.FRatio()),
        convergence=CERTAIN_ENOUGH,
    )
    settings = controller_settings(controller, rig, dt_s, retune=retune)
    return Plan(
        name=f"{rig.name}, position control",
        rig=rig,
        dt_s=dt_s,
        direct_v=np.zeros(reference_m.size),
        reference_m=reference_m,
        noise=noise,
        configuration=Configuration(estimator, settings, watchdog_ms),
        position0_m=float(reference_m[0]),
        values=dict(values or {}),
    )


def open_plan(
    rig: Rig,
    command_v: FloatArray,
    controller: PositionController,
    *,
    dt_s: float,
    noise: FloatArray,
    orders: ArxOrders = THIRD_ORDER,
    forgetting: ehsid.Forgetting | None = None,
    values: Mapping[str, float] | None = None,
    watchdog_ms: int = WATCHDOG_MS,
) -> Plan:
    """The command is given, the target passes it on within its limit and estimates.

    Raises
    ------
    SimulationError, ValueError
        a command that leads to an end of the stroke, or does not move.
    """
    before = simulate(rig, command_v, dt_s=dt_s, keep_inside=True, noise=noise).record
    settings = controller_settings(controller, rig, dt_s, retune=False)
    return Plan(
        name=f"{rig.name}, open loop",
        rig=rig,
        dt_s=dt_s,
        direct_v=command_v,
        reference_m=np.zeros(command_v.size),
        noise=noise,
        configuration=Configuration(
            _scaled_by(before, orders, forgetting or ehsid.FRatio()),
            replace(settings, position_control=False),
            watchdog_ms,
        ),
        values=dict(values or {}),
    )
