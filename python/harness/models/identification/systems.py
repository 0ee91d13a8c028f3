# SPDX-License-Identifier: MIT
"""Converts models to python-control systems, for Bode plots, margins, closed loops, simulation.

>>> system = to_control(result.chosen.model, data.dt_s)
>>> control.bode_plot(system, display_margins=True)

Import this module directly: `ehsid.harness.models.identification` does not import it, because
python-control takes a second to import.
"""

from __future__ import annotations

import control
import numpy as np
import numpy.typing as npt

import ehsid

from .arx import ArxModel
from .errors import IdentificationError
from .orders import ArxOrders


def arx_system(
    orders: ArxOrders, theta: npt.ArrayLike, dt_s: float | None
) -> control.TransferFunction:
    """Returns G(z) = z^-nk (b1 + .. + b_nb z^-(nb-1)) / (1 + a1 z^-1 + .. + a_na z^-na).

    This is Eq. (7) of Ghazali et al. 2011 from input to output, without the constant term.

    Parameters
    ----------
    orders
        structure of the model.
    theta
        shape (na + nb,) or, with the constant term, (na + nb + 1,): a1 .. a_na, b1 .. b_nb.
    dt_s
        sampling time in seconds, > 0; None if it is not known, time then counts samples.

    Returns
    -------
    Discrete-time system with one input `u` and one output `y`, with numerator and denominator in
    powers of z.

    Raises
    ------
    IdentificationError
        theta does not have the shape of the structure, or dt_s is not above 0.
    """
    values = np.asarray(theta, dtype=np.float64)
    na, nb, nk = orders.na, orders.nb, orders.nk
    if values.shape not in ((na + nb,), (orders.n_parameters,)):
        raise IdentificationError(
            f"theta has shape {values.shape}, expected ({orders.n_parameters},) for {orders}"
        )
    if dt_s is not None and not 0.0 < dt_s < np.inf:
        raise IdentificationError(f"dt_s = {dt_s:g}: expected a finite number above 0")
    # Numerator and denominator are multiplied by z^degree, with the largest delay in either of them
    # as degree.
    degree = max(na, nk + nb - 1)
    denominator = np.zeros(degree + 1)
    denominator[0], denominator[1 : na + 1] = 1.0, values[:na]
    numerator = np.zeros(degree + 1)
    numerator[nk : nk + nb] = values[na : na + nb]
    return control.TransferFunction(
        numerator, denominator, True if dt_s is None else dt_s, inputs="u", outputs="y"
    )


def to_control(model: ArxModel, dt_s: float | None) -> control.TransferFunction:
    """Returns an estimated model as a system of python-control, see `arx_system`.

    Parameters
    ----------
    model
        estimated model.
    dt_s
        sampling time in seconds, as in `IoData.dt_s`; None if it is not known.
    """
    return arx_system(model.orders, model.theta, dt_s)


def servo_system(servo: ehsid.ContinuousServo) -> control.TransferFunction:
    """Returns G(s) = K wn^2 / (s (s^2 + 2 xi wn s + wn^2)), from command to position.

    Ghazali et al. 2011, Eq. (5). `control.sample_system(servo_system(servo), dt_s, "zoh")` gives
    the system that `ehsid.discretise(servo, dt_s)` computes without a matrix exponential.

    Parameters
    ----------
    servo
        gain K in m/(s V), natural frequency wn in rad/s, damping ratio xi.
    """
    stiffness = servo.omega_n**2
    return control.TransferFunction(
        [servo.gain * stiffness],
        [1.0, 2.0 * servo.xi * servo.omega_n, stiffness, 0.0],
        inputs="u",
        outputs="y",
    )
