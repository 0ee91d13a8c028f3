# SPDX-License-Identifier: MIT
"""Loops that other packages offer to `ehsid hil`, as the lab does for the published experiment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import entry_points
from typing import Protocol

from ehsid.harness.base.error_words import install_line
from ehsid.harness.rigs import Rig
from ehsid.harness.show.page import Table
from ehsid.harness.signals.simulation import PositionController

from .plan import Plan


class Planner(Protocol):
    """Makes the plans of a loop, by folder below --out."""

    def __call__(
        self,
        rig: Rig,
        controller: PositionController,
        seed: int,
        /,
        *,
        values: Mapping[str, float] | None,
        watchdog_ms: int,
        servo: Mapping[str, float] | None,
    ) -> dict[str, Plan]:
        """Returns the plans of a loop for `rig`, whose random numbers start with `seed`.

        They have a ServoEstimator with the settings `servo`, or estimators of ARX models.
        """


@dataclass(frozen=True)
class OfferedLoop:
    """A loop of several runs, with what its page shows beside them.

    Attributes
    ----------
    plans
        makes the plans.
    beside
        published results of ARX models, for the page.
    sources
        publications, for the page.
    """

    plans: Planner
    beside: Table
    sources: tuple[str, ...]


def offered_loop(name: str) -> OfferedLoop:
    """Returns the loop of this name, an entry point of the group `ehsid.hil_loops`.

    Raises
    ------
    ValueError
        no installed package offers it.
    """
    for offer in entry_points(group="ehsid.hil_loops", name=name):
        loop: OfferedLoop = offer.load()
        return loop
    raise ValueError(
        f"--loop {name}: no installed package offers this loop: expected the lab of ehsid; install "
        f"it with: {install_line('lab')}"
    )
