# SPDX-License-Identifier: MIT
"""Which equation lacks a term, and what it is over the time, on simulated servos."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from servo_records import OTHER, RIG, full, made

from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.diagnosis.laws.equation_terms import SUBSYSTEM, EquationTerms, equation_terms
from ehsid.harness.diagnosis.laws.fitting import (
    LEAST_GAIN,
    equation_shares,
    followed,
    shares_of,
    unknown_input,
)
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.search.candidates import FittedCandidate, calibrate
from ehsid.harness.records import Record
from ehsid.harness.rigs.rig import TableLaw

FORCE_N = 900.0
HERTZ = 1.3


@cache
def case_of(effect: str) -> tuple[Case, FittedCandidate]:
    case = make_case(RIG, [made({**OTHER, **full(effect)} if effect else OTHER, seed=5)])
    return case, calibrate(case)


@cache
def terms_of(effect: str) -> Mapping[str, EquationTerms]:
    return {each.equation: each for each in equation_terms(*case_of(effect))}


@pytest.mark.slow
@pytest.mark.parametrize(
    "effect",
    [
        "coulomb_friction",
        "valve_dead_band",
        pytest.param("internal_leakage", marks=pytest.mark.thorough),
        pytest.param("transport_delay", marks=pytest.mark.thorough),
        pytest.param("sensor_lag", marks=pytest.mark.thorough),
        pytest.param("load_spring", marks=pytest.mark.thorough),
    ],
)
def test_the_equation_of_the_effect_gains_most(effect: str) -> None:
    gains = {name: each.gain for name, each in terms_of(effect).items()}
    best = max(gains, key=lambda name: gains[name])
    assert SUBSYSTEM[best] == effects()[effect].subsystem
    assert gains[best] > 5.0 * LEAST_GAIN
    # Terms that are off explain as much as none.
    assert min(gains.values()) >= 0.0


@pytest.mark.slow
def test_no_equation_gains_where_nothing_is_missing() -> None:
    case, calibrated = case_of("")
    assert equation_shares(case, calibrated) == ((), ())


@pytest.mark.slow
def test_friction_comes_back_over_the_velocity() -> None:
    found = unknown_input(terms_of("coulomb_friction")["force"])
    assert found.of in ("velocity_m_s", "position_by_direction_m")
    assert found.explained > 0.6
    true = full("coulomb_friction")["effects.coulomb_friction.force_n"]
    sliding = found.value[np.abs(found.at) > np.quantile(np.abs(found.at), 0.5)]
    assert np.median(np.abs(sliding)) == pytest.approx(true, rel=0.3)


def pushed() -> tuple[Record, np.ndarray]:
    """A servo that somebody pushes with a force that swings; the force by sample."""
    time_s = np.arange(6000) * 1e-3
    force = FORCE_N * np.sin(2.0 * np.pi * HERTZ * time_s)
    table = TableLaw("force", "time_s", tuple(time_s[::10].tolist()), tuple(force[::10].tolist()))
    return made(OTHER, rig=replace(RIG, tables={"push": table}), seed=5), force


@pytest.mark.slow
def test_a_known_force_comes_back_inside_its_band() -> None:
    record, force = pushed()
    case = make_case(RIG, [record])
    terms = {each.equation: each for each in equation_terms(case, calibrate(case))}
    assert max(terms, key=lambda name: terms[name].gain) == "force"
    found = unknown_input(terms["force"])
    true = np.interp(found.time_s, record.time_s, force)
    assert np.sqrt(np.mean((found.value - true) ** 2)) < 0.15 * FORCE_N
    inside = np.abs(found.value - true) < 1.645 * found.deviation
    assert float(np.mean(inside)) > 0.8


gains = st.dictionaries(st.sampled_from(sorted(SUBSYSTEM)), st.floats(-50.0, 1e4), min_size=1)


@given(gains=gains)
def test_shares_add_up_and_follow_the_gains(gains: dict[str, float]) -> None:
    shares = shares_of(gains)
    if max(gains.values()) < LEAST_GAIN:
        assert shares == {}
        return
    assert sum(shares.values()) == pytest.approx(1.0)
    best = max(gains, key=lambda name: gains[name])
    by_subsystem: dict[str, float] = {}
    for name, share in shares.items():
        by_subsystem[SUBSYSTEM[name]] = by_subsystem.get(SUBSYSTEM[name], 0.0) + share
    assert by_subsystem[SUBSYSTEM[best]] == pytest.approx(max(by_subsystem.values()))


@given(seed=st.integers(0, 100))
def test_an_input_is_traced_to_the_variable_it_was_made_from(seed: int) -> None:
    rng = np.random.default_rng(seed)
    at = {name: rng.uniform(-1.0, 1.0, 400) for name in ("velocity_m_s", "position_m", "time_s")}
    value = np.tanh(4.0 * at["position_m"]) + 0.05 * rng.standard_normal(400)
    name, explained = followed(at, value, np.full(400, 0.05))
    assert name == "position_m"
    assert explained > 0.95
