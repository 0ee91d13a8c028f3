# SPDX-License-Identifier: MIT
"""A real machine whose friction and offset are published, and not told to the diagnosis.

A. Janot, M. Gautier, M. Brunot, "Data set and reference models of EMPS", Workshop on Nonlinear
System Identification Benchmarks, 2019: least-squares values of an inverse dynamic model, with
nothing in common with a fit of simulations.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from ehsid.harness.gap import Diagnosis, diagnose
from ehsid.harness.gap.schema import Estimate
from ehsid.harness.records import read_record
from ehsid.harness.rigs import read_rig

EMPS = Path(__file__).parents[1] / "data" / "emps"
MASS_KG = 95.1089
VISCOUS_N_S_M = 203.5034
COULOMB_N = 20.3935
OFFSET_N = -3.1648

pytestmark = pytest.mark.slow


def diagnosed(*exclude: str) -> Diagnosis:
    rig = read_rig(EMPS / "emps.rig.toml")
    return diagnose([read_record(EMPS / "emps.csv", layout=rig.columns)], rig, exclude=exclude)


def holds(interval: Estimate, published: float) -> bool:
    return interval.low <= published <= interval.high


@pytest.fixture(scope="module")
def emps() -> Diagnosis:
    return diagnosed()


def test_coulomb_friction_and_the_constant_force_are_named(emps: Diagnosis) -> None:
    assert {one.id for one in emps.effects} == {"coulomb_friction", "load_force"}


def test_published_forces_are_inside_the_intervals(emps: Diagnosis) -> None:
    found = {one.id: one.parameters["force_n"] for one in emps.effects}
    assert holds(found["coulomb_friction"], COULOMB_N)
    assert holds(found["load_force"], OFFSET_N)
    # They say something: neither holds zero, and friction is known to better than a fifth.
    assert found["load_force"].high < 0.0
    coulomb = found["coulomb_friction"]
    assert coulomb.high - coulomb.low < 0.4 * coulomb.value


def test_published_viscous_friction_is_inside_the_interval_and_the_mass_near(
    emps: Diagnosis,
) -> None:
    assert holds(emps.calibration["axis.viscous_friction_n_s_m"].found, VISCOUS_N_S_M)
    # Sticking makes the cost rough: minima of nearly the same cost lie 3 % apart in mass, more than
    # the interval of any one of them. It stays within the deviation that the rig tells.
    assert abs(emps.calibration["axis.mass_kg"].found.value / MASS_KG - 1.0) < 0.05


def test_without_coulomb_friction_nothing_else_takes_its_place() -> None:
    found = diagnosed("coulomb_friction")
    named = {one.id for one in found.effects}
    assert "coulomb_friction" not in named
    # Stribeck friction holds Coulomb friction as a case, a spring holds a constant force.
    kin = {"stribeck_friction", "load_force", "load_spring"}
    assert named <= kin or found.verdict in ("outside_catalogue", "ambiguous"), found.sentence
