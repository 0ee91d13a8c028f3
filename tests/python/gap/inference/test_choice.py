# SPDX-License-Identifier: MIT
"""Which set the data ask for: with rivals made by hand, whose errors are known."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any, cast

import numpy as np
import pytest
from gap_rig import RIG

from ehsid.harness.gap.data.floor import NoiseFloor
from ehsid.harness.gap.inference.advantage import advantage
from ehsid.harness.gap.inference.choice import asked_for, choose, decided, one_family
from ehsid.harness.gap.inference.rivals import Rival
from ehsid.harness.gap.inference.search import Found
from ehsid.harness.gap.inference.verdict import named, rule
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.schema import CalibratedValue, Estimate, HowFar

WINDOWS, SAMPLES, FLOOR = 40, 500, 1e-6


class _Record:
    dt_s = 1e-3


class _Case:
    """What the choice asks of a case."""

    outputs = ("position_m",)
    floors = MappingProxyType({"position_m": NoiseFloor(FLOOR, FLOOR, FLOOR)})
    records = (_Record(),)
    rig = RIG
    all_states = False
    pressures = True

    def variation(self) -> np.ndarray:
        return np.array([1e-2])


CASE = cast(Case, cast(Any, _Case()))
SIZES = {
    "effects.coulomb_friction.force_n": 400.0,
    "effects.stribeck_friction.coulomb_n": 400.0,
    "effects.stribeck_friction.static_n": 600.0,
    "effects.stribeck_friction.stribeck_velocity_m_s": 0.02,
    "effects.valve_dead_band.overlap": 0.03,
    "effects.transport_delay.delay_s": 5e-3,
    "effects.sensor_lag.time_constant_s": 5e-3,
}


def rival(*effects: str, rms: float, width: int | None = None, **sizes: float) -> Rival:
    """Held-out errors of this deviation in every window, scattered by a tenth."""
    seed = sum(map(ord, "".join(effects)))
    squares = SAMPLES * rms**2 * np.random.default_rng(seed).uniform(0.9, 1.1, (WINDOWS, 1))
    counts = np.full(WINDOWS, float(SAMPLES))
    mse = squares.sum() / counts.sum()
    cost = 200.0 * np.log(mse + FLOOR**2)
    values = SIZES | {f"effects.{name}": size for name, size in sizes.items()}
    x = np.zeros(20 + (width or len(effects)))
    return Rival(effects, x, values, cost, cost, True, squares, counts)


def found(calibrated: Rival, *rivals: Rival, nominal: float = 1e-3) -> Found:
    ordered = tuple(sorted(rivals, key=lambda one: one.held_out_cost))
    return Found(rival(rms=nominal), calibrated, ordered, ())


def test_the_one_that_explains_is_named() -> None:
    choice = choose(
        CASE,
        found(
            rival(rms=1e-4),
            rival("coulomb_friction", rms=2e-6),
            rival("valve_dead_band", rms=4e-5),
        ),
    )
    assert choice.best.effects == ("coulomb_friction",)
    assert choice.equals == ()


def test_rivals_as_good_are_all_returned() -> None:
    choice = choose(
        CASE,
        found(
            rival(rms=1e-4),
            rival("transport_delay", rms=2.00e-6),
            rival("sensor_lag", rms=2.02e-6),
            rival("valve_dead_band", rms=9e-5),
        ),
    )
    assert choice.best.effects == ("transport_delay",)
    assert [one.effects for one in choice.equals] == [("sensor_lag",)]


def test_nothing_is_named_where_nothing_gains() -> None:
    choice = choose(CASE, found(rival(rms=2e-6), rival("coulomb_friction", rms=1.98e-6)))
    assert choice.best.effects == ()


def test_a_second_effect_must_earn_its_name() -> None:
    one, two = rival("coulomb_friction", rms=2e-5), ("coulomb_friction", "sensor_lag")
    little = choose(CASE, found(rival(rms=1e-4), one, rival(*two, rms=1.95e-5)))
    assert little.best.effects == ("coulomb_friction",)
    much = choose(CASE, found(rival(rms=1e-4), one, rival(*two, rms=1.5e-6)))
    assert much.best.effects == two


def test_what_is_next_to_the_floor_gets_no_name() -> None:
    """A third of the errors, but a fortieth of what the rig alone leaves."""
    one, two = rival("coulomb_friction", rms=5e-6), ("coulomb_friction", "sensor_lag")
    choice = choose(CASE, found(rival(rms=1e-4), one, rival(*two, rms=2.5e-6)))
    assert choice.best.effects == ("coulomb_friction",)


def test_a_pair_is_found_where_neither_alone_gains() -> None:
    pair = ("valve_dead_band", "coulomb_friction")
    choice = choose(
        CASE,
        found(rival(rms=1e-4), rival("coulomb_friction", rms=9.9e-5), rival(*pair, rms=2e-6)),
    )
    assert choice.best.effects == pair


def test_coulomb_is_enough_where_stribeck_adds_little() -> None:
    choice = choose(
        CASE,
        found(
            rival(rms=1e-4),
            rival("stribeck_friction", rms=2e-6, width=3),
            rival("coulomb_friction", rms=2.04e-6),
        ),
    )
    assert choice.best.effects == ("coulomb_friction",)
    assert choice.equals == ()


def test_sizes_that_every_servo_has_are_not_named() -> None:
    small = rival("transport_delay", rms=1e-5, **{"transport_delay.delay_s": 3e-4})
    assert choose(CASE, found(rival(rms=1e-4), small)).best.effects == ()


def test_gains_are_decided_one_way_only() -> None:
    better, worse = rival(rms=2e-6), rival("sensor_lag", rms=3e-6)
    assert decided(advantage(CASE, better, worse))
    assert not decided(advantage(CASE, worse, better))
    assert not asked_for(CASE, worse, better, better)


def test_both_laws_of_friction_are_one_family() -> None:
    assert one_family(["coulomb_friction"]) == one_family(["stribeck_friction"])
    assert one_family(["coulomb_friction"]) != one_family(["sensor_lag"])


def _far(nominal: float, calibrated: float, augmented: float) -> HowFar:
    whole = Estimate(0.9, 0.8, 0.95)
    return HowFar(nominal, calibrated, augmented, (0.001, 0.0012), whole, whole, {})


def _moved(moved: bool) -> dict[str, CalibratedValue]:
    return {"load.mass_kg": CalibratedValue(120.0, Estimate(150.0, 148.0, 152.0), moved)}


@pytest.mark.parametrize(
    ("rivals", "far", "moved", "verdict"),
    [
        ([rival("sensor_lag", rms=2e-6)], (0.5, 0.1, 0.002), False, "effects"),
        (
            [rival("sensor_lag", rms=2e-6), rival("transport_delay", rms=2.02e-6)],
            (0.5, 0.1, 0.002),
            False,
            "ambiguous",
        ),
        (
            [
                rival("stribeck_friction", rms=2e-6),
                rival("coulomb_friction", rms=2.04e-6),
            ],
            (0.5, 0.1, 0.002),
            False,
            "effects",
        ),
        ([rival("sensor_lag", rms=9e-5)], (0.5, 0.4, 0.4), False, "outside_catalogue"),
        ([rival("sensor_lag", rms=5e-5)], (0.5, 0.4, 0.3), False, "outside_catalogue"),
        ([], (0.5, 0.002, 0.002), True, "parameters"),
        ([], (0.002, 0.002, 0.002), False, "no_gap"),
    ],
)
def test_verdicts(
    rivals: list[Rival], far: tuple[float, float, float], moved: bool, verdict: str
) -> None:
    everything = found(rival(rms=1e-4), *rivals)
    choice = choose(CASE, everything)
    # With the values as told errors are three times those with them fitted.
    untouched = rival(rms=3e-4) if moved else everything.calibrated
    ruling = rule(CASE, everything, choice, _far(*far), _moved(moved), (), untouched)
    assert ruling.verdict == verdict
    assert ruling.sentence.endswith(".")
    assert ruling.reasons


def test_values_that_do_as_well_as_told_are_no_parameter_gap() -> None:
    """A value has moved, but what gains is what no data sheet tells."""
    everything = found(rival(rms=1e-5))
    for untouched, verdict in ((1.2e-5, "no_gap"), (3e-4, "parameters")):
        ruling = rule(
            CASE,
            everything,
            choose(CASE, everything),
            _far(0.1, 0.001, 0.001),
            _moved(True),
            (),
            rival(rms=untouched),
        )
        assert ruling.verdict == verdict


def test_a_gain_that_nobody_sees_gets_no_name() -> None:
    """From 4e-4 of the variation to the floor of 1e-4."""
    tiny = found(rival(rms=4e-6), rival("coulomb_friction", rms=1e-6))
    assert choose(CASE, tiny).best.effects == ()


class _SmallMotion(_Case):
    """So that gains near the floor are still seen."""

    def variation(self) -> np.ndarray:
        return np.array([1e-4])


def test_a_set_that_leaves_most_of_the_gap_is_no_explanation() -> None:
    """Of 2 above the floor of 1 one leaves 1.7: no doubt, but 15 %; the other leaves 1."""
    case = cast(Case, cast(Any, _SmallMotion()))
    calibrated = rival(rms=3e-6)
    little, more = (rival("coulomb_friction", rms=rms) for rms in (2.7e-6, 2e-6))
    assert asked_for(case, little, calibrated, calibrated)
    assert choose(case, found(calibrated, little)).best.effects == ()
    assert choose(case, found(calibrated, more)).best.effects == ("coulomb_friction",)


def test_sets_in_words() -> None:
    assert named(["coulomb_friction"]) == "Coulomb friction"
    assert named(["a_b", "sensor_lag", "valve_lag"]) == "a b, sensor lag and valve lag"
