# SPDX-License-Identifier: MIT
"""A float32 servo estimator sample by sample, as bits: trace.csv.

tests/python/core/test_golden.py and tests/cpp/test_golden.cpp step through it and must make the
same bits, so a difference shows at the sample and in the number where it begins. One row a sample
and policy; every number is the bits of a float32 in hexadecimal, the status its code. The run meets
what a controller meets: filling, a lost measurement, an implausible command, a hold, a disturbance
and a change of the plant. `python tests/golden/make_trace.py` writes the trace anew after a change
of the recursion that is meant to change digits.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt
from float32_bits import POLICIES

import ehsid

TRACE = Path(__file__).with_name("trace.csv")
SAMPLES = 660
Float32 = npt.NDArray[np.float32]
PARAMETERS = ("a1", "a2", "a3", "b1", "b2", "b3")
COLUMNS = (
    "policy",
    "command",
    "position",
    "status",
    "innovation",
    "forgetting_factor",
    *PARAMETERS,
    *(f"std_{name}" for name in PARAMETERS),
)


def estimator(policy: str) -> ehsid.ArxEstimator:
    """Settings other than the defaults where they enter the arithmetic; so in test_golden.cpp."""
    return ehsid.ArxEstimator(
        3,
        3,
        1,
        forgetting=POLICIES[policy],
        scaling=ehsid.Scaling(
            command_scale=5.0, position_scale=0.3, command_offset=0.25, position_offset=-0.02
        ),
        reset=ehsid.RmseResetOptions(
            short_window=5.0, long_window=60.0, trigger_ratio=8.0, cool_down=20
        ),
        theta0=[-1.5, 0.5, 0.0, 0.02, 0.0, 0.0],
        variance0=[1e6, 1e6, 1e6, 2.5e5, 2.5e5, 2.5e5],
        dtype="float32",
    )


def signals() -> tuple[Float32, Float32]:
    """Command in volts and position in metres of model (16), with noise."""
    rng = np.random.default_rng(16)
    u, y = np.zeros((2, SAMPLES + 3))
    for k in range(3, SAMPLES + 3):
        gain = 2.0 if k >= 603 else 1.0
        noise = 4e-3 if 573 <= k < 588 else 1e-3
        y[k] = (
            np.dot([2.2390, -1.7820, 0.5427], y[k - 3 : k][::-1])
            + gain * np.dot([0.3850, -0.5810, 0.2954], u[k - 3 : k][::-1])
            + noise * rng.normal()
        )
        u[k] = 0.1 if 123 <= k < 573 else rng.choice([-1.0, 1.0])
    command = (0.25 + 5.0 * u[3:]).astype(np.float32)
    position = (-0.02 + 0.3 * y[3:]).astype(np.float32)
    position[70] = np.nan
    command[100] = 1e6
    return command, position


def bits(*numbers: float) -> list[str]:
    """Each as a float32 in hexadecimal, 8 digits."""
    return [f"{word:08x}" for word in np.array(numbers, dtype=np.float32).view(np.uint32)]


def state(made: ehsid.ArxEstimator) -> list[str]:
    """The columns behind the status."""
    return bits(made.innovation, made.forgetting_factor, *made.theta_hat, *made.standard_deviation)


def write() -> None:
    """Writes trace.csv."""
    with TRACE.open("w", newline="", encoding="ascii") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for policy in POLICIES:
            made = estimator(policy)
            for command, position in zip(*signals(), strict=True):
                status = made.step(command, position)
                table.writerow([policy, *bits(command, position), status.value, *state(made)])


if __name__ == "__main__":
    write()
