# SPDX-License-Identifier: MIT
"""What a simulator lacks moves the found values: intervals allow for it."""

from __future__ import annotations

from dataclasses import replace

import gap_cases as made
import numpy as np
import pytest

from ehsid.harness.diagnosis.decision.results import estimates
from ehsid.harness.diagnosis.model.case import make_case
from ehsid.harness.diagnosis.model.scale import machine_scale
from ehsid.harness.diagnosis.search import model_error as module
from ehsid.harness.diagnosis.search.candidates import calibrate
from ehsid.harness.diagnosis.search.model_error import (
    MODEL_ERROR,
    OF_VALUE,
    SEALS,
    VISCOUS,
    model_error,
    seal_friction,
)
from ehsid.harness.records import make_record
from ehsid.harness.rigs import Rig

# Friction of seals, N, as far as nobody calls it Coulomb friction.
SEALS_N = SEALS * machine_scale(made.RIG).force_n
LAG = {"effects.valve_lag.bandwidth_hz": 60.0, "effects.valve_lag.damping": 0.8}


@pytest.mark.slow
@pytest.mark.parametrize("names", [made.PRESSURES, ("position_m",)])
def test_an_interval_of_viscous_friction_allows_for_the_friction_of_seals(
    names: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Seals with half of what is usual at most: the fit takes it for viscous friction."""
    true = made.OFF[VISCOUS]
    case = made.case_of({**made.OFF, "effects.coulomb_friction.force_n": 0.5 * SEALS_N}, names)
    calibrated = calibrate(case)
    told = estimates(case, calibrated)[0][VISCOUS]
    assert true < told.value < true + 0.5 * seal_friction(case)
    assert told.low < true
    # Without seals it is too narrow.
    monkeypatch.setattr(module, "TAKEN", 0.0)
    assert estimates(case, calibrated)[0][VISCOUS].low > true


def test_viscous_friction_takes_what_least_squares_give_it() -> None:
    case = made.case_of(made.OFF)
    samples = round(module.SPEED_S / made.DT_S)
    speeds = np.concatenate(
        [
            (position[samples:] - position[:-samples]) / module.SPEED_S
            for position in (record.column("position_m") for record in case.records)
        ]
    )
    (slope,), *_ = np.linalg.lstsq(speeds[:, np.newaxis], SEALS_N * np.sign(speeds), rcond=None)
    assert seal_friction(case) == pytest.approx(slope, rel=1e-9)
    # A servo that moves at half the speed shows half as much of its viscous friction.
    slower = [
        make_record(
            {
                "time_s": record.time_s,
                **{name: record.column(name) for name in ("command_v", *made.PRESSURES[1:])},
                "position_m": 0.5 * record.column("position_m"),
            }
        )
        for record in case.records
    ]
    halved = replace(case, training=(slower[0],), held_out=(slower[1],))
    assert seal_friction(halved) == pytest.approx(2.0 * slope, rel=1e-9)


def test_a_fitted_law_of_friction_is_that_of_the_seals_too() -> None:
    case = made.case_of(made.OFF)
    assert model_error(case, (), VISCOUS, 1100.0) > 10.0 * MODEL_ERROR[True]
    for law in ("coulomb_friction", "stribeck_friction"):
        assert model_error(case, (law,), VISCOUS, 1100.0) == MODEL_ERROR[True]
    assert model_error(case, ("sensor_lag",), VISCOUS, 1100.0) > 10.0 * MODEL_ERROR[True]


def test_a_configured_valve_stands_for_more_than_its_lag() -> None:
    rig = Rig("lagging", "ehs", {**made.RIG.values, **LAG}, sensors=made.NOISE)
    records = [made.record(made.OFF, seed) for seed in (1, 2)]
    case = make_case(rig, records[:1], records[1:])
    for name, value in LAG.items():
        assert model_error(case, (), name, value) > 2.0 * MODEL_ERROR[True]
        # As a cause it is what was not configured: its size has an interval of its own.
        assert model_error(case, ("valve_lag",), name, value) == MODEL_ERROR[True]
    position_only = replace(case, outputs=("position_m",))
    for name, value in {**LAG, "fluid.bulk_modulus_pa": 1e9}.items():
        assert model_error(position_only, (), name, value) == OF_VALUE[name][False]
        assert model_error(case, (), name, value) == OF_VALUE[name][True]
    assert model_error(case, (), "load.mass_kg", 100.0) == MODEL_ERROR[True]
    assert model_error(position_only, (), "load.mass_kg", 100.0) == MODEL_ERROR[False]
