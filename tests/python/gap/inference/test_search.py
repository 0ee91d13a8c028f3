# SPDX-License-Identifier: MIT
import gap_cases as made
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ehsid
from ehsid.harness.gap.inference.advantage import above_floor, advantage
from ehsid.harness.gap.inference.rivals import Rival, base, calibrate, polish, screen
from ehsid.harness.gap.inference.search import candidates, restrict, search
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.model.fit import GAIN
from ehsid.harness.gap.thresholds import AT_FLOOR, DECIDED_NATS, DECIDED_RELATIVE
from ehsid.harness.parallel import workers
from ehsid.harness.rigs import read_rig

FEW = ("coulomb_friction", "valve_dead_band", "internal_leakage", "transport_delay")
PAIR = {"effects.coulomb_friction.force_n": 400.0, "effects.valve_dead_band.overlap": 0.03}
IDS = tuple(info.id for info in ehsid.effects())


@pytest.fixture(scope="module")
def calm() -> Case:
    return made.case_of({})


def test_candidates_are_what_the_plant_can_have() -> None:
    # Quantisation shows in the record itself.
    assert candidates(made.RIG) == tuple(one for one in IDS if one != "sensor_quantisation")
    axis = candidates(read_rig(made.RIGS / "axis.toml"))
    assert {"load_force", "transport_delay", "sensor_lag"} <= set(axis)
    assert not any(one.startswith(("valve_", "supply_")) or "leakage" in one for one in axis)


@given(excluded=st.sets(st.sampled_from(IDS)))
def test_candidates_are_neither_told_nor_excluded(excluded: set[str]) -> None:
    told = read_rig(made.RIGS / "bench.toml")
    assert told.effects() == ("valve_lag",)
    found = candidates(told, tuple(excluded))
    assert set(found) == set(IDS) - excluded - {"valve_lag", "sensor_quantisation"}
    assert len(set(found)) == len(found)


@pytest.mark.parametrize(
    ("name", "value", "names"),
    [
        ("coulomb_friction.force_n", 400.0, made.PRESSURES),
        ("transport_delay.delay_s", 0.0053, ("position_m",)),
        *(
            pytest.param(*one, marks=pytest.mark.slow)
            for one in (
                ("valve_dead_band.overlap", 0.03, made.PRESSURES),
                ("valve_dead_band.overlap", 0.03, ("position_m",)),
                ("internal_leakage.coefficient_m3_s_pa", 2e-11, made.PRESSURES),
            )
        ),
    ],
)
def test_the_effect_that_was_put_in_is_best_on_held_out_data(
    name: str, value: float, names: tuple[str, ...]
) -> None:
    case = made.case_of({**made.OFF, f"effects.{name}": value}, names)
    with workers(1):
        found = search(case, made.all_but(*FEW))
    best = found.rivals[0]
    assert best.effects == (name.split(".")[0],)
    assert best.values[f"effects.{name}"] == pytest.approx(value, rel=0.05)
    # Better than the calibrated rig beyond doubt, and nothing is left.
    gain = advantage(case, best, found.calibrated)
    assert gain.nats > DECIDED_NATS
    assert gain.low > 0.0
    assert gain.relative > DECIDED_RELATIVE
    assert above_floor(case, best) < AT_FLOOR
    # Nothing is left: no set of two was looked for.
    assert {len(one.effects) for one in found.rivals} == {1}
    assert [one.held_out_cost for one in found.rivals] == sorted(
        one.held_out_cost for one in found.rivals
    )
    assert sorted(one.effects for one in found.screened) == sorted((one,) for one in FEW)


@pytest.mark.slow
def test_it_is_best_of_the_whole_catalogue() -> None:
    case = made.case_of({**made.OFF, "effects.valve_dead_band.overlap": 0.03})
    found = search(case)
    assert found.rivals[0].effects == ("valve_dead_band",)
    assert len(found.screened) == len(candidates(made.RIG))
    rest = [one for one in found.screened if "valve_dead_band" not in one.effects]
    assert rest
    for one in rest:
        assert advantage(case, found.rivals[0], one).low > 0.0, one.effects


def test_two_effects_are_found_together_and_progress_goes_up_to_one() -> None:
    case = made.case_of({**made.OFF, **PAIR})
    shares: list[float] = []
    with workers(1):
        found = search(case, made.all_but(*FEW[:3]), shares.append)
    best = found.rivals[0]
    assert set(best.effects) == {"coulomb_friction", "valve_dead_band"}
    for name, value in PAIR.items():
        assert best.values[name] == pytest.approx(value, rel=0.05)
    assert above_floor(case, best) < AT_FLOOR
    # Each of the two is worth its place.
    alone = {one.effects: one for one in found.rivals if len(one.effects) == 1}
    for effect in best.effects:
        gain = advantage(case, best, alone[(effect,)])
        assert gain.low > 0.0
        assert gain.relative > DECIDED_RELATIVE
    assert np.all(np.diff(shares) >= 0.0)
    assert 0.0 < shares[0] < 0.5
    assert shares[-1] == 1.0
    # Step by step: calibration, three looks, three long fits and those of the pairs are told.
    assert len(set(shares)) > 8


