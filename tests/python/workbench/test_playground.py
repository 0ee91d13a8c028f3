# SPDX-License-Identifier: MIT
"""The playground: rigs to choose, ranges of sliders, and a run beside another."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from app_sessions import BENCH

from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.rigs import Rig, RigError
from ehsid.harness.signals.simulation import simulate
from ehsid.workbench.playground import (
    DT_S,
    SUBSYSTEMS,
    beside,
    effects_of,
    excitation,
    slider_values,
    typical_sizes,
)
from ehsid.workbench.playground_rigs import TITLES, chosen_rig, rig_titles
from ehsid.workbench.workbench import Workbench

ALL = [(one.id, p) for one in effects().values() for p in one.parameters]


@pytest.fixture(scope="module")
def servo(tmp_path_factory: pytest.TempPathFactory) -> Rig:
    return chosen_rig(Workbench(tmp_path_factory.mktemp("empty")), TITLES["ehs"])


def test_examples_and_rigs_of_machines_can_be_chosen(tmp_path: Path) -> None:
    workbench = Workbench(tmp_path)
    session = workbench.begun("press")
    assert rig_titles(workbench) == list(TITLES.values())
    session.rig_file.write_bytes(BENCH.read_bytes())
    assert rig_titles(workbench)[-1] == "rig of press"
    assert chosen_rig(workbench, "rig of press").name == "bench"
    assert [chosen_rig(workbench, title).plant for title in TITLES.values()] == list(TITLES)
    session.rig_file.write_text("plant = 'none'")
    with pytest.raises(RigError):
        chosen_rig(workbench, "rig of press")


@pytest.mark.parametrize("plant", list(TITLES))
def test_every_effect_of_a_plant_stands_at_one_subsystem(plant: str) -> None:
    found = effects_of(plant)
    assert set(found) <= set(SUBSYSTEMS)
    ids = [effect.id for group in found.values() for effect in group]
    assert len(ids) == len(set(ids))
    assert ("valve_dead_band" in ids) == (plant == "ehs")
    assert "coulomb_friction" in ids
    assert sum(effects_of("ehs")[name] != [] for name in SUBSYSTEMS) == len(SUBSYSTEMS)
    assert sum(map(len, effects_of("ehs").values())) == len(effects())


@pytest.mark.parametrize(("effect", "parameter"), ALL, ids=[f"{e}.{p.name}" for e, p in ALL])
def test_a_slider_spans_the_range_and_stops_at_the_typical_size(effect, parameter) -> None:
    del effect
    stops = slider_values(parameter)
    assert np.all(np.diff(stops) > 0.0)
    assert stops[0] == parameter.minimum
    assert stops[-1] == pytest.approx(parameter.maximum)
    assert parameter.typical in stops
    assert 40 <= stops.size <= 44


def test_an_effect_begins_at_the_size_of_the_rig_or_at_the_typical_one(servo: Rig) -> None:
    friction, lag = effects()["coulomb_friction"], effects()["valve_lag"]
    assert typical_sizes(friction, servo) == {"effects.coulomb_friction.force_n": 400.0}
    other = servo.with_values({"effects.valve_lag.bandwidth_hz": 33.0})
    assert typical_sizes(lag, other)["effects.valve_lag.bandwidth_hz"] == 33.0


def test_with_an_effect_the_same_command_moves_the_rod_otherwise(servo: Rig) -> None:
    command = excitation(servo, "triangle", 0.3)
    without = simulate(servo, command, dt_s=DT_S).record
    same = beside(servo, {}, without)
    assert same.having is without
    runs = beside(servo, {"effects.valve_dead_band.overlap": 0.03}, without)
    np.testing.assert_array_equal(runs.having.column("command_v"), command)
    moved = runs.having.column("position_m") - without.column("position_m")
    assert np.abs(moved).max() > 1e-3
    assert runs.seconds > 0.0


def test_sizes_that_contradict_each_other_are_refused(servo: Rig) -> None:
    without = simulate(servo, excitation(servo, "steps", 0.1), dt_s=DT_S).record
    sizes = typical_sizes(effects()["stribeck_friction"], servo)
    with pytest.raises(RigError):
        beside(servo, sizes | {"effects.stribeck_friction.static_n": 1.0}, without)


def test_the_command_of_a_drive_without_a_rated_one_is_bounded(tmp_path: Path) -> None:
    axis = chosen_rig(Workbench(tmp_path), TITLES["axis"])
    assert 1.0 < np.abs(excitation(axis, "multisine", 0.3)).max() <= 3.0 + 1e-9
