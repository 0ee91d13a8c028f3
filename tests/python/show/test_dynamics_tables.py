# SPDX-License-Identifier: MIT
"""The model in words: units of channels, a table without columns that are empty, reasons."""

from __future__ import annotations

import numpy as np
import pytest
from identification_truth import arx_output

import ehsid
from ehsid.harness.models.identification import IdentificationResult, IoData, identify
from ehsid.harness.show.dynamics_tables import model_table, root_table, servo_lines

DT_S = 1e-3
SERVO = ehsid.ContinuousServo(gain=0.03, omega_n=120.0, xi=0.4)


def identified(dt_s: float | None, order: int) -> IdentificationResult:
    theta = ehsid.discretise(SERVO, DT_S)
    rng = np.random.default_rng(1)
    u = rng.normal(size=4000)
    y = arx_output(theta[:3], theta[3:], 1, u, 1e-8 * rng.normal(size=u.size))
    return identify(IoData.from_arrays(u, y, dt_s=dt_s), orders=[order], delays=[1])


@pytest.fixture(scope="module")
def servo() -> IdentificationResult:
    return identified(DT_S, 3)


def test_channels_have_their_units_and_other_columns_their_names(
    servo: IdentificationResult,
) -> None:
    gain, motion = servo_lines(servo, "command_v", "position_m")
    assert gain.startswith("Velocity gain K = 0.0")
    assert gain.endswith(" m/s per V.")
    assert "omega_n = " in motion
    assert "xi = " in motion
    assert servo_lines(servo, "u", "y")[0].endswith(" unit of y/s per unit of u.")


def test_tables_have_all_coefficients_and_roots(servo: IdentificationResult) -> None:
    names = [row[0] for row in model_table(servo).rows]
    assert names == ["a1", "a2", "a3", "b1", "b2", "b3", "offset"]
    table = root_table(servo)
    assert [row[0] for row in table.rows] == ["pole", "pole", "zero", "zero"]
    assert "f in Hz" in table.columns
    (pole,) = [row for row in table.rows if row[4] == "integrator"]
    assert pole[1].startswith(("1", "0.999"))
    assert pole[5] == ""
    assert [bool(row[5]) for row in table.rows] == [
        row[4] not in ("", "integrator") for row in table.rows
    ]


def test_without_time_and_with_another_order_there_is_no_servo() -> None:
    unknown = identified(None, 3)
    assert "f in Hz" not in root_table(unknown).columns
    assert "needs the sampling time" in " ".join(servo_lines(unknown, "u", "y"))
    assert "na = 2 and nb = 2" in servo_lines(identified(DT_S, 2), "u", "y")[1]
