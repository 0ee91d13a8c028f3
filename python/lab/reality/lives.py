# SPDX-License-Identifier: MIT
"""The life of a machine: dated logs while it wears, is repaired, and gets a new valve.

The same machine is recorded again and again, with the sizes of its effects at each date, and with
the temperature of its oil: a season changes viscous friction and the stiffness of the oil.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.base.numbers import FloatArray

from .case import BEFORE_S, Sensors, definition_of, make_case, record_of
from .effects import Sizes
from .excitation import draw_task
from .noise import draw_noise, usual_logger
from .nominal_rig import draw_nominal_rig
from .unnamed import faults

# Of the viscous friction and of the stiffness of the oil that a degree takes away. Viscosity of a
# mineral oil for hydraulics falls to about a tenth between 20 and 80 degrees, and half of the
# viscous friction of a cylinder is that of its seals.
VISCOUS_PER_C, BULK_PER_C = 0.02, 0.004
YEAR = 365.25

# Sizes of the effects of the machine on a day.
Plan = Callable[[float], Mapping[str, Sizes]]


@dataclass(frozen=True)
class LifeLog:
    """A log of a machine's life."""

    day: float
    columns: Mapping[str, FloatArray]
    """Columns of the record schema, SI."""


def make_life(
    seed: int,
    days: Sequence[float],
    plan: Plan,
    *,
    sensors: Sensors = "pressures+supply",
    seconds: float = 8.0,
    dt_s: float = 0.001,
    season_c: float = 0.0,
    logs_temperature: bool = False,
) -> tuple[str, list[LifeLog]]:
    """Makes the rig file and the logs of a life; the same arguments always make the same.

    Parameters
    ----------
    seed
        of machine, commands and noise, not negative.
    days
        of the logs, not falling.
    plan
        sizes of the effects on a day.
    season_c
        by how much the oil is warmer in summer (day 0 of each year) and colder in winter, degrees.
    logs_temperature
        whether the logs have the temperature of the oil.
    """
    case = make_case(seed, kind="none", sensors=sensors, seconds=1.0)
    rig_rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(11)[0])
    rig = draw_nominal_rig(rig_rng, "ehs")
    logger = usual_logger(rig, dt_s, False)
    samples = round((seconds + BEFORE_S) / dt_s)
    logs = []
    for place, day in enumerate(days):
        rng = np.random.default_rng([seed, 46, place])
        warmer = season_c * float(np.cos(2.0 * np.pi * day / YEAR))
        machine = case.healthy._replace(
            viscous_n_s_m=case.healthy.viscous_n_s_m * (1.0 - VISCOUS_PER_C * warmer),
            bulk_modulus_0_pa=case.healthy.bulk_modulus_0_pa * (1.0 - BULK_PER_C * warmer),
        )
        sizes = plan(day)
        for effect, one in sizes.items():
            machine = definition_of(effect).put(machine, one, case.answer["structure"]["bristle_m"])
        excitation = ("multisine", "steps", "triangle")[place % 3]
        task = draw_task(rng, rig, excitation, samples, dt_s, False, None)  # type: ignore[arg-type]
        noise = draw_noise(rng, rig, samples, logger)
        no_faults = faults({}, rng, samples, dt_s)
        columns = record_of(machine, rig, task, noise, no_faults, sensors, dt_s)
        if logs_temperature:
            measured = 45.0 + warmer + float(rng.normal(0.0, 0.5))
            columns["temperature_c"] = np.full(columns["command_v"].size, measured)
        logs.append(LifeLog(day, columns))
    return case.rig_toml, logs
