# SPDX-License-Identifier: MIT
"""The whole diagnosis, on short records of the simulator."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast, get_args

import numpy as np
import pytest
from made_candidates import CASE, FLOOR, candidate
from made_diagnoses import FRICTION, bench, measured_record

from ehsid.harness.base.parallel import workers
from ehsid.harness.diagnosis import Diagnosis, diagnose
from ehsid.harness.diagnosis import diagnosis as diagnosis_module
from ehsid.harness.diagnosis.deciding import FIT_TOGETHER, WORSE_HELD_OUT
from ehsid.harness.diagnosis.result import Interim, Stage
from ehsid.harness.diagnosis.schema import SUBSYSTEMS
from ehsid.harness.records import make_record
from ehsid.harness.rigs import Rig

MadeOnce = Callable[[str, Callable[[], Any]], Any]


def diagnosed_with_friction() -> tuple[Diagnosis, list[Interim]]:
    """The diagnosis of a rig with other values and Coulomb friction of 412 N: made_diagnoses."""
    progress_shares: list[float] = []
    stages: list[Interim] = []
    diagnosis = diagnose(
        [measured_record("fit", 1, seconds=4.0, dt_s=2e-3)],
        bench(),
        validate=[measured_record("judge", 2, seconds=4.0, dt_s=2e-3)],
        progress=progress_shares.append,
        watch=stages.append,
    )
    assert progress_shares == sorted(progress_shares)
    assert progress_shares[-1] == 1.0
    return diagnosis, stages


@pytest.fixture(scope="module")
def with_friction_and_stages(made_once: MadeOnce) -> tuple[Diagnosis, list[Interim]]:
    made: tuple[Diagnosis, list[Interim]] = made_once("friction", diagnosed_with_friction)
    return made


@pytest.fixture(scope="module")
def with_friction(with_friction_and_stages: tuple[Diagnosis, list[Interim]]) -> Diagnosis:
    return with_friction_and_stages[0]


@pytest.mark.slow
def test_each_stage_tells_what_is_known(
    with_friction_and_stages: tuple[Diagnosis, list[Interim]],
) -> None:
    diagnosis, stages = with_friction_and_stages
    names = list(dict.fromkeys(one.stage for one in stages))
    assert names == [one for one in get_args(Stage) if one in names]
    assert {"values", "alone", "at length", "deciding", "where"} <= set(names)
    how_far = diagnosis.how_far
    assert how_far is not None
    first, *_, last = stages
    assert first.how_far.augmented == first.how_far.calibrated == how_far.nominal
    assert first.sets == () == first.ahead
    assert last.ahead == ("coulomb_friction",)
    assert last.how_far.augmented == pytest.approx(how_far.augmented)
    assert dict(last.sets)["coulomb_friction",] == pytest.approx(how_far.augmented)
    for stage in stages:
        assert [run.record for run in stage.runs] == ["judge"]
        assert stage.runs[0].augmented.keys() == diagnosis.runs[0].augmented.keys()
        left = [gap for _, gap in stage.sets]
        assert left == sorted(left)


@pytest.mark.slow
def test_friction_is_identified_with_its_size(with_friction: Diagnosis) -> None:
    diagnosis = with_friction
    assert diagnosis.verdict == "effects"
    assert [effect.id for effect in diagnosis.effects] == ["coulomb_friction"]
    force = diagnosis.effects[0].parameters["force_n"]
    true_force = FRICTION["effects.coulomb_friction.force_n"]
    # The same simulator made the record: only noise remains.
    assert force.value == pytest.approx(true_force, rel=0.02)
    assert diagnosis.ambiguity_set[0] == ("coulomb_friction",)
    assert diagnosis.effects[0].share_of_shrinkage == pytest.approx(1.0)
    # All others have a size from which on they would have been named, beside the friction.
    seen = {one.id: one for one in diagnosis.could_be_seen}
    assert len(seen) > 15
    assert not {"coulomb_friction", "stribeck_friction", "sensor_quantisation"} & set(seen)
    assert 1e-3 <= seen["transport_delay"].size < 0.02


@pytest.mark.slow
def test_results_of_a_diagnosis_agree(with_friction: Diagnosis) -> None:
    diagnosis = with_friction
    reduction = diagnosis.how_far
    assert reduction is not None
    assert reduction.augmented < reduction.calibrated < reduction.nominal
    assert reduction.augmented == pytest.approx(reduction.noise_floor[1], rel=0.3)
    assert reduction.of_explainable is not None
    assert (
        reduction.of_explainable.low
        <= reduction.of_explainable.value
        <= reduction.of_explainable.high
    )
    assert set(diagnosis.where.subsystem) == set(SUBSYSTEMS)
    assert sum(diagnosis.where.subsystem.values()) == pytest.approx(1.0)
    assert diagnosis.where.subsystem["mechanics"] > 0.9
    # The rig file has 1.1e9 Pa. Slow motion shows little of the mass, but the oil spring shows
    # the bulk modulus.
    bulk = diagnosis.calibration["fluid.bulk_modulus_pa"]
    assert bulk.found.low <= 0.96e9 <= bulk.found.high
    assert bulk.found.value == pytest.approx(0.96e9, rel=0.05)
    assert diagnosis.augmented_rig.values["effects.coulomb_friction.force_n"] > 0.0
    assert diagnosis.records == {"fit": "fit", "judge": "held out"}
    assert diagnosis.settings["window_s"] == 0.5
    scores = [candidate.score for candidate in diagnosis.candidates]
    assert scores == sorted(scores)
    # Every set that was weighed has a probability, and together with what is outside they are one.
    weighed = [each for each in diagnosis.candidates if each.probability is not None]
    assert {(), ("coulomb_friction",)} <= {each.effects for each in weighed}
    assert diagnosis.outside_probability is not None
    probabilities = [each.probability or 0.0 for each in weighed]
    total = math.fsum([*probabilities, diagnosis.outside_probability])
    assert total == pytest.approx(1.0, abs=1e-9)
    named = max(weighed, key=lambda each: each.probability or 0.0)
    assert named.effects == ("coulomb_friction",)
    assert all(each.left is not None and each.left >= 0.0 for each in weighed)


@pytest.mark.thorough
def test_workers_change_nothing(with_friction: Diagnosis) -> None:
    with workers(1):
        again = diagnose(
            [measured_record("fit", 1, seconds=4.0, dt_s=2e-3)],
            bench(),
            validate=[measured_record("judge", 2, seconds=4.0, dt_s=2e-3)],
        )
    first = with_friction
    assert again.effects == first.effects
    assert again.candidates == first.candidates
    assert again.calibration == first.calibration


def test_a_record_at_rest_gives_insufficient_data() -> None:
    time = np.arange(4000) * 1e-3
    rng = np.random.default_rng(3)
    still = make_record(
        {
            "time_s": time,
            "command_v": np.zeros(time.size),
            "position_m": 0.15 + 1e-6 * rng.normal(size=time.size),
        },
        name="still",
    )
    diagnosis = diagnose([still], bench())
    assert diagnosis.verdict == "insufficient_data"
    assert diagnosis.how_far is None
    assert diagnosis.outside_probability is None
    assert diagnosis.effects == ()
    assert "still" in {remark.record for remark in diagnosis.remarks if remark.serious}


def test_no_record_is_an_error() -> None:
    with pytest.raises(ValueError, match="needs a record"):
        diagnose([], Rig("bench", "ehs", bench().values))


@pytest.mark.parametrize(
    ("worse", "outside", "engine", "shown"),
    [
        (0.9, 1.0, None, None),
        (1.1, 1.1 * FIT_TOGETHER, None, "cause"),
        (1.1, 1.1 * FIT_TOGETHER, "simulink", "cause"),
        (1.1, 0.9 * FIT_TOGETHER, None, "values"),
        (1.1, 0.9 * FIT_TOGETHER, "simulink", None),
    ],
)
def test_what_only_the_held_out_records_show(
    worse: float, outside: float, engine: str | None, shown: str | None
) -> None:
    """Nothing is left of the fitted records, and of the held-out ones this share of the limit.

    Errors of the size r leave ln(1 + (r / floor)^2) / 2.
    """
    held_out = candidate(rms=FLOOR * math.sqrt(math.expm1(2.0 * worse * WORSE_HELD_OUT)))
    best = replace(held_out, fit_powers=candidate(rms=0.0).powers)
    posterior = SimpleNamespace(outside=outside)
    case = copy(CASE)
    case.engine = cast(Any, engine)
    evaluation = SimpleNamespace(
        case=case, selection=SimpleNamespace(best=best, posterior=posterior)
    )
    assert diagnosis_module._shown_by_held_out(cast(Any, evaluation)) == shown


@pytest.mark.slow
def test_a_map_that_fails_does_not_lose_the_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    """As by a matrix that rounding made indefinite."""

    def fails(*_: object) -> None:
        raise np.linalg.LinAlgError("Matrix is not positive definite")

    monkeypatch.setattr(diagnosis_module, "equation_shares", fails)
    found = diagnose([measured_record("fit", 1, seconds=3.0, dt_s=2e-3)], bench())
    assert found.verdict == "effects"
    assert [effect.id for effect in found.effects] == ["coulomb_friction"]
    assert found.where.subsystem == {}
    assert found.where.notes == (diagnosis_module.NOT_TOLD,)
