# SPDX-License-Identifier: MIT
"""What the user chooses for a model: its recursion, and the values that the sliders offer."""

from __future__ import annotations

import json

import ehsid
from ehsid.harness.catalogue.policies import POLICIES, policies_of
from ehsid.harness.models.estimation import Recursion
from ehsid.harness.models.identification import ArxOrders

from .session import MOST_COEFFICIENTS, MOST_DELAY, ModelChoice, Session

# Factors are of interest near 1, where each step doubles or halves the memory or so.
FACTORS = (
    *(0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.985, 0.99),
    *(0.993, 0.995, 0.997, 0.998, 0.999, 0.9995, 0.9998, 0.9999, 1.0),
)
DECADES = 2  # that a slider reaches to both sides of a default
SMALL = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)  # where the default is 0


def slider_values(setting: ehsid.PolicySetting, value: float) -> list[float]:
    """Returns the values that a slider for a setting offers, in order.

    Parameters
    ----------
    setting
        setting of a policy, with its range and its default.
    value
        that it has now, which is always among them.
    """
    if setting.range == "in (0, 1]":
        offered = [*FACTORS]
    elif setting.default > 0.0:
        digits = [10.0**k * m for k in range(-DECADES, DECADES) for m in (1.0, 2.0, 5.0)]
        offered = [float(f"{setting.default * one:.3g}") for one in (*digits, 10.0**DECADES)]
    else:
        offered = [*SMALL]
    if setting.range == ">= 0":
        offered.append(0.0)
    elif setting.range == ">= 1":
        offered = [1.0, *(one for one in offered if one > 1.0)]
    return sorted({*offered, setting.default, value})


def value_of(choice: ModelChoice, setting: ehsid.PolicySetting) -> float:
    """Returns the value of a setting of the chosen policy."""
    return choice.settings.get(setting.name, setting.default)


def set_method(choice: ModelChoice, method: str) -> None:
    """Chooses a recursion; a policy that it does not take gives way to the default one."""
    choice.method = method
    if choice.policy not in policies_of(method):
        set_policy(choice, ModelChoice().policy)


def set_policy(choice: ModelChoice, policy: str) -> None:
    """Chooses a forgetting policy with its defaults."""
    choice.policy = policy
    choice.settings = {}


def recursion_of(choice: ModelChoice) -> Recursion:
    """Returns the settings of the estimator, the same as those of `ehsid estimate`.

    Raises
    ------
    ValueError
        a setting is outside its range.
    """
    return Recursion(
        ArxOrders(choice.na, choice.nb, choice.nk, offset=True),
        POLICIES[choice.policy].policy(**choice.settings),
        reset=choice.reset,
        method=choice.method,
    )


def adopt_found(session: Session) -> None:
    """Gives the estimator orders and delay that the identification has found, if it has these."""
    found = json.loads((session.folder / "model" / "identify.json").read_bytes())
    orders, choice = found["chosen"]["orders"], session.settings.model
    if max(orders["na"], orders["nb"]) <= MOST_COEFFICIENTS and orders["nk"] <= MOST_DELAY:
        choice.na, choice.nb, choice.nk = orders["na"], orders["nb"], orders["nk"]
