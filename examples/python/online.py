# SPDX-License-Identifier: MIT
"""Estimates a servo online, sample by sample: python online.py SAMPLES.csv"""

import sys

import numpy as np

import ehsid

DT_S = 0.005
SHOWN = (1000, 1999, 2040, 3000, 3999)  # numbers of the samples that are printed
NAMES = ("a1", "a2", "a3", "b1", "b2", "b3")


def print_row(k: int, estimator: ehsid.ArxEstimator) -> None:
    """Prints the estimate with nine digits, enough to tell any two float32 apart."""
    numbers = "".join(f" {value:15.8e}" for value in estimator.theta_hat)
    print(f"{DT_S * k:6.3f}{numbers}  {'yes' if estimator.converged else 'no'}")


def print_number(name: str, value: float, deviation: float) -> None:
    """Prints a number of the servo with its standard deviation."""
    print(f"{name:<16} {value:#.4g} +- {deviation:.2g}")


def main() -> None:
    """Estimates the servo whose samples are in the file that is named on the command line."""
    if len(sys.argv) != 2:
        sys.exit("usage: online.py SAMPLES.csv, for example ../data/servo_samples.csv")
    samples = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1, dtype=np.float32)

    # The largest command and the largest position make the signals of order one.
    scaling = ehsid.Scaling(command_scale=10.0, position_scale=0.1)
    estimator = ehsid.ArxEstimator(3, 3, 1, scaling=scaling)  # float32, as on a controller

    print("time_s" + "".join(f" {name:>15}" for name in NAMES) + "  converged")
    refused = 0
    for k, (_, command_v, position_m) in enumerate(samples):
        status = estimator.step(command_v, position_m)
        if ehsid.is_error(status):  # no plausible number: the estimate is as before
            refused += 1
        elif status == ehsid.Status.reset:  # theta is kept, and becomes uncertain
            when = f"{DT_S * k:6.3f}"
            print(when, "the servo has changed: the estimator has started to learn anew")
        if k in SHOWN:
            print_row(k, estimator)
    print(f"{len(samples)} samples, {refused} of them refused")

    servo = estimator.servo(DT_S)
    if servo.status != ehsid.ServoReadingStatus.ok:
        sys.exit(f"the model is not one of a servo: {servo.description}")
    print_number("K in m/(s V)", servo.gain, servo.gain_std)
    print_number("omega_n in rad/s", servo.omega_n, servo.omega_n_std)
    print_number("xi", servo.xi, servo.xi_std)


if __name__ == "__main__":
    main()
