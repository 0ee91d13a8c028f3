# SPDX-License-Identifier: MIT
"""A term that follows the time alone is found, on records of which it is known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
import pytest
from gap_cases import DT_S, OFF, RIG, all_but, command_of, measured, record

from ehsid.harness.base.numbers import plain_number
from ehsid.harness.diagnosis import diagnosis
from ehsid.harness.diagnosis.deciding import DRIFTS
from ehsid.harness.diagnosis.diagnosis import diagnose
from ehsid.harness.diagnosis.laws import wandering as module
from ehsid.harness.diagnosis.laws.drifting import Drift
from ehsid.harness.diagnosis.laws.wandering import what_wanders
from ehsid.harness.diagnosis.model.case import make_case
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.diagnosis.result import Wandering
from ehsid.harness.diagnosis.search.candidates import calibrate
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs.rig import TableLaw
from ehsid.harness.show.where_section import diagnosis_facts

FloatArray = npt.NDArray[np.float64]

SECONDS = 10.0
KNOTS_S = np.linspace(0.0, SECONDS, 101)
# Largest size of each term: share of full opening, N, m.
SIZES = {"spool": 2e-3, "force": 300.0, "sensor": 6e-3}


def sine(time_s: FloatArray, seed: int) -> FloatArray:
    """A wave of its own in each record, of size one."""
    return np.asarray(np.sin(2.0 * np.pi * time_s / (3.5 + seed) + 2.0 * seed))


def wandering(
    equation: str,
    seed: int,
    of: Callable[[FloatArray, int], FloatArray] = sine,
    values: Mapping[str, float] = MappingProxyType({}),
) -> Record:
    """A record of the rig with a term of an equation over the time."""
    rng = np.random.default_rng(seed)
    command = command_of(SECONDS, DT_S, rng)
    if equation != "sensor":
        at_knots = (SIZES[equation] * of(KNOTS_S, seed)).tolist()
        law = TableLaw(equation, "time_s", tuple(KNOTS_S.tolist()), tuple(at_knots))
        return measured(replace(RIG, tables={"wanders": law}), command, rng, {**OFF, **values})
    made = measured(RIG, command, rng, {**OFF, **values})
    columns = {name: made.column(name) for name in made.columns}
    columns["position_m"] = made.column("position_m") + SIZES[equation] * of(made.time_s, seed)
    return make_record({"time_s": made.time_s, **columns})


def found_in(fitted: Record, *held_out: Record) -> Wandering | None:
    case = make_case(RIG, [fitted], list(held_out))
    return what_wanders(case, calibrate(case))


@pytest.mark.slow
@pytest.mark.parametrize("equation", SIZES)
def test_what_wanders_is_told_with_its_equation_and_its_curve(equation: str) -> None:
    fitted, held_out = wandering(equation, 1), wandering(equation, 2)
    found = found_in(replace(fitted, name="first"), replace(held_out, name="second"))
    assert found is not None
    assert found.adds_to == equation
    assert found.gain >= DRIFTS
    assert list(found.curves) == ["first", "second"]
    for seed, (time_s, value) in enumerate(found.curves.values(), 1):
        true = SIZES[equation] * sine(time_s, seed)
        if equation == "sensor":  # a steady rate of it is alike to a null bias
            true -= np.polyval(np.polyfit(time_s, true, 1), time_s)
        true -= np.mean(true)
        # The values of the rig, which the fit moved, take a part of it.
        assert np.std(value - true) < 0.15 * np.std(true)


@pytest.mark.slow
def test_blocks_of_one_record_tell_it_too() -> None:
    found = found_in(wandering("sensor", 1))
    assert found is not None
    ((time_s, value),) = found.curves.values()
    # All windows of the record are in the curve, whichever blocks were held out.
    assert np.allclose(np.diff(time_s), 0.5)
    assert np.ptp(value) == pytest.approx(2.0 * SIZES["sensor"], rel=0.15)
    told = (
        f"wanders over {plain_number(1e3 * float(np.ptp(value)), 3)} mm in the course of a record"
    )
    assert found.looks_like.startswith(told)


@pytest.mark.slow
def test_of_several_equations_the_one_that_gains_most_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With the position only, a null of the valve that wanders is nearly alike."""
    fitted, held_out = (without_pressures(wandering("sensor", seed)) for seed in (1, 2))
    found = found_in(fitted, held_out)
    assert found is not None
    assert found.adds_to == "sensor"
    monkeypatch.setattr(module, "EQUATIONS", ("spool",))
    spool = found_in(fitted, held_out)
    assert spool is not None
    assert spool.gain < found.gain
    monkeypatch.setattr(module, "DRIFTS", 1.01 * spool.gain)
    assert found_in(fitted, held_out) is None
    monkeypatch.setattr(module, "DRIFTS", 0.99 * spool.gain)
    assert found_in(fitted, held_out) is not None
    monkeypatch.setattr(module, "FOLLOWS", 0.9999)
    assert found_in(fitted, held_out) is None


