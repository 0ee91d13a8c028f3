# SPDX-License-Identifier: MIT
"""Plans of runs: signals of each sample, configuration of the target, and loops of others."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib.metadata import entry_points
from typing import Any, Protocol

import numpy as np

import ehsid
from ehsid.harness.base.error_words import install_line
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.parameters import SERVO_ORDERS
from ehsid.harness.firmware.configuration import EstimatorConfiguration
from ehsid.harness.firmware.servo import ServoSettings
from ehsid.harness.models.identification import ArxOrders
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig
from ehsid.harness.show.page import Table
from ehsid.harness.signals.simulation import (
    PositionController,
    draw_noise,
    simulate,
    simulate_closed_loop,
    suggested_controller,
    velocity_gain,
)
from ehsid.harness.signals.simulation.settings import SignalOptions, as_command, as_reference

from .configuration import Configuration, ControllerSettings
from .cycles import CycleOptions, Cycles


@dataclass(frozen=True)
class LoopRun:
    """A run on a test signal."""

    position_control: bool
    """Whether the signal is the reference of the controller on the target; else it is the command.
    """
    signal: SignalOptions
    """The test signal."""
    bandwidth_hz: float | None
    """Bandwidth of the position loop, Hz; None for the default."""
    forgetting: ehsid.Forgetting
    orders: ArxOrders
    """Forgetting policy and orders of the estimator."""
    retune: bool
    """Whether the gain of the controller follows the estimate."""
    values: Mapping[str, float]
    """Values of the simulated machine that the controller does not know, by full name."""
    watchdog_ms: int
    """Time without a valid request after which the target closes the valve, ms."""
    cycles: CycleOptions | None = None
    """How irregular the cycles are; None for regular ones."""

    def plan(self, rig: Rig) -> Plan:
        """Returns the plan of the run with a rig.

        Raises
        ------
        SimulationError, ValueError
            an option is out of range, or the rig cannot follow the signal.
        """
        plan = self._regular(rig)
        if self.cycles is None:
            return plan
        rng = np.random.default_rng([self.signal.seed, 2])
        return replace(plan, cycles=self.cycles.draw(plan.samples, plan.dt_s, rng))

    def _regular(self, rig: Rig) -> Plan:
        controller = suggested_controller(rig, self.bandwidth_hz)
        # As in `ehsid simulate --noise`, the noise has another random stream than the test signal.
        rng = np.random.default_rng([self.signal.seed, 1])
        settings: dict[str, Any] = {
            "dt_s": self.signal.dt,
            "noise": draw_noise(rig, self.signal.samples, rng),
            "orders": self.orders,
            "forgetting": self.forgetting,
            "values": self.values,
            "watchdog_ms": self.watchdog_ms,
        }
        if self.position_control:
            reference = as_reference(rig, self.signal, controller)
            return position_plan(rig, reference, controller, retune=self.retune, **settings)
        return open_plan(rig, as_command(rig, self.signal), controller, **settings)


def with_machine(plan: Plan, actual: Rig) -> Plan:
    """Returns the plan with another simulated machine than the one that it was made for.

    Raises
    ------
    ValueError
        the machines are of different kinds.
    """
    if actual.plant != plan.rig.plant:
        raise ValueError(
            f'--actual: a plant "{actual.plant}", the rig is "{plan.rig.plant}": expected the same'
        )
    return replace(plan, rig=actual)


class Planner(Protocol):
    """Makes the plans of a loop, by folder below --out."""

    def __call__(
        self,
        rig: Rig,
        controller: PositionController,
        seed: int,
        /,
        *,
        values: Mapping[str, float] | None,
        watchdog_ms: int,
        servo: Mapping[str, float] | None,
    ) -> dict[str, Plan]:
        """Returns the plans of a loop for `rig`, whose random numbers start with `seed`.

        They have a ServoEstimator with the settings `servo`, or estimators of ARX models.
        """


@dataclass(frozen=True)
class OfferedLoop:
    """A loop of several runs, with what its page shows beside them."""

    plans: Planner
    """Makes the plans."""
    beside: Table
    """Published results of ARX models, for the page."""
    sources: tuple[str, ...]
    """Publications, for the page."""


def offered_loop(name: str) -> OfferedLoop:
    """Returns the loop of this name, an entry point of the group `ehsid.hil_loops`.

    Raises
    ------
    ValueError
        no installed package offers it.
    """
    for offer in entry_points(group="ehsid.hil_loops", name=name):
        loop: OfferedLoop = offer.load()
        return loop
    raise ValueError(
        f"--loop {name}: no installed package offers this loop: expected the lab of ehsid; install "
        f"it with: {install_line('lab')}"
    )


# A third-order model about an operating point that is not known in advance.
THIRD_ORDER = ArxOrders(*SERVO_ORDERS, offset=True)
# The gain from the estimate stays between these multiples of the fixed gain. In each sample it
# changes by at most a hundredth of the fixed gain.
GAIN_RANGE = (0.5, 2.0)
GAIN_STEP = 0.01
# For this gain an estimate has converged if each parameter is known to a tenth; the default is a
# twentieth.
CERTAIN_ENOUGH = ehsid.ConvergenceOptions(tolerance=0.1)
WATCHDOG_MS = 500


@dataclass(frozen=True, eq=False)
class Plan:
    """Plan of one run of N samples; where cycles are lost, of N cycles."""

    name: str
    """Name of the run, for the user."""
    rig: Rig
    """Rig that the host simulates."""
    dt_s: float
    """Sampling time, s."""
    direct_v: FloatArray
    """Added to the controller's command, V, shape (N,); in an open loop the command itself."""
    reference_m: FloatArray
    """Reference position, m, shape (N,); its speed is computed from its differences."""
    noise: FloatArray
    """Noise that is added to the outputs, shape (N, 6), see `draw_noise`."""
    configuration: Configuration
    """Configuration of the estimator and the controller."""
    position0_m: float | None = None
    """Initial position, m."""
    values: Mapping[str, float] = field(default_factory=dict)
    """Values of the simulated machine that replace those of the rig, by full name; the controller
    does not know them."""
    change: Mapping[str, float] = field(default_factory=dict)
    """Factors on values of the rig, by full name, that act from the middle of the run on; the
    target is not informed of this change of the plant."""
    cycles: Cycles | None = None
    """The cycles where they are not regular; not with a change of the plant."""

    @property
    def times_s(self) -> FloatArray:
        """Times of the samples, s, shape (N,)."""
        regular = np.arange(self.samples, dtype=np.float64) * self.dt_s
        return regular if self.cycles is None else self.cycles.times_s

    @property
    def samples(self) -> int:
        """Number of samples N."""
        return self.direct_v.size

    @property
    def change_at(self) -> int | None:
        """First sample for which `change` holds; None without a change."""
        return self.samples // 2 if self.change else None

    def cut(self, samples: int) -> Plan:
        """Returns the plan of the first samples; not with a change of the plant or with cycles."""
        assert not self.change
        assert self.cycles is None
        return replace(
            self,
            direct_v=self.direct_v[:samples],
            reference_m=self.reference_m[:samples],
            noise=self.noise[:samples],
        )

    @property
    def reference_speed_m_s(self) -> FloatArray:
        """Reference speed from each sample to the next, m/s, shape (N,); zero at the last one."""
        return np.append(np.diff(self.reference_m), 0.0) / self.dt_s


