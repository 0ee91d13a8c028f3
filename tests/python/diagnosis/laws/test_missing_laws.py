# SPDX-License-Identifier: MIT
"""Laws that the catalogue lacks, found in records of machines that have them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from gap_cases import DT_S, OFF, RIG, command_of, measured, over_the_stroke, record

from ehsid.harness.diagnosis.deciding import EFFECT, EVIDENCE
from ehsid.harness.diagnosis.laws.choosing import LAW, LawsFound, missing_laws
from ehsid.harness.diagnosis.laws.fitting import with_one_law
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.search.candidates import (
    FittedCandidate,
    calibrate,
    decision_case,
    linearised_start,
    refine,
    screen,
)
from ehsid.harness.diagnosis.search.gap_reduction import mean_gap
from ehsid.harness.diagnosis.search.score import left, price_of_values
from ehsid.harness.records import Record
from ehsid.harness.rigs.rig import TableLaw

pytestmark = pytest.mark.thorough

# A friction that comes up with the velocity over 0.1 m/s: no effect of the catalogue does.
SPEEDS = np.linspace(-0.6, 0.6, 61)
FORCES = 2500.0 * np.tanh(SPEEDS / 0.1)
DRAG = TableLaw("force", "velocity_m_s", tuple(SPEEDS.tolist()), tuple(FORCES.tolist()))

# A drag that grows with the square of the velocity.
TURBULENT = TableLaw(
    "force", "velocity_m_s", tuple(SPEEDS.tolist()), tuple((5e4 * SPEEDS * abs(SPEEDS)).tolist())
)


def with_table(law: TableLaw, seed: int, values: Mapping[str, float] | None = None) -> Record:
    rng = np.random.default_rng(seed)
    rig = replace(RIG, tables={"hidden": law})
    return measured(rig, command_of(6.0, DT_S, rng), rng, {**OFF, **(values or {})})


@pytest.fixture(scope="module")
def case() -> Case:
    return make_case(RIG, [with_table(DRAG, 1)], [with_table(DRAG, 2)])


def laws_beside(case: Case, effect: str) -> tuple[FittedCandidate, LawsFound]:
    """The fit with an effect that stands in for the law, and what is found beside it."""
    calibrated = calibrate(case)
    screened = screen(case, (effect,), [linearised_start(case, (), calibrated.x)])
    stand_in = refine(case, (effect,), screened.x)
    assert left(decision_case(case), stand_in) < left(decision_case(case), calibrated)
    found = missing_laws(case, calibrated, stand_in)
    assert found is not None
    return stand_in, found


@pytest.fixture(scope="module")
def found(case: Case) -> LawsFound:
    return laws_beside(case, "sensor_backlash")[1]


def test_the_equation_the_variable_and_the_curve_are_those_of_the_machine(
    found: LawsFound,
) -> None:
    (law,) = found.laws
    assert (law.law.adds_to, law.law.of) == ("force", "velocity_m_s")
    assert law.rivals == ()
    assert law.share_of_shrinkage == pytest.approx(1.0)
    true = np.interp(law.law.knots, DRAG.knots, DRAG.values)
    low, high = np.array(law.band).T
    inside = (low <= true) & (true <= high)
    # The band holds 90 % at each knot; of the visited range 80 % is asked for.
    assert np.array(law.visited)[inside].sum() >= 0.8
    assert sum(law.visited) == pytest.approx(1.0)


def test_an_effect_that_stood_in_for_the_law_is_left_out(found: LawsFound) -> None:
    assert found.candidate.effects == ()
    assert found.of_effects == 0.0


def test_the_law_removes_most_of_what_can_be_explained(case: Case, found: LawsFound | None) -> None:
    assert found is not None
    fine = decision_case(case)
    # What is asked for on machines whose cause was withheld: 0.8 of the explainable gap.
    assert left(fine, found.candidate) < 0.2 * left(fine, calibrate(case))


def test_an_effect_of_the_same_subsystem_stays_with_its_size_and_the_law_is_the_rest() -> None:
    size = "effects.coulomb_friction.force_n"
    case = make_case(RIG, *([with_table(TURBULENT, seed, {size: 900.0})] for seed in (1, 2)))
    friction, found = laws_beside(case, "coulomb_friction")
    assert found.candidate.effects == ("coulomb_friction",)
    assert found.held == {size: friction.values[size]}
    assert found.candidate.values[size] == pytest.approx(friction.values[size])
    (law,) = found.laws
    assert (law.law.adds_to, law.law.of) == ("force", "velocity_m_s")
    assert 0.0 < found.of_effects < 1.0
    assert found.of_effects + law.share_of_shrinkage == pytest.approx(1.0)
    # The friction was fitted without the law, so that the law has its error as well.
    knots, low, high = np.array(law.law.knots), *np.array(law.band).T
    error = 900.0 - friction.values[size]
    rest = np.interp(knots, TURBULENT.knots, TURBULENT.values) + error * np.sign(knots)
    inside = (low <= rest) & (rest <= high)
    assert np.array(law.visited)[inside].sum() >= 0.8


def test_a_sound_machine_lacks_no_law() -> None:
    case = make_case(RIG, [record(OFF, 1)], [record(OFF, 2)])
    calibrated = calibrate(case)
    assert missing_laws(case, calibrated, calibrated) is None


def test_a_law_that_gains_less_than_it_costs_is_not_shown() -> None:
    small = replace(DRAG, values=tuple(0.05 * value for value in DRAG.values))
    case = make_case(RIG, [with_table(small, 1)], [with_table(small, 2)])
    calibrated, fine = calibrate(case), decision_case(case)
    best = with_one_law(fine, calibrated)[0]
    gain = left(fine, calibrated) - best.left
    assert 0.0 < gain < LAW / EVIDENCE
    assert mean_gap(best.candidate.sums) < mean_gap(calibrated.sums)
    assert missing_laws(case, calibrated, calibrated) is None


PLACES = np.linspace(0.05, 0.25, 21)
# A linkage: over what is visited, 0.12 to 0.22 m, the mass grows by half, the force by 1.2 kN.
AWAY = PLACES - 0.15
HEAVIER = RIG.values["load.mass_kg"] * (5.0 * AWAY + 24.0 * AWAY**2)
LIFT = 1e4 * (PLACES - 0.05) + 6e4 * AWAY**2
GROWING = TableLaw("mass", "position_m", tuple(PLACES.tolist()), tuple(HEAVIER.tolist()))
LIFTED = TableLaw("force", "position_m", tuple(PLACES.tolist()), tuple(LIFT.tolist()))


def test_a_mild_linkage_is_evidence_where_another_law_as_small_is_none() -> None:
    mild = replace(GROWING, values=tuple(0.4 * value for value in GROWING.values))
    case = make_case(RIG, *([over_the_stroke({"mass": mild}, seed)] for seed in (1, 2)))
    calibrated, fine = calibrate(case), decision_case(case)
    found = missing_laws(case, calibrated, calibrated)
    assert found is not None
    assert [law.law.adds_to for law in found.laws] == ["mass"]
    gain = EVIDENCE * (left(fine, calibrated) - left(fine, found.candidate))
    assert EFFECT < gain < LAW
    of_values = price_of_values(fine, found.candidate, found.candidate).total
    assert found.hypotheses == (((), pytest.approx(gain - EFFECT - of_values)),)


# Something of 60 N/mm that the rod touches at 170 mm.
TOUCHED = TableLaw("force", "position_m", (0.0, 0.17, 0.3), (0.0, 0.0, 7800.0))


def test_a_spring_beside_a_force_over_the_position_is_a_part_of_it() -> None:
    case = make_case(RIG, *([over_the_stroke({"force": TOUCHED}, seed)] for seed in (1, 2)))
    _, found = laws_beside(case, "load_spring")
    assert found.candidate.effects == ()
    assert found.held == {}
    (law,) = found.laws
    assert (law.law.adds_to, law.law.of) == ("force", "position_m")
    assert "that the rod touches there" in law.looks_like


def test_a_spring_beside_a_mass_over_the_position_is_taken_in() -> None:
    tables = {"mass": GROWING, "force": LIFTED}
    case = make_case(RIG, *([over_the_stroke(tables, seed)] for seed in (1, 2)))
    _, found = laws_beside(case, "load_spring")
    assert found.candidate.effects == ()
    laws = {(law.law.adds_to, law.law.of): law for law in found.laws}
    assert set(laws) == {("mass", "position_m"), ("force", "position_m")}
    mass = laws["mass", "position_m"]
    assert "as in a linkage" in mass.looks_like
    low, high = np.array(mass.band).T
    true = np.interp(mass.law.knots, GROWING.knots, GROWING.values)
    # The mass of the rig file may have a part of it.
    moved = found.candidate.values["load.mass_kg"] - RIG.values["load.mass_kg"]
    inside = (low <= true - moved) & (true - moved <= high)
    assert np.array(mass.visited)[inside].sum() >= 0.8
