# SPDX-License-Identifier: MIT
"""The rig file that is made of what a simulator says of itself."""

from __future__ import annotations

from pathlib import Path

import pytest
from user_simulators import FOLDER, fmu_with, needs_linux64

from ehsid.harness.rigs import Rig, RigError, parse_rig
from ehsid.harness.rigs.quantities import read_quantity
from ehsid.harness.rigs.simulator_guess import Named, guess_signals, uncertain
from ehsid.harness.rigs.simulator_new import NewRig, new_simulator_rig
from ehsid.harness.rigs.simulator_section import Signal, SimulatorSection

pytestmark = needs_linux64


def made(simulator: Path | str, folder: Path = FOLDER) -> NewRig:
    return new_simulator_rig(str(simulator), folder, "mine", {})


def rig_of(simulator: Path | str, folder: Path = FOLDER) -> tuple[Rig, SimulatorSection]:
    new = made(simulator, folder)
    assert not new.missing
    rig = parse_rig(new.text, folder=folder)
    assert rig.simulator is not None
    return rig, rig.simulator


@pytest.mark.parametrize("name", ["bench.fmu", "bench3.fmu"])
def test_an_fmu_with_ports(name: str) -> None:
    rig, section = rig_of(FOLDER / name)
    assert section.fmu == name
    assert section.inputs == {"command_v": Signal("u")}
    assert {key: one.name for key, one in section.outputs.items()} == {
        "position_m": "y",
        "velocity_m_s": "v",
        "pressure_a_pa": "p_a",
        "pressure_b_pa": "p_b",
        "supply_flow_m3_s": "q_supply",
    }
    assert {key: one.name for key, one in section.ports.items()} == {
        "force_n": "force",
        "supply_pressure_pa": "p_supply",
        "flow_a_m3_s": "q_a",
        "flow_b_m3_s": "q_b",
    }
    assert section.start == {"position_m": Signal("position_start")}
    # The supply is an input, so that its nominal value is none that could be wrong.
    assert set(section.parameters) == {
        *("mass", "viscous_friction", "bulk_modulus", "rated_flow"),
        *("valve.frequency", "valve.damping"),
    }
    assert section.parameters["mass"].value == 150.0
    assert rig.values["supply.pressure_pa"] == 1.4e7
    assert (
        "# [simulator.parameters.supply_nominal]  # value = 14000000.0" in made(FOLDER / name).text
    )


def test_an_fmu_without_ports() -> None:
    rig, section = rig_of(FOLDER / "bench_portless.fmu")
    assert section.outputs == {"position_m": Signal("y")}
    assert not section.ports
    assert section.parameters["supply_pressure"].sigma == 0.03
    assert rig.values["supply.pressure_pa"] == 1.4e7


def test_a_python_class_and_a_function() -> None:
    _, section = rig_of(f"{FOLDER / 'bench_plant.py'}:Bench")
    assert section.python == "bench_plant.py:Bench"
    assert section.ports["flow_b_m3_s"] == Signal("flow_b_m3_s")
    assert section.start == {"position_m": Signal("position_m")}
    assert section.parameters["valve_frequency"].value == 80.0
    _, section = rig_of(f"{FOLDER / 'bench_plant.py'}:simulate")
    assert section.outputs == {"position_m": Signal("position_m")}
    assert section.start == {"position_m": Signal("position_m")}
    assert not section.parameters


def test_paths_are_relative_to_the_new_file(tmp_path: Path) -> None:
    _, section = rig_of(FOLDER / "bench.fmu", tmp_path)
    assert section.fmu is not None
    assert section.fmu.startswith("../")
    assert section.path == FOLDER / "bench.fmu"


def test_what_is_given_of_the_machine_stands_in_the_file() -> None:
    known = {"stroke": read_quantity("35 cm", "--stroke", "mm", "m")}
    new = new_simulator_rig(str(FOLDER / "bench.fmu"), FOLDER, "mine", known)
    rig = parse_rig(new.text, folder=FOLDER)
    assert rig.values["cylinder.stroke_m"] == 0.35
    assert "# given as 35 cm" in new.text
    assert "# tank_pressure_pa = 2e5  # fill in: absolute, for leaks to the tank" in new.text


VARIABLES = """
<ScalarVariable name="In1" valueReference="1" causality="input"><Real start="0" unit="mA"/>
</ScalarVariable>
<ScalarVariable name="Out1" valueReference="2" causality="output" description="Stroke of the rod">
<Real unit="mm"/></ScalarVariable>
<ScalarVariable name="Out2" valueReference="3" causality="output" description="cap side">
<Real unit="bar"/></ScalarVariable>
<ScalarVariable name="Out3" valueReference="4" causality="output" description="rod side">
<Real unit="bar"/></ScalarVariable>
<ScalarVariable name="setpoint_position" valueReference="5" causality="output"><Real unit="mm"/>
</ScalarVariable>
<ScalarVariable name="M[1]" valueReference="6" causality="parameter" variability="fixed"
description="moved mass"><Real start="80" unit="kg"/></ScalarVariable>
<ScalarVariable name="offset" valueReference="7" causality="parameter" variability="fixed">
<Real start="0"/></ScalarVariable>
<ScalarVariable name="friction" valueReference="8" causality="parameter" variability="fixed">
<Real start="0"/></ScalarVariable>
<ScalarVariable name="g" valueReference="9" causality="parameter" variability="constant">
<Real start="9.81"/></ScalarVariable>
"""


