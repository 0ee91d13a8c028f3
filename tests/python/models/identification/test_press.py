# SPDX-License-Identifier: MIT
"""A servo-hydraulic press: our model, that of numpy, and that of the author of the data.

The author's model of the press (M. Quiroz, D. Maurel 2022; `examples/data/README.md`) has a delay
of 25.9 ms and a gain of 1.004 at 1 Hz, and its dominant pole at -48.6 1/s.
"""

from __future__ import annotations

import numpy as np
import pytest
from sources import ROOT

from ehsid.harness.models.identification import ArxOrders, IoData, fit_arx, identify
from ehsid.harness.models.identification.arx import ArxModel
from ehsid.harness.models.identification.loop import to_control
from ehsid.harness.records import read_record

PRESS = ROOT / "examples" / "data" / "mts_press.csv.gz"
DELAY_S, GAIN, POLE_1_S = 0.0259, 1.004, -48.6
AT_1_HZ = 2.0 * np.pi


@pytest.fixture(scope="module")
def press() -> IoData:
    record = read_record(PRESS, columns=["target_mm", "position_mm"])
    assert record.dt_s == pytest.approx(1e-3)
    assert len(record) == 20_000
    return IoData.from_record(record, "target_mm", "position_mm")


def reading(model: ArxModel) -> tuple[float, float, float]:
    """Return delay in s and gain at 1 Hz, and the slowest pole in 1/s."""
    system = to_control(model, 1e-3)
    response = complex(system(np.exp(1j * AT_1_HZ * 1e-3)))
    poles = system.poles()
    slowest = float(np.max(np.log(np.abs(poles[np.abs(poles) > 1e-9])))) / 1e-3
    return -float(np.angle(response)) / AT_1_HZ, abs(response), slowest


def test_the_whole_record_gives_the_model_of_the_author(press: IoData) -> None:
    """The bounds are below what the choice of delay changes: from 3 to 7, the pole by 20 %."""
    delay_s, gain, pole = reading(fit_arx(press, ArxOrders(2, 2, 5, offset=True)))
    assert delay_s == pytest.approx(DELAY_S, abs=0.5e-3)  # half a sample
    assert gain == pytest.approx(GAIN, rel=0.015)
    assert pole == pytest.approx(POLE_1_S, rel=0.06)


def test_identification_by_default_says_the_same(press: IoData) -> None:
    """Order 2 from one half of the record."""
    result = identify(press)
    assert (result.chosen.orders.na, result.chosen.orders.nb) == (2, 2)
    assert result.chosen.simulation_fit_percent == pytest.approx(96.6, abs=0.1)
    delay_s, gain, pole = reading(result.chosen.model)
    assert delay_s == pytest.approx(DELAY_S, abs=2e-3)
    assert gain == pytest.approx(GAIN, rel=0.02)
    assert pole == pytest.approx(POLE_1_S, rel=0.15)
