# SPDX-License-Identifier: MIT
"""ServoEstimator in float32 sample by sample, as bits: servo_trace.csv.

Read by the tests that read trace.csv, with the same rules; the last column is the checksum of the
saved state, so that every number of the state is compared. Two runs: `steps` meets the start, lost
and implausible samples, a change of the plant, a hold, and a change of sign that makes all begin
anew; `sine` a single sine, a gain below zero, settings other than the defaults, and a rest at the
end, during which omega_n and xi cannot be told.
`python tests/golden/make_servo_trace.py` writes the trace anew after a change of the estimator that
is meant to change digits.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from make_trace import Float32, bits

import ehsid

TRACE = Path(__file__).with_name("servo_trace.csv")
SAMPLES = {"steps": 1100, "sine": 600}
SETTINGS = {
    "steps": {"dt_s": 0.01},
    "sine": {"dt_s": 0.01, "delay": 3, "drift": 0.05, "tolerance": 0.25},
}
VALUES = ("gain", "omega_n", "xi")
STATE = (
    *(f"{value}{part}" for value in VALUES for part in ("", "_half_width", "_reason")),
    "checksum",
)
COLUMNS = ("run", "command", "position", "status", *STATE)


def estimator(run: str) -> ehsid.ServoEstimator:
    """So in test_golden.cpp and in the firmware."""
    return ehsid.ServoEstimator(**SETTINGS[run])  # type: ignore[arg-type]


def signals(run: str) -> tuple[Float32, Float32]:
    """Command and position of a servo of 25 rad/s and xi 0.3, with 5 um of noise, in SI units."""
    rng = np.random.default_rng(7)
    dt_s = SETTINGS[run]["dt_s"]
    command, position = np.zeros((2, SAMPLES[run]))
    delayed = [0.0, 0.0]
    p = v = a = 0.0
    for k in range(SAMPLES[run]):
        held = 650 <= k < 760 if run == "steps" else k >= 540
        position[k] = 0.1 + p + 5e-6 * rng.normal()
        if held:
            command[k] = 0.0
        elif run == "sine":
            command[k] = 2.0 * np.sin(2.0 * np.pi * 1.5 * k * dt_s)
        else:
            error = 0.1 + (0.02 if k // 60 % 2 == 0 else -0.02) - position[k]
            command[k] = 100.0 * error if k < 850 else -100.0 * error
        gain = -0.05 if run == "sine" else 0.03 if k < 450 else 0.045 if k < 850 else -0.045
        delayed.append(command[k])
        u = delayed[-3] if run == "sine" else command[k]
        for _ in range(0 if held else 50):
            h = dt_s / 50
            a += h * (625.0 * (gain * u - v) - 15.0 * a)
            v += h * a
            p += h * v
        v, a = (0.0, 0.0) if held else (v, a)
    if run == "steps":
        position[[70, 330]] = np.nan
        command[[100, 360]] = 2e12
        position[400] = 9.999
    return command.astype(np.float32), position.astype(np.float32)


def state(made: ehsid.ServoEstimator) -> list[str]:
    """The columns behind the status."""
    told = made.servo()
    words = []
    for value in (told.gain, told.omega_n, told.xi):
        words += [*bits(value.value, value.half_width), f"{int(value.reason):x}"]
    return [*words, f"{int.from_bytes(made.save()[-4:], 'little'):08x}"]


def write() -> None:
    """Writes servo_trace.csv."""
    with TRACE.open("w", newline="", encoding="ascii") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for run in SETTINGS:
            made = estimator(run)
            for command, position in zip(*signals(run), strict=True):
                status = made.step(command, position)
                table.writerow([run, *bits(command, position), f"{int(status):x}", *state(made)])


if __name__ == "__main__":
    write()
