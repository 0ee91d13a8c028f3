# SPDX-License-Identifier: MIT
"""The servo that was read from an estimate, sampled again: by our code and by python-control."""

from __future__ import annotations

from dataclasses import dataclass

import control
import numpy as np

import ehsid
from ehsid.harness.arrays import FloatArray
from ehsid.harness.identification.systems import servo_system
from ehsid.harness.studies.reading import Reading


@dataclass(frozen=True, eq=False)
class SampledServo:
    """Coefficients a1, a2, a3, b1, b2, b3 of Eq. (6), each of shape (6,).

    Attributes
    ----------
    gain, omega_n, xi
        of the servo (5): K in m/(s V), rad/s, damping ratio.
    estimate
        theta from which they were read.
    ours
        zero-order hold by `ehsid.discretise`.
    by_control
        zero-order hold by python-control, from the matrix exponential of its state space.
    """

    gain: float
    omega_n: float
    xi: float
    estimate: FloatArray
    ours: FloatArray
    by_control: FloatArray


def sample_again(reading: Reading, dt_s: float) -> SampledServo | None:
    """From the last theta that is a servo; None if none is.

    Parameters
    ----------
    reading
        of a record.
    dt_s
        sampling time in seconds.
    """
    good = [i for i, status in enumerate(reading.status) if status == "ok"]
    if not good:
        return None
    gain, omega_n, xi = (float(value) for value in reading.value[good[-1]])
    servo = ehsid.ContinuousServo(gain=gain, omega_n=omega_n, xi=xi)
    sampled = control.sample_system(servo_system(servo), dt_s, method="zoh")
    # Three poles and two zeros: python-control leaves out leading zeros of the numerator.
    numerator = sampled.num[0][0]
    return SampledServo(
        gain,
        omega_n,
        xi,
        reading.theta[good[-1]],
        np.asarray(ehsid.discretise(servo, dt_s), dtype=np.float64),
        np.concatenate((sampled.den[0][0][1:], np.zeros(3 - numerator.size), numerator)),
    )
