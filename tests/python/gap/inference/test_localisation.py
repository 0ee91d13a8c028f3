# SPDX-License-Identifier: MIT
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from servo_records import EFFECTS, OTHER, RIG, full, made

from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.gap.inference.attribution import attribute_equations, attribute_errors
from ehsid.harness.gap.inference.candidates import FittedCandidate
from ehsid.harness.gap.inference.families import friction_laws
from ehsid.harness.gap.inference.gap_reduction import WindowSums
from ehsid.harness.gap.inference.localisation import Evidence, gather, localise
from ehsid.harness.gap.model.case import Case, make_case
from ehsid.harness.gap.model.fit import fit
from ehsid.harness.gap.model.spectrum import BANDS
from ehsid.harness.gap.schema import SUBSYSTEMS
from ehsid.harness.records import make_record

POSITION = ("position_m",)


def case_of(values: Mapping[str, float], columns: tuple[str, ...] | None = None) -> Case:
    options = {} if columns is None else {"columns": columns}
    records = [made({**OTHER, **values}, seed=seed, **options) for seed in (1, 2)]
    return make_case(RIG, records[:1], records[1:])


def calibrated(case: Case) -> FittedCandidate:
    """A fit from the centres of the priors: these records have no limit cycle."""
    problem = case.problem()
    fitted = fit(problem, problem.centre())
    values = {p.name: p.value(float(x)) for p, x in zip(problem.parameters, fitted.x, strict=True)}
    return candidate(fitted.x, values)


def candidate(x: np.ndarray, values: Mapping[str, float]) -> FittedCandidate:
    """A candidate without the costs and errors that only the selection reads."""
    nothing, powers, count = np.zeros((1, 1)), np.zeros((1, 1, BANDS)), np.ones(1)
    sums = WindowSums({}, {}, count)
    return FittedCandidate((), x, values, 0.0, 0.0, True, nothing, count, powers, powers, sums)


def with_effects(calibrated_fit: FittedCandidate, effect_ids: Sequence[str]) -> FittedCandidate:
    return replace(calibrated_fit, effects=tuple(effect_ids))


@dataclass(frozen=True)
class Gathered:
    """A case, its calibration, and the evidence that was gathered from both."""

    case: Case
    base: FittedCandidate
    evidence: Evidence


def gathered(case: Case) -> Gathered:
    base = calibrated(case)
    return Gathered(case, base, gather(case, base))


@pytest.fixture(scope="module")
def clean() -> Gathered:
    return gathered(case_of({}, POSITION))


@pytest.fixture(scope="module")
def rubbing() -> Gathered:
    return gathered(case_of(full("coulomb_friction")))


# One effect of each subsystem is tested every day.
EVERY_DAY = ("valve_dead_band", "internal_leakage", "coulomb_friction", "sensor_lag")


@pytest.mark.parametrize(
    "effect",
    [
        pytest.param(effect, marks=() if effect in EVERY_DAY else pytest.mark.slow)
        for effect in sorted(EFFECTS.keys() - {"entrained_air", "valve_lag"})
    ],
)
def test_equations_name_the_subsystem(effect: str) -> None:
    record = made({**OTHER, **full(effect)}, seed=5)
    attribution = attribute_equations([record], RIG, {})
    shares = attribution.subsystem
    assert sum(shares.values()) == pytest.approx(1.0)
    assert max(shares, key=lambda name: shares[name]) == effects()[effect].subsystem
    assert attribution.included[0].gain > 0.0


def test_two_effects_share_the_gap() -> None:
    values = {**OTHER, **full("valve_hysteresis"), **full("coulomb_friction")}
    attribution = attribute_equations([made(values, seed=5)], RIG, {})
    # The play keeps the rod at rest for longer, where the position has no information on friction.
    assert {"valve", "mechanics"} <= {name for name, v in attribution.subsystem.items() if v > 0.1}
    assert "valve_hysteresis" in [ranked_effect.effect for ranked_effect in attribution.included]


def test_equations_show_no_gap_without_an_effect() -> None:
    attribution = attribute_equations([made(OTHER, seed=6)], RIG, {})
    assert (attribution.subsystem, attribution.included, attribution.notes) == ({}, (), ())
    assert len(attribution.equations) == 4


