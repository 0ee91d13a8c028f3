# SPDX-License-Identifier: MIT
"""The sections of a user's simulator in a rig file: read, written, and refused with a reason."""

from __future__ import annotations

import pickle
import shutil
from pathlib import Path
from typing import Any

import pytest
from user_simulators import FOLDER, description_of, fmu_with, needs_linux64, rig_document, text_of

from ehsid.harness.rigs import RigError, parse_rig, read_rig, rig_text, write_rig
from ehsid.harness.rigs.simulator_section import Signal, SimulatorValue

pytestmark = needs_linux64

RIGS = ["rig.toml", "rig3.toml", "rig_portless.toml", "rig_python.toml"]
MASS = "simulator.parameters.mass"
FREQUENCY = "simulator.parameters.valve.frequency"


def section_of(document: dict[str, Any]) -> Any:
    rig = parse_rig(text_of(document))
    assert rig.simulator is not None
    return rig.simulator


def problems_of(document: dict[str, Any]) -> tuple[str, ...]:
    with pytest.raises(RigError) as caught:
        parse_rig(text_of(document))
    return caught.value.problems


def one_problem(document: dict[str, Any]) -> str:
    (problem,) = problems_of(document)
    return problem


def test_the_contract_is_read() -> None:
    rig = read_rig(FOLDER / "rig.toml")
    section = rig.simulator
    assert section is not None
    assert section.fmu == "bench.fmu"
    assert section.path == FOLDER / "bench.fmu"
    assert rig.plant == "simulator"
    assert section.inputs == {"command_v": Signal("u")}
    assert section.outputs["supply_flow_m3_s"] == Signal("q_supply")
    assert section.ports["force_n"] == Signal("force", 1.0)
    assert section.start == {"position_m": Signal("position_start")}
    assert section.scales == {"force_n": 4.36e4, "flow_m3_s": 7.69e-4}
    assert section.parameters["valve.frequency"] == SimulatorValue(80.0, 0.2, True)
    assert rig.values[FREQUENCY] == 80.0
    assert rig.values["valve.rated_command_v"] == 10.0
    assert rig.sigma(FREQUENCY) == 0.2


@pytest.mark.parametrize("name", RIGS)
def test_what_is_written_is_read_as_the_same_rig(name: str) -> None:
    rig = read_rig(FOLDER / name).with_values({MASS: 123.0})
    text = rig_text(rig)
    again = parse_rig(text)
    assert rig_text(again) == text
    assert dict(again.values) == dict(rig.values)
    assert again.simulator is not None
    assert rig.simulator is not None
    for part in ("inputs", "outputs", "ports", "start", "scales", "constants", "valve_bandwidth"):
        assert getattr(again.simulator, part) == getattr(rig.simulator, part)
    assert rig_text(pickle.loads(pickle.dumps(rig))) == text


def test_paths_stay_in_their_folder_and_become_absolute_elsewhere(tmp_path: Path) -> None:
    home, away = tmp_path / "home", tmp_path / "away"
    shutil.copytree(FOLDER, home)
    away.mkdir()
    for name, key, stated in (
        ("rig.toml", "fmu", "bench.fmu"),
        ("rig_python.toml", "python", "bench_plant.py:Bench"),
    ):
        rig = read_rig(home / name)
        for folder in (home, away):
            write_rig(rig, folder / "new.toml")
            found = read_rig(folder / "new.toml").simulator
            assert found is not None
            whole = str(home / stated)
            assert getattr(found, key) == (stated if folder is home else whole)


def test_a_text_alone_is_of_the_current_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    text = (FOLDER / "rig.toml").read_text(encoding="utf-8")
    monkeypatch.chdir(FOLDER)
    section = parse_rig(text).simulator
    assert section is not None
    assert section.path == FOLDER / "bench.fmu"


