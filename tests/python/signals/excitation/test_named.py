# SPDX-License-Identifier: MIT
"""Test signals by name keep their peak and their length."""

from __future__ import annotations

import numpy as np
import pytest

from ehsid.harness.cli.options import SignalName
from ehsid.harness.signals.excitation import SIGNALS, named_signal


def test_the_command_line_has_the_same_names() -> None:
    assert [one.value for one in SignalName] == list(SIGNALS)


@pytest.mark.parametrize("name", SIGNALS)
def test_a_signal_has_its_length_and_peak_and_follows_its_seed(name: str) -> None:
    made = named_signal(name, 2000, 1e-3, peak=3.0, top_hz=20.0, seed=4)
    again = named_signal(name, 2000, 1e-3, peak=3.0, top_hz=20.0, seed=4)
    assert made.shape == (2000,)
    assert 1.5 < np.abs(made).max() <= 3.0 + 1e-9
    np.testing.assert_array_equal(made, again)


def test_an_unknown_name_is_refused_with_those_there_are() -> None:
    with pytest.raises(ValueError, match="multisine, prbs"):
        named_signal("noise", 100, 1e-3, peak=1.0, top_hz=10.0, seed=0)
