# SPDX-License-Identifier: MIT
"""Makes the plan of a run on a test signal: in open loop, or in position control on the target.

Loops that other packages offer to `ehsid hil`, as the lab does for the published experiment.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import entry_points
from typing import Any, Protocol

import numpy as np

import ehsid
from ehsid.harness.base.error_words import install_line
from ehsid.harness.models.identification import ArxOrders
from ehsid.harness.rigs import Rig
from ehsid.harness.show.page import Table
from ehsid.harness.signals.simulation import PositionController, draw_noise, suggested_controller
from ehsid.harness.signals.simulation.settings import SignalOptions, as_command, as_reference

from .plan import Plan, open_plan, position_plan


@dataclass(frozen=True)
class LoopRun:
    """A run on a test signal."""

    position_control: bool
    """Whether the signal is the reference of the controller on the target; else it is the command.
    """
    signal: SignalOptions
    """The test signal."""
    bandwidth_hz: float | None
    """Bandwidth of the position loop, Hz; None for the default."""
    forgetting: ehsid.Forgetting
    orders: ArxOrders
    """Forgetting policy and orders of the estimator."""
    retune: bool
    """Whether the gain of the controller follows the estimate."""
    values: Mapping[str, float]
    """Values of the simulated machine that the controller does not know, by full name."""
    watchdog_ms: int
    """Time without a valid request after which the target closes the valve, ms."""

    def plan(self, rig: Rig) -> Plan:
        """Returns the plan of the run with a rig.

        Raises
        ------
        SimulationError, ValueError
            an option is out of range, or the rig cannot follow the signal.
        """
        controller = suggested_controller(rig, self.bandwidth_hz)
        # As in `ehsid simulate --noise`, the noise has another random stream than the test signal.
        rng = np.random.default_rng([self.signal.seed, 1])
        settings: dict[str, Any] = {
            "dt_s": self.signal.dt,
            "noise": draw_noise(rig, self.signal.samples, rng),
            "orders": self.orders,
            "forgetting": self.forgetting,
            "values": self.values,
            "watchdog_ms": self.watchdog_ms,
        }
        if self.position_control:
            reference = as_reference(rig, self.signal, controller)
            return position_plan(rig, reference, controller, retune=self.retune, **settings)
        return open_plan(rig, as_command(rig, self.signal), controller, **settings)


def with_machine(plan: Plan, actual: Rig) -> Plan:
    """Returns the plan with another simulated machine than the one that it was made for.

    Raises
    ------
    ValueError
        the machines are of different kinds.
    """
    if actual.plant != plan.rig.plant:
        raise ValueError(
            f'--actual: a plant "{actual.plant}", the rig is "{plan.rig.plant}": expected the same'
        )
    return replace(plan, rig=actual)


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
    """A loop of several runs, with what its page shows beside them."""

    plans: Planner
    """Makes the plans."""
    beside: Table
    """Published results of ARX models, for the page."""
    sources: tuple[str, ...]
    """Publications, for the page."""


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