def test_scales_offsets_units_and_signs() -> None:
    document = rig_document()
    simulator = document["simulator"]
    simulator["inputs"]["command_v"] = {"name": "u", "scale": 10, "offset": 0.5}
    simulator["outputs"] |= {
        "position_m": {"name": "y", "unit": "mm"},
        "pressure_a_pa": {"name": "p_a", "unit": "barg"},
        "supply_flow_m3_s": {"name": "q_supply", "unit": "l/min"},
    }
    simulator["ports"]["force_n"] = {"name": "force", "unit": "kN", "positive": "retracts"}
    section = section_of(document)
    assert section.inputs["command_v"] == Signal("u", 10.0, 0.5)
    assert section.outputs["position_m"] == Signal("y", 1000.0, 0.0)
    pressure = section.outputs["pressure_a_pa"]
    # 101325 Pa absolute is what a gauge shows as zero.
    assert pressure.scale * 101325.0 + pressure.offset == pytest.approx(0.0, abs=1e-12)
    assert pressure.scale * 1101325.0 + pressure.offset == pytest.approx(10.0)
    assert section.outputs["supply_flow_m3_s"].scale == pytest.approx(6e4)
    assert section.ports["force_n"] == Signal("force", -1e-3, 0.0)
    rig = parse_rig(text_of(document))
    again = parse_rig(rig_text(rig)).simulator
    assert again is not None
    assert again.outputs == section.outputs
    assert again.ports == section.ports


def test_names_with_dots_need_no_quotes() -> None:
    document = rig_document()
    parameters = document["simulator"]["parameters"]
    parameters["valve"] = {"frequency": parameters.pop("valve.frequency")}
    assert "valve.frequency" in section_of(document).parameters


@pytest.mark.parametrize("name", ["rig.toml", "rig3.toml", "rig_python.toml"])
def test_a_value_that_is_not_stated_is_that_of_the_simulator(name: str) -> None:
    document = rig_document(name)
    document["simulator"]["parameters"]["mass"] = {"sigma": 2.5}
    rig = parse_rig(text_of(document))
    assert rig.values[MASS] == 150.0
    assert rig.sigma(MASS) == 2.5


def test_the_lag_of_the_valve() -> None:
    document = rig_document()
    lag = document["simulator"]["valve_lag"] = {"bandwidth_hz": "valve.frequency"}
    assert section_of(document).valve_bandwidth == "valve.frequency"
    lag["damping"] = 0.9
    section = section_of(document)
    assert section.valve_damping == 0.9
    text = rig_text(parse_rig(text_of(document)))
    again = parse_rig(text).simulator
    assert again is not None
    assert (again.valve_bandwidth, again.valve_damping) == ("valve.frequency", 0.9)
    document["simulator"]["valve_lag"] = {"bandwidth_hz": "valve.frequenzy"}
    assert "did you mean 'valve.frequency'?" in one_problem(document)


def test_constants_are_numbers_and_switches() -> None:
    document = rig_document()
    document["simulator"]["constants"] = {"valve.damping": 0.8}
    assert section_of(document).constants == {"valve.damping": 0.8}
    document["simulator"]["constants"] = {"valve.damping": True}
    assert section_of(document).constants == {"valve.damping": 1.0}
    document["simulator"]["constants"] = {"mass": 2.0}
    assert "stands in [simulator.parameters], too" in one_problem(document)