def test_what_no_effect_explains_stays_with_its_equation() -> None:
    """A ripple of the pump: a supply pressure that no supply droop explains.

    It is in the measured signal only, so that the flows of the valve do not agree with it, either.
    """
    record = made(OTHER, seed=7)
    time_s = np.array(record.time_s)
    hum = record.column("supply_pressure_pa") + 3e5 * np.sin(2.0 * np.pi * 37.0 * time_s)
    noisy = replace(record, columns={**record.columns, "supply_pressure_pa": hum})
    attribution = attribute_equations([noisy], RIG, {})
    assert attribution.subsystem["hydraulics"] > 0.75
    assert any("supply line" in note for note in attribution.notes)


def test_an_excluded_effect_is_not_named() -> None:
    record = made({**OTHER, **full("coulomb_friction")}, seed=5)
    twins = sorted(friction_laws())
    attribution = attribute_equations([record], RIG, {}, exclude=twins)
    assert not set(twins) & {ranked_effect.effect for ranked_effect in attribution.included}
    # The rest of the gap is still attributed to its subsystem.
    assert attribution.subsystem["mechanics"] > 0.5
    assert attribution.notes


@pytest.mark.parametrize(
    "effect", ["valve_dead_band", "valve_hysteresis", "internal_leakage", "transport_delay"]
)
def test_errors_of_the_position_name_the_subsystem(effect: str) -> None:
    case = case_of(full(effect), POSITION)
    attribution = attribute_errors(case.problem(), calibrated(case).x)
    assert attribution.equations == ()
    assert effects()[effect].subsystem in attribution.subsystem
    assert sum(attribution.subsystem.values()) == pytest.approx(1.0)


def test_errors_of_a_wrong_motion_show_no_subsystem() -> None:
    record = made(OTHER, columns=POSITION)
    # The command of the valve has the wrong sign.
    swapped = {**record.columns, "command_v": -record.column("command_v")}
    records = [make_record({"time_s": record.time_s, **swapped})] * 2
    case = make_case(RIG, records[:1], records[1:])
    problem = case.problem()
    attribution = attribute_errors(problem, problem.centre())
    assert attribution.subsystem == {}
    assert "do not say" in attribution.notes[0]


def test_where_without_effects_rests_on_the_equations(rubbing: Gathered) -> None:
    where = localise(rubbing.case, rubbing.base, None)
    assert set(where.subsystem) == set(SUBSYSTEMS)
    assert where.subsystem["mechanics"] > 0.9
    assert [share.equation for share in where.equations]
    assert sum(share.share_of_gap.value for share in where.frequency) == pytest.approx(
        1.0, abs=0.02
    )
    assert where.regimes
    # The same evidence, gathered before.
    again = localise(rubbing.case, rubbing.base, None, evidence=rubbing.evidence)
    assert again.subsystem == where.subsystem


@pytest.mark.slow
def test_contradictions_of_place_and_effects_are_noted(rubbing: Gathered) -> None:
    case, base = rubbing.case, rubbing.base
    agreeing = localise(case, base, with_effects(base, ["coulomb_friction"]))
    assert agreeing.subsystem["mechanics"] == 1.0
    assert agreeing.notes == ()
    other = localise(case, base, with_effects(base, ["valve_dead_band"]))
    assert other.subsystem["valve"] == 1.0
    assert any("mechanics" in note for note in other.notes)
    assert any("valve" in note for note in other.notes)


@given(
    shares=st.dictionaries(
        st.sampled_from(["valve_dead_band", "coulomb_friction", "load_force"]),
        st.floats(-1.0, 5.0),
        max_size=3,
    )
)
def test_shares_of_effects_sum_to_one(clean: Gathered, shares: dict[str, float]) -> None:
    empty = candidate(np.zeros(0), {})
    best = with_effects(empty, ["valve_dead_band", "coulomb_friction", "load_force"])
    where = localise(clean.case, clean.base, best, shares=shares, evidence=clean.evidence)
    subsystem = where.subsystem
    assert sum(subsystem.values()) == pytest.approx(1.0)
    assert min(subsystem.values()) >= 0.0
    assert subsystem["hydraulics"] == subsystem["sensor"] == subsystem["timing"] == 0.0


def test_a_clean_position_can_only_be_noise(clean: Gathered) -> None:
    assert clean.evidence.attribution.subsystem == {}
    where = localise(clean.case, clean.base, None)
    assert where.equations == ()
    assert len(where.notes) == 1
