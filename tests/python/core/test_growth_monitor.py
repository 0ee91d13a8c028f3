# SPDX-License-Identifier: MIT
"""GrowthMonitor has the bits of a reference in numpy, whatever it measures; a run is its steps."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from growth_reference import Reference, tables

import ehsid

BLOCK, BLOCKS = 150, 12
FloatArray = npt.NDArray[np.float64]


def samples(rng: np.random.Generator, *, hostile: bool) -> tuple[FloatArray, FloatArray]:
    """Returns commands and positions of about 12 blocks, in which something grows."""
    count = BLOCK * BLOCKS
    command = np.repeat(2.0 * rng.normal(size=count // 10), 10)
    moved = 1e-3 * command + 3e-6 * np.sign(command)
    position = np.cumsum(moved) - moved + 1e-5 * rng.normal(size=count)
    if hostile:
        bad = rng.random(count) < 0.01
        values = [np.nan, np.inf, -np.inf, 1e12, -2e12, 1e-42, 3e38, 0.0]
        position[bad] = rng.choice(values, bad.sum())
        bad = rng.random(count) < 0.01
        command[bad] = rng.choice(values, bad.sum())
    return command, position


@pytest.mark.parametrize("hostile", [False, True])
@pytest.mark.parametrize(("signatures", "tests"), [(1, 1), (3, 2), (7, 3)])
def test_the_bits_are_those_of_the_reference(signatures: int, tests: int, hostile: bool) -> None:
    rng = np.random.default_rng([48, signatures, hostile])
    made = tables(rng, signatures, tests, BLOCK)
    monitor, reference = ehsid.GrowthMonitor(**made), Reference(**made)
    command, position = samples(rng, hostile=hostile)
    run = ehsid.GrowthMonitor(**made).run(command, position)
    grown = False
    with np.errstate(over="ignore", invalid="ignore"):
        for k, (u, y) in enumerate(zip(command, position, strict=True)):
            status = monitor.step(u, y)
            reference.step(u, y)
            assert run.status[k] == status
            assert run.innovation[k].tobytes() == reference.innovation.tobytes(), k
            if reference.counted == BLOCK - 1 and status == ehsid.Status.ok:
                assert run.statistic[k].tobytes() == reference.statistic.tobytes(), k
                assert run.alarmed[k].tolist() == reference.alarmed.tolist(), k
                grown |= bool((reference.statistic > 0.0).any())
    assert grown, "the reference had nothing to compare"
    assert monitor.first == reference.first
    assert monitor.named == reference.named
    told = [monitor.told(n) for n in range(tests)]
    assert [one.statistic for one in told] == [float(s) for s in run.statistic[-1]]
    monitor.restart()
    assert monitor.first == monitor.named == -1
    assert not any(monitor.told(n).statistic for n in range(tests))


@pytest.mark.parametrize(
    "wrong",
    [
        {"delay": 9},
        {"block": 10},
        {"weight": np.full(40, -1.0)},
        {"mean": np.full(40, np.nan)},
        {"command_edges": np.zeros(7)},
        {"tests": [(3, 1.0, 0.25)]},
        {"tests": [(0, 1.0, 1.0)]},
        {"effect": [0, 0, 5]},
        {"limit": 0.0},
        {"signature": np.zeros((39, 3))},
        {"effect": [0, 0]},
    ],
)
def test_tables_without_a_meaning_are_refused(wrong: dict[str, object]) -> None:
    made = tables(np.random.default_rng(1), 3, 1, BLOCK)
    with pytest.raises(ValueError, match=r"expected|must"):
        ehsid.GrowthMonitor(**{**made, **wrong})


def test_a_test_that_there_is_not_is_refused() -> None:
    monitor = ehsid.GrowthMonitor(**tables(np.random.default_rng(1), 3, 2, BLOCK))
    with pytest.raises(IndexError, match="expected 0 to 1"):
        monitor.told(2)
