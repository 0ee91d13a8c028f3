# SPDX-License-Identifier: MIT
"""Effects of the catalogue that show only beside a law without a name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from gap_cases import RIG, over_the_stroke
from made_candidates import CASE
from made_candidates import candidate as made_candidate

from ehsid.harness.diagnosis.deciding import EFFECT, EVIDENCE, VALUES
from ehsid.harness.diagnosis.laws import choosing
from ehsid.harness.diagnosis.laws.beside import constant_of, effect_beside, is_part, without_law
from ehsid.harness.diagnosis.laws.choosing import (
    CAUSE,
    LAW,
    missing_laws,
    moves_as_lever,
    shows_linkage,
)
from ehsid.harness.diagnosis.laws.fitting import with_law
from ehsid.harness.diagnosis.laws.forms import laws
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.model.parameters import Law
from ehsid.harness.diagnosis.search.candidates import (
    FittedCandidate,
    calibrate,
    decision_case,
    linearised_start,
    refine,
    screen,
)
from ehsid.harness.diagnosis.search.score import left, price_of_values
from ehsid.harness.rigs.rig import TableLaw

PLACES = np.linspace(0.05, 0.25, 21)
AWAY = PLACES - 0.15
# The mass of a linkage: over 0.12 to 0.22 m, which the rod visits, it nearly trebles.
HEAVIER = RIG.values["load.mass_kg"] * (10.0 * AWAY + 48.0 * AWAY**2)
GROWING = TableLaw("mass", "position_m", tuple(PLACES.tolist()), tuple(HEAVIER.tolist()))
DELAY = "effects.transport_delay.delay_s"
FRICTION = "effects.coulomb_friction.force_n"
TRIED = ("transport_delay", "internal_leakage", "load_force", "coulomb_friction")


def linkage(values: Mapping[str, float], mass: TableLaw = GROWING) -> Case:
    tables = {"mass": mass}
    records = ([over_the_stroke(tables, seed, values, seconds=4.0)] for seed in (1, 2))
    return decision_case(make_case(RIG, *records))


def with_laws(case: Case, *names: str) -> FittedCandidate:
    candidate = calibrate(case)
    for name in names:
        law = next(each for each in laws(case, candidate) if each.name == name)
        candidate = with_law(case, candidate, law)
    return candidate


@pytest.fixture(scope="module")
def late() -> Case:
    """A linkage whose command comes 6 ms late."""
    return linkage({DELAY: 0.006})


@pytest.fixture(scope="module")
def with_mass(late: Case) -> FittedCandidate:
    return with_laws(late, "mass_of_position_m")


def test_a_delay_shows_beside_the_mass(late: Case, with_mass: FittedCandidate) -> None:
    found = effect_beside(late, with_mass, TRIED)
    assert found is not None
    assert found.effects == ("transport_delay",)
    # The error of a size that is accepted in blind checks: 2 % in the median, ten times that here.
    assert found.values[DELAY] == pytest.approx(0.006, rel=0.2)
    assert [law.name for law in found.laws] == ["mass_of_position_m"]
    assert left(late, found) < left(late, with_mass)


def test_an_effect_that_takes_too_little_is_not_named(
    late: Case, with_mass: FittedCandidate
) -> None:
    found = effect_beside(late, with_mass, TRIED)
    assert found is not None
    takes = left(late, with_mass) - left(late, found)
    assert effect_beside(late, with_mass, TRIED, 0.99 * takes) is not None
    assert effect_beside(late, with_mass, TRIED, 1.01 * takes) is None


def test_an_effect_that_may_not_be_named_is_not_tried(
    late: Case, with_mass: FittedCandidate
) -> None:
    found = effect_beside(late, with_mass, TRIED[1:])
    assert found is None or "transport_delay" not in found.effects


def test_an_effect_that_a_curve_can_have_in_it_is_not_tried_beside_it(late: Case) -> None:
    places = np.linspace(0.05, 0.25, 4)
    force, mass = (Law(each, "position_m", places, 1.0) for each in ("force", "mass"))
    assert is_part("load_force", [force])
    assert is_part("coulomb_friction", [mass, force])
    # A mass over the position is no part of a friction, nor of a force.
    assert not is_part("coulomb_friction", [mass])
    assert not is_part("transport_delay", [mass, force])
    with_force = with_laws(late, "force_of_position_m")
    assert effect_beside(late, with_force, ("load_force", "coulomb_friction")) is None


@pytest.mark.parametrize(
    ("growth", "values", "shows"),
    [
        # A fifth of what it is above: over the visited range the mass grows by a third.
        (0.2, {}, True),
        (0.2, {FRICTION: 500.0}, True),
        (0.0, {}, False),
        (0.0, {FRICTION: 500.0}, False),
    ],
)
def test_a_linkage_shows_beside_the_right_effects_and_no_other_machine_seems_to_be_one(
    growth: float, values: Mapping[str, float], shows: bool
) -> None:
    table = replace(GROWING, values=tuple(growth * value for value in GROWING.values))
    case = linkage(values, table)
    best = calibrate(case)
    if values:
        start = linearised_start(case, (), best.x)
        best = refine(case, ("coulomb_friction",), screen(case, ("coulomb_friction",), [start]).x)
    assert shows_linkage(case, best) is shows


@pytest.mark.parametrize(
    ("laws", "largest_kg", "lever"),
    [
        (("mass",), 1.17, True),
        (("mass",), 1.13, False),
        # Beside the force of a boom the mass tells as well.
        (("mass", "force"), 1.17, True),
        (("force", "mass"), 1.13, False),
        (("force",), 2.0, False),
        (("mass", "delay"), 2.0, False),
        ((), 2.0, False),
    ],
)
def test_a_mass_that_hardly_changes_is_no_lever(
    monkeypatch: pytest.MonkeyPatch, laws: tuple[str, ...], largest_kg: float, lever: bool
) -> None:
    places = np.linspace(0.0, 0.3, 4)
    each = tuple(Law(law, "position_m", places, 1.0) for law in laws)
    # The whole mass, of which the rig has 0.6 kg, is 1 kg up to 0.1 m and the largest one from
    # 0.2 m on. Beyond 0.25 m, where the rod seldom is, it is twice as much.
    changes = np.array([1.0, 1.0, largest_kg, 2.0 * largest_kg]) - 0.6
    of_law = {"mass": changes, "force": 0.0 * changes, "delay": 0.0 * changes}
    candidate = replace(
        made_candidate(rms=1e-5),
        x=np.concatenate(
            [np.zeros(20), *(np.linalg.solve(e.basis, of_law[e.adds_to]) for e in each)]
        ),
        values={"load.mass_kg": 0.6},
        laws=each,
    )
    rod = np.concatenate([np.linspace(0.05, 0.2, 96), np.linspace(0.2, 0.3, 4)])
    monkeypatch.setattr(choosing, "visited", lambda *_: {"position_m": rod})
    assert moves_as_lever(CASE, candidate) is lever
    price = len(laws) * (EFFECT if lever else LAW) / EVIDENCE
    assert choosing._price(CASE, candidate) == pytest.approx(price)
    # It leaves what the rig leaves, so that there is only what it costs.
    cause = 0.0 if lever else CAUSE
    evidence = choosing._evidence(CASE, made_candidate(rms=1e-5), candidate)
    of_values = price_of_values(CASE, candidate, candidate).total
    assert evidence == pytest.approx(-EVIDENCE * price - cause - of_values)
    candidate.x[0] = 100.0  # a value far from the rig file
    evidence = choosing._evidence(CASE, made_candidate(rms=1e-5), candidate)
    assert evidence == pytest.approx(-EVIDENCE * price - cause - VALUES)


def test_nothing_is_named_where_nothing_else_is_missing() -> None:
    case = linkage({})
    assert effect_beside(case, with_laws(case, "mass_of_position_m"), TRIED) is None


def test_a_delay_that_does_not_drift_has_a_name(late: Case) -> None:
    both = with_laws(late, "delay_of_time_s", "mass_of_position_m")
    law = both.laws[0]
    without = without_law(late, both, law)
    assert [each.name for each in without.laws] == ["mass_of_position_m"]
    assert without.x.size == both.x.size - law.knots.size
    found = constant_of(late, without, law, TRIED)
    assert found is not None
    assert found.effects == ("transport_delay",)
    assert found.values[DELAY] == pytest.approx(0.006, rel=0.2)
    assert constant_of(late, without, law, TRIED[1:]) is None
    assert constant_of(late, found, law, TRIED) is None  # it is there already


@pytest.mark.thorough
def test_the_delay_is_named_and_the_mass_is_the_law(late: Case) -> None:
    calibrated = calibrate(late)
    found = missing_laws(late, calibrated, calibrated, effect_ids=TRIED)
    assert found is not None
    assert found.candidate.effects == ("transport_delay",)
    assert ("mass", "position_m") in {(law.law.adds_to, law.law.of) for law in found.laws}
    assert "delay" not in {law.law.adds_to for law in found.laws}
    shares = [law.share_of_shrinkage for law in found.laws]
    assert found.of_effects + sum(shares) == pytest.approx(1.0)
    assert found.of_effects > 0.0
    # Without the delay the laws are less probable, by more than its prior cost.
    (effects, evidence), (others, less) = found.hypotheses
    assert (effects, others) == (("transport_delay",), ())
    assert less < evidence


@pytest.mark.thorough
def test_a_spring_that_stood_in_for_the_lever_is_taken_in_and_the_delay_stays(late: Case) -> None:
    calibrated = calibrate(late)
    screened = screen(late, ("load_spring",), [linearised_start(late, (), calibrated.x)])
    spring = refine(late, ("load_spring",), screened.x)
    # The laws shall start from the spring, whatever they would find without it.
    found = missing_laws(late, spring, spring, effect_ids=TRIED)
    assert found is not None
    assert found.candidate.effects == ("transport_delay",)
    assert ("mass", "position_m") in {(law.law.adds_to, law.law.of) for law in found.laws}
