# SPDX-License-Identifier: MIT
"""The diagnosis of a user's simulator: as an FMU with a rig file, and as a class of Python."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
import numpy.typing as npt
import pytest
from user_simulators import FOLDER, needs_linux64

import ehsid
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.diagnosis import diagnose
from ehsid.harness.diagnosis.decision.inside import (
    Inside,
    evidence_of,
    moved_furthest,
    outside_shares,
    stands_for,
    uncarried_odds,
)
from ehsid.harness.diagnosis.model.scale import effect_starts, machine_scale, scan_starts
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.diagnosis.schema import Estimate
from ehsid.harness.records import read_record
from ehsid.harness.rigs import read_rig

DT = 2e-3


class Servo:
    """Speed follows the command with a lag."""

    inputs = ("command_v",)
    outputs = ("position_m",)
    parameters = MappingProxyType({"speed_per_volt": 0.03, "lag_s": 0.02})

    def reset(self, parameters=None, position_m=0.1):
        self.told = {**self.parameters, **(parameters or {})}
        self.state = [position_m, 0.0]
        return (position_m,)

    def step(self, dt, command_v):
        share = 1.0 - np.exp(-dt / self.told["lag_s"])
        position, speed = self.state
        speed += share * (self.told["speed_per_volt"] * command_v - speed)
        self.state = [position + dt * speed, speed]
        return (self.state[0],)


def simulate(command_v, dt, parameters=None, position_m=0.1, ports=None):
    servo = Servo()
    position = [servo.reset(parameters, position_m)[0]]
    position += [servo.step(dt, one)[0] for one in command_v[:-1]]
    return {"position_m": np.array(position)}


simulate.parameters = Servo.parameters


def record(delay: int, seed: int) -> dict[str, npt.NDArray[np.float64]]:
    """10 s of a machine that is faster by 5 % and acts `delay` samples later."""
    rng = np.random.default_rng(seed)
    time = np.arange(5000) * DT
    phases = rng.uniform(0.0, 2.0 * np.pi, 8)
    hz = np.array([0.3, 0.7, 1.3, 2.9, 4.7, 8.3, 13.1, 19.0])
    u = np.sum(np.cos(2 * np.pi * hz[:, None] * time + phases[:, None]), axis=0)
    servo = Servo()
    servo.reset({"speed_per_volt": 0.0315, "lag_s": 0.021})
    sent = np.concatenate([np.zeros(delay), u])[: u.size]
    position = [0.1, *(servo.step(DT, float(one))[0] for one in sent[:-1])]
    noisy = np.array(position) + rng.normal(0.0, 1e-5, u.size)
    return {"time_s": time, "command_v": u, "position_m": noisy}


@pytest.mark.slow
@pytest.mark.parametrize("simulator", [Servo, Servo(), simulate], ids=["class", "object", "record"])
def test_what_a_program_passes(simulator) -> None:
    found = ehsid.diagnose(record(4, 1), simulator=simulator, progress=False, effort="list")
    assert found.verdict in ("effects", "ambiguous")
    assert "transport_delay" in found.result.ambiguity_set[0]
    (delay,) = (each for each in found.result.effects if each.id == "transport_delay")
    assert delay.sizes["delay_s"].value == pytest.approx(4 * DT, rel=0.15)
    reasons = {each.id: each.why for each in found.result.cannot_judge}
    assert reasons["coulomb_friction"] == "the simulator has no input for forces"


@pytest.mark.slow
def test_a_class_that_lacks_nothing() -> None:
    found = ehsid.diagnose(record(0, 3), simulator=Servo, progress=False, effort="list")
    assert found.verdict in ("no_gap", "parameters")


@pytest.mark.slow
@needs_linux64
def test_an_fmu_with_ports_lacks_friction() -> None:
    found = diagnose(
        [read_record(FOLDER / "coulomb.csv")],
        read_rig(FOLDER / "rig.toml"),
        options=DiagnosisOptions(effort="list"),
    )
    assert found.ambiguity_set[0] == ("coulomb_friction",)
    assert found.effects[0].sizes["force_n"].value == pytest.approx(800.0, rel=0.15)
    assert found.where.subsystem["mechanics"] > 0.9
    assert found.settings["windows"] == "caught and released"
    written = found.augmented_rig
    assert written.values["effects.coulomb_friction.force_n"] > 0.0
    assert written.simulator is not None


class Backwards(Servo):
    """Moves against its command."""

    parameters = MappingProxyType({"speed_per_volt": -0.03, "lag_s": 0.02})


def test_a_simulator_that_moves_against_the_machine_is_refused() -> None:
    found = ehsid.diagnose(record(0, 3), simulator=Backwards, progress=False)
    assert found.verdict == "insufficient_data"
    assert "the simulator the other way" in found.result.sentence


def test_what_a_value_stands_in_for() -> None:
    assert stands_for("simulator.parameters.viscous_friction") == "mechanics"
    assert stands_for("simulator.parameters.oil.bulkModulus") == "hydraulics"
    assert stands_for("simulator.parameters.valve.frequency") is None
    assert stands_for("load.mass_kg") is None


def test_a_value_that_moves_far_is_evidence_where_its_effects_cannot_be_tried() -> None:
    ports, portless = read_rig(FOLDER / "rig.toml"), read_rig(FOLDER / "rig_portless.toml")
    moved = {
        "simulator.parameters.mass": Estimate(4.0, 3.5, 4.5),
        "simulator.parameters.bulk_modulus": Estimate(-1.0, -1.5, -0.5),
    }
    first, second = moved_furthest(portless, moved)
    assert (first.value, first.subsystem) == ("mass", "mechanics")
    assert second.subsystem == "hydraulics"
    assert evidence_of([first]) == pytest.approx(0.5 * 4.0**2 - 0.5 * 2.0**2)
    assert evidence_of([second]) == 0.0
    assert moved_furthest(ports, moved) == []
    assert uncarried_odds(portless) > 3.0 * uncarried_odds(ports) > 0.0


def test_fits_start_at_sizes_of_either_sign() -> None:
    """Around a user's simulator; a size that cannot be negative keeps its starts."""
    rig = read_rig(FOLDER / "rig.toml")
    every = effects()["sensor_nonlinearity"].starts(machine_scale(rig))
    ours = [start for start in every if start["amplitude_m"] != 0.0]
    assert 0 < len(ours) < len(every)
    assert scan_starts("sensor_nonlinearity", rig) == []
    theirs = effect_starts("sensor_nonlinearity", rig)
    assert [(start["amplitude_m"], start["period_m"]) for start in theirs] == [
        (sign * start["amplitude_m"], start["period_m"]) for sign in (1.0, -1.0) for start in ours
    ]
    assert len(effect_starts("valve_null_bias", rig)) == 2
    for effect in ("coulomb_friction", "transport_delay"):
        starts = effect_starts(effect, rig)
        assert starts == effects()[effect].starts(machine_scale(rig))


