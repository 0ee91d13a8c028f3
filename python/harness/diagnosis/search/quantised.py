# SPDX-License-Identifier: MIT
"""Quantisation of the position sensor: the record shows it without a fit.

It belongs to the noise floor, so that it does not shrink the gap.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..data.floor import sensor_step
from ..model.case import Case
from ..schema import Estimate

# Rounding makes most of the noise if its deviation is half of that of the noise. On the development
# records it was a twentieth to a ninth without the effect, and three quarters and more with it.
STEP_OF_FLOOR = 0.5
# More than twice the sensor noise in the rig file is no longer that noise.
STEP_OF_RIG_NOISE = 2.0
# Smallest step, share of the stroke: a resolution of fourteen bits over the stroke is usual.
LEAST_STEP = 6e-5
# Files hold the levels with four digits and more.
STEP_SCATTER = 1e-3

QUANTISATION = "sensor_quantisation"


def position_step(case: Case, exclude: Sequence[str] = ()) -> Estimate | None:
    """Returns the step of the position, m, if it is larger than a sensor has anyway, else None.

    Its rounding noise, q / sqrt(12) (W. R. Bennett, Bell Syst. Tech. J. 27(3), 1948), must make up
    most of the noise floor and exceed the sensor noise in the rig file. The step must be the same
    in all records.
    """
    if QUANTISATION in (*case.rig.effects(), *exclude) or "position_m" not in case.floors:
        return None
    steps = [sensor_step(record.column("position_m")) for record in case.records]
    step = min(steps)
    if step <= 0.0 or max(steps) > (1.0 + STEP_SCATTER) * step:
        return None
    noise = step / math.sqrt(12.0)
    rig_noise = case.rig.sensors.get("position_noise_m", 0.0)
    stroke = case.rig.values.get("cylinder.stroke_m") or _travel(case)
    if (
        noise < STEP_OF_FLOOR * case.floors["position_m"].value
        or noise < STEP_OF_RIG_NOISE * rig_noise
        or step < LEAST_STEP * stroke
    ):
        return None
    return Estimate(step, (1.0 - STEP_SCATTER) * step, (1.0 + STEP_SCATTER) * step)


def _travel(case: Case) -> float:
    positions = [record.column("position_m") for record in case.records]
    return float(max(p.max() for p in positions) - min(p.min() for p in positions))
