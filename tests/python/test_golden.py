# SPDX-License-Identifier: MIT
"""The compiled module makes the bits of the committed trace; test_golden.cpp is the same in C++."""

import csv

import make_trace
import numpy as np
import pytest

import ehsid

Status = ehsid.Status
Rows = list[dict[str, str]]
STATE = make_trace.COLUMNS[4:]


@pytest.fixture(scope="module")
def trace() -> dict[str, Rows]:
    rows: dict[str, Rows] = {policy: [] for policy in make_trace.POLICIES}
    with make_trace.TRACE.open(newline="", encoding="ascii") as file:
        for row in csv.DictReader(file):
            rows[row["policy"]].append(row)
    return rows


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
        assert status == int(rows[k]["status"]), f"sample {k}"
        assert make_trace.state(estimator) == [rows[k][name] for name in STATE], f"sample {k}"


@pytest.mark.parametrize("policy", make_trace.POLICIES)
def test_a_run_makes_the_bits_of_the_trace(policy: str, trace: dict[str, Rows]) -> None:
    rows = trace[policy]
    u, y = column(rows, "command", "position").T
    path = make_trace.estimator(policy).run(u, y)
    status = np.array([int(row["status"]) for row in rows])
    assert np.array_equal(path.status, status)
    assert path.theta.tobytes() == column(rows, *STATE[2:8]).tobytes()
    assert path.standard_deviation.tobytes() == column(rows, *STATE[8:]).tobytes()
    assert path.forgetting_factor.tobytes() == column(rows, "forgetting_factor").tobytes()
    estimated = np.isin(status, [Status.ok, Status.no_information, Status.reset])
    innovation = column(rows, "innovation")[:, 0]
    assert path.innovation[estimated].tobytes() == innovation[estimated].tobytes()
    assert np.isnan(path.innovation[~estimated]).all()


def test_the_trace_meets_what_a_controller_meets(trace: dict[str, Rows]) -> None:
    met: set[Status] = set()
    for policy, rows in trace.items():
        assert len(rows) == make_trace.SAMPLES
        status = [Status(int(row["status"])) for row in rows]
        assert status[:3] == [Status.filling] * 3
        assert status[70] == Status.invalid_input
        assert status[100] == Status.out_of_range
        assert Status.reset in status[200:220], policy
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
