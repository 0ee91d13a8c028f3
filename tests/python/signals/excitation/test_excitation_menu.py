# SPDX-License-Identifier: MIT
"""The menu of excitations at all sampling times of a log."""

from __future__ import annotations

import numpy as np
import pytest

from ehsid.harness.signals.excitation.menu import MENU, Entry

SECONDS = 16.0


@pytest.mark.parametrize("dt_s", [2e-4, 1e-3, 0.02, 0.05, 0.1, 0.25])
@pytest.mark.parametrize("entry", MENU, ids=[entry.description for entry in MENU])
def test_every_entry_can_be_sent_at_every_sampling_time(entry: Entry, dt_s: float) -> None:
    """Logs with a sample every 0.1 s exist: a period of 0.25 s has no four samples there."""
    n = round(SECONDS / dt_s)
    shape = entry.shape(n, dt_s)
    assert shape.shape == (n,)
    assert np.abs(shape).max() <= 1.0 + 1e-12
    assert np.ptp(shape) > 0.1
    assert np.count_nonzero(np.diff(shape)) >= 8
