# SPDX-License-Identifier: MIT
"""Writes servo_samples.csv, which the examples in C++, C and Python read.

    python examples/data/make_servo_samples.py

A servo under a proportional controller, 20 s at 5 ms. At 10 s its velocity gain grows by half, as
with a higher supply pressure. The white noise acts on the servo itself, so that least squares is
without bias. Two samples are wrong: the sensor gives no number once, and an impossible one once.
"""

from pathlib import Path

import numpy as np

import ehsid

DT_S = 0.005
SAMPLES = 4000
NO_NUMBER, IMPOSSIBLE = 1200, 2600  # sample numbers of the two faults


def servo(gain: float) -> np.ndarray:
    """Coefficients a1, a2, a3, b1, b2, b3 of a servo with 16 Hz and little damping."""
    return ehsid.discretise(ehsid.ContinuousServo(gain=gain, omega_n=100.0, xi=0.3), DT_S)


def simulate() -> tuple[np.ndarray, np.ndarray]:
    """Returns command in V and position in m."""
    random = np.random.default_rng(1)
    noise_m = 5e-6 * random.standard_normal(SAMPLES)
    dither_v = 1.5 * random.choice([-1.0, 1.0], SAMPLES // 4).repeat(4)
    command, position = np.zeros(SAMPLES), np.zeros(SAMPLES)
    for k in range(SAMPLES):
        theta = servo(0.04 if k < SAMPLES // 2 else 0.06)
        past_y = [position[k - i] if k >= i else 0.0 for i in (1, 2, 3)]
        past_u = [command[k - i] if k >= i else 0.0 for i in (1, 2, 3)]
        position[k] = -theta[:3] @ past_y + theta[3:] @ past_u + noise_m[k]
        wanted_m = 0.03 * np.sin(2.0 * np.pi * k * DT_S / 4.0)
        command[k] = np.clip(60.0 * (wanted_m - position[k]) + dither_v[k], -10.0, 10.0)
    return command, position


def main() -> None:
    """Writes the file beside this script, with the digits that a float32 needs."""
    command, position = (signal.astype(np.float32) for signal in simulate())
    position[NO_NUMBER], position[IMPOSSIBLE] = np.nan, 1e9
    rows = [
        f"{k * DT_S:.3f},{u:.9g},{y:.9g}\n"
        for k, (u, y) in enumerate(zip(command, position, strict=True))
    ]
    path = Path(__file__).with_name("servo_samples.csv")
    path.write_text("time_s,command_v,position_m\n" + "".join(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
