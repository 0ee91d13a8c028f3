# SPDX-License-Identifier: MIT
"""The generator of lives: the same machine, older."""

from __future__ import annotations

import numpy as np
import pytest

from ehsid.lab.reality import lives
from ehsid.lab.reality.lives import YEAR, make_life

DEAD_BAND = {"valve_dead_band": {"overlap": 0.05}}


def columns(*days: float, **options: object) -> list[dict[str, np.ndarray]]:
    plan = lambda day: DEAD_BAND if day >= 2.0 else {}  # noqa: E731 -- one line says it all
    _, logs = make_life(3, days, plan, seconds=1.0, **options)  # type: ignore[arg-type]
    return [dict(log.columns) for log in logs]


def test_the_same_arguments_make_the_same_life() -> None:
    for first, second in zip(columns(0.0, 3.0), columns(0.0, 3.0), strict=True):
        assert all(np.array_equal(first[name], second[name]) for name in first)


def test_a_log_depends_on_its_day_by_the_effects_only() -> None:
    healthy, worn = columns(0.0, 1.0)[1], columns(0.0, 3.0)[1]
    assert np.array_equal(columns(0.0, 1.5)[1]["position_m"], healthy["position_m"])
    # The loop reacts to the dead band, of 1 % and more of the travel.
    travel = np.ptp(healthy["position_m"])
    assert np.max(np.abs(worn["position_m"] - healthy["position_m"])) > 0.01 * travel


@pytest.mark.parametrize("unmoved", ["VISCOUS_PER_C", "BULK_PER_C"])
def test_summer_oil_is_warm_and_changes_friction_and_stiffness(
    unmoved: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lives, unmoved, 0.0)  # the other one alone moves the machine, too
    summer, winter = columns(0.0, YEAR / 2.0, season_c=20.0, logs_temperature=True)
    # 45 degrees in the mean of a year, within three deviations of its sensor.
    assert abs(float(np.mean(summer["temperature_c"])) - 65.0) < 1.5
    assert abs(float(np.mean(winter["temperature_c"])) - 25.0) < 1.5
    plain = columns(0.0, YEAR / 2.0, logs_temperature=True)[1]
    assert not np.array_equal(plain["pressure_a_pa"], winter["pressure_a_pa"])
    assert np.array_equal(plain["time_s"], winter["time_s"])
