# SPDX-License-Identifier: MIT
"""The gain of a model that integrates, as a position servo does: speed per unit of the command."""

from __future__ import annotations

import numpy as np

from .arx import ArxModel
from .roots import poles_zeros

# A pole counts as an integrator if it cannot be told from z = 1 at this many deviations.
DEVIATIONS = 3.0


def integrator(model: ArxModel) -> int | None:
    """Returns which pole of `poles_zeros(model)` is an integrator; None if the model has none.

    The model integrates if its real pole that is nearest to z = 1 cannot be told from it, or moves
    away from it by less than 1/e over the record from which the model was estimated.
    """
    poles = poles_zeros(model).poles
    away = np.abs(1.0 - poles.values)
    nearest = int(np.argmin(np.where(poles.values.imag == 0.0, away, np.inf)))
    distance = float(away[nearest])
    deviation = float(np.sqrt(max(poles.covariance[nearest, 0, 0], 0.0)))
    told_apart = distance > DEVIATIONS * deviation if poles.reliable[nearest] else True
    if poles.values[nearest].imag != 0.0 or (told_apart and distance * model.n_rows > 1.0):
        return None
    return nearest


def velocity_gain(model: ArxModel, dt_s: float) -> float | None:
    """Returns K in G(z) ~ K dt / (z - 1) at low frequencies; None if the model does not integrate.

    This is the K of Ghazali et al. 2011, Eq. (5). The pole that `integrator` names is taken as
    z = 1: K = B(1) / (dt prod (1 - p_i)), over all other poles p_i.

    Parameters
    ----------
    model
        estimated model.
    dt_s
        sampling time in seconds.

    Returns
    -------
    K in units of the output a second and unit of the input.
    """
    nearest = integrator(model)
    if nearest is None:
        return None
    others = np.delete(poles_zeros(model).poles.values, nearest)
    return float(np.sum(model.b) / (dt_s * np.prod(1.0 - others)).real)
