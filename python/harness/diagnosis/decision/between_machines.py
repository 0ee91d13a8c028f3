# SPDX-License-Identifier: MIT
"""Intervals that hold between machines, and not only between the windows of one machine.

Gradients and bootstraps over windows tell how much a figure scatters on one machine. They do not
tell by how much machines differ from the simulator, nor how a gap on another motion differs from
the one on the record. The ends of an interval move outwards by distances at which 90 % of the
intervals held the truth on generated machines (Y. Romano, E. Patterson, E. Candès, Conformalized
quantile regression, NeurIPS 2019); `ehsid gap-calibrate` computes them.
"""

from __future__ import annotations

from msgspec.structs import replace

from ...catalogue.keys import ParameterKey
from ..model.parameters import Parameter
from ..schema import Estimate, HowFar, Value

# Distances by which intervals of 90 % had to be wider to hold on 1,000 generated machines, at the
# low and the high end, with pressures (True) and with the position alone (False); see
# docs/gap/calibration.md. Of sizes of effects they are shares of
# the size, of shrinkage they are shrinkage.
SIZE_FURTHER = {True: (0.039, 0.014), False: (0.105, 0.033)}
SHRINKAGE_FURTHER = {True: (0.297, 0.253), False: (0.363, 0.367)}
SHRINKAGE_FURTHER_FROM_NOMINAL = {True: (0.169, 0.139), False: (0.357, 0.079)}


def size_between_machines(estimate: Estimate, parameter: Parameter, pressures: bool) -> Estimate:
    """Returns the estimate of a parameter of an effect with an interval that holds on any machine.

    The ends stay within the bounds of the parameter. Other parameters stay as they are.
    """
    if ParameterKey(parameter.name).effect is None:
        return estimate
    size = abs(estimate.value)
    low, high = (size * distance for distance in SIZE_FURTHER[pressures])
    ends = parameter.value(parameter.low), parameter.value(parameter.high)
    return Estimate(
        estimate.value,
        max(estimate.low - low, min(ends)),
        min(estimate.high + high, max(ends)),
    )


def reduction_between_machines(reduction: HowFar, pressures: bool) -> HowFar:
    """Returns the reduction of the gap by effects, with intervals for other motions."""
    of_explainable = _further(reduction.shrinkage_of_explainable, SHRINKAGE_FURTHER[pressures])
    from_nominal = _further(
        reduction.shrinkage_from_nominal, SHRINKAGE_FURTHER_FROM_NOMINAL[pressures]
    )
    return replace(
        reduction, shrinkage_of_explainable=of_explainable, shrinkage_from_nominal=from_nominal
    )


def _further(share: Value, distances: tuple[float, float]) -> Value:
    """Moves the ends of a share outwards; no more than the whole gap can vanish."""
    low, high = share.ci90
    return Value(share.value, (low - distances[0], max(high, min(high + distances[1], 1.0))))
