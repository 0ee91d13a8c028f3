# SPDX-License-Identifier: MIT
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import gap_cases as made
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ehsid
from ehsid.harness.base.parallel import workers
from ehsid.harness.catalogue.families import spelled_out
from ehsid.harness.catalogue.parameters import effects as catalogue
from ehsid.harness.diagnosis.decision.effect_selection import select_effects
from ehsid.harness.diagnosis.decision.hypotheses import posterior
from ehsid.harness.diagnosis.model.case import Case
from ehsid.harness.diagnosis.model.fit import GAIN, TRIES
from ehsid.harness.diagnosis.model.parameters import effect_parameters
from ehsid.harness.diagnosis.model.scale import effect_starts
from ehsid.harness.diagnosis.model.separation import contains
from ehsid.harness.diagnosis.model.spectrum import BANDS
from ehsid.harness.diagnosis.search import search as searching
from ehsid.harness.diagnosis.search.candidates import (
    FittedCandidate,
    calibrate,
    decision_case,
    grown_from,
    linearised_start,
    refine,
    screen,
)
from ehsid.harness.diagnosis.search.gap_reduction import WindowSums
from ehsid.harness.diagnosis.search.intervals import likelihood_gain
from ehsid.harness.diagnosis.search.score import above_noise, score_of
from ehsid.harness.diagnosis.search.search import (
    BEHIND_NATS,
    NOTHING_LEFT,
    SCREENING,
    _grown_again,
    _is_ahead_of_all_inside,
    _screen_extensions,
    _spelled_out_tasks,
    candidate_effects,
    never_behind,
    restrict,
    search,
    without_small_effects,
)
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.simulation import simulate

FEW = ("coulomb_friction", "valve_dead_band", "internal_leakage", "transport_delay")
PAIR = {"effects.coulomb_friction.force_n": 400.0, "effects.valve_dead_band.overlap": 0.03}
IDS = tuple(info.id for info in ehsid.effects())


@pytest.fixture(scope="module")
def calm() -> Case:
    return made.case_of({})


def test_candidate_effects_are_those_that_the_plant_can_have() -> None:
    # The record itself shows quantisation.
    assert candidate_effects(made.RIG) == tuple(
        effect for effect in IDS if effect != "sensor_quantisation"
    )
    axis = candidate_effects(read_rig(made.RIGS / "axis.toml"))
    assert {"load_force", "transport_delay", "sensor_lag"} <= set(axis)
    assert not any(
        effect.startswith(("valve_", "supply_", "pressure_")) or "leakage" in effect
        for effect in axis
    )


