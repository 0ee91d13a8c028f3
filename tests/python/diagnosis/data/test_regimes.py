# SPDX-License-Identifier: MIT

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sources import ROOT

from ehsid.harness.diagnosis.data.regimes import reversals, visited
from ehsid.harness.records import make_record
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.excitation import triangle
from ehsid.harness.signals.simulation import simulate

RIGS = ROOT / "examples" / "rigs"
DT_S = 1e-3


@given(
    turns=st.integers(1, 30),
    amplitude=st.floats(0.1, 100.0),
    offset=st.floats(-50.0, 50.0),
    noise=st.floats(0.0, 0.01),
)
def test_reversals_of_a_triangle_are_counted_through_noise(
    turns: int, amplitude: float, offset: float, noise: float
) -> None:
    # A quarter period from zero, then half a period for each reversal.
    n = 100 * (2 * turns + 1)
    signal = triangle(n, 1.0, amplitude=amplitude, period_s=400.0)
    rng = np.random.default_rng(turns)
    noisy = offset + signal + noise * amplitude * rng.uniform(-1.0, 1.0, n)
    # Reversals are by 5 % of the range; the noise is at most 1 % of it.
    assert reversals(noisy, 0.05) == turns


def test_a_constant_has_no_reversals() -> None:
    assert reversals(np.full(100, 3.0), 0.05) == 0
    assert reversals(np.linspace(0.0, 1.0, 100), 0.05) == 0


def test_held_commands_and_slow_ramps_rest() -> None:
    rig = read_rig(RIGS / "bench.toml")

    def resting(command: np.ndarray) -> float:
        return visited(simulate(rig, command, dt_s=DT_S).record, rig).resting

    # Held for 0.2 s: from a tenth of a second after each step on.
    assert resting(np.repeat([3.0, -3.0, 3.0, -3.0], 200)) == pytest.approx(0.5, abs=0.01)
    assert resting(triangle(4000, DT_S, amplitude=1.0, period_s=1.0)) > 0.9  # 0.4 of rated a second
    assert resting(triangle(4000, DT_S, amplitude=3.0, period_s=0.2)) == 0.0


def test_a_slow_triangle_is_slow_near_null_and_has_no_fast_power() -> None:
    rig = read_rig(RIGS / "bench.toml")
    command = triangle(8000, DT_S, amplitude=0.4, period_s=2.0)
    regimes = visited(simulate(rig, command, dt_s=DT_S).record, rig)
    assert regimes.largest_command == pytest.approx(0.04)
    assert regimes.near_null == 1.0
    assert regimes.command_reversals == 8
    assert regimes.motion_reversals >= 7
    assert regimes.travel is not None
    assert regimes.travel < 0.1
    assert regimes.at_ends == 0.0
    # The slope of the triangle is a square wave of 0.5 Hz. The power of its harmonics falls with
    # 1 / f^2: 99 % of it is below the 40th harmonic.
    assert regimes.fast_power_hz < 25.0
    assert regimes.load_signs in (1, 2)


def test_time_at_an_end_stop_is_counted() -> None:
    rig = read_rig(RIGS / "bench.toml")
    regimes = visited(simulate(rig, np.full(4000, 10.0), dt_s=DT_S).record, rig)
    assert regimes.largest_command == 1.0
    assert regimes.near_null == 0.0
    assert regimes.at_ends is not None
    assert regimes.at_ends > 0.5
    assert regimes.command_reversals == 0


def test_white_commands_have_fast_power_up_to_half_the_sampling_rate() -> None:
    rig = read_rig(RIGS / "bench.toml")
    command = np.random.default_rng(0).uniform(-1.0, 1.0, 4000)
    regimes = visited(simulate(rig, command, dt_s=DT_S).record, rig)
    assert regimes.fast_power_hz > 400.0


def test_an_axis_has_neither_stroke_nor_pressures() -> None:
    rig = read_rig(RIGS / "axis.toml")
    command = 3.0 * np.sin(np.arange(4000) * DT_S * 6.0)
    regimes = visited(simulate(rig, command, dt_s=DT_S).record, rig)
    assert regimes.travel is None
    assert regimes.load_signs is None
    assert regimes.lowest_pressure_pa is None
    # The drive has no limit: the largest command of the record replaces it.
    assert regimes.largest_command == 1.0


def test_pressures_show_the_sign_of_the_load() -> None:
    rig = read_rig(RIGS / "bench.toml")
    time = np.arange(2000) * DT_S
    bore, rod = rig.values["cylinder.bore_m"], rig.values["cylinder.rod_m"]
    balance = (bore**2 - rod**2) / bore**2
    for amplitude, signs in ((1e6, 2), (0.0, 1)):
        p_b = np.full(time.size, 5e6)
        p_a = balance * p_b + 1e5 + amplitude * np.sin(20.0 * time)
        record = make_record(
            {
                "time_s": time,
                "command_v": np.sin(time),
                "position_m": 0.1 + 0.01 * np.sin(time),
                "pressure_a_pa": p_a,
                "pressure_b_pa": p_b,
            }
        )
        regimes = visited(record, rig)
        assert regimes.load_signs == signs
        # A thousandth of the samples of both chambers exceeds each value.
        signs_both = np.sort(np.concatenate([p_a, p_b]))
        assert regimes.lowest_pressure_pa == pytest.approx(signs_both[4], rel=1e-3)
        assert regimes.highest_pressure_pa == pytest.approx(signs_both[-5], rel=1e-3)