def fmu_of(folder: Path, variables: str) -> Path:
    return fmu_with(
        folder / "model.fmu",
        '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g">'
        '<CoSimulation modelIdentifier="bench" needsExecutionTool="true"/>'
        f"<ModelVariables>{variables}</ModelVariables></fmiModelDescription>",
    )


def test_units_and_descriptions_tell_where_names_do_not(tmp_path: Path) -> None:
    fmu = fmu_of(tmp_path, VARIABLES)
    _, section = rig_of(fmu, tmp_path)
    assert section.inputs["command_v"] == Signal("In1")
    assert section.outputs == {
        "position_m": Signal("Out1", 1000.0),
        "pressure_a_pa": Signal("Out2", 1e-5),
        "pressure_b_pa": Signal("Out3", 1e-5),
    }
    assert list(section.parameters) == ["M[1]"]
    text = made(fmu, tmp_path).text
    assert "moved mass in kg" in text
    # A sigma of the logarithm says nothing of a value of zero.
    assert "# [simulator.parameters.friction]  # value = 0.0" in text
    assert "# [simulator.parameters.offset]  # value = 0.0" in text
    assert "parameters.g]" not in text
    assert "# the FMU needs the tool that it was exported from" in text


def test_what_cannot_be_told_is_left_to_the_user_with_the_names(tmp_path: Path) -> None:
    two = "".join(
        f'<ScalarVariable name="{name}" valueReference="{i}" causality="{of}"><Real/>'
        "</ScalarVariable>"
        for i, (name, of) in enumerate(
            [("In1", "input"), ("In2", "input"), ("Out1", "output"), ("Out2", "output")]
        )
    )
    new = made(fmu_of(tmp_path, two), tmp_path)
    assert '# command_v = ""  # fill in: it may be In1, In2' in new.text
    assert '# position_m = ""  # fill in: it may be Out1, Out2' in new.text
    assert new.missing == (
        "'simulator.inputs.command_v' is missing: expected the simulator's name of the command of "
        "the valve",
        "'simulator.outputs.position_m' is missing: expected the simulator's name of the position "
        "of the rod",
    )


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("valve_cmd", "Fext"), {"command_v": "valve_cmd", "force_n": "Fext"}),
        (("loadForce", "ValveVoltage"), {"command_v": "ValveVoltage", "force_n": "loadForce"}),
        (("u", "ps"), {"command_v": "u", "supply_pressure_pa": "ps"}),
        (("command", "pSupply"), {"command_v": "command", "supply_pressure_pa": "pSupply"}),
        (("u1", "u2"), {"command_v": None}),
        (("Stellsignal", "Kraft"), {"command_v": "Stellsignal", "force_n": "Kraft"}),
    ],
)
def test_names_of_inputs(names: tuple[str, ...], expected: dict[str, str | None]) -> None:
    guesses = guess_signals([Named(name) for name in names], [])
    for contract, name in expected.items():
        chosen = guesses[contract].chosen
        assert (chosen.name if chosen else None) == name, contract


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("x", "xd", "pA", "pB"), ("x", "xd", "pA", "pB")),
        (("Cylinder.Position", "Target.Position"), ("Cylinder.Position", None, None, None)),
        (("s_rod", "v_rod", "p1", "p2"), ("s_rod", "v_rod", "p1", "p2")),
        (("pressureCap", "pressureRod", "stroke"), ("stroke", None, "pressureCap", "pressureRod")),
    ],
)
def test_names_of_outputs(names: tuple[str, ...], expected: tuple[str | None, ...]) -> None:
    guesses = guess_signals([], [Named(name) for name in names])
    contracts = ("position_m", "velocity_m_s", "pressure_a_pa", "pressure_b_pa")
    found = [guesses[f"outputs.{one}"].chosen for one in contracts]
    assert tuple(one.name if one else None for one in found) == expected


def test_values_that_are_usually_uncertain() -> None:
    assert uncertain(Named("m_load", description="Mass of the load")) is not None
    assert uncertain(Named("c_leak")) is not None
    assert uncertain(Named("gravity")) is None


def test_what_is_no_simulator(tmp_path: Path) -> None:
    for stated, says in (
        (tmp_path / "no.fmu", "there is no such file"),
        (FOLDER / "bench_plant.py", "is no FMU, or damaged"),
        (f"{FOLDER / 'bench_plant.py'}:Bank", "nothing in it has the name 'Bank'"),
        ("a b:c", "expected an FMU, or FILE.py:NAME"),
    ):
        with pytest.raises(RigError) as caught:
            made(stated)
        assert says in str(caught.value)
