# SPDX-License-Identifier: MIT
"""Settings sent to the target before a run: estimator, controller and watchdog.

Snapshot of an estimate during a run: a file from which an estimator can begin again.

No request of the protocol reads the covariance of the target. The host runs the same estimator on
the same samples, so its covariance is that of the target as long as both agree bit for bit.
"""

from __future__ import annotations

import struct
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

import ehsid
from ehsid.harness.base.encoding import from_json, json_text
from ehsid.harness.base.files import write_text
from ehsid.harness.firmware import EstimatorConfiguration, Seed, ServoSettings
from ehsid.harness.firmware.header import upper_triangle
from ehsid.harness.models.identification import IdentificationError

from . import messages
from .frames import MAX_BODY, HilError, Message, check
from .messages import Settings

# Forgetting policies; the index is the number of the policy in the protocol.
POLICIES = tuple(info.policy for info in ehsid.policies())


@dataclass(frozen=True)
class ControllerSettings:
    """Settings of the target's controller; ranges in examples/firmware/servo/controller.hpp."""

    sample_time_s: float
    """Time from one sample to the next, s."""
    fixed_gain_v_m: float
    """Proportional gain while the estimate does not set it, V/m."""
    feed_forward_v_s_m: float
    """Command for each m/s of the reference, V s/m."""
    command_limit_v: float
    """Largest |command|, V."""
    bandwidth_rad_s: float
    """Bandwidth of the closed loop at which a gain from the estimate aims, rad/s."""
    gain_min_v_m: float
    gain_max_v_m: float
    """Bounds of the gain from the estimate, V/m."""
    gain_step: float
    """Largest change of the gain in a sample, as a share of the fixed gain."""
    position_control: bool = True
    """Whether the target controls the position; if not, the command is the `direct_v` of each
    sample, within the limit."""
    retune: bool = True
    """Whether the gain follows the estimate."""

    @property
    def flags(self) -> int:
        """Its flags in the message."""
        control = self.position_control * Settings.POSITION_CONTROL
        return control | self.retune * Settings.FOLLOW_ESTIMATE


@dataclass(frozen=True, eq=False)
class Configuration:
    """Complete configuration of a target before a run."""

    estimator: EstimatorConfiguration
    """Settings of the estimator, with its initial estimate if it has a seed."""
    controller: ControllerSettings
    """Settings of the position controller."""
    watchdog_ms: int
    """Time without a valid request after which the target closes the valve, ms."""
    servo: ServoSettings | None = None
    """Settings of a ServoEstimator, which then runs in place of `estimator`."""

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


ENDING = ".snapshot.json"
# P comes rounded to float32 and may then not be positive definite. A share of its variances on the
# diagonal makes it so; the smallest one that does is taken.
SHARES = (0.0, 1e-7, 1e-6, 1e-5, 1e-4)


@dataclass(frozen=True)
class Snapshot:
    """Content of the file."""

    schema_version: Literal[1]
    rig: str
    time_s: float
    """Name of the rig, and time in the run, s."""
    na: int
    nb: int
    nk: int
    offset: bool
    """Orders of the estimator with n parameters."""
    command_scale: float
    position_scale: float
    command_offset: float
    position_offset: float
    """Scaling of the signals, V and m."""
    theta: tuple[float, ...]
    """The n parameters, in the units of the signals about the offsets."""
    u: tuple[tuple[float, ...], ...]
    d: tuple[float, ...]
    """Factors of the covariance P = u diag(d) u' of the scaled parameters; u by rows."""
    noise_variance: float
    """Residual variance, m^2."""


