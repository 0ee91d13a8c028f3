# SPDX-License-Identifier: MIT
"""Values that change in the course of the records are seen, on records of which it is known."""

from __future__ import annotations

import math

import pytest
from gap_cases import OFF, RIG, all_but, over_the_stroke, record

from ehsid.harness.diagnosis.deciding import DRIFTS
from ehsid.harness.diagnosis.diagnosis import diagnose
from ehsid.harness.diagnosis.laws import drifting
from ehsid.harness.diagnosis.laws.drifting import Drift, explains_more, values_that_drift
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.diagnosis.search.candidates import (
    calibrate,
    linearised_start,
    refine,
    screen,
)
from ehsid.harness.records import Record
from ehsid.harness.rigs.rig import TableLaw

SECONDS = 6.0
RATE = "effects.flow_gain_drift.rate_1_s"


def recorded(seed: int, rate_1_s: float, overlap: float) -> Record:
    values = {**OFF, RATE: rate_1_s, "effects.valve_dead_band.overlap": overlap}
    return record(values, seed, seconds=SECONDS)


def case_of(*rates: float, overlap: float = 0.0) -> Case:
    return make_case(RIG, *([recorded(seed, rate, overlap)] for seed, rate in enumerate(rates, 1)))


def drift_of(*rates: float, overlap: float = 0.0) -> Drift | None:
    """Drift beside the rig without effects, or beside its dead band where it has one."""
    case = case_of(*rates, overlap=overlap)
    best = calibrate(case)
    if overlap > 0.0:
        short = screen(case, ("valve_dead_band",), [linearised_start(case, (), best.x)])
        best = refine(case, short.effects, short.x)
    return values_that_drift(case, best)


@pytest.mark.slow
@pytest.mark.parametrize("overlap", [0.0, 0.03])
def test_a_flow_that_grows_is_seen_with_its_size(overlap: float) -> None:
    """From the start to the end of a record the flow grows by the rate times its length."""
    drift = drift_of(0.01, 0.01, overlap=overlap)
    assert drift is not None
    assert drift.gain >= DRIFTS
    changes = dict(drift.changes)
    name, found = next(iter(changes.items()))
    assert name == "valve.rated_flow_m3_s"
    # The prior pulls towards none, and a line of the logarithm is not one of the value.
    assert math.log1p(found) == pytest.approx(math.log1p(0.01 * SECONDS), rel=0.15)
    assert "as if rated flow of the valve rose by" in drift.sentence


def test_what_changes_is_told_in_words() -> None:
    names = ("effects.internal_leakage.coefficient_m3_s_pa", "effects.valve_lag.bandwidth_hz")
    told = Drift(1.0, tuple((name, -0.25) for name in names)).sentence
    assert "as if internal leakage fell by 25 %, or valve lag (bandwidth) fell by 25 %." in told


@pytest.mark.parametrize(
    ("name", "may"),
    [
        ("load.viscous_friction_n_s_m", True),
        ("effects.internal_leakage.coefficient_m3_s_pa", True),
        ("effects.supply_droop.source_resistance_pa_s_m3", False),  # it bends over the flow
        ("cylinder.bore_m", False),
        ("nuisance.spool_bandwidth_hz", False),
    ],
)
def test_what_may_change_within_minutes(name: str, may: bool) -> None:
    assert drifting._may_change(name) == may


@pytest.mark.slow
def test_what_every_servo_does_is_no_drift(monkeypatch: pytest.MonkeyPatch) -> None:
    """A value that may change by as much, as the viscous friction may, is no evidence."""
    case = case_of(0.01, 0.01)
    best = calibrate(case)
    grown = math.log1p(0.01 * SECONDS)
    monkeypatch.setattr(drifting, "ORDINARY", {"valve.rated_flow_m3_s": 0.75 * grown})
    assert values_that_drift(case, best) is None
    # Half as much is not enough: what is beyond it is evidence, and is told with its whole size.
    monkeypatch.setattr(drifting, "ORDINARY", {"valve.rated_flow_m3_s": 0.25 * grown})
    drift = values_that_drift(case, best)
    assert drift is not None
    assert math.log1p(drift.changes[0][1]) == pytest.approx(grown, rel=0.15)


@pytest.mark.slow
def test_what_the_other_record_contradicts_and_what_is_not_there_is_no_drift() -> None:
    assert drift_of(0.0, 0.0) is None
    assert drift_of(0.0, 0.0, overlap=0.03) is None
    assert drift_of(0.01, -0.01) is None


# A load that comes after half of the record.
LATE = TableLaw("force", "time_s", (0.0, 3.0, 3.2, SECONDS), (0.0, 0.0, 1500.0, 1500.0))


@pytest.mark.slow
def test_a_drift_makes_laws_over_the_time_needless_where_none_explains_more() -> None:
    growing = case_of(0.01, 0.01)
    best = calibrate(growing)
    drift = values_that_drift(growing, best)
    assert drift is not None
    assert explains_more(growing, best, drift)
    late = make_case(RIG, *([over_the_stroke({"late": LATE}, seed)] for seed in (1, 2)))
    best = calibrate(late)
    drift = values_that_drift(late, best) or Drift(DRIFTS, ())
    assert not explains_more(late, best, drift)


@pytest.mark.slow
def test_a_drift_beside_a_named_effect_is_a_cause_outside_of_the_catalogue() -> None:
    """Without the drift the dead band explains all but what its flow gains in 6 s."""
    options = DiagnosisOptions(exclude=all_but("valve_dead_band", "transport_delay"))
    verdicts, named = {}, {}
    for rate in (0.0, 0.01):
        fitted, held_out = (recorded(seed, rate, 0.03) for seed in (1, 2))
        found = diagnose([fitted], RIG, validate=[held_out], options=options)
        verdicts[rate] = found.verdict
        named[rate] = [effect.id for effect in found.effects]
        assert ("in the course of the records" in found.sentence) == (rate > 0.0), found.sentence
        assert found.missing_laws == ()
    assert verdicts == {0.0: "effects", 0.01: "outside_catalogue"}
    assert set(map(tuple, named.values())) == {("valve_dead_band",)}
