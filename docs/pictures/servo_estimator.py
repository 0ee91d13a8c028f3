# SPDX-License-Identifier: MIT
"""Draws docs/pictures/servo_estimator.png: python docs/pictures/servo_estimator.py

An ordinary servo (K 0.03 m/s per V, 25 rad/s, xi 0.3) in a P loop with steps of +-20 mm, 5 um of
noise on the position sensor, 10 ms; at 30 s K rises by half. ServoEstimator beside least squares.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.base.files import replacing

mpl.use("Agg")
from matplotlib import pyplot as plt

FloatArray = npt.NDArray[np.float64]
DT_S, SECONDS, CHANGE_S, SEED = 0.01, 60.0, 30.0, 1
GAIN, OMEGA_N, XI, NOISE_M, BANDWIDTH = 0.03, 25.0, 0.3, 5e-6, 4.0


def run() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Returns K with its half width and trust, shape (n, 3), the loop's kp, rls's K.

    The loop adapts kp to K as long as K is trusted, as the README shows.
    """
    random = np.random.default_rng(SEED)
    estimator = ehsid.ServoEstimator(DT_S)
    scaling = ehsid.Scaling(command_scale=3.0, position_scale=0.02)
    squares = ehsid.ArxEstimator(3, 3, 1, scaling=scaling)
    count = round(SECONDS / DT_S)
    told, gains, least = np.zeros((count, 3)), np.zeros(count), np.full(count, np.nan)
    x = v = a = 0.0
    kp, pieces = 60.0, 40
    for k in range(count):
        true = GAIN if k * DT_S < CHANGE_S else 1.5 * GAIN
        position = x + random.normal(0.0, NOISE_M)
        target = 0.02 if k * DT_S % 1.2 < 0.6 else -0.02
        command = float(np.clip(kp * (target - position), -10.0, 10.0))
        estimator.step(command, position)
        squares.step(command, position)
        gain = estimator.servo().gain
        if gain.trusted:
            kp += 0.01 * (BANDWIDTH / gain.value - kp)
        told[k], gains[k] = (gain.value, gain.half_width, gain.trusted), kp
        if k > 10:
            reading = ehsid.identify_servo(squares.theta_hat, squares.covariance, DT_S)
            least[k] = reading.gain
        for _ in range(pieces):
            a += DT_S / pieces * (OMEGA_N**2 * (true * command - v) - 2.0 * XI * OMEGA_N * a)
            v += DT_S / pieces * a
            x += DT_S / pieces * v
    return told, gains, least


def main() -> None:
    """Runs the loop and writes the picture."""
    told, gains, least = run()
    time_s = DT_S * np.arange(told.shape[0])
    value, half, trusted = told[:, 0], told[:, 1], told[:, 2] > 0.0
    true = np.where(time_s < CHANGE_S, GAIN, 1.5 * GAIN)
    figure, (top, bottom) = plt.subplots(
        2, 1, sharex=True, figsize=(9.0, 5.2), height_ratios=(2, 1), layout="constrained"
    )
    top.plot(time_s, true, color="black", linewidth=1.0, label="true")
    top.fill_between(
        time_s, value - half, value + half, color="tab:blue", alpha=0.25, label="90 % interval"
    )
    for shown, color, label in (
        (trusted, "tab:blue", "ServoEstimator, trusted"),
        (~trusted, "tab:orange", "ServoEstimator, not trusted"),
    ):
        top.plot(time_s, np.where(shown, value, np.nan), color=color, linewidth=1.8, label=label)
    top.plot(time_s, least, color="tab:gray", linewidth=1.2, linestyle="--", label="least squares")
    top.set(ylim=(0.015, 0.065), ylabel="K, m/s per V")
    top.legend(loc="upper left", ncols=2, fontsize=9)
    bottom.plot(time_s, gains, color="tab:blue", label="kp of the loop, adapted while K is trusted")
    bottom.plot(time_s, BANDWIDTH / true, color="black", linewidth=1.0, label="right kp")
    bottom.set(xlabel="time, s", ylabel="kp, V/m")
    bottom.legend(loc="upper right", fontsize=9)
    for axes in (top, bottom):
        axes.grid(alpha=0.3)
    with replacing(Path(__file__).with_suffix(".png")) as path:
        figure.savefig(path, dpi=110, format="png")


if __name__ == "__main__":
    main()
