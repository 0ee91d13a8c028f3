# SPDX-License-Identifier: MIT
from collections.abc import Mapping

import pytest
from servo_records import AXIS, EFFECTS, OTHER, RIG, full, made

from ehsid.harness.catalogue.parameters import effects as catalogue
from ehsid.harness.gap.inference.effect_ranking import rank_effects
from ehsid.harness.gap.inference.families import friction_laws, repeats_a_law
from ehsid.harness.gap.model.equations import equations, residuals
from ehsid.harness.gap.model.inverse_signals import all_values, measured
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig


def ranked_effects(record: Record, rig: Rig = RIG) -> list[tuple[str, Mapping[str, float], float]]:
    servo_equations = equations([record], rig, {})
    signals, values = [measured(record, rig)], all_values(rig, {})
    ranked = rank_effects(
        servo_equations, lambda effect: residuals(signals, {**values, **effect}, rig.plant), rig
    )
    return [
        (ranked_effect.effect, ranked_effect.values, ranked_effect.gain) for ranked_effect in ranked
    ]


# One effect of each subsystem is tested every day.
EVERY_DAY = ("valve_dead_band", "internal_leakage", "coulomb_friction", "transport_delay")


@pytest.mark.parametrize(
    "effect",
    [
        pytest.param(effect, marks=() if effect in EVERY_DAY else pytest.mark.slow)
        for effect in sorted(EFFECTS.keys() - {"valve_lag", "sensor_backlash"})
    ],
)
def test_the_effect_that_was_put_in_is_ranked_first(effect: str) -> None:
    ranked = ranked_effects(made({**OTHER, **full(effect)}, seed=3))
    # Nested laws, such as friction with and without its rise, force with and without its spring.
    twins = {other for other in catalogue() if repeats_a_law((effect, other))} - {effect}
    twins |= {"valve_lag"} if effect == "transport_delay" else set()
    first = next(entry for entry in ranked if entry[0] not in twins)
    assert first[0] == effect, ranked[:4]
    assert first[2] > 0.1


@pytest.mark.parametrize(
    "effect", ["valve_dead_band", "internal_leakage", "coulomb_friction", "load_force"]
)
def test_sizes_of_ranked_effects_are_good_starts(effect: str) -> None:
    ranked = ranked_effects(made({**OTHER, **full(effect)}, seed=4))
    values = next(values for name, values, _ in ranked if name == effect)
    for name, value in full(effect).items():
        assert values[name] == pytest.approx(value, rel=0.25)


def test_no_effect_gains_where_none_was_put_in() -> None:
    for seed in range(3):
        assert all(gain < 0.05 for _, _, gain in ranked_effects(made(OTHER, seed=seed)))


def test_friction_of_an_axis_is_ranked_first_from_its_position() -> None:
    values = {"effects.coulomb_friction.force_n": 20.0}
    record = made(values, rig=AXIS, columns=("position_m",))
    assert ranked_effects(record, AXIS)[0][0] in friction_laws()