def test_where_a_cause_lies_that_cannot_be_tried() -> None:
    """A play in the sensor looks like friction, a bias like a leak, where those cannot be tried."""
    ports, portless = read_rig(FOLDER / "rig.toml"), read_rig(FOLDER / "rig_portless.toml")
    play = {"sensor_backlash": 0.5}
    assert outside_shares(ports, [], play) == {"sensor": 1.0}
    shares = outside_shares(portless, [], play)
    assert shares["mechanics"] == pytest.approx(0.8)
    assert sum(shares.values()) == pytest.approx(1.0)
    bias = outside_shares(portless, [Inside("mechanics", "mass", 1.0)], {"valve_null_bias": 0.5})
    assert max(bias, key=bias.__getitem__) == "hydraulics"
    assert outside_shares(portless, [], {"transport_delay": 0.0}) == {}


def test_a_rig_or_a_simulator_is_needed() -> None:
    with pytest.raises(ValueError, match="rig is missing"):
        ehsid.diagnose(record(0, 3), progress=False)
    with pytest.raises(ValueError, match='plant = "simulator"'):
        ehsid.diagnose(
            record(0, 3),
            ehsid.Rig.new(
                bore="63 mm", rod="35 mm", stroke="300 mm", supply="120 bar", rated_flow="38 l/min"
            ),
            simulator=Servo,
            progress=False,
        )