def taken(
    estimator: ehsid.ArxEstimator,
    configuration: EstimatorConfiguration,
    theta: tuple[float, ...],
    *,
    rig: str,
    time_s: float,
) -> Snapshot:
    """Returns the snapshot of the target's estimate.

    Parameters
    ----------
    estimator
        the host's estimator on the same samples.
    configuration
        its settings.
    theta
        the target's parameters.
    rig, time_s
        see `Snapshot`.

    Raises
    ------
    HilError
        target and host do not agree, so that the covariance of the target is not known; or it is
        not positive definite, also not with a share of its variances.
    """
    ours, theirs = (np.asarray(one, dtype=np.float32) for one in (estimator.theta_hat, theta))
    if ours.tobytes() != theirs.tobytes():
        raise HilError(
            "no snapshot: the parameters of the target are not those of this host on the same "
            "samples, so its covariance is not known; build the firmware with -ffp-contract=off "
            "and the version of this ehsid"
        )
    seed = _snapshot_seed(estimator)
    orders, scaling = configuration.orders, configuration.scaling
    return Snapshot(
        schema_version=1,
        rig=rig,
        time_s=time_s,
        na=orders.na,
        nb=orders.nb,
        nk=orders.nk,
        offset=orders.offset,
        command_scale=scaling.command_scale,
        position_scale=scaling.position_scale,
        command_offset=scaling.command_offset,
        position_offset=scaling.position_offset,
        theta=tuple(map(float, seed.theta)),
        u=tuple(tuple(map(float, row)) for row in seed.u),
        d=tuple(map(float, seed.d)),
        noise_variance=seed.noise_variance,
    )


def _snapshot_seed(estimator: ehsid.ArxEstimator) -> Seed:
    covariance = np.asarray(estimator.P, dtype=np.float64)
    variances = np.diag(np.diag(covariance))
    for share in SHARES:
        with suppress(IdentificationError):
            return Seed.from_covariance(
                estimator.theta_hat, covariance + share * variances, estimator.residual_variance
            )
    raise HilError(
        "no snapshot: the parameters are not told apart well enough yet, so that their covariance "
        "is singular; wait until the signals have moved more"
    )


def write_snapshot(path: Path, snapshot: Snapshot) -> None:
    """Writes the file, whole or not at all."""
    write_text(path, json_text(snapshot))


def read_snapshot(path: Path) -> Snapshot:
    """Reads the file.

    Raises
    ------
    HilError
        it cannot be read, or is not the file of a snapshot.
    """
    try:
        return from_json(path.read_bytes(), Snapshot)
    except OSError as error:
        raise HilError(
            f"{path}: cannot be read ({error.strerror}): expected the file of a snapshot; check "
            "the path"
        ) from None
    except msgspec.DecodeError as error:
        raise HilError(
            f"{path}: this is not the file of a snapshot ({error}): expected one that was stored "
            "during a run; name another one"
        ) from None


def restored(snapshot: Snapshot, configuration: EstimatorConfiguration) -> EstimatorConfiguration:
    """Returns the settings with which an estimator begins at the estimate of a snapshot.

    Raises
    ------
    HilError
        the orders are others, or the numbers are none that an estimator accepts.
    """
    orders = configuration.orders
    held = (snapshot.na, snapshot.nb, snapshot.nk, snapshot.offset)
    if held != (orders.na, orders.nb, orders.nk, orders.offset):
        raise HilError(
            f"the snapshot has na {snapshot.na}, nb {snapshot.nb}, nk {snapshot.nk}: expected "
            f"{orders}, the orders of this run; take a snapshot with the same orders"
        )
    made = replace(
        configuration,
        scaling=ehsid.Scaling(
            command_scale=snapshot.command_scale,
            position_scale=snapshot.position_scale,
            command_offset=snapshot.command_offset,
            position_offset=snapshot.position_offset,
        ),
        seed=Seed(
            np.array(snapshot.theta),
            np.array(snapshot.u),
            np.array(snapshot.d),
            snapshot.noise_variance,
        ),
    )
    try:
        made.estimator()
    except (ValueError, TypeError) as error:
        raise HilError(
            f"the estimate of the snapshot is not one that an estimator can begin with ({error}): "
            "expected a file as it was stored; take another one"
        ) from None
    return made
