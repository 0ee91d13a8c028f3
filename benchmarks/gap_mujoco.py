# SPDX-License-Identifier: MIT
"""Diagnoses an axis of MuJoCo against MuJoCo itself, as the simulator of a user.

The machine is another model of the same engine: a mass that is 4 % larger, damping 15 % larger, and
one thing that the simulator lacks. MuJoCo's own friction is a constraint with its own solver, not a
law of ours. Needs mujoco; takes five minutes on two cores.

    pip install mujoco
    python benchmarks/gap_mujoco.py
"""

from __future__ import annotations

import time
from types import MappingProxyType

import mujoco
import numpy as np

import ehsid

DT = 2e-3
STEP = 1e-3
MODEL = """<mujoco><option timestep="{step}" integrator="implicitfast"/><worldbody><body>
<joint name="rod" type="slide" axis="1 0 0" damping="{damping}" frictionloss="{friction}"/>
<geom type="box" size=".1 .1 .1" mass="{mass}"/></body></worldbody><actuator>
<general joint="rod" gainprm="{gain}" biasprm="0 0 -3000" biastype="affine" dyntype="filter"
dynprm="0.004"/></actuator></mujoco>"""


class Axis:
    """A mass on a slide, whose drive asks for a speed in proportion to the command."""

    inputs = ("command_v", "force_n")
    outputs = ("position_m", "velocity_m_s")
    parameters = MappingProxyType({"mass": 95.0, "damping": 200.0, "gain": 150.0})

    def reset(self, parameters=None, position_m=0.0, friction=0.0):
        """Back to rest at a position, with these values."""
        values = {**self.parameters, **(parameters or {})}
        text = MODEL.format(step=STEP, friction=friction, **values)
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.data.qpos[0] = position_m
        return self.read()

    def read(self):
        """Position and velocity."""
        return float(self.data.qpos[0]), float(self.data.qvel[0])

    def step(self, dt, command_v, force_n=0.0):
        """On by dt with the inputs held."""
        self.data.ctrl[0], self.data.qfrc_applied[0] = command_v, force_n
        count = max(1, round(dt / STEP))
        self.model.opt.timestep = dt / count
        for _ in range(count):
            mujoco.mj_step(self.model, self.data)
        return self.read()


def record(seed: int, friction: float, delay: int) -> dict[str, np.ndarray]:
    """8 s of the machine, with noise of 2 um on its sensor."""
    rng = np.random.default_rng(seed)
    seconds = np.arange(4000) * DT
    hz = np.array([0.2, 0.5, 0.9, 1.7, 3.1, 5.3])
    phases = rng.uniform(0.0, 2.0 * np.pi, (hz.size, 1))
    command = 1.2 * np.sum(np.cos(2.0 * np.pi * hz[:, None] * seconds + phases), axis=0)
    machine = Axis()
    machine.reset({"mass": 99.0, "damping": 230.0, "gain": 153.0}, friction=friction)
    sent = np.concatenate([np.zeros(delay), command])[: command.size]
    position = np.array([0.0, *(machine.step(DT, float(one))[0] for one in sent[:-1])])
    position += rng.normal(0.0, 2e-6, position.size)
    return {"time_s": seconds, "command_v": command, "position_m": position}


def main() -> None:
    """Prints a line for each machine."""
    print("missing in the simulator | verdict | sets | sizes | gap before, after | seconds")
    for missing, friction, delay in (
        ("Coulomb friction, 120 N", 120.0, 0),
        ("nothing", 0.0, 0),
        ("delay, 6 ms", 0.0, 3),
    ):
        began = time.perf_counter()
        found = ehsid.diagnose(record(3, friction, delay), simulator=Axis, progress=False)
        sizes = [
            f"{each.id} {name} {value.value:.4g}"
            for each in found.result.effects
            for name, value in each.sizes.items()
        ]
        gap = found.result.how_far
        assert gap is not None
        print(
            f"{missing} | {found.verdict} | {found.result.ambiguity_set} | {', '.join(sizes)} | "
            f"{gap.nominal:.2g}, {gap.augmented:.2g} | {time.perf_counter() - began:.0f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
