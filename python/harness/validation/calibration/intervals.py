# SPDX-License-Identifier: MIT
"""Whether 90 % intervals hold what they promise: sizes of effects, and shrinkage of the gap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ehsid.harness.validation.calibration.machines import MEASURES, Machine
from ehsid.harness.validation.scoring.figures import Figure, share
from ehsid.harness.validation.scoring.reading import SENSORS
from ehsid.harness.validation.scoring.tables import TARGETS

WORDS = {
    "of_explainable": "shrinkage of the explainable gap",
    "from_nominal": "shrinkage from the simulator as configured",
}


@dataclass(frozen=True)
class Intervals:
    """Shares of the intervals, over the machines with the same sensors, that hold the truth."""

    measured: str
    figures: tuple[Figure, ...]


def intervals(machines: Sequence[Machine]) -> tuple[Intervals, ...]:
    """Returns the shares for each class of sensors: of sizes, and of each measure of shrinkage."""
    return tuple(
        Intervals(measured, _figures([one for one in machines if one.measured == measured]))
        for measured in SENSORS
    )


def _figures(machines: Sequence[Machine]) -> tuple[Figure, ...]:
    target = TARGETS["coverage"][SENSORS[0]]
    sizes = [size.inside for machine in machines for size in machine.sizes]
    promises = [promise for machine in machines for promise in machine.promises]
    return (
        share("sizes of effects", sizes, target),
        *(
            share(
                WORDS[measure],
                [
                    promise.predicted.low <= promise.realised <= promise.predicted.high
                    for promise in promises
                    if promise.measure == measure
                ],
                target,
            )
            for measure in MEASURES
        ),
    )