# Keys of a table, what is put there (None removes it), and what the problem says.
FAULTS: list[tuple[str, Any, str]] = [
    ("simulator.fmu", "nowhere.fmu", "there is no such file"),
    ("simulator.fmu", None, "neither fmu nor python: expected one of them"),
    ("simulator.python", "bench_plant.py:Bench", "both fmu and python"),
    ("simulator.fmu", 3, "expected text, a path"),
    ("simulator.stepp_s", 0.1, "did you mean 'step_s'?"),
    ("simulator.step_s", -1.0, "expected seconds, above 0"),
    ("simulator.tolerance", 0.5, "0.2 at most"),
    ("simulator.scales.force_n", 0.0, "expected a number above 0"),
    ("simulator.scales.force", 1.0, "did you mean 'force_n'?"),
    ("simulator.inputs", None, "'simulator.inputs.command_v' is missing"),
    ("simulator.inputs.command_v", "force_", "did you mean 'force'?"),
    ("simulator.inputs.command_v", "mass", "it is a parameter of the FMU: expected an input"),
    ("simulator.inputs.force_n", "force", "belongs to [simulator.ports]"),
    ("simulator.inputs.command_v", {"name": "u", "scale": 0}, "expected a number other than 0"),
    ("simulator.inputs.command_v", {"name": "u", "scal": 1}, "did you mean 'scale'?"),
    ("simulator.inputs.command_v", {"name": "u", "positive": "extends"}, "'positive' is not known"),
    ("simulator.outputs.position_m", None, "'simulator.outputs.position_m' is missing"),
    ("simulator.outputs.positon_m", "y", "did you mean 'position_m'?"),
    ("simulator.outputs.position_m", "u", "it is an input of the FMU: expected an output, one of"),
    ("simulator.outputs.position_m", {"name": "y", "unit": "bar"}, "same kind as m"),
    (
        "simulator.outputs.supply_flow_m3_s",
        {"name": "q_supply", "unit": "bar"},
        "same kind as m^3/s, such as l/min",
    ),
    ("simulator.outputs.position_m", {"name": "y", "unit": "mm", "scale": 2}, "remove one of them"),
    ("simulator.outputs.position_m", 3, "expected a name of the simulator"),
    ("simulator.outputs.velocity_m_s", "y", "expected one name for each"),
    ("simulator.ports.force_n", {"name": "force", "positive": "up"}, '"extends" or "retracts"'),
    ("simulator.ports.flow_a_m3_s", "u", "'simulator.inputs.command_v' has this name, too"),
    ("simulator.start.position_m", "y", "it is an output of the FMU"),
    ("simulator.constants", {"mode": 1}, "the FMU has no variable of this name"),
    ("simulator.constants", {"valve.damping": "high"}, "expected a number"),
    ("simulator.parameters.mas", {"value": 1.0, "sigma": 1.0}, "did you mean 'mass'?"),
    ("simulator.parameters.mass", {"value": 1.0}, "'simulator.parameters.mass.sigma' is missing"),
    ("simulator.parameters.mass", {"value": 1.0, "sigma": 0.0}, "expected a standard deviation"),
    ("simulator.parameters.mass", {"value": "1 kg", "sigma": 1.0}, "expected a number"),
    ("simulator.parameters.mass", {"value": -1.0, "sigma": 1.0, "log": True}, "since log = true"),
    ("simulator.parameters.mass", {"sigma": 1.0, "log": "yes"}, "expected true or false"),
    ("simulator.parameters.mass", {"sigma": 1.0, "sigm": 1.0}, "did you mean 'sigma'?"),
    ("simulator.parameters.y", {"value": 1.0, "sigma": 1.0}, "it is an output of the FMU"),
    ("simulator.valve_lag", {"damping": 0.7}, "bandwidth_hz' is missing"),
    ("simulator", None, "'simulator' is missing: expected a section [simulator]"),
    ("valve.rated_command_v", None, "'valve.rated_command_v' is missing"),
    ("valve.rated_flow_m3_s", 1e-3, 'a plant "simulator" has no such value'),
    ("nuisance", {"flow_exponent": 0.52}, 'a plant "simulator" has no such value'),
    ("plant", "linear", "a plant 'linear' has no such section"),
    ("effects", {"entrained_air": {"volume_fraction": 0.01}}, "acts inside the simulator"),
    (
        "effects",
        {"table": {"seal": {"adds_to": "force", "of": "position_m", "knots": [0.0, 1.0],
                            "values": [0.0, 1.0]}}},
        "a table acts inside the plants of ehsid",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("place", "given", "says"), FAULTS)
def test_each_fault_is_named(place: str, given: Any, says: str) -> None:
    document = rig_document()
    *sections, key = place.split(".")
    table = document
    for section in sections:
        table = table.setdefault(section, {})
    if given is None:
        del table[key]
    else:
        table[key] = given
    problems = problems_of(document)
    assert any(says in problem for problem in problems), problems
    assert all(len(problem.splitlines()) == 1 for problem in problems)


def test_all_problems_are_told_at_once() -> None:
    document = rig_document()
    document["simulator"]["step_s"] = 0
    document["simulator"]["outputs"]["position_m"] = "x"
    document["simulator"]["parameters"]["mass"]["sigma"] = -1.0
    document["sensors"]["position_noise_m"] = -1.0
    assert len(problems_of(document)) == 4


def test_an_integer_is_no_signal(tmp_path: Path) -> None:
    other = description_of().replace(
        'initial="exact"><Real start="150.0"/>', 'initial="exact"><Integer start="150"/>'
    )
    fmu = fmu_with(tmp_path / "other.fmu", other)
    document = rig_document()
    document["simulator"]["fmu"] = str(fmu)
    assert "of the type Integer: expected a real number" in one_problem(document)
    del document["simulator"]["parameters"]["mass"]
    document["simulator"]["constants"] = {"mass": 120}
    assert section_of(document).constants == {"mass": 120.0}


def test_an_fmu_without_a_library_for_this_platform(tmp_path: Path) -> None:
    document = rig_document()
    fmu = fmu_with(tmp_path / "o.fmu", description_of(), binaries=False)
    document["simulator"]["fmu"] = str(fmu)
    assert "has no library for this platform, linux64: its platforms are: none" in one_problem(
        document
    )


PYTHON_FAULTS = [
    ("bench_plant.py", "expected FILE.py:NAME"),
    ("bench plant:Bench", "expected FILE.py:NAME"),
    ("bench_plant.py:Bank", "nothing in it has the name 'Bank'"),
    ("nowhere.py:Bench", "there is no such file"),
]


@pytest.mark.parametrize(("stated", "says"), PYTHON_FAULTS)
def test_faults_of_a_python_simulator(stated: str, says: str) -> None:
    document = rig_document("rig_python.toml")
    document["simulator"]["python"] = str(FOLDER / stated) if ".py" in stated else stated
    assert says in one_problem(document)


def test_names_of_a_python_class_are_checked() -> None:
    document = rig_document("rig_python.toml")
    document["simulator"]["outputs"]["position_m"] = "positon"
    document["simulator"]["ports"]["force_n"] = "force"
    document["simulator"]["parameters"]["mas"] = {"value": 1.0, "sigma": 0.1}
    problems = problems_of(document)
    assert [problem.rpartition("; ")[2] for problem in problems] == [
        "did you mean 'force_n'?",
        "did you mean 'position_m'?",
        "did you mean 'mass'?",
    ]


def test_reading_a_rig_file_runs_nothing(tmp_path: Path) -> None:
    (tmp_path / "bad.py").write_text("raise SystemExit\nclass Bench:\n    inputs = ['u']\n")
    document = rig_document("rig_python.toml")
    document["simulator"] |= {"python": str(tmp_path / "bad.py:Bench"), "ports": {}}
    document["simulator"]["inputs"]["command_v"] = "u"
    assert section_of(document).inputs["command_v"].name == "u"


def test_a_module_is_not_looked_at() -> None:
    document = rig_document("rig_python.toml")
    document["simulator"]["python"] = "no_such_module.inner:Bench"
    assert section_of(document).python == "no_such_module.inner:Bench"


def test_values_of_the_simulator_are_replaced_and_checked() -> None:
    rig = read_rig(FOLDER / "rig.toml")
    other = rig.with_values({MASS: 120.0, "effects.coulomb_friction.force_n": 300.0})
    assert other.values[MASS] == 120.0
    assert other.effects() == ("coulomb_friction",)
    # The section keeps what the file states, which is what a fit moves away from.
    assert other.simulator is rig.simulator
    assert other.plant_values().shape == rig.plant_values().shape
    for values, says in (
        ({"simulator.parameters.mas": 1.0}, "did you mean 'simulator.parameters.mass'?"),
        ({MASS: -1.0}, "expected a value above 0"),
        ({MASS: float("nan")}, "expected a finite number"),
        ({"effects.line_resonance.frequency_hz": 100.0}, "acts inside the simulator"),
    ):
        with pytest.raises(RigError) as caught:
            rig.with_values(values)
        assert says in str(caught.value)


def test_a_servo_of_ours_has_no_values_of_a_simulator() -> None:
    from ehsid.harness.rigs.new import published_rig

    with pytest.raises(RigError, match="the rig has no simulator"):
        published_rig().with_values({MASS: 1.0})
