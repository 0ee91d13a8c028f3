# SPDX-License-Identifier: MIT
"""The exported C99 estimator on emulated cores: the bits of the host, without and with an FPU."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import ehsid
from ehsid.harness.firmware import header_of_record
from ehsid.harness.models.identification import ArxOrders, IoData

RUN = Path(__file__).parents[2] / "firmware" / "cores" / "run.py"


@pytest.mark.slow
def test_every_core_has_the_bits_of_the_host(tmp_path: Path) -> None:
    """Self-test of a third-order estimator on each core whose tools are there, at both levels."""
    rng = np.random.default_rng(11)
    u = rng.normal(size=600)
    y = np.zeros(600)
    for k in range(2, 600):
        y[k] = 1.6 * y[k - 1] - 0.7 * y[k - 2] + 0.1 * u[k - 1]
    data = IoData(u, y + 1e-3 * rng.normal(size=600), (slice(0, 600),), 0.005)
    made = header_of_record(
        Path("record.csv"),
        data,
        ArxOrders(3, 3, 1),
        forgetting=ehsid.FRatio(),
        whole="c",
        stem="servo",
    )
    (tmp_path / "servo.c").write_text(made.text, encoding="utf-8")
    # The programs of the cores include the header by this name.
    (tmp_path / "servo_estimator.h").write_text(made.beside, encoding="utf-8")
    (tmp_path / "servo.h").write_text(made.beside, encoding="utf-8")
    said = subprocess.run(
        [sys.executable, RUN, tmp_path / "servo.c", "--json"],
        capture_output=True,
        text=True,
        check=True,
    )
    costs = json.loads(said.stdout)
    if not costs:
        pytest.skip("no compiler and emulator of a core")
    for each in costs:
        assert each["same_bits"], each
        assert each["instructions"] > 0, each