@pytest.mark.parametrize("names", [made.PRESSURES, ("position_m",)])
def test_nothing_is_found_where_there_is_nothing(names: tuple[str, ...]) -> None:
    case = made.case_of(made.OFF, names)
    with workers(1):
        found = search(case, made.all_but(*FEW))
    assert above_floor(case, found.calibrated) < AT_FLOOR
    for one in found.rivals:
        # Only alone, and without an advantage: a free parameter gains half a nat by chance, five
        # of its deviations more are four.
        assert len(one.effects) == 1
        assert advantage(case, one, found.calibrated).nats < 4.0, one.effects
        assert advantage(case, one, found.calibrated).relative < DECIDED_RELATIVE


def test_with_nothing_to_try_the_calibration_is_all() -> None:
    case = made.case_of(made.OFF)
    shares: list[float] = []
    with workers(1):
        found = search(case, IDS, shares.append)
    assert found.rivals == found.screened == ()
    assert found.nominal.held_out_cost > found.calibrated.held_out_cost
    assert shares[-1] == 1.0


@pytest.mark.slow
def test_the_result_does_not_depend_on_the_workers() -> None:
    case = made.case_of({**made.OFF, "effects.transport_delay.delay_s": 0.0053})
    found = []
    for count in (1, 2):
        with workers(count):
            found.append(search(case, made.all_but(*FEW[2:])))
    one, two = found
    for first, second in zip(
        (one.nominal, one.calibrated, *one.rivals, *one.screened),
        (two.nominal, two.calibrated, *two.rivals, *two.screened),
        strict=True,
    ):
        assert first.effects == second.effects
        np.testing.assert_array_equal(first.x, second.x)
        assert (first.cost, first.held_out_cost) == (second.cost, second.held_out_cost)
        np.testing.assert_array_equal(first.squares, second.squares)


def never_fitted(case: Case, effects: tuple[str, ...]) -> Rival:
    """Each value of x another one."""
    x, nothing = np.arange(float(len(case.parameters(effects)))), np.zeros(0)
    return Rival(effects, x, {}, 0.0, 0.0, True, nothing[:, np.newaxis], nothing)


@given(data=st.data())
def test_taking_effects_away_leaves_the_others_as_they_are(calm: Case, data: st.DataObject) -> None:
    fitted = [one for one in IDS if one != "sensor_quantisation"]
    effects = tuple(
        data.draw(st.lists(st.sampled_from(fitted), min_size=1, max_size=4, unique=True))
    )
    kept = tuple(one for one in effects if data.draw(st.booleans()))
    rival = never_fitted(calm, effects)
    found = restrict(calm, rival, kept)
    # By name: what is left has the x that it had.
    before = dict(zip([p.name for p in calm.parameters(effects)], rival.x, strict=True))
    left = [p.name for p in calm.parameters(kept)]
    np.testing.assert_array_equal(found, [before[name] for name in left])


def test_a_set_is_reached_from_what_is_left_of_a_larger_one() -> None:
    """The backward step from three effects comes to where the forward one came with two."""
    case = made.case_of(PAIR)
    one = screen(case, ("coulomb_friction",), [base(case, (), calibrate(case).x)])
    two = screen(case, (*one.effects, "valve_dead_band"), [base(case, one.effects, one.x)])
    three = screen(case, (*two.effects, "transport_delay"), [base(case, two.effects, two.x)])
    forward = polish(case, two.effects, two.x)
    backward = polish(case, two.effects, restrict(case, three, two.effects))
    # Fits end where a step gains less than GAIN.
    assert backward.cost == pytest.approx(forward.cost, abs=20.0 * GAIN)
    for name, value in PAIR.items():
        assert backward.values[name] == pytest.approx(value, rel=0.05)


def test_what_is_excluded_is_not_found_behind_the_law_that_holds_it() -> None:
    case = made.case_of({**made.OFF, "effects.coulomb_friction.force_n": 400.0})
    with workers(1):
        found = search(case, made.all_but("stribeck_friction", "valve_dead_band"))
    assert any("stribeck_friction" in one.effects for one in found.rivals)
    assert all("coulomb_friction" not in one.effects for one in found.rivals)
