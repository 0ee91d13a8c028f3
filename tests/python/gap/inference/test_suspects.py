# SPDX-License-Identifier: MIT
from collections.abc import Mapping

import pytest
from servo_records import AXIS, EFFECTS, OTHER, RIG, full, made

from ehsid.harness.gap.inference.suspects import suspects
from ehsid.harness.gap.model.equations import equations, residuals
from ehsid.harness.gap.model.inverse_signals import all_values, measured
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig


def suspected(record: Record, rig: Rig = RIG) -> list[tuple[str, Mapping[str, float], float]]:
    found = equations([record], rig, {})
    signals, told = [measured(record, rig)], all_values(rig, {})
    ranked = suspects(found, lambda effect: residuals(signals, {**told, **effect}, rig.plant), rig)
    return [(one.effect, one.values, one.gain) for one in ranked]


# One of each subsystem every day.
EVERY_DAY = ("valve_dead_band", "internal_leakage", "coulomb_friction", "transport_delay")


@pytest.mark.parametrize(
    "effect",
    [
        pytest.param(effect, marks=() if effect in EVERY_DAY else pytest.mark.slow)
        for effect in sorted(EFFECTS.keys() - {"valve_lag", "sensor_backlash"})
    ],
)
def test_the_effect_that_was_put_in_is_suspected_first(effect: str) -> None:
    ranked = suspected(made({**OTHER, **full(effect)}, seed=3))
    # Friction with and without its rise, force with and without its spring: nested twins.
    twins = {
        "coulomb_friction": {"stribeck_friction"},
        "load_force": {"load_spring"},
        "transport_delay": {"valve_lag"},
    }
    first = next(one for one in ranked if one[0] not in twins.get(effect, set()))
    assert first[0] == effect, ranked[:4]
    assert first[2] > 0.1


@pytest.mark.parametrize(
    "effect", ["valve_dead_band", "internal_leakage", "coulomb_friction", "load_force"]
)
def test_sizes_of_suspects_are_good_starts(effect: str) -> None:
    ranked = suspected(made({**OTHER, **full(effect)}, seed=4))
    values = next(values for name, values, _ in ranked if name == effect)
    for name, value in full(effect).items():
        assert values[name] == pytest.approx(value, rel=0.25)


def test_nothing_is_suspected_where_there_is_nothing() -> None:
    for seed in range(3):
        assert all(gain < 0.05 for _, _, gain in suspected(made(OTHER, seed=seed)))


def test_friction_of_an_axis_is_suspected_from_its_position() -> None:
    values = {"effects.coulomb_friction.force_n": 20.0}
    record = made(values, rig=AXIS, columns=("position_m",))
    assert suspected(record, AXIS)[0][0] in ("coulomb_friction", "stribeck_friction")
