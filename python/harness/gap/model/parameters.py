# SPDX-License-Identifier: MIT
"""What a fit may move: values of the rig, nuisances, effects; how far, and how it counts them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from ehsid.harness.gap.thresholds import (
    HELD,
    LOGARITHMIC_NUISANCES,
    MOST_SIGMAS,
    NUISANCE_ENDS,
    NUISANCE_SIGMA,
    SEEN_BY_PRESSURES,
    UNSEEN_CENTRE,
)
from ehsid.harness.rigs import Rig
from ehsid.harness.rigs.parameters import (
    EFFECT_PREFIX,
    acts_on,
    effects,
    is_rig_value,
    plant_parameters,
)

OF_HIDDEN_SPOOL = ("nuisance.spool_bandwidth_hz", "nuisance.spool_damping")
# Effects whose size a nuisance has within the tolerance of any servo.
STANDS_FOR = MappingProxyType({"valve_null_bias": "nuisance.null_bias"})
FRICTION_NUISANCES = ("nuisance.presliding_m", "nuisance.sliding_onset_m_s")

# Smallest size of an effect that a fit may go to, as a share of its largest: below it is off.
SMALLEST_SHARE = 1e-5


@dataclass(frozen=True)
class Parameter:
    """A value of the plant as the fit sees it: x, which is the value or its logarithm.

    Attributes
    ----------
    name
        full name.
    logarithmic
        x = ln(value), for what is positive and known by a factor.
    centre, sigma
        prior of x, normal; sigma infinite where nothing is told.
    low, high
        bounds of x.
    """

    name: str
    logarithmic: bool
    centre: float
    sigma: float
    low: float
    high: float

    def value(self, x: float) -> float:
        """The value of the plant."""
        return math.exp(x) if self.logarithmic else x

    def slope(self, x: float) -> float:
        """Derivative of the value by x."""
        return math.exp(x) if self.logarithmic else 1.0

    def held(self) -> Parameter:
        """The same where it does not move."""
        return replace(self, low=self.centre, high=self.centre)

    def place(self, value: float) -> float:
        """The x of a value, inside the bounds."""
        if self.logarithmic:
            value = math.log(value) if value > 0.0 else self.low
        return min(max(value, self.low), self.high)


def calibration_parameters(
    rig: Rig, *, pressures: bool = True, unseen: bool = False
) -> tuple[Parameter, ...]:
    """Values of the rig inside their uncertainty, and nuisances inside their bounds.

    Effects that the rig tells are calibrated like any other value. What defines other values or is
    measured with a ruler stays, and so do nuisances that do not act on the plant, or, where no
    pressures are measured, cannot be told from an effect; but for `unseen`, which takes them in.
    """
    found = []
    for name, value in rig.values.items():
        if (
            name in HELD
            or value == 0.0
            or not (is_rig_value(name) or name.startswith(EFFECT_PREFIX))
        ):
            continue
        info, sigma = plant_parameters()[name], rig.sigma(name)
        if value > 0.0:
            centre = math.log(value)
            reach = MOST_SIGMAS * sigma
            high = min(centre + reach, _log_within(info.maximum))
            low = (
                max(centre - reach, _log_above(info.minimum))
                if info.minimum > 0
                else centre - reach
            )
            found.append(Parameter(name, True, centre, sigma, low, high))
        else:
            width = sigma * abs(value)
            low = max(value - MOST_SIGMAS * width, info.minimum)
            found.append(Parameter(name, False, value, width, low, value + MOST_SIGMAS * width))
    out = () if pressures or unseen else SEEN_BY_PRESSURES
    return (*found, *(one for one in _nuisances(rig, pressures) if one.name not in out))


def _log_within(maximum: float) -> float:
    """Its logarithm, rounded so that the value that comes back is not above it."""
    x = math.log(maximum)
    while math.exp(x) > maximum:
        x = math.nextafter(x, -math.inf)
    return x


def _log_above(minimum: float) -> float:
    """The same of a minimum: what comes back is not below it."""
    x = math.log(minimum)
    while math.exp(x) < minimum:
        x = math.nextafter(x, math.inf)
    return x


def _nuisances(rig: Rig, pressures: bool) -> list[Parameter]:
    found = []
    told_lag = rig.values.get(f"{EFFECT_PREFIX}valve_lag.bandwidth_hz", 0.0) > 0.0
    for name, sigma in NUISANCE_SIGMA.items():
        if rig.plant != "ehs" and name not in FRICTION_NUISANCES:
            continue
        if name in OF_HIDDEN_SPOOL and told_lag:
            continue
        info = plant_parameters()[name]
        usual = info.typical if pressures else UNSEEN_CENTRE.get(name, info.typical)
        typical = rig.values.get(name, usual)
        low, high = NUISANCE_ENDS.get(name, (info.minimum, info.maximum))
        if name in LOGARITHMIC_NUISANCES:
            bounds = _log_above(low), _log_within(high)
            found.append(Parameter(name, True, math.log(typical), sigma, *bounds))
        else:
            found.append(Parameter(name, False, typical, sigma, low, high))
    return found


def effect_parameters(
    effect: str, start: Mapping[str, float], plant: str = "ehs"
) -> tuple[tuple[Parameter, float], ...]:
    """Parameters of an effect without a prior, each with the x of its start.

    Parameters
    ----------
    effect
        id.
    start
        by the parameter's own name; an active size.
    plant
        of the rig.

    Raises
    ------
    ValueError
        the plant does not have the effect.
    """
    info = effects()[effect]
    if not acts_on(info, plant):
        raise ValueError(f"a plant \"{plant}\" has no {info.subsystem}: '{effect}' cannot act")
    found = []
    for parameter in info.parameters:
        name = f"{EFFECT_PREFIX}{effect}.{parameter.name}"
        value = start[parameter.name]
        if parameter.minimum < 0.0:
            # Of either sign: a force, a bias.
            made = Parameter(name, False, 0.0, math.inf, parameter.minimum, parameter.maximum)
        else:
            low = max(parameter.minimum, SMALLEST_SHARE * parameter.maximum)
            made = Parameter(
                name,
                True,
                _log_above(low),
                math.inf,
                _log_above(low),
                _log_within(parameter.maximum),
            )
        found.append((made, made.place(value)))
    return tuple(found)
