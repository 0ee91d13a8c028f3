# SPDX-License-Identifier: MIT
"""Headers of a servo that stands still at another command than the mean of the record."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import ehsid
from ehsid.harness.cli import cli
from ehsid.harness.firmware import chosen_orders, header_of_record
from ehsid.harness.models.identification import ArxOrders, IoData

DT_S = 0.02
AT_REST_V = 0.1


@pytest.fixture(scope="module")
def servo() -> IoData:
    """A record whose command has the mean zero, of a servo that needs 0.1 V to stand still."""
    a1, a2, a3, b1, b2, b3 = ehsid.discretise(
        ehsid.ContinuousServo(gain=0.03, omega_n=25.0, xi=0.3), DT_S
    )
    rng = np.random.default_rng(1)
    u = np.repeat(rng.permutation([-1.0, 1.0] * 250), 4)
    y = np.zeros(u.size)
    for k in range(3, u.size):
        y[k] = -a1 * y[k - 1] - a2 * y[k - 2] - a3 * y[k - 3] + rng.normal(scale=4e-6)
        y[k] += np.array([b1, b2, b3]) @ (u[k - 3 : k][::-1] - AT_REST_V)
    return IoData.from_arrays(u, y, dt_s=DT_S)


@pytest.mark.parametrize("offset", [False, True])
def test_the_constant_term_lets_an_integrating_servo_converge(servo: IoData, offset: bool) -> None:
    header = header_of_record(
        Path("record.csv"), servo, ArxOrders(3, 3, 1, offset=offset), forgetting=ehsid.FRatio()
    )
    assert header.converges is offset


def test_orders_that_identification_chooses_have_the_constant_term(servo: IoData) -> None:
    assert chosen_orders(servo).offset
    assert not chosen_orders(servo, offset=False).offset


def test_the_command_takes_the_constant_term_and_says_where_it_is_missed(
    servo: IoData, tmp_path: Path
) -> None:
    record = tmp_path / "record.csv"
    np.savetxt(
        record, np.column_stack([servo.u, servo.y]), delimiter=",", header="u,y", comments=""
    )
    taken = ["export", str(record), "--input", "u", "--output", "y", "--dt", f"{DT_S}"]
    header = tmp_path / "servo.hpp"
    run = CliRunner().invoke
    with_it = run(cli, [*taken, "--out", str(header)])
    assert "offset" in with_it.stdout
    assert "note" not in with_it.stderr
    without = run(cli, [*taken, "--no-offset", "--out", str(header)])
    assert without.exit_code == 0
    assert "offset" not in without.stdout
    assert "does not report that it has converged" in without.stderr
    assert "--na 3 --nb 3 --nk 1 --no-offset` says what to try" in without.stderr
    quiet = run(cli, [*taken, "--no-offset", "--quiet", "--out", str(header)])
    assert quiet.stderr == ""
