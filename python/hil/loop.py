# SPDX-License-Identifier: MIT
"""Makes the plan of a run on a test signal: in open loop, or in position control on the target."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import ehsid
from ehsid.harness.models.identification import ArxOrders
from ehsid.harness.rigs import Rig
from ehsid.harness.signals.simulation import draw_noise, suggested_controller
from ehsid.harness.signals.simulation.signal_options import SignalOptions, as_command, as_reference

from .plan import Plan, open_plan, position_plan


@dataclass(frozen=True)
class LoopRun:
    """A run on a test signal.

    Attributes
    ----------
    position_control
        whether the signal is the reference of the controller on the target; else it is the command.
    signal
        the test signal.
    bandwidth_hz
        bandwidth of the position loop, Hz; None for the default.
    forgetting, orders
        forgetting policy and orders of the estimator.
    retune
        whether the gain of the controller follows the estimate.
    values
        values of the simulated machine that the controller does not know, by full name.
    watchdog_ms
        time without a valid request after which the target closes the valve, ms.
    """

    position_control: bool
    signal: SignalOptions
    bandwidth_hz: float | None
    forgetting: ehsid.Forgetting
    orders: ArxOrders
    retune: bool
    values: Mapping[str, float]
    watchdog_ms: int

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