def _scaled_by(
    record: Record, orders: ArxOrders, forgetting: ehsid.Forgetting
) -> EstimatorConfiguration:
    """Makes an estimator configuration whose scaling comes from a simulated record.

    The offsets are the means of the signals, the scales their standard deviations. With this
    scaling P_0 is vague.
    """
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
    made.estimator()  # raises ValueError for settings out of range before anything is sent
    return made


def _limit(limit_v: float) -> float:
    """Returns a finite command limit, V, as the protocol requires; an axis has no limit."""
    return limit_v if math.isfinite(limit_v) else float(np.finfo(np.float32).max)


def controller_settings(
    controller: PositionController, rig: Rig, dt_s: float, *, retune: bool
) -> ControllerSettings:
    """Converts the simulator's P controller to the settings of the target's controller.

    Raises
    ------
    ValueError
        the controller has an integral, which the target's controller does not have.
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
    """Returns the plan of a run in which the controller on the target follows a reference.

    The host first simulates the loop once with the rig as configured. The loop must be stable, and
    its signals give the scaling of the estimator.

    Raises
    ------
    SimulationError, ValueError
        an error of `simulate_closed_loop`, or the command or the position is constant.
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


def with_servo(plan: Plan, chosen: Mapping[str, float]) -> Plan:
    """Returns the plan with a ServoEstimator in place of its estimator of an ARX model.

    Parameters
    ----------
    chosen
        settings other than the defaults: some of delay, drift and tolerance.

    Raises
    ------
    ValueError
        a setting is out of its range.
    """
    servo = ServoSettings.chosen(plan.dt_s, chosen)
    return replace(plan, configuration=replace(plan.configuration, servo=servo))


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
    """Returns the plan of a run in open loop with a given command.

    The target passes the command on within its limit and estimates the parameters.

    Raises
    ------
    SimulationError, ValueError
        the command leads to an end of the stroke, or the command or the position is constant.
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
