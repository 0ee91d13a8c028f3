# SPDX-License-Identifier: MIT
"""Parameters of a fit: values of the rig, nuisances and effects, with priors and bounds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from ehsid import EffectTerms

from ...catalogue.keys import ParameterKey
from ...catalogue.parameters import acts_on, effects, plant_parameters
from ...rigs import Rig
from ..thresholds import (
    HELD,
    LOGARITHMIC_NUISANCES,
    MOST_SIGMAS,
    NUISANCE_ENDS,
    NUISANCE_SIGMA,
    SEEN_BY_PRESSURES,
    UNSEEN_CENTRE,
)

OF_HIDDEN_SPOOL = ("nuisance.spool_bandwidth_hz", "nuisance.spool_damping")
FRICTION_NUISANCES = ("nuisance.presliding_m", "nuisance.sliding_onset_m_s")

# Smallest size of an effect in a fit, as a share of its largest size. A smaller effect is off.
SMALLEST_SHARE = 1e-5


@dataclass(frozen=True)
class Parameter:
    """A value of the plant as a parameter x of the fit; x is the value or its logarithm.

    Attributes
    ----------
    name
        full name of the value.
    logarithmic
        true if x = ln(value), for positive values whose uncertainty is a factor.
    centre, sigma
        mean and standard deviation of the normal prior of x; sigma is infinite without a prior.
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
        """Value of the plant that belongs to x."""
        return math.exp(x) if self.logarithmic else x

    def slope(self, x: float) -> float:
        """Derivative of the value with respect to x."""
        return math.exp(x) if self.logarithmic else 1.0

    def held(self) -> Parameter:
        """Returns the same parameter, held at the centre of its prior."""
        return replace(self, low=self.centre, high=self.centre)

    def place(self, value: float) -> float:
        """Returns the x of a value, clipped to the bounds."""
        if self.logarithmic:
            value = math.log(value) if value > 0.0 else self.low
        return min(max(value, self.low), self.high)


def calibration_parameters(
    rig: Rig, *, pressures: bool = True, unseen: bool = False
) -> tuple[Parameter, ...]:
    """Returns the values of the rig and the nuisances that a calibration may change.

    The uncertainty of a rig value gives its prior and bounds. Effects in the rig file are treated
    like any other value. Values that define others or are measured with a ruler (HELD) stay, and so
    do nuisances that do not act on the plant. Without measured pressures, nuisances that cannot be
    distinguished from an effect (SEEN_BY_PRESSURES) stay, too, unless `unseen` includes them.
    """
    parameters = []
    for name, value in rig.values.items():
        if (
            name in HELD
            or value == 0.0
            or ParameterKey(name).is_nuisance
            or ParameterKey(name).is_initial
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
            parameters.append(Parameter(name, True, centre, sigma, low, high))
        else:
            std = sigma * abs(value)
            low = max(value - MOST_SIGMAS * std, info.minimum)
            parameters.append(Parameter(name, False, value, std, low, value + MOST_SIGMAS * std))
    left_out = () if pressures or unseen else SEEN_BY_PRESSURES
    return (*parameters, *(p for p in _nuisances(rig, pressures) if p.name not in left_out))


def _log_within(maximum: float) -> float:
    """Logarithm of a maximum, rounded so that its exponential is not above the maximum."""
    x = math.log(maximum)
    while math.exp(x) > maximum:
        x = math.nextafter(x, -math.inf)
    return x


def _log_above(minimum: float) -> float:
    """Logarithm of a minimum, rounded so that its exponential is not below the minimum."""
    x = math.log(minimum)
    while math.exp(x) < minimum:
        x = math.nextafter(x, math.inf)
    return x


def _nuisances(rig: Rig, pressures: bool) -> list[Parameter]:
    nuisances = []
    rig_has_lag = EffectTerms(rig.plant_values()).spool_lag[0] > 0.0
    for name, sigma in NUISANCE_SIGMA.items():
        if rig.plant != "ehs" and name not in FRICTION_NUISANCES:
            continue
        if name in OF_HIDDEN_SPOOL and rig_has_lag:
            continue
        info = plant_parameters()[name]
        default = info.typical if pressures else UNSEEN_CENTRE.get(name, info.typical)
        typical = rig.values.get(name, default)
        low, high = NUISANCE_ENDS.get(name, (info.minimum, info.maximum))
        if name in LOGARITHMIC_NUISANCES:
            bounds = _log_above(low), _log_within(high)
            nuisances.append(Parameter(name, True, math.log(typical), sigma, *bounds))
        else:
            nuisances.append(Parameter(name, False, typical, sigma, low, high))
    return nuisances


def effect_parameters(
    effect: str, start: Mapping[str, float], plant: str = "ehs"
) -> tuple[tuple[Parameter, float], ...]:
    """Returns the parameters of an effect, without priors, each with the x where its fit starts.

    Parameters
    ----------
    effect
        id of the effect.
    start
        start value by the parameter's own name; sizes at which the effect is active.
    plant
        kind of plant of the rig.

    Raises
    ------
    ValueError
        the plant does not have the subsystem on which the effect acts.
    """
    info = effects()[effect]
    if not acts_on(info, plant):
        raise ValueError(f"a plant \"{plant}\" has no {info.subsystem}: '{effect}' cannot act")
    pairs = []
    for parameter in info.parameters:
        name = ParameterKey.of_effect(effect, parameter.name)
        value = start[parameter.name]
        if parameter.minimum < 0.0:
            # A force or a bias can have either sign, so that x cannot be a logarithm.
            converted = Parameter(name, False, 0.0, math.inf, parameter.minimum, parameter.maximum)
        else:
            low = max(parameter.minimum, SMALLEST_SHARE * parameter.maximum)
            converted = Parameter(
                name,
                True,
                _log_above(low),
                math.inf,
                _log_above(low),
                _log_within(parameter.maximum),
            )
        pairs.append((converted, converted.place(value)))
    return tuple(pairs)
