# SPDX-License-Identifier: MIT
"""Two causes that a record cannot separate are returned as a set, with the experiment for it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
import pytest
from gap_cases import BENCH, DT_S, measured

from ehsid.harness.diagnosis import diagnose
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig

RIG = Rig("bench", "ehs", BENCH.values, sensors={"position_noise_m": 6e-6})
# The phase of a lag at low frequency is that of a delay of damping / (pi bandwidth).
DELAY_S = 0.008
DELAY = {"effects.transport_delay.delay_s": DELAY_S}
LAG = {
    "effects.valve_lag.bandwidth_hz": 0.8 / np.pi / DELAY_S,
    "effects.valve_lag.damping": 0.8,
}
# Far below the corner of the valve, 32 Hz, and not periodic within the record.
SMOOTH_HZ = np.array([0.31, 0.73, 1.17, 1.61])


def smooth(rng: np.random.Generator, seconds: float = 12.0) -> npt.NDArray[np.float64]:
    """A command with low frequencies only, a tenth of its range."""
    t = np.arange(round(seconds / DT_S)) * DT_S
    phase = rng.uniform(0.0, 2.0 * np.pi, SMOOTH_HZ.size)
    return np.asarray(0.3 * np.sin(2.0 * np.pi * SMOOTH_HZ * t[:, np.newaxis] + phase).sum(axis=1))


def run(values: Mapping[str, float], command: npt.NDArray[np.float64], seed: int) -> Record:
    """A record of command and position only, with the noise of the sensor."""
    return measured(RIG, command, np.random.default_rng(seed), values, ("position_m",))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("values", "truth"), [(DELAY, "transport_delay"), (LAG, "valve_lag")], ids=["delay", "lag"]
)
def test_delay_and_lag_are_a_set_until_the_next_experiment(
    values: Mapping[str, float], truth: str
) -> None:
    fitted = [run(values, smooth(np.random.default_rng(1)), 1)]
    held_out = [run(values, smooth(np.random.default_rng(2)), 2)]
    diagnosis = diagnose(fitted, RIG, validate=held_out)
    assert diagnosis.verdict == "ambiguous", diagnosis.sentence
    named = {effect for effects in diagnosis.ambiguity_set for effect in effects}
    assert {"transport_delay", "valve_lag"} <= named
    assert diagnosis.next_record is not None
    # The operator runs the experiment; the new record is diagnosed together with the others.
    command = diagnosis.next_record.column("command_v")
    second = diagnose([*fitted, run(values, command, 3)], RIG)
    assert second.verdict == "effects", second.sentence
    assert [effect.id for effect in second.effects] == [truth]
