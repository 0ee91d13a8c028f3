# SPDX-License-Identifier: MIT
"""Laws that no catalogue has a name for: how their sizes are drawn, and the true curve of each.

They are put into machines like effects, but only on request: the pools of the drawn effects stay as
they are, so that a seed goes on to make the same machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from ehsid.harness.base.arrays import FloatArray

from .effects import Effect, Sizes, full_flow, signed
from .nominal_rig import NominalRig
from .truth import Truth

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
