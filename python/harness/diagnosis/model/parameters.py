# SPDX-License-Identifier: MIT
"""Parameters of a fit: values of the rig, nuisances and effects, with priors and bounds.

A law without a name as part of a fit: a table whose values have a smoothness prior.

The values at the knots are a Gaussian process over the variable with the Matérn covariance of order
5/2 (C. Rasmussen, C. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, eq. 4.17),

    k(r) = s^2 (1 + a + a^2 / 3) exp(-a),   a = sqrt(5) r / l,

with the size s that such a term may have on this machine and the length l. The distance r is
counted in knots, so that a law can bend most where they are close. With the Cholesky factor L of
the covariance the values are L z, and the parameters z are independent with variance one: a prior
as any other parameter has. Between knots the term is linear, as in a rig file.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ehsid import EffectTerms

from ...base.numbers import FloatArray
from ...catalogue.parameters import OUTSIDE_NUISANCES, effects, missing_part, plant_parameters
from ...catalogue.spellings import ParameterKey
from ...rigs import Rig
from ...rigs.rig import MOST_SIGMAS, TableLaw
from ...rigs.simulator_section import own_name

# Prior centres where no pressure is measured. It is often not known whether the supply pressure in
# the rig file is absolute or above the atmosphere; 0.5 is in the middle of both.
UNSEEN_CENTRE = {"nuisance.atmosphere": 0.5}
OF_HIDDEN_SPOOL = ("nuisance.spool_bandwidth_hz", "nuisance.spool_damping")
# Those of an axis without a valve.
AXIS_NUISANCES = (
    "nuisance.presliding_m",
    "nuisance.sliding_onset_m_s",
    "nuisance.between_samples",
)

# Smallest size of an effect in a fit, as a share of its largest size. A smaller effect is off.
SMALLEST_SHARE = 1e-5
# Smallest force of an effect in a fit, N: the largest one is that of a press, and a share of it
# would be more than the friction of a small axis.
SMALLEST_N = 0.2


@dataclass(frozen=True)
class Parameter:
    """A value of the plant as a parameter x of the fit; x is the value or its logarithm."""

    name: str
    """Full name of the value."""
    logarithmic: bool
    """True if x = ln(value), for positive values whose uncertainty is a factor."""
    centre: float
    sigma: float
    """Mean and standard deviation of the normal prior of x; sigma is infinite without a prior."""
    low: float
    high: float
    """Bounds of x."""

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


def calibration_parameters(rig: Rig, *, pressures: bool = True) -> tuple[Parameter, ...]:
    """Returns the values of the rig and the nuisances that a calibration may change.

    The uncertainty of a rig value gives its prior and bounds. Effects in the rig file are treated
    like any other value. Values that define others or are measured with a ruler (`held`) stay, and
    so do nuisances that do not act on the plant. pressures: whether a chamber pressure is measured.
    """
    if rig.simulator is not None:
        return (*_of_simulator(rig), *_nuisances(rig, pressures))
    parameters, known = [], plant_parameters()
    for name, value in rig.values.items():
        key = ParameterKey(name)
        if known[name].held or value == 0.0 or key.is_nuisance or key.is_initial:
            continue
        parameters.append(_of_plant(name, value, rig.sigma(name)))
    return (*parameters, *_nuisances(rig, pressures))


def _of_plant(name: str, value: float, sigma: float) -> Parameter:
    """A value of the plant, not zero, with its relative 1-sigma, within what the plant takes."""
    info = plant_parameters()[name]
    if value > 0.0:
        centre, reach = math.log(value), MOST_SIGMAS * sigma
        high = min(centre + reach, _log_within(info.maximum))
        low = max(centre - reach, _log_above(info.minimum)) if info.minimum > 0 else centre - reach
        return Parameter(name, True, centre, sigma, low, high)
    std = sigma * abs(value)
    low = max(value - MOST_SIGMAS * std, info.minimum)
    return Parameter(name, False, value, std, low, value + MOST_SIGMAS * std)


def _of_simulator(rig: Rig) -> Iterator[Parameter]:
    """Values of a user's simulator that may be wrong, and effects in the rig file."""
    assert rig.simulator is not None
    for name, value in rig.values.items():
        key, own = ParameterKey(name), own_name(name)
        if own is not None:
            told = rig.simulator.parameters[own]
            centre = math.log(value) if told.log else value
            reach = MOST_SIGMAS * told.sigma
            yield Parameter(name, told.log, centre, told.sigma, centre - reach, centre + reach)
        elif key.effect is not None and value != 0.0:
            yield _of_plant(name, value, rig.sigma(name))


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
    for name, info in plant_parameters().items():
        if not ParameterKey(name).is_nuisance:
            continue
        if rig.plant == "simulator" and name not in OUTSIDE_NUISANCES:
            continue
        if rig.plant in ("axis", "linear") and name not in AXIS_NUISANCES:
            continue
        if name in OF_HIDDEN_SPOOL and rig_has_lag:
            continue
        default = info.typical if pressures else UNSEEN_CENTRE.get(name, info.typical)
        typical = rig.values.get(name, default)
        low, high = info.fit_ends
        if info.logarithmic:
            bounds = _log_above(low), _log_within(high)
            nuisances.append(Parameter(name, True, math.log(typical), info.sigma, *bounds))
        else:
            nuisances.append(Parameter(name, False, typical, info.sigma, low, high))
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
        the plant does not have that on which the effect acts.
    """
    info = effects()[effect]
    part = missing_part(info, plant)
    if part is not None:
        raise ValueError(f"a plant \"{plant}\" has no {part}: '{effect}' cannot act")
    pairs = []
    for parameter in info.parameters:
        name = ParameterKey.of_effect(effect, parameter.name)
        value = start[parameter.name]
        if parameter.minimum < 0.0:
            # A force or a bias can have either sign, so that x cannot be a logarithm.
            converted = Parameter(name, False, 0.0, math.inf, parameter.minimum, parameter.maximum)
        else:
            least = SMALLEST_N if parameter.unit == "N" else SMALLEST_SHARE * parameter.maximum
            low = max(parameter.minimum, least)
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


# Length l of the prior, in knots: a law bends a few times at most.
LENGTH = 3.0
# Share of s^2 that keeps the covariance of close knots regular; no law is known to a thousandth.
NUGGET = 1e-6


@dataclass(frozen=True, eq=False)
class Law:
    """Table of K values that a fit determines."""

    adds_to: str
    of: str
    """Equation and variable, as `TableLaw` has them."""
    knots: FloatArray
    """Shape (K,), rising."""
    size: float
    """Standard deviation s of the values by the prior, in the unit of the equation."""
    suffix: str = ""
    """End of the name, where the rig has a table of the same name already."""

    @property
    def name(self) -> str:
        """Name of its table in a rig file."""
        return f"{self.adds_to}_of_{self.of}{self.suffix}"

    @cached_property
    def basis(self) -> FloatArray:
        """Cholesky factor L of the covariance of the prior, shape (K, K): the values are L z."""
        place = np.arange(self.knots.size)
        a = math.sqrt(5.0) * np.abs(place[:, np.newaxis] - place) / LENGTH
        covariance = self.size**2 * (
            (1.0 + a + a * a / 3.0) * np.exp(-a) + NUGGET * np.eye(self.knots.size)
        )
        return np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)

    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters z."""
        return tuple(
            Parameter(f"{self.name}[{k}]", False, 0.0, 1.0, -math.inf, math.inf)
            for k in range(self.knots.size)
        )

    def table(self, z: FloatArray) -> TableLaw:
        """The table of a rig file with the values of the parameters z, shape (K,)."""
        values = self.basis @ z
        return TableLaw(self.adds_to, self.of, tuple(self.knots.tolist()), tuple(values.tolist()))


def block_basis(laws: Sequence[Law]) -> FloatArray:
    """Factors of all laws in one matrix, shape (T, T): their values are its product with all z."""
    count = sum(law.knots.size for law in laws)
    basis, first = np.zeros((count, count)), 0
    for law in laws:
        end = first + law.knots.size
        basis[first:end, first:end] = law.basis
        first = end
    return basis
