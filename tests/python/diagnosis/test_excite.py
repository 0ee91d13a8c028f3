# SPDX-License-Identifier: MIT
"""The signal that shows an effect best."""

from __future__ import annotations

import math

import numpy as np
import pytest
from gap_cases import RIG, RIGS

from ehsid.harness.diagnosis import excite
from ehsid.harness.diagnosis.excite import signals_for
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.excitation.menu import MENU

SLOW, FAST = MENU[1], MENU[10]  # a slow triangle, and a multisine past the valve


def test_a_delay_asks_for_fast_signals_and_a_spring_for_travel(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(excite, "MENU", (SLOW, FAST))
    delay = signals_for(RIG, "transport_delay", dt_s=5e-3)
    assert [one.description[:9] for one in delay] == ["multisine", "slow tria"]
    spring = signals_for(RIG, "load_spring", dt_s=5e-3, pressures=True)
    assert spring[0].description.startswith("slow triangle")
    for first, second in (delay, spring):
        assert first.seen.size <= second.seen.size or math.isnan(second.seen.size)
        # Inside the limits of the machine.
        position, command = (first.record.column(name) for name in ("position_m", "command_v"))
        assert 0.0 < position.min() < position.max() < RIG.values["cylinder.stroke_m"]
        assert np.abs(command).max() <= RIG.values["valve.rated_command_v"]


def test_a_rig_without_limits_is_refused() -> None:
    with pytest.raises(ValueError, match="rated command and a stroke"):
        signals_for(read_rig(RIGS / "axis.toml"), "sensor_backlash")
    with pytest.raises(ValueError, match="no chambers"):
        signals_for(read_rig(RIGS / "linear.toml"), "sensor_backlash", pressures=True)


def test_an_effect_that_the_logged_signals_cannot_show_is_refused() -> None:
    for effect in ("pressure_sensor_gain", "position_sensor_delay"):
        with pytest.raises(ValueError, match="and add --pressures"):
            signals_for(RIG, effect)
