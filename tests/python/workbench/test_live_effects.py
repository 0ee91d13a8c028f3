# SPDX-License-Identifier: MIT
"""Effects of the simulated machine that are moved during a run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ehsid.harness.catalogue.parameters import plant_parameters
from ehsid.harness.rigs.new import published_rig
from ehsid.harness.signals.simulation import parse_settings
from ehsid.workbench.live.effects import effect_text, machine_words, moved, sizes_of, stops

RIG = published_rig()
OVERLAP, LAG = "effects.valve_dead_band.overlap", "effects.valve_lag.bandwidth_hz"
LEAK = "effects.internal_leakage.coefficient_m3_s_pa"


def test_only_what_differs_from_the_rig_is_a_value_of_the_machine() -> None:
    assert sizes_of({}, RIG) == {}
    assert sizes_of({OVERLAP: 0.0}, RIG) == {}
    assert sizes_of({OVERLAP: 0.05, LEAK: 0.0}, RIG) == {OVERLAP: 0.05}
    worn = replace(RIG, values={**RIG.values, OVERLAP: 0.05})
    assert sizes_of({OVERLAP: 0.05}, worn) == {}
    assert sizes_of({OVERLAP: 0.0}, worn) == {OVERLAP: 0.0}


def test_an_effect_with_several_sizes_takes_the_others_of_the_rig_or_typical_ones() -> None:
    damping = "effects.valve_lag.damping"
    assert sizes_of({LAG: 20.0}, RIG) == {LAG: 20.0, damping: RIG.values[damping]}
    without = {name: value for name, value in RIG.values.items() if name not in (LAG, damping)}
    typical = plant_parameters()[damping].typical
    assert typical != RIG.values[damping]
    bare = replace(RIG, values=without)
    assert sizes_of({LAG: 20.0}, bare) == {LAG: 20.0, damping: typical}


@pytest.mark.parametrize("key", moved("ehs"))
@pytest.mark.parametrize("share", [0.0, 0.3])
def test_a_slider_has_the_size_of_the_rig_and_keeps_the_limits(key: str, share: float) -> None:
    parameter = moved("ehs")[key].parameters[0]
    own = share * parameter.typical
    sizes = stops(parameter, own)
    assert own in sizes
    assert np.all(np.diff(sizes) > 0.0)
    assert sizes[-1] <= parameter.maximum
    assert sizes[-1] >= parameter.typical
    assert min(sizes[sizes != own]) >= parameter.minimum


def test_values_come_back_from_their_text() -> None:
    values = sizes_of({OVERLAP: 0.0512345, LAG: 20.5, LEAK: 1.23456e-11}, RIG)
    assert parse_settings(effect_text(values).split()) == values


def test_a_machine_is_told_in_words_and_units() -> None:
    assert machine_words({}) == "as its rig file says"
    assert machine_words({LAG: 20.0}) == "valve lag: bandwidth 20\N{NO-BREAK SPACE}Hz"
