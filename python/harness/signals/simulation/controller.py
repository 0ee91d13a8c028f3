# SPDX-License-Identifier: MIT
"""Position controller that drives a simulated rig in closed loop."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ...rigs import Rig

ATMOSPHERE_PA = 101325.0

# Faster than any position loop of such a machine.
LARGEST_BANDWIDTH_HZ = 1000.0


@dataclass(frozen=True)
class PositionController:
    """P or PI position controller with velocity feed-forward, as in most servos.

    u = clip(gain (e + integral of e dt / integral_time) + feed_forward r', +-limit),  e = r - y.

    While the command is at its limit, the integral is held where it would drive the command further
    into the limit (clamping: Astrom, Hagglund, Advanced PID Control, ISA 2006, sec. 3.5).
    """

    gain_v_m: float
    """Proportional gain, V/m, > 0."""
    integral_time_s: float = math.inf
    """Integral time, s, > 0; infinite for a P controller."""
    feed_forward_v_s_m: float = 0.0
    """Command for each m/s of the reference, V s/m."""
    limit_v: float = math.inf
    """Largest |command|, V, > 0; infinite without a limit."""

    def __post_init__(self) -> None:
        for name in ("gain_v_m", "integral_time_s", "limit_v"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"controller: {name} = {getattr(self, name):g}: expected > 0")
        for name in ("gain_v_m", "feed_forward_v_s_m"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"controller: {name} must be finite")

    def step(
        self,
        integral_m_s: float,
        reference_m: float,
        position_m: float,
        speed_m_s: float,
        dt_s: float,
    ) -> tuple[float, float]:
        """Returns the command of this sample, V, and the integral for the next sample, m s.

        `speed_m_s` is the speed of the reference.
        """
        error = reference_m - position_m
        next_integral = integral_m_s + error * dt_s
        unlimited = self.gain_v_m * (error + integral_m_s / self.integral_time_s)
        unlimited += self.feed_forward_v_s_m * speed_m_s
        command = min(max(unlimited, -self.limit_v), self.limit_v)
        into_limit = (unlimited - command) * error > 0.0
        return command, integral_m_s if into_limit else next_integral


def velocity_gain(rig: Rig) -> float:
    """Steady speed of the unloaded rod per volt, averaged over both directions, m/(s V)."""
    v = rig.values
    if rig.plant == "simulator":
        raise ValueError(
            f"{rig.name}: its plant is a simulator of the user, which runs on a whole command and "
            "whose speed for a volt the rig file does not tell: expected a test signal in open "
            "loop, or a logged command"
        )
    if rig.plant == "axis":
        return v["axis.force_per_volt"] / max(v["axis.viscous_friction_n_s_m"], 1e-12)
    if rig.plant == "linear":
        return v["linear.flow_gain_m3_s"] * v["linear.spool_gain_1_v"] / v["linear.area_m2"]
    cap = math.pi / 4.0 * v["cylinder.bore_m"] ** 2
    annulus = cap - math.pi / 4.0 * v["cylinder.rod_m"] ** 2
    # Orifices q = K sqrt(dp) on both sides, no net force, pressures above atmosphere: extending
    #   (p_s - (cap v / K)^2) cap = (p_t + (annulus v / K)^2) annulus,
    # retracting with the areas exchanged (Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6).
    supply = v["supply.pressure_pa"] - ATMOSPHERE_PA
    tank = v["supply.tank_pressure_pa"] - ATMOSPHERE_PA
    flow_factor = v["valve.rated_flow_m3_s"] / math.sqrt(v["valve.rated_pressure_drop_pa"])
    speeds = [
        flow_factor * math.sqrt(max(supply * a - tank * b, 0.0) / (cap**3 + annulus**3))
        for a, b in ((cap, annulus), (annulus, cap))
    ]
    return sum(speeds) / 2.0 / v["valve.rated_command_v"]


def command_limit(rig: Rig) -> float:
    """Rated command, V; infinite for an axis, because its drive has no rated command."""
    if rig.plant == "linear":
        return 1.0 / rig.values["linear.spool_gain_1_v"]
    return rig.values.get("valve.rated_command_v", math.inf)


def stable_bandwidth(rig: Rig) -> float:
    """Bandwidth w of a P loop with a margin to oscillation, rad/s; infinite where it is unknown.

    The loop w wn^2 / (s (s^2 + 2 xi wn s + wn^2)) is stable for w < 2 xi wn, Eq. (5). For plant
    "linear" the result is half of this bound. For a cylinder ("ehs") it is infinite, because the
    data sheet does not give the damping.
    """
    v = rig.values
    if rig.plant == "axis":
        # The closed loop has a pair of poles with a damping of 0.7. An axis has no spring, so a
        # larger w lowers the damping and does not make the loop unstable.
        return 0.5 * v["axis.viscous_friction_n_s_m"] / v["axis.mass_kg"]
    if rig.plant == "linear":
        # 2 xi wn = 4 beta_e (K_c + C_p) / V_t
        loss = v["linear.flow_pressure_m3_s_pa"] + v["linear.leakage_m3_s_pa"]
        return 2.0 * v["linear.bulk_modulus_pa"] * loss / v["linear.volume_m3"]
    return math.inf


def suggested_controller(rig: Rig, bandwidth_hz: float | None = None) -> PositionController:
    """Returns a P controller with full velocity feed-forward for a rig.

    Position errors decay as exp(-w t) with w = gain velocity_gain.

    Parameters
    ----------
    rig
        rig to control; its rated command is the command limit.
    bandwidth_hz
        w / (2 pi), Hz, > 0 and <= 1000; by default 2 Hz, or `stable_bandwidth` where that is
        smaller.
    """
    if bandwidth_hz is None:
        bandwidth_hz = min(2.0, stable_bandwidth(rig) / (2.0 * math.pi))
    if not 0.0 < bandwidth_hz <= LARGEST_BANDWIDTH_HZ:
        raise ValueError(
            f"a bandwidth of {bandwidth_hz:g} Hz: expected a number above 0, "
            f"{LARGEST_BANDWIDTH_HZ:g} Hz at most; servo-hydraulic position loops have 1 to 100 Hz"
        )
    per_volt = velocity_gain(rig)
    return PositionController(
        gain_v_m=2.0 * math.pi * bandwidth_hz / per_volt,
        feed_forward_v_s_m=1.0 / per_volt,
        limit_v=command_limit(rig),
    )


def with_integral(controller: PositionController) -> PositionController:
    """Adds an integral to a P controller so that the closed loop has a damping of one.

    The integral time is four time constants of the loop.
    """
    # s^2 + w s + w / T has a double pole at T = 4 / w; w = gain / feed_forward.
    w = controller.gain_v_m / controller.feed_forward_v_s_m
    return replace(controller, integral_time_s=4.0 / w)
