# SPDX-License-Identifier: MIT
"""The play operator that the effects of the simulator use, sample by sample."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from plant_reference import typical
from plant_runs import simulate

from ehsid._core import play

SIGNALS = st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=50)


@given(SIGNALS, st.floats(0.0, 10.0), st.floats(-5.0, 5.0))
def test_the_output_moves_only_where_it_is_pushed(
    signal: list[float], half_width: float, start: float
) -> None:
    held = start
    for u, w in zip(signal, play(signal, half_width, start=start), strict=True):
        pushed = u - half_width if u - half_width > held else u + half_width
        assert w == (held if abs(u - held) <= half_width else pushed) or w == pytest.approx(held)
        assert abs(u - w) <= half_width * (1.0 + 1e-12) + 1e-12
        held = w


def test_it_is_that_of_the_simulated_spool() -> None:
    levels = 3.0 * np.sin(np.arange(20.0))
    command = np.repeat(levels, 200)  # long enough for the lag of the spool
    values = typical() | {"effects.valve_hysteresis.half_width": 0.05}
    spool = simulate(values, command, 4)["spool"][199::200]
    np.testing.assert_allclose(
        play(levels / values["valve.rated_command_v"], 0.05), spool, atol=1e-9
    )


@pytest.mark.parametrize("half_width", [-1e-9, np.nan, np.inf])
def test_a_wrong_half_width_is_refused(half_width: float) -> None:
    with pytest.raises(ValueError, match="half_width must be finite and >= 0"):
        play([0.0], half_width)


def test_a_wrong_signal_is_refused() -> None:
    with pytest.raises(ValueError, match="signal"):
        play([[0.0]], 1.0)
