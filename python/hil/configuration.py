# SPDX-License-Identifier: MIT
"""Settings sent to the target before a run: estimator, controller and watchdog."""

from __future__ import annotations

import struct
from dataclasses import dataclass

import ehsid
from ehsid.harness.firmware import EstimatorConfiguration, Seed, ServoSettings
from ehsid.harness.firmware.header import upper_triangle

from . import messages
from .frames import MAX_BODY
from .layout import Message, check
from .messages import Settings

# Forgetting policies; the index is the number of the policy in the protocol.
POLICIES = tuple(info.policy for info in ehsid.policies())


@dataclass(frozen=True)
class ControllerSettings:
    """Settings of the target's controller; ranges in examples/firmware/servo/controller.hpp.

    Attributes
    ----------
    sample_time_s
        time from one sample to the next, s.
    fixed_gain_v_m
        proportional gain while the estimate does not set it, V/m.
    feed_forward_v_s_m
        command for each m/s of the reference, V s/m.
    command_limit_v
        largest |command|, V.
    bandwidth_rad_s
        bandwidth of the closed loop at which a gain from the estimate aims, rad/s.
    gain_min_v_m, gain_max_v_m
        bounds of the gain from the estimate, V/m.
    gain_step
        largest change of the gain in a sample, as a share of the fixed gain.
    position_control
        whether the target controls the position; if not, the command is the `direct_v` of each
        sample, within the limit.
    retune
        whether the gain follows the estimate.
    """

    sample_time_s: float
    fixed_gain_v_m: float
    feed_forward_v_s_m: float
    command_limit_v: float
    bandwidth_rad_s: float
    gain_min_v_m: float
    gain_max_v_m: float
    gain_step: float
    position_control: bool = True
    retune: bool = True

    @property
    def flags(self) -> int:
        """Its flags in the message."""
        control = self.position_control * Settings.POSITION_CONTROL
        return control | self.retune * Settings.FOLLOW_ESTIMATE


@dataclass(frozen=True, eq=False)
class Configuration:
    """Complete configuration of a target before a run.

    Attributes
    ----------
    estimator
        settings of the estimator, with its initial estimate if it has a seed.
    controller
        settings of the position controller.
    watchdog_ms
        time without a valid request after which the target closes the valve, ms.
    servo
        settings of a ServoEstimator, which then runs in place of `estimator`.
    """

    estimator: EstimatorConfiguration
    controller: ControllerSettings
    watchdog_ms: int
    servo: ServoSettings | None = None

    @property
    def message(self) -> Message:
        """The message that carries it."""
        return messages.CONFIGURE if self.servo is None else messages.CONFIGURE_SERVO

    @property
    def policy(self) -> int:
        """Number of the forgetting policy in the protocol."""
        return self.estimator.forgetting.info.number - 1

    def body(self) -> bytes:
        """Returns the body of `configure`, or of `configure_servo`.

        Raises
        ------
        ValueError
            a number does not fit its type (the message names it), the drifts of the parameters
            differ, or the seed has another number of parameters or more than 11.
        """
        if self.servo is not None:
            return self._servo_body(self.servo)
        estimator, controller = self.estimator, self.controller
        orders, seed, reset = estimator.orders, estimator.seed, estimator.reset
        flags = (
            orders.offset * Settings.OFFSET
            | (reset is not None) * Settings.RESET
            | controller.flags
            | (seed is not None) * Settings.SEED
        )
        groups = {
            "scaling": estimator.scaling,
            "rls": estimator.rls,
            # Without a reset the body has the default settings, which are valid and not used.
            "reset": ehsid.RmseResetOptions() if reset is None else reset,
            "convergence": estimator.convergence,
            "estimator": estimator,
            "controller": controller,
        }
        values: dict[str, float] = {
            "policy": self.policy,
            "na": orders.na,
            "nb": orders.nb,
            "nk": orders.nk,
            "flags": flags,
            "watchdog_ms": self.watchdog_ms,
        }
        for field in self.message.fixed:
            if field.group == "forgetting":
                values[field.name] = _forgetting(estimator.forgetting, field.name)
            elif field.group:
                values[field.name] = getattr(groups[field.group], field.name)
        body = self.message.pack(values)
        return body if seed is None else body + _seed(seed, orders.n_parameters, len(body))

    def _servo_body(self, servo: ServoSettings) -> bytes:
        values = {**vars(self.controller), **vars(servo), "sample_time_s": servo.dt_s}
        values |= {"flags": self.controller.flags, "watchdog_ms": self.watchdog_ms}
        return self.message.pack(values)


def _forgetting(policy: ehsid.Forgetting, member: str) -> float:
    """Returns a setting of the forgetting policy; 0 for a setting of another policy."""
    for setting in policy.info.settings:
        if setting.member == member:
            value: float | list[float] = getattr(policy, setting.name)
            values = value if isinstance(value, list) else [value]
            if len(set(values)) != 1:
                raise ValueError(
                    f"{member} = {values}: the line carries one for all parameters; "
                    "give a single number"
                )
            return values[0]
    return 0.0


def _seed(seed: Seed, n: int, before: int) -> bytes:
    """Returns the estimate to start from, which stands behind `before` bytes of the body."""
    if seed.theta.shape != (n,) or seed.d.shape != (n,) or seed.u.shape != (n, n):
        raise ValueError(
            f"an estimate to start from with theta {seed.theta.shape}, d {seed.d.shape}, "
            f"u {seed.u.shape}: expected ({n},), ({n},), ({n}, {n}) for these orders"
        )
    numbers = {
        f"{name}[{i}]": float(value)
        for name, values in (("theta", seed.theta), ("d", seed.d), ("u", upper_triangle(seed)))
        for i, value in enumerate(values)
    }
    numbers["noise_variance"] = seed.noise_variance
    for name, value in numbers.items():
        check(f"{name} of the estimate to start from", value, "f32")
    packed = struct.pack(f"<{len(numbers)}f", *numbers.values())
    if before + len(packed) > MAX_BODY:
        raise ValueError(
            f"an estimate to start from of {n} parameters does not fit into a packet; "
            "at most 12 do: take a lower order or leave the estimate away"
        )
    return packed