def without_pressures(made: Record) -> Record:
    columns = {name: made.column(name) for name in ("command_v", "position_m")}
    return make_record({"time_s": made.time_s, **columns})


def jumping(time_s: FloatArray, seed: int) -> FloatArray:
    """Another value in each half of a second, which no neighbour tells."""
    rng = np.random.default_rng(seed)
    return np.asarray(rng.standard_normal(64)[(time_s / 0.5).astype(np.int64)])


@pytest.mark.slow
def test_what_is_not_smooth_or_not_in_both_records_does_not_wander() -> None:
    sound = record(OFF, 2, seconds=SECONDS)
    assert found_in(record(OFF, 1, seconds=SECONDS), sound) is None
    assert found_in(wandering("sensor", 1), sound) is None
    assert found_in(sound, wandering("sensor", 1)) is None
    assert found_in(wandering("force", 1, jumping), wandering("force", 2, jumping)) is None
    # Friction that the simulator lacks follows the motion.
    rubbing = {**OFF, "effects.coulomb_friction.force_n": 400.0}
    assert found_in(*(record(rubbing, seed, seconds=SECONDS) for seed in (1, 2))) is None


OPTIONS = DiagnosisOptions(exclude=all_but("valve_dead_band", "transport_delay"))


@pytest.mark.slow
def test_a_sensor_that_wanders_is_a_cause_outside_of_the_catalogue() -> None:
    """The effects that are tried stand for all: none of them is in the records."""
    fitted, held_out = wandering("sensor", 1), wandering("sensor", 2)
    found = diagnose([fitted], RIG, validate=[held_out], options=OPTIONS)
    assert found.verdict == "outside_catalogue"
    assert "lacks a term: error of the position sensor over the time. It wanders" in found.sentence
    assert any("changes with the time alone" in reason for reason in found.reasons)
    assert found.wandering is not None
    assert found.missing_laws == ()
    assert found.where.subsystem["sensor"] == pytest.approx(1.0)
    facts = {fact.name: fact for fact in diagnosis_facts(found).facts}
    assert "wanders over" in facts["Which"].note


@pytest.mark.slow
def test_beside_an_effect_the_part_of_the_machine_is_shared(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    dead = {"effects.valve_dead_band.overlap": 0.03}
    fitted, held_out = (wandering("sensor", seed, values=dead) for seed in (1, 2))
    found = diagnose([fitted], RIG, validate=[held_out], options=OPTIONS)
    assert found.verdict == "outside_catalogue"
    assert [effect.id for effect in found.effects] == ["valve_dead_band"]
    assert found.wandering is not None
    shares = found.where.subsystem
    assert shares["sensor"] + shares["valve"] == pytest.approx(1.0)
    assert min(shares["sensor"], shares["valve"]) > 0.01
    # Values that drift are told first: a flow that grows moves the rod as a sensor that wanders.
    drift = Drift(1.0, (("load.mass_kg", 0.5),))
    monkeypatch.setattr(diagnosis, "values_that_drift", lambda *_: drift)
    found = diagnose([fitted], RIG, validate=[held_out], options=OPTIONS)
    assert found.wandering is None
    assert found.sentence.endswith(drift.sentence)
