# SPDX-License-Identifier: MIT
"""Errors of sizes and values, and whether their intervals hold the truth."""

import math

from ehsid.harness.gap.schema import Estimate
from ehsid.harness.validation.scoring.figures_sizes import effect_errors, rig_errors
from ehsid.harness.validation.scoring.judged_case import Scored
from ehsid.harness.validation.scoring.reading import Answer, Named, Said
from ehsid.harness.validation.scoring.right import judge

STRIBECK = {"coulomb_n": 500.0, "static_n": 1000.0, "stribeck_velocity_m_s": 0.02}


def scored(kind: str = "one", truth: str = "stribeck_friction") -> Scored:
    answer = Answer(
        kind,
        "plain",
        "ehs",
        "position",
        ("prbs",),
        {truth: STRIBECK},
        ("mechanics",),
        {"load.mass_kg": 100.0, "supply.pressure_pa": 1e7},
    )
    named = Named(
        "stribeck_friction",
        0.9,
        {
            "coulomb_n": Estimate(505.0, 490.0, 520.0),
            "static_n": Estimate(900.0, 880.0, 920.0),
            "stribeck_velocity_m_s": Estimate(math.nan, math.nan, math.nan),
        },
    )
    said = Said(
        "effects",
        (named,),
        calibration={
            "load.mass_kg": Estimate(102.0, 99.0, 105.0),
            "supply.pressure_pa": Estimate(1.1e7, 1.05e7, 1.15e7),
            "nuisance.presliding_m": Estimate(2e-5, 1e-5, 3e-5),
        },
    )
    return Scored("a1", answer, said, judge(answer, said))


def test_sizes_by_parameter() -> None:
    first, second = effect_errors([scored()])
    assert (first.parameter, first.primary, first.inside) == ("coulomb_n", True, True)
    assert math.isclose(first.relative, 0.01)
    assert (second.parameter, second.primary, second.inside) == ("static_n", False, False)
    assert math.isclose(second.relative, 0.1)


def test_sizes_of_another_name_are_not_compared() -> None:
    assert effect_errors([scored(truth="coulomb_friction")]) == ()


def test_rig_values_have_a_truth_nuisances_have_none() -> None:
    mass, pressure = rig_errors([scored()])
    assert (mass.parameter, mass.inside) == ("load.mass_kg", True)
    assert (pressure.inside, round(pressure.relative, 6)) == (False, 0.1)


def test_values_of_a_machine_with_something_unknown_are_not_compared() -> None:
    assert rig_errors([scored("open", "second_load_mass")]) == ()


def test_a_size_of_nothing_has_no_relative_error() -> None:
    case = scored()
    answer = Answer(
        "one", "plain", "ehs", "position", ("prbs",), {"stribeck_friction": {"coulomb_n": 0.0}}, ()
    )
    (found,) = effect_errors([Scored("a1", answer, case.said, case.judged)])
    assert math.isinf(found.relative)
