# SPDX-License-Identifier: MIT
"""Machines of a calibration whose truth is drawn from the probabilities of known constants."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ehsid.harness.catalogue.families import friction_laws
from ehsid.harness.catalogue.parameters import effects as catalogue
from ehsid.harness.diagnosis.schema import Estimate
from ehsid.harness.diagnosis.search.score import Constants
from ehsid.lab.calibration.checking import LEAST_MACHINES, Calibration, calibrate
from ehsid.lab.calibration.choices import choices_of, probabilities
from ehsid.lab.calibration.machines import Found, Machine, Promised, Size, WeighedSet
from ehsid.lab.scoring.judging import SENSORS

# Away from those in use by one to three standard errors of a fit to some hundred machines.
TRUE = Constants(
    evidence=20.0,
    least_left=0.2,
    effect=1.5,
    small=1.5,
    outside=0.5,
    outside_beside=-0.5,
    outside_left=2.5,
    outside_explained=-0.5,
    outside_position=0.8,
    lapse=0.06,
)
# Effects that are no friction, and no law that contains another or is contained.
CONTAINED = {info.contains for info in catalogue().values()}
EFFECTS = tuple(
    name
    for name, info in catalogue().items()
    if name not in (*friction_laws(), *CONTAINED, "sensor_quantisation") and not info.contains
)
SIZE = Estimate(2.0, 1.0, 3.0)
SEALS = ("LuGre", "Dahl", "Bouc-Wen")


def machine(
    truth: tuple[str, ...],
    *sets: tuple[str, ...],
    kind: str = "one",
    measured: str = SENSORS[0],
    name: str = "m",
) -> Machine:
    """A machine with these sets beside the empty one; each leaves as much as all others."""
    weighed = tuple(WeighedSet(effects, 1.0, 0.0) for effects in ((), *sets))
    return Machine(name, kind, "wide", measured, truth, weighed)  # type: ignore[arg-type]


def unanswered(count: int, rng: np.random.Generator) -> list[Machine]:
    """Machines with 4 to 11 sets of one or two effects, without a truth yet."""
    made = []
    for i in range(count):
        none = float(rng.uniform(0.02, 1.0))
        sets = [WeighedSet((), none, 0.0)]
        for j in range(int(rng.integers(3, 11))):
            effects = EFFECTS[j : j + 2] if rng.random() < 0.3 else EFFECTS[j : j + 1]
            left = none * float(rng.uniform(0.1, 1.0) ** rng.uniform())
            sets.append(WeighedSet(effects, left, max(0.0, float(rng.uniform(-1.0, 1.0)))))
        seals = {"seals": str(rng.choice(SEALS))}
        measured = SENSORS[int(rng.random() < 0.5)]
        made.append(Machine(f"{i:05d}", "none", "wide", measured, (), tuple(sets), seals))
    return made


def answered(
    machines: list[Machine], rng: np.random.Generator, constants: Constants = TRUE
) -> list[Machine]:
    """The machines with truths drawn from their probabilities, and intervals that hold in 90 %."""
    made = []
    for one, row in zip(machines, probabilities(choices_of(machines), constants), strict=True):
        drawn = int(rng.choice(row.size, p=row))
        outside = drawn == row.size - 1
        truth = () if outside else one.sets[drawn].effects
        kind = "open" if outside else "one" if truth else "none"
        realised = 0.9 if rng.random() < 0.9 else 0.5
        made.append(
            replace(
                one,
                kind=kind,
                truth=truth,
                sizes=tuple(
                    Size(
                        effect, "size", Estimate(2.0, 1.0, 3.0), 1.5 if rng.random() < 0.9 else 4.0
                    )
                    for effect in truth
                ),
                promises=(Promised("of_explainable", Estimate(0.9, 0.8, 1.0), realised),),
            )
        )
    return made


def drawn_machines(count: int, seed: int, constants: Constants = TRUE) -> list[Machine]:
    """Machines with truths, all drawn with this seed."""
    rng = np.random.default_rng(seed)
    return answered(unanswered(count, rng), rng, constants)


def made_calibration() -> Calibration:
    """A calibration with families that are left out, and with a truth that was never weighed."""
    machines = drawn_machines(2 * len(SEALS) * LEAST_MACHINES, 3)
    machines[0] = replace(machines[0], kind="one", truth=("load_force",))
    return calibrate(Found(tuple(machines), {"insufficient_data": 4}))
