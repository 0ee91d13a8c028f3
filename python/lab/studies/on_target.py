# SPDX-License-Identifier: MIT
"""The recursive part of the experiment, as a loop that `ehsid hil` finds by its entry point.

The recursive part of the experiment as hardware-in-the-loop runs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

import ehsid
from ehsid.harness.rigs import Rig
from ehsid.harness.signals.simulation import PositionController, draw_noise
from ehsid.hil.plan import WATCHDOG_MS, OfferedLoop, Plan, open_plan, with_servo

from .comparison import Contender
from .pages.recursive_sections import published_table
from .recursive import CONTENDERS
from .rig_records import DT_S, SAMPLES, SOURCE, excitation_of, trim

MASS = "load.mass_kg"
# Names of the contenders by the folder of their run.
FACTORS = dict(zip(("varying", "lambda_0.99", "lambda_1", "f_ratio"), CONTENDERS, strict=True))
# Factor on the mass of the load at the change, in a run without and in a run with the reset of
# Fig. 4.
CHANGED_LOAD = 2.0
CHANGED = {"changed": False, "changed_reset": True}


def experiment_plans(
    rig: Rig,
    controller: PositionController,
    seed: int,
    *,
    values: Mapping[str, float] | None = None,
    watchdog_ms: int = WATCHDOG_MS,
    servo: Mapping[str, float] | None = None,
) -> dict[str, Plan]:
    """Returns the plans of the recursive part of the published experiment, by folder.

    Each plan has 2000 samples of 50 ms of a random-phase multisine, the record of
    `ehsid.lab.studies.rig_records.rig_record` with this seed. There is one plan for each
    forgetting policy. If the rig has `load.mass_kg`, two more plans with the varying factor double
    the load at half of the run, without and with the reset of Fig. 4.

    With `servo`, the settings of a ServoEstimator that are not its defaults, there is one plan with
    this estimator, and one in which the load doubles.
    """
    # The random numbers are drawn in the order of `rig_record`, so that the record is the same.
    rng = np.random.default_rng(seed)
    command = excitation_of(rig, rng)
    command = command + trim(rig, command)
    plan = open_plan(
        rig,
        command,
        controller,
        dt_s=DT_S,
        noise=draw_noise(rig, SAMPLES, rng),
        values=values,
        watchdog_ms=watchdog_ms,
    )
    if servo is not None:
        observed = with_servo(replace(plan, name=f"{rig.name}, ServoEstimator"), servo)
        if MASS not in rig.values:
            return {"servo": observed}
        name, change = f"{observed.name}, load doubled", {MASS: CHANGED_LOAD}
        return {"servo": observed, "changed": replace(observed, name=name, change=change)}
    plans = {
        folder: _with_factor(plan, factor, CONTENDERS[factor]) for folder, factor in FACTORS.items()
    }
    if MASS not in rig.values:
        return plans
    varying = FACTORS["varying"]
    for folder, reset in CHANGED.items():
        contender = replace(CONTENDERS[varying], reset=reset)
        words = f"{varying}, load doubled, {'with' if reset else 'no'} reset"
        changed = _with_factor(plan, words, contender)
        plans[folder] = replace(changed, change={MASS: CHANGED_LOAD})
    return plans


def _with_factor(plan: Plan, words: str, contender: Contender) -> Plan:
    configuration = plan.configuration
    estimator = replace(
        configuration.estimator,
        forgetting=contender.forgetting,
        rls=contender.options,
        reset=ehsid.RmseResetOptions() if contender.reset else None,
    )
    return replace(
        plan,
        name=f"{plan.rig.name}, lambda: {words}",
        configuration=replace(configuration, estimator=estimator),
    )


LOOP = OfferedLoop(experiment_plans, published_table(), (SOURCE,))
