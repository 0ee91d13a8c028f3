# SPDX-License-Identifier: MIT
"""Samples the servo read from an estimate again, by `ehsid.discretise` and by python-control."""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np

import ehsid
from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.models.identification.systems import servo_system

from .reading import Reading


@dataclass(frozen=True, eq=False)
class SampledServo:
    """Coefficients a1, a2, a3, b1, b2, b3 of Eq. (6) from three sources, each of shape (6,).

    Attributes
    ----------
    gain, omega_n, xi
        parameters of the servo (5): K in m/(s V), omega_n in rad/s, damping ratio.
    estimate
        estimated theta from which these parameters were read.
    ours
        coefficients with zero-order hold by `ehsid.discretise`.
    by_control
        coefficients with zero-order hold by python-control, from the matrix exponential of its
        state space.
    """

    gain: float
    omega_n: float
    xi: float
    estimate: FloatArray
    ours: FloatArray
    by_control: FloatArray


def sample_again(reading: Reading, dt_s: float) -> SampledServo | None:
    """Samples the servo of the last valid reading; returns None if no reading is valid.

    Parameters
    ----------
    reading
        physical parameters over a record; a reading is valid if its status is "ok".
    dt_s
        sampling time in seconds.
    """
    good = [i for i, status in enumerate(reading.status) if status == "ok"]
    if not good:
        return None
    gain, omega_n, xi = (float(value) for value in reading.value[good[-1]])
    servo = ehsid.ContinuousServo(gain=gain, omega_n=omega_n, xi=xi)
    sampled = control.sample_system(servo_system(servo), dt_s, method="zoh")
    # The numerator has three coefficients. python-control omits leading zeros, so they are added.
    numerator = sampled.num[0][0]
    return SampledServo(
        gain,
        omega_n,
        xi,
        reading.theta[good[-1]],
        np.asarray(ehsid.discretise(servo, dt_s), dtype=np.float64),
        np.concatenate((sampled.den[0][0][1:], np.zeros(3 - numerator.size), numerator)),
    )