@given(excluded=st.sets(st.sampled_from(IDS)))
def test_candidate_effects_are_neither_configured_nor_excluded(excluded: set[str]) -> None:
    rig = read_rig(made.RIGS / "bench.toml")
    assert rig.effects() == ("valve_lag",)
    effects = candidate_effects(rig, tuple(excluded))
    assert set(effects) == set(IDS) - excluded - {"valve_lag", "sensor_quantisation"}
    assert len(set(effects)) == len(effects)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "value", "names"),
    [
        ("coulomb_friction.force_n", 400.0, made.PRESSURES),
        ("transport_delay.delay_s", 0.0053, ("position_m",)),
        *(
            pytest.param(*parameters, marks=pytest.mark.thorough)
            for parameters in (
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
    # By the position alone it takes longer to tell effects apart.
    seconds = 4.0 if len(names) > 1 else 6.0
    case = made.case_of({**made.OFF, f"effects.{name}": value}, names, seconds)
    with workers(1):
        result = search(case, made.all_but(*FEW))
    best = result.refined[0]
    assert best.effects == (name.split(".")[0],)
    assert best.values[f"effects.{name}"] == pytest.approx(value, rel=0.05)
    # It is certainly better than the calibrated rig, and its errors are at the floor.
    assert score_of(case, best) > score_of(case, result.calibrated) + 10.0
    assert above_noise(case, best) < NOTHING_LEFT
    # Therefore no set of two effects was tried.
    assert {len(candidate.effects) for candidate in result.refined} == {1}
    assert [candidate.held_out_cost for candidate in result.refined] == sorted(
        candidate.held_out_cost for candidate in result.refined
    )
    assert sorted(candidate.effects for candidate in result.screened) == sorted(
        (effect,) for effect in FEW
    )


@pytest.mark.thorough
def test_a_dead_band_is_best_of_the_whole_catalogue() -> None:
    case = made.case_of({**made.OFF, "effects.valve_dead_band.overlap": 0.03})
    result = search(case)
    # A law that contains the dead band may fit the noise a little better; it is not named.
    assert "valve_dead_band" in spelled_out(result.refined[0].effects)
    probabilities = posterior(case, result.calibrated, result.refined)
    best = select_effects(result, probabilities).best
    assert best.effects == ("valve_dead_band",)
    assert len(result.screened) == len(candidate_effects(made.RIG))
    others = [
        candidate
        for candidate in result.screened
        if "valve_dead_band" not in spelled_out(candidate.effects)
    ]
    assert others
    for candidate in others:
        assert likelihood_gain(case, best, candidate).nats > 0.0, candidate.effects


@pytest.mark.slow
def test_two_effects_are_identified_together_and_each_stage_has_progress() -> None:
    case = made.case_of({**made.OFF, **PAIR})
    told: list[tuple[str, list[float]]] = []
    with workers(1):
        result = search(
            case,
            made.all_but(*FEW[:3]),
            lambda share: told[-1][1].append(share),
            lambda stage, *_, tasks=0: told.append((stage, [])),
        )
    best = result.refined[0]
    assert set(best.effects) == {"coulomb_friction", "valve_dead_band"}
    for name, value in PAIR.items():
        assert best.values[name] == pytest.approx(value, rel=0.05)
    assert above_noise(case, best) < NOTHING_LEFT
    # Each of the two effects has a gain of its own.
    singles = {
        candidate.effects: candidate for candidate in result.refined if len(candidate.effects) == 1
    }
    for effect in best.effects:
        assert score_of(case, best) > score_of(case, singles[(effect,)])
    assert [stage for stage, _ in told] == ["values", "alone", "at length", "together", "deciding"]
    for stage, shares in told:
        assert np.all(np.diff(shares) >= 0.0), stage
        assert all(0.0 < share <= 1.0 for share in shares), stage
    # Progress is reported after each screening and each long fit.
    assert [len(shares) > 0 for _, shares in told] == [False, True, True, True, False]
    assert told[1][1][-1] >= SCREENING


@pytest.mark.slow
@pytest.mark.parametrize(
    "names", [made.PRESSURES, pytest.param(("position_m",), marks=pytest.mark.thorough)]
)
def test_no_effect_gains_where_none_was_put_in(names: tuple[str, ...]) -> None:
    case = made.case_of(made.OFF, names)
    with workers(1):
        result = search(case, made.all_but(*FEW))
    assert above_noise(case, result.calibrated) < NOTHING_LEFT
    for candidate in result.refined:
        # Only single effects, without a real gain: a free parameter gains half a nat by chance, and
        # with five standard deviations more some four nats.
        assert len(candidate.effects) == 1
        assert likelihood_gain(case, candidate, result.calibrated).nats < 4.0, candidate.effects
        assert score_of(case, candidate) < score_of(case, result.calibrated)


@pytest.mark.slow
def test_with_nothing_to_try_the_calibration_is_all() -> None:
    case = made.case_of(made.OFF)
    with workers(1):
        result = search(case, IDS)
    assert result.refined == result.screened == ()
    assert result.nominal.held_out_cost > result.calibrated.held_out_cost


def never_fitted(case: Case, effects: tuple[str, ...]) -> FittedCandidate:
    """A candidate in which every value of x is different."""
    x, nothing = np.arange(float(len(case.parameters(effects)))), np.zeros(0)
    none = np.zeros((0, len(case.outputs), BANDS))
    sums = WindowSums({}, {}, nothing)
    return FittedCandidate(
        effects, x, {}, 0.0, 0.0, True, nothing[:, np.newaxis], nothing, none, none, sums
    )


@given(data=st.data())
def test_taking_effects_away_leaves_the_others_as_they_are(calm: Case, data: st.DataObject) -> None:
    fitted = [effect for effect in IDS if effect != "sensor_quantisation"]
    effects = tuple(
        data.draw(st.lists(st.sampled_from(fitted), min_size=1, max_size=4, unique=True))
    )
    remaining = tuple(effect for effect in effects if data.draw(st.booleans()))
    candidate = never_fitted(calm, effects)
    restricted = restrict(calm, candidate, remaining)
    # By name: each remaining parameter keeps its x.
    before = dict(zip([p.name for p in calm.parameters(effects)], candidate.x, strict=True))
    names = [p.name for p in calm.parameters(remaining)]
    np.testing.assert_array_equal(restricted, [before[name] for name in names])


@pytest.mark.slow
def test_a_set_is_reached_from_what_is_left_of_a_larger_one() -> None:
    """The backward step from three effects reaches the same fit as the forward step to two."""
    case = made.case_of(PAIR)
    single = screen(case, ("coulomb_friction",), [linearised_start(case, (), calibrate(case).x)])
    pair = screen(
        case,
        (*single.effects, "valve_dead_band"),
        [linearised_start(case, single.effects, single.x)],
    )
    triple = screen(
        case, (*pair.effects, "transport_delay"), [linearised_start(case, pair.effects, pair.x)]
    )
    forward = refine(case, pair.effects, pair.x)
    backward = refine(case, pair.effects, restrict(case, triple, pair.effects))
    # Fits end where a step gains less than GAIN.
    assert backward.cost == pytest.approx(forward.cost, abs=20.0 * GAIN)
    for name, value in PAIR.items():
        assert backward.values[name] == pytest.approx(value, rel=0.05)


@pytest.mark.slow
def test_an_excluded_effect_is_not_reached_through_the_law_that_contains_it() -> None:
    case = made.case_of({**made.OFF, "effects.coulomb_friction.force_n": 400.0})
    with workers(1):
        result = search(case, made.all_but("stribeck_friction", "valve_dead_band"))
    assert any("stribeck_friction" in candidate.effects for candidate in result.refined)
    assert all("coulomb_friction" not in candidate.effects for candidate in result.refined)


def test_a_set_starts_again_from_a_larger_one_whose_further_effect_does_not_matter(
    calm: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A fit that ended in another minimum is found out by a larger set that fits far better."""
    small, large = 1e-5, 0.03
    sizes = {
        ("internal_leakage",): {"effects.internal_leakage.coefficient_m3_s_pa": 2e-11},
        ("internal_leakage", "valve_null_bias"): {
            "effects.internal_leakage.coefficient_m3_s_pa": 2e-11,
            "effects.valve_null_bias.offset": small,
        },
        ("internal_leakage", "valve_dead_band"): {
            "effects.internal_leakage.coefficient_m3_s_pa": 2e-11,
            "effects.valve_dead_band.overlap": large,
        },
    }

    def made(effects: tuple[str, ...], cost: float) -> FittedCandidate:
        count = len(calm.parameters(effects))
        values = sizes.get(effects, {})
        return replace(_fitted(calm), effects=effects, x=np.full(count, cost), values=values,
                       cost=cost, held_out_cost=cost)  # fmt: skip

    started = []

    def refined(case: Case, effects: tuple[str, ...], x: np.ndarray) -> FittedCandidate:
        started.append((effects, x.size))
        return made(effects, 42.0)

    monkeypatch.setattr("ehsid.harness.diagnosis.search.search.refine", refined)
    alone, biased, banded = sizes
    fitted = [made((), 100.0), made(alone, 90.0), made(biased, 40.0), made(banded, 10.0)]
    with workers(1):
        found = without_small_effects(calm, fitted)
    # The dead band matters, so that its set says nothing about the leakage alone.
    assert started == [(alone, len(calm.parameters(alone)))]
    assert {one.effects: one.cost for one in found} == {
        (): 100.0,
        alone: 42.0,
        biased: 40.0,
        banded: 10.0,
    }
    # Where the smaller set is not behind, nothing is fitted again.
    started.clear()
    with workers(1):
        without_small_effects(calm, [made((), 100.0), made(alone, 40.5), made(biased, 40.0)])
    assert started == []


def _fitted(case: Case) -> FittedCandidate:
    nothing, powers = np.zeros((1, len(case.outputs))), np.zeros((1, len(case.outputs), BANDS))
    return FittedCandidate((), np.zeros(1), {}, 0.0, 0.0, True, nothing, np.ones(1), powers, powers,
                           WindowSums({}, {}, np.ones(1)))  # fmt: skip


# What a law that acts only nearly as a simpler one misses of it. Oil in a line has a mass, if a
# small one, and the volume of the line is that of oil of 1 GPa.
MISSED = {"line_resonance": 0.15}


@pytest.mark.parametrize(
    "law", [info for info in ehsid.effects() if info.contains], ids=lambda info: info.id
)
def test_a_servo_with_a_law_that_acts_as_a_simpler_one_moves_as_with_that_one(
    law: ehsid.EffectInfo,
) -> None:
    command = made.command_of(2.0, made.DT_S, np.random.default_rng(3))
    assert law.contains is not None
    simple = {p.name: p.typical for p in catalogue()[law.contains].parameters}
    runs = [
        simulate(
            made.RIG,
            command,
            dt_s=made.DT_S,
            values={f"effects.{effect}.{name}": size for name, size in sizes.items()},
        ).record
        for effect, sizes in ((law.contains, simple), (law.id, law.same(simple)), (law.id, {}))
    ]
    for name in made.PRESSURES:
        plain, same, without = (run.column(name) for run in runs)
        # The two laws add the same terms in another order. Rounding grows by the oil spring, which
        # is damped, so that a few thousand steps leave far less than 1e-9 of the signal.
        effect = np.max(np.abs(without - plain))
        missed = MISSED.get(law.id, 0.0) * effect
        np.testing.assert_allclose(same, plain, rtol=0.0, atol=1e-9 * np.ptp(plain) + missed)
        assert effect > 1e-4 * np.ptp(plain)


def _far_off(case: Case, effects: tuple[str, ...]) -> FittedCandidate:
    """A set whose fit ended far from its minimum: at the centres of the priors, effects large."""
    problem = decision_case(case).problem(effects)
    x = problem.centre()
    sizes = [
        size
        for effect in effects
        for _, size in effect_parameters(effect, effect_starts(effect, case.rig)[-1])
    ]
    x[x.size - len(sizes) :] = sizes
    values = {p.name: p.value(float(place)) for p, place in zip(problem.parameters, x, strict=True)}
    return replace(_fitted(case), effects=effects, x=x, values=values, cost=problem.cost(x),
                   held_out_cost=0.0)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "well_fitted",
    [
        ("coulomb_friction",),
        *(pytest.param(one, marks=pytest.mark.thorough) for one in ((), ("load_force",))),
    ],
    ids="+".join,
)
def test_no_set_is_behind_one_that_it_contains(well_fitted: tuple[str, ...]) -> None:
    case = made.case_of(
        {**made.OFF, "effects.coulomb_friction.force_n": 400.0, "effects.load_force.force_n": 900.0}
    )
    sets = (
        (),
        ("coulomb_friction",),
        ("stribeck_friction",),
        ("load_force",),
        ("load_spring",),
        ("coulomb_friction", "transport_delay"),
        ("load_spring", "coulomb_friction"),
        ("stribeck_friction", "load_spring"),
        ("stribeck_friction", "valve_hysteresis", "load_force"),
    )
    far = [_far_off(case, effects) for effects in sets]
    start = far[sets.index(well_fitted)]
    good = refine(case, well_fitted, start.x)
    fitted = [good if each.effects == well_fitted else each for each in far]
    # The others are indeed behind it where they contain it.
    behind = [each for each in far if each is not start and contains(each.effects, well_fitted)]
    assert behind
    assert all(each.cost > good.cost + BEHIND_NATS for each in behind)
    with workers(1):
        found = never_behind(case, fitted)
    assert [each.effects for each in found] == list(sets)
    for larger in found:
        for smaller in found:
            if contains(larger.effects, smaller.effects):
                assert larger.cost <= smaller.cost + BEHIND_NATS, (larger.effects, smaller.effects)
    # No set has become worse, and the cost of each is that of its values.
    for before, after in zip(fitted, found, strict=True):
        assert after.cost <= before.cost
        problem = decision_case(case).problem(after.effects)
        assert after.cost == pytest.approx(problem.cost(after.x), rel=1e-12)


def test_a_law_that_improves_on_the_way_is_passed_on_to_the_one_that_contains_it(
    calm: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Coulomb friction starts again from the calibration; Stribeck friction then from Coulomb."""
    coulomb, stribeck = ("coulomb_friction",), ("stribeck_friction",)
    costs = {(): 50.0, coulomb: 90.0, stribeck: 40.0}
    fitted = [replace(_fitted(calm), effects=effects, cost=cost) for effects, cost in costs.items()]
    started = []

    def from_contained(case: Case, contained: FittedCandidate, effects: Any) -> FittedCandidate:
        started.append((contained.effects, effects))
        return replace(contained, effects=effects, cost={coulomb: 10.0, stribeck: 9.0}[effects])

    monkeypatch.setattr("ehsid.harness.diagnosis.search.search._from_contained", from_contained)
    with workers(1):
        found = never_behind(calm, fitted)
    assert started == [((), coulomb), (coulomb, stribeck)]
    assert [each.cost for each in found] == [50.0, 10.0, 9.0]


STRIBECK = {
    "effects.stribeck_friction.coulomb_n": 250.0,
    "effects.stribeck_friction.static_n": 400.0,
    "effects.stribeck_friction.stribeck_velocity_m_s": 0.015,
}


@pytest.mark.slow
def test_a_law_in_a_wrong_minimum_starts_again_from_its_simpler_law() -> None:
    case = made.case_of({**made.OFF, **STRIBECK})
    with workers(1):
        simple = refine(case, ("coulomb_friction",), _far_off(case, ("coulomb_friction",)).x)
        far = _far_off(case, ("stribeck_friction",))
        other = replace(_fitted(case), effects=("valve_dead_band",))
        short = grown_from(case, simple, ("stribeck_friction",))
        found, same = _grown_again(case, [far, other], [far, other, simple])
        assert _grown_again(case, [far], [far]) == [far]  # without the simpler law
        assert _grown_again(case, [found], [found, simple]) == [found]
    assert same is other
    assert short.cost < simple.cost < far.cost
    assert found.cost <= short.cost
    for name, size in STRIBECK.items():
        assert found.values[name] == pytest.approx(size, rel=0.1), name


@pytest.mark.thorough
def test_screening_costs_what_its_candidates_cost(
    calm: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Simulations are counted: every candidate costs the same with and without the others."""
    runs: list[int] = []
    simulate = ehsid.simulate_plant

    def counted(*arguments: Any, **options: Any) -> Any:
        runs.append(1 + len(options["varied"]))
        return simulate(*arguments, **options)

    monkeypatch.setattr(ehsid, "simulate_plant", counted)
    parent = calibrate(calm)

    def cost(effects: tuple[str, ...]) -> int:
        runs.clear()
        with workers(1):
            _screen_extensions(calm, [parent], effects, lambda _: None)
        return sum(runs)

    none = cost(())
    alone = [cost((effect,)) - none for effect in FEW]
    assert cost(FEW) - none == sum(alone)
    assert min(alone) > 0
    # From two sizes a step each and two more from both: a run with the one sensitivity for each
    # size, tried steps, and now and then all sensitivities anew.
    per_step = 1 + len(calm.parameters()) + 1
    assert max(alone) <= 2 * 3 * (TRIES + per_step) + 1


@pytest.mark.slow
def test_the_two_effects_as_which_one_acts_are_fitted_as_well() -> None:
    forces = {"effects.coulomb_friction.force_n": 400.0, "effects.load_force.force_n": -150.0}
    case = made.case_of({**made.OFF, **forces})
    simple = refine(case, ("coulomb_friction",), np.append(calibrate(case).x, 400.0))
    short = grown_from(case, simple, ("coulomb_friction_sides",))
    sides = refine(case, short.effects, short.x)
    fitted = [simple, sides]
    (task,) = _spelled_out_tasks(case, IDS, fitted, fitted)
    two = task()
    assert set(two.effects) == {"coulomb_friction", "load_force"}
    for name, value in forces.items():
        assert two.values[name] == pytest.approx(value, rel=0.05)
    # It is not fitted again, nor with an effect that is not to be tried, nor without a start.
    assert _spelled_out_tasks(case, IDS, fitted, [*fitted, two]) == []
    assert _spelled_out_tasks(case, ["coulomb_friction"], fitted, fitted) == []
    assert _spelled_out_tasks(case, IDS, [sides], [sides]) == []


def test_a_law_is_extended_only_where_it_is_ahead_of_the_simpler_one(calm: Case) -> None:
    def fitted(*effects: str) -> FittedCandidate:
        return replace(_fitted(calm), effects=effects)

    simple, stribeck = fitted("coulomb_friction"), fitted("stribeck_friction")
    other = fitted("sensor_lag")
    scores = {
        frozenset[str](): -9.0,
        frozenset(simple.effects): -5.0,
        frozenset(other.effects): -6.0,
    }
    for law, is_ahead in ((-5.1, False), (-4.9, True)):
        inside = {**scores, frozenset(stribeck.effects): law}
        assert _is_ahead_of_all_inside(stribeck, inside) == is_ahead
        # What a set does not contain is no reason against it.
        assert _is_ahead_of_all_inside(simple, inside)
        assert _is_ahead_of_all_inside(other, inside)
    assert not _is_ahead_of_all_inside(other, {**scores, frozenset(other.effects): -9.5})


@pytest.mark.slow
def test_a_law_that_contains_another_starts_from_the_short_fit_of_that_one(
    calm: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    screened: list[tuple[str, ...]] = []

    def counted(case: Case, effects: tuple[str, ...], starts: Any) -> FittedCandidate:
        screened.append(effects)
        return screen(case, effects, starts)

    monkeypatch.setattr("ehsid.harness.diagnosis.search.search.screen", counted)
    parent = calibrate(calm)
    laws = ("coulomb_friction", "stribeck_friction")
    with workers(1):
        for effects in (laws, laws[1:]):
            screened.clear()
            found = _screen_extensions(calm, [parent], effects, lambda _: None)
            assert screened == [laws[:1]]
            assert sorted(each.effects for each in found) == [(law,) for law in effects]


def test_a_simpler_law_in_another_order_stands_for_no_set(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nothing is chosen, the simpler law that a set starts from is no set of its own."""

    @dataclass(frozen=True)
    class Fitted:
        effects: tuple[str, ...]
        x: None = None

    monkeypatch.setattr(searching, "left", lambda case, fitted: 0.0)
    monkeypatch.setattr(searching, "linearised_start", lambda case, effects, x: None)
    monkeypatch.setattr(searching, "preselected", lambda case, sets, kept, progress: [])
    monkeypatch.setattr(searching, "screen", lambda case, effects, starts: Fitted(effects))
    monkeypatch.setattr(searching, "grown_from", lambda case, simpler, effects: Fitted(effects))
    case = SimpleNamespace(effort="screened")
    parents = [Fitted(("coulomb_friction",)), Fitted(("sensor_backlash",))]
    ids = ("sensor_backlash", "coulomb_friction_sides")
    found = searching._screen_extensions(case, parents, ids, None)
    assert [each.effects for each in found] == [("sensor_backlash", "coulomb_friction_sides")]
