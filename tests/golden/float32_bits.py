# SPDX-License-Identifier: MIT
"""Float32 estimates as hashes of their bits, for every policy.

tests/python/core/test_float32_bits.py compares the Python package with float32_bits.inc, and
tests/cpp/test_float32_bits.cpp what a C++ program makes of the same samples, on every compiler: so
all agree to the last bit. `python tests/golden/float32_bits.py` writes the table anew after a
change of the recursion that is meant to change digits.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

import ehsid

TABLE = Path(__file__).with_suffix(".inc")
SAMPLES = 4000
POLICIES = {info.policy.__name__: info.policy() for info in ehsid.policies()}


def signals() -> tuple[list[float], list[float]]:
    """Model (16) rounded to 1/1024, in integers, so that every language makes the same samples.

    Command: random steps, from sample 1500 held, from 2500 random again with gain two.
    """
    word = 2463534242
    u, y = [0, 0, 0], [0, 0, 0]
    for k in range(SAMPLES):
        word ^= (word << 13) & 0xFFFFFFFF  # Marsaglia's xorshift32
        word ^= word >> 17
        word ^= (word << 5) & 0xFFFFFFFF
        gain = 2 if k >= 2500 else 1
        model = 2293 * y[-1] - 1825 * y[-2] + 556 * y[-3]
        model += gain * (394 * u[-1] - 595 * u[-2] + 302 * u[-3])
        y.append((model >> 10) + (word >> 8) % 33 - 16)
        held = 1500 <= k < 2500
        u.append(512 if held else 1024 if word & 1 else -1024)
    return [x / 1024.0 for x in u[3:]], [x / 1024.0 for x in y[3:]]


def fnv1a(data: bytes) -> int:
    """64-bit FNV-1a hash."""
    value = 0xCBF29CE484222325
    for byte in data:
        value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return value


def hashes() -> dict[str, int]:
    """Of theta, standard deviations and status after every sample, by policy."""
    u, y = signals()
    result = {}
    for name, policy in POLICIES.items():
        scaling = ehsid.Scaling(command_scale=0.75, position_scale=3.0, position_offset=0.5)
        estimator = ehsid.ArxEstimator(
            3, 2, 2, offset=True, forgetting=policy, scaling=scaling, dtype="float32"
        )
        path = estimator.run(u, y)
        rows = np.concatenate(
            (
                path.theta.astype("<f4").view(np.uint8).reshape(SAMPLES, -1),
                path.standard_deviation.astype("<f4").view(np.uint8).reshape(SAMPLES, -1),
                path.status[:, None],
            ),
            axis=1,
        )
        result[name] = fnv1a(rows.tobytes())
    return result


def table() -> dict[str, int]:
    """What is written in float32_bits.inc."""
    entries = re.findall(r"EXPECTED_BITS\((\w+), (0x[0-9a-f]+)\)", TABLE.read_text())
    return {name: int(value, 16) for name, value in entries}


if __name__ == "__main__":
    lines = [f"EXPECTED_BITS({name}, {value:#018x})" for name, value in hashes().items()]
    TABLE.write_text("// Written by float32_bits.py.\n" + "\n".join(lines) + "\n")
