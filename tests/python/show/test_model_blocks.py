# SPDX-License-Identifier: MIT
"""The model in words: units of channels, tables without columns that are empty, all digits."""

from __future__ import annotations

import io

import numpy as np
import pytest
from identification_truth import arx_output, model16

import ehsid
from ehsid.harness.cli.console import Console, print_blocks
from ehsid.harness.models.identification import IdentificationResult, IoData, identify
from ehsid.harness.show.model_blocks import model_told

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
    gain, motion = model_told(servo, "command_v", "position_m").servo
    assert gain.startswith("Velocity gain K = 0.0")
    assert gain.endswith(" m/s per V.")
    assert "omega_n = " in motion
    assert "xi = " in motion
    assert model_told(servo, "u", "y").servo[0].endswith(" unit of y/s per unit of u.")


def test_numbers_follow_the_units_of_people(servo: IdentificationResult) -> None:
    ends = ("command_v", "position_m")
    plain, usual = model_told(servo, *ends), model_told(servo, *ends, usual=True)
    assert usual.servo[0].endswith(" mm/s per V.")
    assert plain.servo[1:] == usual.servo[1:]
    assert usual.coefficients.columns == (*plain.coefficients.columns, "unit")
    units = [row[3] for row in usual.coefficients.rows]
    assert units == ["", "", "", "mm/V", "mm/V", "mm/V", "mm"]
    for before, after in zip(plain.coefficients.rows, usual.coefficients.rows, strict=True):
        factor = 1e3 if after[3] else 1.0
        for one, other in zip(before[1:3], after[1:3], strict=True):
            assert float(str(other)) == pytest.approx(factor * float(str(one)), rel=1e-5)


def test_tables_have_all_coefficients_and_roots(servo: IdentificationResult) -> None:
    told = model_told(servo, "u", "y")
    names = [row[0] for row in told.coefficients.rows]
    assert names == ["a1", "a2", "a3", "b1", "b2", "b3", "offset"]
    table = told.roots
    assert [row[0] for row in table.rows] == ["pole", "pole", "zero", "zero"]
    assert "f in Hz" in table.columns
    (pole,) = [row for row in table.rows if row[4] == "integrator"]
    assert pole[1].startswith(("1", "0.999"))
    assert pole[5] == ""
    assert [bool(row[5]) for row in table.rows] == [
        row[4] not in ("", "integrator") for row in table.rows
    ]


def test_without_time_and_with_another_order_there_is_no_servo() -> None:
    unknown = model_told(identified(None, 3), "u", "y")
    assert "f in Hz" not in unknown.roots.columns
    assert "needs the sampling time" in " ".join(unknown.servo)
    assert "na = 2 and nb = 2" in model_told(identified(DT_S, 2), "u", "y").servo[1]


def test_a_model_that_is_better_than_one_of_a_servo_says_how_late_it_follows() -> None:
    rng = np.random.default_rng(1)
    u = rng.normal(size=2000)
    y = arx_output(np.array([-0.5]), np.array([1.0]), 1, u, 1e-3 * rng.normal(size=u.size))
    data = IoData.from_arrays(u, y, dt_s=DT_S)
    both = model_told(identify(data, orders=[1, 3], delays=[1]), "u", "y").servo
    (line,) = both
    assert " ms late with a static gain of " in line  # 1 / (z - 0.5): two samples
    late = float(line.partition("slow input ")[2].split()[0])
    assert late == pytest.approx(2e3 * DT_S, rel=0.02)
    assert len(model_told(identify(data, orders=[1], delays=[1]), "u", "y").servo) == 2


@pytest.mark.parametrize("size", [1e-6, 1e-4, 1.0, 1e6])
def test_the_table_of_orders_has_all_digits_at_80_columns(size: float) -> None:
    u, y = model16(seed=4, n=800, noise=1e-3)
    result = identify(IoData.from_arrays(u, size * np.asarray(y)))
    table = model_told(result, "u", "y").orders
    out = io.StringIO()
    print_blocks([table], Console(file=out, width=80))
    assert "…" not in out.getvalue()
    for row in table.rows:
        assert all(cell in out.getvalue() for cell in row)
    power = next((w for w in table.caption.split() if w.startswith("1e")), "1")
    for row, candidate in zip(table.rows, result.by_order, strict=True):
        for cell, value in (
            (row[4], candidate.validation.fpe),
            (row[5], candidate.validation.loss),
            (row[7], candidate.validation.mdl),
        ):
            # Of numbers that are far from those of the chosen order there is one digit.
            digits = 1e-4 if "e" not in cell else 0.5
            assert float(cell) * float(power) == pytest.approx(value, rel=digits)
