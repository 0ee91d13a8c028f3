# SPDX-License-Identifier: MIT
"""The servo as one stiff ordinary differential equation, solved by scipy with tight tolerances.

Written from the equations of the documents, with another integrator (LSODA of ODEPACK), another
state (velocity and pressures at the same instants), another spool (an equation, not a transition
matrix). Radau gives the same within 1e-7 of the range, takes eight times as long, and goes on
where the speed of the spool meets its limit, at which LSODA stays.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

import ehsid

FloatArray = npt.NDArray[np.float64]
ATMOSPHERE = 101325.0
ABSOLUTE = [1e-12, 1e-10, 1e-2, 1e-2, 1e-2, 1e-11, 1e-8, 1e-9, 1e-12, 1e-12, 1e-10, 1e-13, 1e-2]
ABSOLUTE += [1e-2, 1e-2, 1e-9, 1e-9]
OUTPUTS = (
    "position_m",
    "velocity_m_s",
    "pressure_a_pa",
    "pressure_b_pa",
    "supply_pressure_pa",
    "spool",
)


def typical() -> dict[str, float]:
    """Every parameter of the plant: rig and nuisances at their typical values, effects off."""
    return {
        parameter.name: 0.0 if parameter.name.startswith("effects.") else parameter.typical
        for parameter in ehsid.plant_parameters()
    }


def sign(x: float) -> float:
    return float((x > 0.0) - (x < 0.0))


class Reference:
    """State: y, v, p_a, p_b, p_s, spool, spool rate, bend of the seals, sensor, swing and its rate,
    flow in the pressure line, pressure where it begins, readings of p_a and p_b, poppets of
    the counterbalance valves.

    The swing is that of the flexible load, relative to the rod.
    """

    def __init__(self, plant: str, values: Mapping[str, float]) -> None:
        self.plant = plant
        self.p = dict(values)
        p = self.p
        self.a_a = np.pi / 4.0 * p["cylinder.bore_m"] ** 2
        self.a_b = self.a_a - np.pi / 4.0 * p["cylinder.rod_m"] ** 2
        self.atmosphere = p["nuisance.atmosphere"] * ATMOSPHERE * (self.a_a - self.a_b)
        self.hydraulic = plant == "ehs"
        prefix = "load" if self.hydraulic else "axis"
        self.mass = p[f"{prefix}.mass_kg"]
        self.viscous = p[f"{prefix}.viscous_friction_n_s_m"]
        self.middle = p["cylinder.stroke_m"] / 2.0 if self.hydraulic else 0.0
        if self.effect("valve_lag", "bandwidth_hz") > 0.0:
            self.spool = (
                self.effect("valve_lag", "bandwidth_hz"),
                self.effect("valve_lag", "damping"),
            )
        else:
            self.spool = p["nuisance.spool_bandwidth_hz"], p["nuisance.spool_damping"]

    def effect(self, effect: str, parameter: str) -> float:
        return self.p[f"effects.{effect}.{parameter}"]

    def load(self, y: float) -> float:
        spring = self.effect("load_spring", "stiffness_n_m") * (y - self.middle)
        constant = self.effect("load_spring", "force_at_mid_stroke_n")
        depth = max(y - self.effect("contact_spring", "position_m"), 0.0)
        contact = self.effect("contact_spring", "stiffness_n_m") * depth
        return spring + constant + contact + self.effect("load_force", "force_n")

    def friction(self, v: float, y: float) -> float:
        force = self.effect("coulomb_friction", "force_n")
        way = "extending" if v >= 0.0 else "retracting"
        force += self.effect("coulomb_friction_sides", f"force_{way}_n")
        rise = self.effect("position_friction", "rise_n_m") * (y - self.middle)
        force += max(self.effect("position_friction", "force_n") + rise, 0.0)
        coulomb = self.effect("stribeck_friction", "coulomb_n")
        static = self.effect("stribeck_friction", "static_n")
        speed = self.effect("stribeck_friction", "stribeck_velocity_m_s")
        if speed > 0.0:
            force += coulomb + (static - coulomb) * math.exp(-((v / speed) ** 2))
        return force * (0.1 + 0.9 * abs(v) / math.hypot(v, self.p["nuisance.sliding_onset_m_s"]))

    def friction_at_rest(self) -> float:
        """The mean of both directions and of both ends of the stroke."""
        half = 0.5 * self.p["cylinder.stroke_m"]
        ends = (self.middle - half, self.middle + half)
        return 0.25 * sum(self.friction(v, y) for v in (0.0, -1e-300) for y in ends)

    def reading(self, y: float) -> float:
        period = self.effect("sensor_nonlinearity", "period_m")
        amplitude = self.effect("sensor_nonlinearity", "amplitude_m")
        return y + amplitude * math.sin(2.0 * math.pi * y / period) if period > 0.0 else y

    def bulk_modulus(self, p: float) -> float:
        rise = self.p["nuisance.bulk_slope"] * (p - self.p["supply.pressure_pa"] / 2.0)
        beta = self.p["fluid.bulk_modulus_pa"] + rise
        alpha = self.effect("entrained_air", "volume_fraction")
        r = alpha * (ATMOSPHERE / p) ** (1.0 / 1.3)
        beta = beta * (1.0 + r) / (1.0 + r * beta / (1.3 * p))
        gas = self.p["nuisance.free_gas"] * self.p["fluid.bulk_modulus_pa"] * ATMOSPHERE
        return beta / (1.0 + gas / p**2)

    def flow(self, x: float, drop: float, share: float, wider: float) -> float:
        """Through an edge with this share of the common gain; wider: logarithm of its rounding,
        beyond the common one."""
        p = self.p
        e = p["nuisance.flow_exponent"]
        r = p["nuisance.edge_rounding"] * math.exp(wider)
        within = min(max(x, -2.0 * r), 2.0 * r)
        closes = (within + 2.0 * r) ** 2 / (8.0 * r) + max(x - 2.0 * r, 0.0)
        area = 0.5 * (x + math.hypot(x, r))
        area += p["nuisance.edge_closing"] * (closes - area)
        gain = share * p["valve.rated_flow_m3_s"] / p["valve.rated_pressure_drop_pa"] ** e
        softened = drop**2 + p["nuisance.laminar_pressure_pa"] ** 2
        return gain * area * drop * softened ** ((e - 1.0) / 2.0)

    def port_valves(self, p: float) -> float:
        """Flow through relief and make-up valve out of a chamber."""
        above = p - self.effect("relief_valve", "pressure_pa")
        spring = self.effect("makeup_check", "pressure_pa")
        below = self.p["supply.tank_pressure_pa"] - spring - p
        out = self.effect("relief_valve", "flow_gain_m3_s_pa") * max(above, 0.0)
        return out - self.effect("makeup_check", "flow_gain_m3_s_pa") * max(below, 0.0)

    def opening(self, x: float) -> float:
        x = x + self.effect("valve_null_bias", "offset") + self.p["nuisance.null_bias"]
        limit = self.effect("valve_flow_saturation", "limit")
        return limit * math.tanh(x / limit) if limit > 0.0 else x

    def rates(self, time_s: float, state: FloatArray, u: float) -> FloatArray:
        # Plain numbers: a numpy scalar takes several times as long for each operation.
        y, v, p_a, p_b, p_s, x, dx, s, m, z, dz, q, p_0, m_a, m_b, s_a, s_b = state.tolist()
        p = self.p
        # States of effects that are off stay where they are. If no rate depended on them, the steps
        # of Radau's difference quotients would grow until they overflow.
        rate = [0.0] * 7 + [-s, y - m, -z, -dz, -q, p["supply.pressure_pa"] - p_0]
        late = self.effect("pressure_sensor_lag", "time_constant_s") or 1.0
        rate += [(p_a - m_a) / late, (p_b - m_b) / late]
        rate += [(self.held(*p) - s) / 0.01 for *p, s in ((p_a, p_b, s_a), (p_b, p_a, s_b))]
        w, zeta = 2.0 * np.pi * self.spool[0], self.spool[1]
        rate[5], rate[6] = dx, w * w * (u - x) - 2.0 * zeta * w * dx
        slew = p["nuisance.spool_slew_1_s"]
        if self.hydraulic and abs(dx) >= slew:
            rate[5] = math.copysign(slew, dx)
            rate[6] = min(rate[6] * sign(dx), 0.0) * sign(dx)
        force = -self.load(y)
        if self.hydraulic:
            at_rest = self.opening(x if self.spool[0] > 0.0 else u)
            common = self.effect("valve_dead_band", "overlap") + p["nuisance.edge_overlap"]
            out = common + self.effect("valve_dead_band_sides", "overlap_a")
            back = common + self.effect("valve_dead_band_sides", "overlap_b")
            sides, tank = p["nuisance.edge_overlap_sides"], p["nuisance.edge_overlap_tank"]
            ways = ("direction", "sides", "tank")
            d, g, k = (p[f"nuisance.edge_gain_{way}"] for way in ways)
            w, i, r = (p[f"nuisance.edge_rounding_{way}"] for way in ways)
            p_t = p["supply.tank_pressure_pa"]
            share = max(0.05, 1.0 + self.effect("flow_gain_drift", "rate_1_s") * time_s)
            flow = self.flow
            q_pa = share * flow(at_rest - out - sides + tank, p_s - p_a, 1 + d + g - k, w + i - r)
            q_at = share * flow(
                -at_rest - back - sides - tank, p_a - p_t, 1 - d + g + k, -w + i + r
            )
            q_pb = share * flow(
                -at_rest - back + sides + tank, p_s - p_b, 1 - d - g - k, -w - i - r
            )
            q_bt = share * flow(at_rest - out + sides - tank, p_b - p_t, 1 + d - g + k, w - i + r)
            q_at, q_bt = s_a * q_at, s_b * q_bt
            inside = self.effect("internal_leakage", "coefficient_m3_s_pa") * (p_a - p_b)
            out_a = self.effect("external_leakage", "coefficient_a_m3_s_pa") * (p_a - p_t)
            out_b = self.effect("external_leakage", "coefficient_b_m3_s_pa") * (p_b - p_t)
            out_a += self.port_valves(p_a)
            out_b += self.port_valves(p_b)
            v_a = p["cylinder.dead_volume_a_m3"] + self.a_a * y
            v_b = p["cylinder.dead_volume_b_m3"] + self.a_b * (p["cylinder.stroke_m"] - y)
            rate[2] = self.bulk_modulus(p_a) / v_a * (q_pa - q_at - inside - out_a - self.a_a * v)
            rate[3] = self.bulk_modulus(p_b) / v_b * (q_pb - q_bt + inside - out_b + self.a_b * v)
            resistance = self.effect("supply_droop", "source_resistance_pa_s_m3")
            accumulator = self.effect("supply_droop", "accumulator_capacitance_m3_pa")
            turn = 2.0 * np.pi * self.effect("line_resonance", "frequency_hz")
            if turn > 0.0:
                volume = self.effect("line_resonance", "volume_m3")
                softness = volume / p["fluid.bulk_modulus_pa"]
                inertance = 1.0 / (turn**2 * softness)
                lost = 2.0 * self.effect("line_resonance", "damping") * turn * q
                rate[4] = (q - q_pa - q_pb) / softness
                rate[11] = (p_0 - p_s) / inertance - lost
                if resistance > 0.0:
                    rate[12] = ((p["supply.pressure_pa"] - p_0) / resistance - q) / accumulator
            elif resistance > 0.0:
                source = (p["supply.pressure_pa"] - p_s) / resistance
                rate[4] = (source - q_pa - q_pb) / accumulator
            force += p_a * self.a_a - p_b * self.a_b - self.atmosphere
        else:
            force += p["axis.force_per_volt"] * u
        g0 = self.friction_at_rest()
        if g0 > 0.0:
            d = p["nuisance.presliding_m"]
            rate[7] = (v - abs(v) * s * g0 / self.friction(v, y)) / d
            force -= g0 * s + g0 * d / 0.02 * max(rate[7] * sign(v), 0.0) * sign(v)
        rate[0] = v
        hanging = self.mass * self.effect("flexible_load", "mass_share")
        turn = 2.0 * np.pi * self.effect("flexible_load", "frequency_hz")
        pull = turn**2 * z + 2.0 * self.effect("flexible_load", "damping") * turn * dz
        rate[1] = (force - self.viscous * v + hanging * pull) / (self.mass - hanging)
        if hanging > 0.0:
            rate[9], rate[10] = dz, -pull - rate[1]
        tau = self.effect("sensor_lag", "time_constant_s")
        if tau > 0.0:
            rate[8] = (self.reading(y) - m) / tau
        return np.array(rate)

    def start(self) -> FloatArray:
        p = self.p
        y = p["initial.position_m"]
        total = p["supply.pressure_pa"] + p["supply.tank_pressure_pa"]
        force = self.load(y) + self.atmosphere
        # p_a A_a - p_b A_b = force with p_a + p_b = total
        p_a, p_b = np.linalg.solve([[self.a_a, -self.a_b], [1.0, 1.0]], [force, total])
        v, p_s = p["initial.velocity_m_s"], p["supply.pressure_pa"]
        m = self.reading(y)
        first = [y, v, p_a, p_b, p_s, 0, 0, 0, m, 0, 0, 0, p_s, p_a, p_b]
        return np.array([*first, self.held(p_a, p_b), self.held(p_b, p_a)], dtype=float)

    def held(self, own: float, other: float) -> float:
        """Share that a counterbalance valve passes at rest."""
        setting = self.effect("counterbalance_valve", "pressure_pa")
        lifting = own + self.effect("counterbalance_valve", "pilot_ratio") * other
        return min(max((lifting - setting) / (0.2 * setting), 0.0), 1.0) if setting else 1.0

    def pressures(self, state: FloatArray) -> list[float]:
        """What the sensors of the chamber pressures show; both effects at once are no case here."""
        first = 13 if self.effect("pressure_sensor_lag", "time_constant_s") > 0.0 else 2
        return [
            (self.effect("pressure_sensor_gain", f"gain_{side}") or 1.0) * state[first + i]
            + self.effect("pressure_sensor_offset", f"offset_{side}_pa")
            for i, side in enumerate("ab")
        ]

    def stuck(self, u: FloatArray, dt_s: float) -> FloatArray:
        """The commanded spool position where the spool sticks at rest, sample by sample."""
        threshold = self.effect("spool_stiction", "threshold")
        rest_s = self.effect("spool_stiction", "rest_s")
        if threshold == 0.0:
            return u
        x = np.zeros(u.size)
        moved_at = -math.inf
        for k, value in enumerate(u.tolist()):
            x[k] = last = x[k - 1] if k else 0.0
            before = abs(u[k - 1] - last) if k else 0.0
            limit = -threshold * math.expm1(-(k - moved_at) * dt_s / rest_s)
            away = abs(value - last)
            if away > limit:
                share = 1.0 if moved_at == k - 1 else (away - limit) / (away - before)
                x[k], moved_at = last + share * (value - last), k
        return x

    def run(
        self, command: FloatArray, dt_s: float, fine: int = 20, method: str = "LSODA"
    ) -> dict[str, FloatArray]:
        """Outputs at the samples; the play of the sensor is followed at `fine` points of each."""
        scale = self.p["valve.rated_command_v"] if self.hydraulic else 1.0
        half = self.effect("valve_hysteresis", "half_width")
        delay = self.effect("transport_delay", "delay_s")
        play, held = self.effect("sensor_backlash", "half_width_m"), self.p["initial.position_m"]
        u, w = np.zeros(command.size), 0.0
        for k, value in enumerate(command / scale):
            w = min(max(w, value - half), value + half)
            u[k] = w
        u = self.stuck(u, dt_s)
        whole, part = divmod(delay, dt_s)
        state = self.start()
        outputs = {name: np.zeros(command.size) for name in OUTPUTS}
        lagging = self.effect("sensor_lag", "time_constant_s") > 0.0
        old = self.effect("position_sensor_delay", "delay_s")
        times, seen = [-1.0, 0.0], 2 * [self.reading(state[0])]
        for k in range(command.size):
            shown = float(np.interp(k * dt_s - old, times, seen))
            step = self.effect("sensor_quantisation", "step_m")
            shown = step * np.round(shown / step) if step > 0.0 else shown
            for name, value in zip(
                OUTPUTS, [shown, state[1], *self.pressures(state), *state[4:6]], strict=True
            ):
                outputs[name][k] = value
            # Between two samples the delayed command changes once, `part` after the sample.
            first = int(k - whole - 1) if part > 0.0 else int(k - whole)
            for index, begun, span in (
                (first, k * dt_s, part),
                (int(k - whole), k * dt_s + part, dt_s - part),
            ):
                if span <= 0.0:
                    continue
                value = u[index] if index >= 0 else 0.0
                solution = solve_ivp(
                    lambda t, x, begun=begun, value=value: self.rates(begun + t, x, value),
                    (0.0, span),
                    state,
                    method=method,
                    rtol=1e-9,
                    atol=ABSOLUTE,
                    t_eval=np.linspace(0.0, span, fine),
                )
                for time_s, y, m in zip(solution.t, solution.y[0], solution.y[8], strict=True):
                    held = min(max(held, y - play), y + play)
                    times.append(begun + time_s)
                    seen.append(m if lagging else self.reading(held if play > 0.0 else y))
                state = solution.y[:, -1].copy()
        return outputs
