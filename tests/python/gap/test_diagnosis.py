# SPDX-License-Identifier: MIT
"""The diagnosis as one call, on short records of the simulator."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from made_diagnoses import FRICTION, bench, measured_record

from ehsid.harness.gap import Diagnosis, diagnose
from ehsid.harness.gap.schema import SUBSYSTEMS
from ehsid.harness.parallel import workers
from ehsid.harness.records import make_record
from ehsid.harness.rigs import Rig


@cache
def with_friction() -> Diagnosis:
    """Other values and Coulomb friction of 412 N, see made_diagnoses."""
    seen: list[float] = []
    found = diagnose(
        [measured_record("fit", 1, seconds=6.0, dt_s=1e-3)],
        bench(),
        validate=[measured_record("judge", 2, seconds=6.0, dt_s=1e-3)],
        progress=seen.append,
    )
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    return found


@pytest.mark.slow
def test_friction_is_named_with_its_size() -> None:
    found = with_friction()
    assert found.verdict == "effects"
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    force = found.effects[0].parameters["force_n"]
    true = FRICTION["effects.coulomb_friction.force_n"]
    # The same simulator made the record: what is left is noise.
    assert force.value == pytest.approx(true, rel=0.02)
    assert found.ambiguity_set[0] == ("coulomb_friction",)
    assert found.effects[0].share_of_shrinkage == pytest.approx(1.0)


@pytest.mark.slow
def test_findings_hang_together() -> None:
    found = with_friction()
    far = found.how_far
    assert far is not None
    assert far.augmented < far.calibrated < far.nominal
    assert far.augmented == pytest.approx(far.noise_floor[1], rel=0.3)
    assert far.of_explainable is not None
    assert far.of_explainable.low <= far.of_explainable.value <= far.of_explainable.high
    assert set(found.where.subsystem) == set(SUBSYSTEMS)
    assert sum(found.where.subsystem.values()) == pytest.approx(1.0)
    assert found.where.subsystem["mechanics"] > 0.9
    # Told 1.1e9; slow motion says little of the mass, but the oil spring is felt.
    bulk = found.calibration["fluid.bulk_modulus_pa"]
    assert bulk.found.low <= 0.96e9 <= bulk.found.high
    assert bulk.found.value == pytest.approx(0.96e9, rel=0.05)
    assert found.augmented_rig.values["effects.coulomb_friction.force_n"] > 0.0
    assert found.records == {"fit": "fit", "judge": "held out"}
    assert found.settings["window_s"] == 0.5
    scores = [one.score for one in found.candidates]
    assert scores == sorted(scores)


@pytest.mark.slow
def test_workers_change_nothing() -> None:
    with workers(1):
        again = diagnose(
            [measured_record("fit", 1, seconds=6.0, dt_s=1e-3)],
            bench(),
            validate=[measured_record("judge", 2, seconds=6.0, dt_s=1e-3)],
        )
    first = with_friction()
    assert again.effects == first.effects
    assert again.candidates == first.candidates
    assert again.calibration == first.calibration


def test_a_record_at_rest_carries_nothing() -> None:
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
    found = diagnose([still], bench())
    assert found.verdict == "insufficient_data"
    assert found.how_far is None
    assert found.effects == ()
    assert "still" in {remark.record for remark in found.remarks if remark.serious}


def test_no_record_is_an_error() -> None:
    with pytest.raises(ValueError, match="needs a record"):
        diagnose([], Rig("bench", "ehs", bench().values))
