# SPDX-License-Identifier: MIT
"""A machine that is stepped does what it does in one run."""

from __future__ import annotations

import numpy as np
import pytest

from ehsid.lab.reality import machine as equations
from ehsid.lab.reality.case import make_case, start_state
from ehsid.lab.reality.noise import draw_noise, usual_logger
from ehsid.lab.reality.nominal_rig import draw_nominal_rig
from ehsid.lab.reality.stepping import REFINEMENT, SteppedReality

SEED, DT_S, COUNT = 5, 1e-3, 300


@pytest.mark.slow
def test_steps_give_the_samples_of_the_whole_run() -> None:
    case = make_case(SEED, effects={"valve_hysteresis": {"half_width": 0.02}}, seconds=1.0)
    rig = draw_nominal_rig(np.random.default_rng(np.random.SeedSequence(SEED).spawn(11)[0]), "ehs")
    logger = usual_logger(rig, DT_S, False)
    middle = 0.5 * rig.stroke_m
    stepped = SteppedReality(
        "machine",
        case.truth,
        rig,
        logger,
        sensors="pressures",
        dt_s=DT_S,
        seconds=2.0 * COUNT * DT_S,
        seed=1,
        position_m=middle,
    )
    rated = rig.values["valve.rated_command_v"]
    command = 0.3 * rated * np.sin(0.05 * np.arange(COUNT))
    shown = []
    for one in command:
        shown.append(stepped.read()["position_m"])
        stepped.step(float(one))
    noise = draw_noise(np.random.default_rng(1), rig, 2 * COUNT, logger)
    truth = case.truth._replace(sensor_step_m=max(case.truth.sensor_step_m, noise.position_step_m))
    still = np.zeros(COUNT)
    _, out = equations.run(
        *(truth, start_state(truth, middle), DT_S, command / rated, still, 0.0),
        *(noise.command_step, noise.position_m[:COUNT], noise.late_s[:COUNT]),
        *(np.zeros(COUNT, dtype=np.bool_), REFINEMENT),
    )
    # The same function on the same state: to look before a step must not move the machine.
    np.testing.assert_array_equal(shown, out[:, equations.OUT_Y])
