# SPDX-License-Identifier: MIT
"""Friction and a leak at the ports of the Python bench in steps of 0.1 ms, written by hand."""

from __future__ import annotations

import sys

import numpy as np
import numpy.typing as npt
from user_simulators import FOLDER

sys.path.insert(0, str(FOLDER))
from bench_plant import Bench  # type: ignore[import-not-found]

FloatArray = npt.NDArray[np.float64]
FINE_S = 1e-4


def rubbing(u: FloatArray, dt_s: float, force_n: float) -> FloatArray:
    """Friction that is as steep about rest as steps of 0.1 ms of 150 kg can follow."""
    return _run(u, dt_s, lambda y, v, a, b: {"force_n": -force_n * float(np.tanh(v / 3e-4))})


def leaking(u: FloatArray, dt_s: float, coefficient: float) -> FloatArray:
    """Laminar flow from A to B."""

    def flows(_y: float, _v: float, a: float, b: float) -> dict[str, float]:
        flow = coefficient * (a - b)
        return {"flow_a_m3_s": -flow, "flow_b_m3_s": flow}

    return _run(u, dt_s, flows)


def _run(u: FloatArray, dt_s: float, ports: object) -> FloatArray:
    bench = Bench()
    now = bench.reset()
    rows = []
    for command in u.tolist():
        rows.append(now)
        for _ in range(round(dt_s / FINE_S)):
            now = bench.step(FINE_S, command, **ports(*now))  # type: ignore[operator]
    return np.array(rows)


def drooping(u: FloatArray, dt_s: float, resistance: float, capacitance: float) -> FloatArray:
    """A pump behind a resistance, with an accumulator in front of the valve."""
    bench = Bench()
    now = bench.reset()
    rows = []
    supply = 1.4e7
    for command in u.tolist():
        rows.append(now)
        for _ in range(round(dt_s / FINE_S)):
            now = bench.step(FINE_S, command, supply_pressure_pa=supply)
            opening, gain = bench.state[4], bench.rated_flow / 3.5e6**0.5
            side = now[2] if opening >= 0.0 else now[3]
            drop = supply - side
            flow = gain * abs(opening) * drop / (drop * drop + 1e10) ** 0.25
            supply += FINE_S * ((1.4e7 - supply) / resistance - flow) / capacitance
    return np.array(rows)
