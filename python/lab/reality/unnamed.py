# SPDX-License-Identifier: MIT
"""Laws that no catalogue has a name for: how their sizes are drawn, and the true curve of each.

They are put into machines like effects, but only on request: the pools of the drawn effects stay as
they are, so that a seed goes on to make the same machine.

Effects that the catalogue of the diagnosis does not contain.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ehsid.harness.base.numbers import FloatArray

from .effects import Effect, Sizes, full_flow, signed
from .nominal_rig import NominalRig, spread
from .truth import Truth
from .variants import with_friction


def _unchanged(machine: Truth, sizes: Sizes, _: float) -> Truth:
    return machine


def _draw_second_mass(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    total = rig.values["load.mass_kg" if rig.plant == "ehs" else "axis.mass_kg"]
    share = float(rng.uniform(0.3, 0.6))
    natural = 2.0 * math.pi * float(rng.uniform(4.0, 12.0))
    mass = share * total
    return {
        "share": share,
        "spring_n_m": mass * natural**2,
        "damper_n_s_m": 2.0 * float(rng.uniform(0.02, 0.1)) * mass * natural,
    }


def _second_mass(machine: Truth, sizes: Sizes, _: float) -> Truth:
    """Splits the load into two masses; the rig file states the sum of both."""
    return machine._replace(
        mass_kg=(1.0 - sizes["share"]) * machine.mass_kg,
        second_mass_kg=sizes["share"] * machine.mass_kg,
        second_spring_n_m=sizes["spring_n_m"],
        second_damper_n_s_m=sizes["damper_n_s_m"],
    )


def _local_friction(machine: Truth, sizes: Sizes, bristle_m: float) -> Truth:
    """Adds the friction force at one place; elsewhere friction is at least a fiftieth of it."""
    least = max(machine.static_n, 0.02 * sizes["force_n"])
    machine = with_friction(machine, least, least, machine.stribeck_m_s, bristle_m)
    share = sizes["force_n"] / least
    return machine._replace(
        local_share=share,
        local_at_m=sizes["at_m"],
        local_width_m=sizes["width_m"],
        # This keeps the damping ratio at the place where the bristles are stiffest.
        bristle_n_s_m=machine.bristle_n_s_m / math.sqrt(1.0 + share),
    )


OUTSIDE: Mapping[str, Effect] = {
    "second_load_mass": Effect("mechanics", _draw_second_mass, _second_mass, axis=True),
    "supply_ripple": Effect(
        "hydraulics",
        lambda rng, rig: {
            "amplitude": float(rng.uniform(0.06, 0.15)),
            "frequency_hz": float(rng.uniform(4.0, 25.0)),
        },
        lambda machine, sizes, _: machine._replace(
            hum_share=sizes["amplitude"], hum_hz=sizes["frequency_hz"]
        ),
    ),
    "lost_command_frames": Effect(
        "timing",
        lambda rng, rig: {"share": float(rng.uniform(0.15, 0.4)), "burst_s": 0.02},
        _unchanged,
        axis=True,
    ),
    "warming_oil": Effect(
        "hydraulics",
        lambda rng, rig: {
            "viscous": float(rng.uniform(-0.7, -0.5)),
            "bulk": float(rng.uniform(-0.25, -0.15)),
            "leak_m3_s_pa": float(rng.uniform(0.4, 0.8))
            * full_flow(rig)
            / rig.values["supply.pressure_pa"],
        },
        lambda machine, sizes, _: machine._replace(
            warming_viscous=sizes["viscous"],
            warming_bulk=sizes["bulk"],
            warming_leak_m3_s_pa=sizes["leak_m3_s_pa"],
        ),
    ),
    "position_dependent_friction": Effect(
        "mechanics",
        lambda rng, rig: {
            "force_n": rig.force_n * float(rng.uniform(0.06, 0.12)),
            "at_m": rig.stroke_m * float(rng.uniform(0.42, 0.58)),
            "width_m": rig.stroke_m * float(rng.uniform(0.03, 0.07)),
        },
        _local_friction,
        axis=True,
    ),
    "valve_stiction": Effect(
        "valve",
        lambda rng, rig: {"band": float(rng.uniform(0.04, 0.09))},
        lambda machine, sizes, _: machine._replace(stick=sizes["band"]),
    ),
    "drifting_sensor": Effect(
        "sensor",
        lambda rng, rig: {
            "amplitude_m": rig.stroke_m * float(rng.uniform(0.01, 0.02)),
            "period_s": float(rng.uniform(4.0, 10.0)),
        },
        _unchanged,
        axis=True,
    ),
    "spiking_sensor": Effect(
        "sensor",
        lambda rng, rig: {
            "amplitude_m": rig.stroke_m * spread(rng, 0.004, 0.015),
            "rate_1_s": float(rng.uniform(2.0, 6.0)),
        },
        _unchanged,
        axis=True,
    ),
}


def _draw_heating(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    leak = spread(rng, 0.002, 0.006) * full_flow(rig) / rig.values["supply.pressure_pa"]
    return {
        "rise_k": float(rng.uniform(10.0, 25.0)),
        "time_constant_s": float(rng.uniform(5.0, 15.0)),
        "leak_m3_s_pa": leak,
    }


def _draw_dissolving(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    return {
        "volume_fraction": spread(rng, 0.01, 0.04),
        "all_dissolved_pa": float(rng.uniform(0.3, 0.8)) * rig.values["supply.pressure_pa"],
        "dissolving_s": spread(rng, 0.1, 2.0),
        "coming_out_s": spread(rng, 0.02, 0.1),
    }


# Causes that machines of the grade "field" may have besides. Oil that heats changes all that
# depends on its viscosity at once: friction, leakage and the laminar flow of the edges.
FIELD: Mapping[str, Effect] = {
    "heating_oil": Effect(
        "hydraulics",
        _draw_heating,
        lambda machine, sizes, _: machine._replace(
            heating_k=sizes["rise_k"],
            warming_s=sizes["time_constant_s"],
            leak_ab_m3_s_pa=machine.leak_ab_m3_s_pa + sizes["leak_m3_s_pa"],
        ),
    ),
    "dissolving_air": Effect(
        "hydraulics",
        _draw_dissolving,
        lambda machine, sizes, _: machine._replace(
            dissolving_gas=sizes["volume_fraction"],
            all_dissolved_pa=sizes["all_dissolved_pa"],
            dissolving_s=sizes["dissolving_s"],
            coming_out_s=sizes["coming_out_s"],
        ),
    ),
    "bowed_scale": Effect(
        "sensor",
        lambda rng, rig: {"bow_m": rig.stroke_m * signed(rng, 0.005, 0.02)},
        lambda machine, sizes, _: machine._replace(scale_bow_m=sizes["bow_m"]),
    ),
    "logger_clock": Effect(
        "timing", lambda rng, rig: {"rate": signed(rng, 3e-4, 2e-3)}, _unchanged
    ),
}


@dataclass(frozen=True)
class Faults:
    """Faults that are not in the equations.

    `error`, (n,), is the error of the measured position, m; `lost`, (n,), is true where a
    command is lost. `clock_rate`: by which share the clock of what is measured is slower than that
    of the commands; both agree at the first sample.
    """

    error: FloatArray
    lost: npt.NDArray[np.bool_]
    clock_rate: float = 0.0


def faults(
    effects: Mapping[str, Sizes], rng: np.random.Generator, samples: int, dt_s: float
) -> Faults:
    """Draws sensor drift, sensor spikes and lost frames; each only if it is among the effects."""
    error = np.zeros(samples)
    lost = np.zeros(samples, dtype=np.bool_)
    time = dt_s * np.arange(samples)
    if sizes := effects.get("drifting_sensor"):
        phase = rng.uniform(0.0, 2.0 * math.pi)
        error += sizes["amplitude_m"] * np.sin(2.0 * math.pi * time / sizes["period_s"] + phase)
    if sizes := effects.get("spiking_sensor"):
        for start in np.flatnonzero(rng.random(samples) < sizes["rate_1_s"] * dt_s):
            size = sizes["amplitude_m"] * rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.5)
            error[start : start + int(rng.integers(1, 4))] += size
    if sizes := effects.get("lost_command_frames"):
        # A Markov chain of two states has the given mean length of a burst and share of time.
        leave = min(dt_s / sizes["burst_s"], 1.0)
        enter = leave * sizes["share"] / (1.0 - sizes["share"])
        draws = rng.random(samples)
        state = False
        for k in range(samples):
            state = draws[k] < enter if not state else draws[k] >= leave
            lost[k] = state
    clock_rate = effects.get("logger_clock", {}).get("rate", 0.0)
    return Faults(error, lost, clock_rate)


# True term of the equation over its variable, SI, for the constants of the machine.
Curve = Callable[[FloatArray, Truth], FloatArray]


@dataclass(frozen=True)
class UnnamedLaw:
    """A law: the effect that puts it into a machine, its equation, its variable and its curve."""

    effect: Effect
    adds_to: str
    of: str
    curve: Curve


def _draw_knee(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    return {"knee": float(rng.uniform(0.15, 0.4)), "gain": float(rng.uniform(0.35, 0.6))}


def _draw_later_load(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    return {
        "force_n": rig.force_n * signed(rng, 0.05, 0.12),
        "at_s": float(rng.uniform(4.0, 8.0)),
        "rise_s": float(rng.uniform(0.5, 2.0)),
    }


def _later_load(machine: Truth, sizes: Sizes, _: float) -> Truth:
    return machine._replace(
        later_load_n=sizes["force_n"], later_at_s=sizes["at_s"], later_rise_s=sizes["rise_s"]
    )


def _opening_beyond(x: FloatArray, t: Truth) -> FloatArray:
    """Opening of a valve with a knee, less the spool position."""
    steep = (1.0 - t.knee_gain * t.knee) / (1.0 - t.knee)
    size = np.abs(x)
    bent = np.where(size < t.knee, t.knee_gain * size, 1.0 - steep * (1.0 - size))
    return np.sign(x) * bent - x


UNNAMED: Mapping[str, UnnamedLaw] = {
    "cubic_spring": UnnamedLaw(
        Effect(
            "mechanics",
            lambda rng, rig: {
                "n_m3": rig.force_n * float(rng.uniform(0.1, 0.3)) / (0.25 * rig.stroke_m) ** 3
            },
            lambda machine, sizes, _: machine._replace(cubic_n_m3=sizes["n_m3"]),
        ),
        "force",
        "position_m",
        lambda y, t: t.cubic_n_m3 * (y - 0.5 * t.stroke_m) ** 3,
    ),
    "turbulent_drag": UnnamedLaw(
        Effect(
            "mechanics",
            lambda rng, rig: {
                "n_s2_m2": rig.force_n * float(rng.uniform(0.1, 0.3)) / (0.5 * rig.speed_m_s) ** 2
            },
            lambda machine, sizes, _: machine._replace(drag_n_s2_m2=sizes["n_s2_m2"]),
        ),
        "force",
        "velocity_m_s",
        lambda v, t: t.drag_n_s2_m2 * v * np.abs(v),
    ),
    "later_load": UnnamedLaw(
        Effect("mechanics", _draw_later_load, _later_load),
        "force",
        "time_s",
        lambda time, t: (
            t.later_load_n * 0.5 * (1.0 + np.tanh((time - t.later_at_s) / t.later_rise_s))
        ),
    ),
    "dual_gain_valve": UnnamedLaw(
        Effect(
            "valve",
            _draw_knee,
            lambda machine, sizes, _: machine._replace(knee=sizes["knee"], knee_gain=sizes["gain"]),
        ),
        "spool",
        "spool",
        _opening_beyond,
    ),
    "drifting_null": UnnamedLaw(
        Effect(
            "valve",
            lambda rng, rig: {"rate_1_s": signed(rng, 0.002, 0.006)},
            lambda machine, sizes, _: machine._replace(bias_rate_1_s=sizes["rate_1_s"]),
        ),
        "spool",
        "time_s",
        lambda time, t: t.bias_rate_1_s * time,
    ),
    "orifice_leak": UnnamedLaw(
        Effect(
            "hydraulics",
            lambda rng, rig: {
                "m3_s_pa05": float(rng.uniform(0.08, 0.2))
                * full_flow(rig)
                / math.sqrt(0.5 * rig.values["supply.pressure_pa"])
            },
            lambda machine, sizes, _: machine._replace(orifice_leak_m3_s_pa05=sizes["m3_s_pa05"]),
        ),
        "flow_a",
        "pressure_a_pa",
        lambda p, t: -t.orifice_leak_m3_s_pa05 * np.sqrt(np.maximum(p - t.tank_pa, 0.0)),
    ),
    "bent_scale": UnnamedLaw(
        Effect(
            "sensor",
            lambda rng, rig: {
                "slope": signed(rng, 0.03, 0.08),
                "at_m": rig.stroke_m * float(rng.uniform(0.45, 0.55)),
            },
            lambda machine, sizes, _: machine._replace(
                scale_slope=sizes["slope"], scale_at_m=sizes["at_m"]
            ),
        ),
        "sensor",
        "position_m",
        lambda y, t: t.scale_slope * np.maximum(y - t.scale_at_m, 0.0),
    ),
    "growing_delay": UnnamedLaw(
        Effect(
            "timing",
            lambda rng, rig: {"rate": float(rng.uniform(6e-4, 1.5e-3))},
            lambda machine, sizes, _: machine._replace(delay_rate=sizes["rate"]),
        ),
        "delay",
        "time_s",
        lambda time, t: t.delay_rate * time,
    ),
}
