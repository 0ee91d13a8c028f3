# SPDX-License-Identifier: MIT
"""Settings sent to the target before a run: estimator, controller and watchdog."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import ehsid
from ehsid.harness.deploy.export import EstimatorConfiguration, Seed
from ehsid.harness.deploy.export.c_header import CONVERGENCE, RESET, RLS, SCALING
from ehsid.harness.deploy.export.header import upper_triangle
from ehsid.harness.deploy.hil.frames import MAX_BODY
from ehsid.harness.deploy.hil.layout import Body, Whole
from ehsid.harness.deploy.hil.messages import Kind

# Forgetting policies; the index is the number of the policy in the protocol.
POLICIES = tuple(info.policy for info in ehsid.policies())
_CONTROLLER = (
    "sample_time_s",
    "fixed_gain_v_m",
    "feed_forward_v_s_m",
    "command_limit_v",
    "bandwidth_rad_s",
    "gain_min_v_m",
    "gain_max_v_m",
    "gain_step",
)


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
    """

    kind: ClassVar[Kind] = Kind.CONFIGURE

    estimator: EstimatorConfiguration
    controller: ControllerSettings
    watchdog_ms: int

    @property
    def policy(self) -> int:
        """Number of the forgetting policy in the protocol."""
        return self.estimator.forgetting.info.number - 1

    def body(self) -> bytes:
        """Returns the body of `configure`.

        Raises
        ------
        ValueError
            a number does not fit its type (the message names it), the drifts of the parameters
            differ, or the seed has another number of parameters or more than 11.
        """
        estimator, controller = self.estimator, self.controller
        orders, seed, reset = estimator.orders, estimator.seed, estimator.reset
        flags = (orders.offset, reset is not None, controller.position_control, seed is not None)
        bits = sum(on << bit for bit, on in enumerate((*flags, controller.retune)))
        body = Body()
        body.whole("policy", self.policy, Whole.U8)
        for name in ("na", "nb", "nk"):
            body.whole(name, getattr(orders, name), Whole.U8)
        body.whole("flags", bits, Whole.U8)
        _append(body, estimator.scaling, SCALING)
        _append_forgetting(body, estimator.forgetting)
        _append(body, estimator.rls, RLS)
        # Without a reset the body has the default settings, which are valid and not used.
        _append(body, ehsid.RmseResetOptions() if reset is None else reset, RESET)
        _append(body, estimator.convergence, CONVERGENCE)
        _append(body, estimator, ("variance0", "input_limit"))
        _append(body, controller, _CONTROLLER)
        body.whole("watchdog_ms", self.watchdog_ms, Whole.U32)
        if seed is not None:
            _append_seed(body, seed, orders.n_parameters)
        return bytes(body)


def _append(body: Body, settings: object, names: tuple[str, ...]) -> None:
    for name in names:
        value = getattr(settings, name)
        if name in ("cool_down", "hold"):
            body.whole(name, value, Whole.I32)
        else:
            body.real(name, value)


def _append_forgetting(body: Body, policy: ehsid.Forgetting) -> None:
    """Appends the settings of the policy at their places; the other places hold 0."""
    settings = {setting.hil_place: setting for setting in policy.info.settings}
    for place in range(ehsid.HIL_PLACES):
        setting = settings.get(place)
        if setting is None:
            body.real(f"place {place}", 0.0)
            continue
        value: float | list[float] = getattr(policy, setting.name)
        values = value if isinstance(value, list) else [value]
        if len(set(values)) != 1:
            raise ValueError(
                f"{setting.member} = {values}: the line carries one for all parameters; "
                "give a single number"
            )
        body.real(setting.member, values[0])


def _append_seed(body: Body, seed: Seed, n: int) -> None:
    if seed.theta.shape != (n,) or seed.d.shape != (n,) or seed.u.shape != (n, n):
        raise ValueError(
            f"an estimate to start from with theta {seed.theta.shape}, d {seed.d.shape}, "
            f"u {seed.u.shape}: expected ({n},), ({n},), ({n}, {n}) for these orders"
        )
    for name, values in (("theta", seed.theta), ("d", seed.d), ("u", upper_triangle(seed))):
        for i, value in enumerate(values):
            body.real(f"{name}[{i}] of the estimate to start from", float(value))
    body.real("noise_variance of the estimate to start from", seed.noise_variance)
    if len(bytes(body)) > MAX_BODY:
        raise ValueError(
            f"an estimate to start from of {n} parameters does not fit into a packet; "
            "at most 11 do: take a lower order or leave the estimate away"
        )
