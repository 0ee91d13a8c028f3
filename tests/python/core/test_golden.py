# SPDX-License-Identifier: MIT
"""The compiled module makes the bits of the traces; test_golden.cpp is the same in C++.

That a run has the bits of its steps, test_bindings_run.py and test_servo_estimator.py show.
"""

import csv
from pathlib import Path

import make_servo_trace
import make_trace
import numpy as np
import pytest

import ehsid

Status = ehsid.Status
Rows = list[dict[str, str]]
STATE = make_trace.COLUMNS[4:]


def read(path: Path, by: str) -> dict[str, Rows]:
    rows: dict[str, Rows] = {}
    with path.open(newline="", encoding="ascii") as file:
        for row in csv.DictReader(file):
            rows.setdefault(row[by], []).append(row)
    return rows


@pytest.fixture(scope="module")
def trace() -> dict[str, Rows]:
    return read(make_trace.TRACE, "policy")


@pytest.fixture(scope="module")
def servo_trace() -> dict[str, Rows]:
    return read(make_servo_trace.TRACE, "run")


def column(rows: Rows, *names: str) -> make_trace.Float32:
    """Shape (samples, names)."""
    words = [[int(row[name], 16) for name in names] for row in rows]
    return np.array(words, dtype=np.uint32).view(np.float32)


@pytest.mark.parametrize("policy", make_trace.POLICIES)
def test_every_step_makes_the_bits_of_the_trace(policy: str, trace: dict[str, Rows]) -> None:
    rows = trace[policy]
    estimator = make_trace.estimator(policy)
    for k, (command, position) in enumerate(column(rows, "command", "position")):
        status = estimator.step(command, position)
        made = dict(zip(STATE, make_trace.state(estimator), strict=True))
        assert status == int(rows[k]["status"]), f"{policy}, sample {k}: status"
        assert made == {name: rows[k][name] for name in STATE}, f"{policy}, sample {k}"


def test_the_trace_meets_what_a_controller_meets(trace: dict[str, Rows]) -> None:
    met: set[Status] = set()
    for policy, rows in trace.items():
        assert len(rows) == make_trace.SAMPLES
        status = [Status(int(row["status"])) for row in rows]
        assert status[:3] == [Status.filling] * 3
        assert status[70] == Status.invalid_input
        assert status[100] == Status.out_of_range
        # Of Exponential at the disturbance, which it would keep, of the others at the change.
        assert Status.reset in status[580:620], policy
        met.update(status)
    assert Status.no_information in met
    for policy in ("Exponential", "ErrorDriven", "FRatio"):
        assert np.unique(column(trace[policy], "forgetting_factor")).size > 5, policy


def test_every_policy_has_a_trace_of_its_own(trace: dict[str, Rows]) -> None:
    assert len({column(rows, *STATE).tobytes() for rows in trace.values()}) == len(trace)


def test_inputs_are_those_of_the_script(trace: dict[str, Rows]) -> None:
    # Not to the last bit: numpy's dot product may add in another order elsewhere.
    for rows in trace.values():
        assert np.allclose(
            column(rows, "command", "position").T, make_trace.signals(), equal_nan=True
        )


@pytest.mark.parametrize("run", make_servo_trace.SETTINGS)
def test_every_step_of_a_servo_makes_the_bits_of_its_trace(
    run: str, servo_trace: dict[str, Rows]
) -> None:
    rows = servo_trace[run]
    estimator = make_servo_trace.estimator(run)
    assert len(rows) == make_servo_trace.SAMPLES[run]
    for k, (command, position) in enumerate(column(rows, "command", "position")):
        if k % 50 == 49:  # another one goes on from the saved state
            estimator, before = make_servo_trace.estimator(run), estimator
            estimator.restore(before.save())
        status = estimator.step(command, position)
        made = dict(zip(make_servo_trace.STATE, make_servo_trace.state(estimator), strict=True))
        assert status == int(rows[k]["status"], 16), f"{run}, sample {k}: status"
        assert made == {name: rows[k][name] for name in made}, f"{run}, sample {k}"


def test_the_trace_of_a_servo_meets_every_status_and_every_reason(
    servo_trace: dict[str, Rows],
) -> None:
    rows = [row for run in servo_trace.values() for row in run]
    met = {Status(int(row["status"], 16)) for row in rows}
    refused = {Status.invalid_input, Status.out_of_range}
    assert met == refused | {Status.ok, Status.filling, Status.no_information, Status.reset}
    reasons = {int(row[f"{name}_reason"]) for row in rows for name in make_servo_trace.VALUES}
    assert reasons >= set(ehsid.TrustReason) - {ehsid.TrustReason.model_does_not_fit}
    for run, run_rows in servo_trace.items():
        assert np.allclose(
            column(run_rows, "command", "position").T,
            make_servo_trace.signals(run),
            equal_nan=True,
        )
