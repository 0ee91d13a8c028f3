# SPDX-License-Identifier: MIT
"""The exported simulator of a rig: valid, the bits of Python, parameters, states, the command."""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from sources import ROOT
from test_export import run

from ehsid.harness.catalogue.parameters import acts_on, effects, names_of, plant_parameters
from ehsid.harness.firmware.simulator_fmu import simulator_fmu
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.rigs.rig import TableLaw
from ehsid.harness.signals.simulation import simulate

fmpy = pytest.importorskip("fmpy")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("c++") is None, reason="no C++ compiler is here"),
]

BENCH = ROOT / "examples" / "rigs" / "bench.toml"
DT_S = 2.0**-9  # exact sums, so that a step begins at the time of its sample
SAMPLES = 1500
COMMAND_V = np.repeat(np.random.default_rng(1).uniform(-2.0, 2.0, SAMPLES // 30), 30)
# Two names: one that a language would take, and one that it would not.
TABLES = {
    "my-law": TableLaw("force", "velocity_m_s", (-0.3, -0.1, 0.1, 0.2), (-90.0, -40.0, 30.0, 70.0)),
    "boom": TableLaw("mass", "position_m", (0.0, 0.3), (20.0, -30.0)),
    "wear": TableLaw("spool", "time_s", (0.0, 2.0), (0.0, 0.01)),
}


def with_all_effects(plant: str) -> Rig:
    """The example of a plant, with every effect that acts on it, and tables where it has oil."""
    rig = read_rig(ROOT / "examples" / "rigs" / f"{plant}.toml")
    names = (
        name for one in effects().values() if acts_on(one, rig.plant) for name in names_of(one)
    )
    rig = rig.with_values({name: plant_parameters()[name].typical for name in names})
    return replace(rig, tables=TABLES if rig.plant == "ehs" else {})


@pytest.fixture(scope="module", params=[("bench", 2), ("axis", 3), ("linear", 3)], ids=str)
def exported(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Rig, int, Path]:
    plant, fmi = request.param
    path = tmp_path_factory.mktemp(plant) / "machine.fmu"
    rig = with_all_effects(plant)
    made = simulator_fmu(rig, name="machine", fmi=fmi, dt_s=DT_S)
    assert "a library for Linux" in made.write(path)
    return rig, fmi, path


def assert_has_the_bits(path: Path, rig: Rig, start_values: dict[str, float]) -> None:
    """Compare a run of the FMU with one of the rig in Python."""
    signals = np.zeros(SAMPLES, [("time", float), ("command_v", float)])
    signals["time"], signals["command_v"] = np.arange(SAMPLES) * DT_S, COMMAND_V
    found = fmpy.simulate_fmu(
        str(path),
        stop_time=SAMPLES * DT_S,
        output_interval=DT_S,
        input=signals,
        start_values=start_values,
    )[:SAMPLES]
    record = simulate(rig, COMMAND_V, dt_s=DT_S).record
    outputs = [name for name in record.columns if name not in ("time_s", "command_v")]
    assert {*outputs} == {*found.dtype.names} - {"time"}
    for name in outputs:
        assert found[name].tobytes() == record.column(name).tobytes(), name


def test_a_run_has_the_bits_of_python(exported: tuple[Rig, int, Path]) -> None:
    from fmpy.validation import validate_fmu

    rig, _, path = exported
    assert validate_fmu(str(path)) == []
    assert_has_the_bits(path, rig, {})


def test_a_parameter_is_the_value_in_the_rig_file(exported: tuple[Rig, int, Path]) -> None:
    rig, _, path = exported
    described = fmpy.read_model_description(str(path)).modelVariables
    starts = {one.name: float(one.start) for one in described if one.causality == "parameter"}
    wanted = {**rig.values, "initial.velocity_m_s": 0.0}
    assert wanted.items() <= starts.items()
    assert all(one.unit for one in described if one.name != "time")
    # Another mass has other steps of integration.
    mass = next(name for name in rig.values if name.endswith("mass_kg"))
    changed = {mass: 0.1 * rig.values[mass], "effects.coulomb_friction.force_n": 0.0}
    changed |= {"initial.position_m": 0.07, "effects.sensor_quantisation.step_m": 3e-5}
    tables, more = dict(rig.tables), {}
    if tables:
        more = {"effects.table.'my-law'.values[3]": 100.0}
        tables["my-law"] = replace(tables["my-law"], values=(-90.0, -40.0, 100.0, 70.0))
    assert_has_the_bits(path, replace(rig.with_values(changed), tables=tables), changed | more)


class Running:
    """An instance of the FMU after its initialisation."""

    def __init__(self, exported: tuple[Rig, int, Path], folder: Path) -> None:
        self.rig, fmi, path = exported
        described = fmpy.read_model_description(str(path))
        self.references = {one.name: one.valueReference for one in described.modelVariables}
        self.kind = {2: "Real", 3: "Float64"}[fmi]
        self.state = {2: "FMUstate", 3: "FMUState"}[fmi]
        self.messages: list[bytes] = []
        self.fmu = fmpy.instantiate_fmu(fmpy.extract(str(path), str(folder)), described)
        self.start()
        self.time = 0.0

    def start(self) -> None:
        if self.kind == "Real":
            self.fmu.setupExperiment(stopTime=1.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def put(self, name: str, value: float) -> None:
        getattr(self.fmu, f"set{self.kind}")([self.references[name]], [value])

    def got(self, name: str) -> float:
        return float(getattr(self.fmu, f"get{self.kind}")([self.references[name]])[0])

    def step(self, steps: float = 1.0) -> None:
        h = steps * DT_S
        self.fmu.doStep(currentCommunicationPoint=self.time, communicationStepSize=h)
        self.time += h

    def positions(self, command_v: npt.NDArray[np.float64]) -> list[float]:
        found = []
        for volts in command_v.tolist():
            self.put("command_v", volts)
            self.step()
            found.append(self.got("position_m"))
        return found

    def does(self, verb: str, *given: Any) -> Any:
        return getattr(self.fmu, f"{verb}{self.state}")(*given)


def test_states_steps_and_what_is_refused(exported: tuple[Rig, int, Path], tmp_path: Path) -> None:
    one = Running(exported, tmp_path)
    failure = fmpy.fmi1.FMICallException
    first = one.positions(COMMAND_V[:100])
    saved = one.does("get")
    on = one.positions(COMMAND_V[100:200])
    one.does("set", saved)
    assert one.positions(COMMAND_V[100:200]) == on
    one.does("free", saved)
    mass = next(name for name in one.rig.values if name.endswith("mass_kg"))
    for refused in (
        lambda: one.put(mass, 50.0),
        lambda: one.put("position_m", 0.1),
        lambda: one.step(0.5),
        lambda: one.step(float("inf")),
    ):
        with pytest.raises(failure):
            refused()
    # Three steps at once hold the command.
    one.fmu.reset()
    one.start()
    one.put("command_v", COMMAND_V[0])
    one.step(3.0)
    assert one.got("position_m") == first[2]
    one.put("command_v", float("nan"))
    with pytest.raises(failure):
        one.step()
    # A value outside its range is found before the first step.
    one.fmu.reset()
    one.put(mass, -1.0)
    for refused in (one.start, one.step):
        with pytest.raises(failure):
            refused()
    one.fmu.freeInstance()


@pytest.mark.parametrize(("fmi", "compiler"), [(2, "clang++"), (3, "g++")])
def test_the_sources_compile_alone(fmi: int, compiler: str, tmp_path: Path) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler} is here")
    files = simulator_fmu(with_all_effects("bench"), name="machine", fmi=fmi).files
    for file, text in files.items():
        if file.startswith("sources/"):
            (tmp_path / Path(file).name).write_text(text, encoding="ascii")
    flags = ["-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Werror"]
    prefix = f"-DFMI{fmi}_FUNCTION_PREFIX=machine_"
    command = [compiler, *flags, prefix, "-c", "simulator_fmu.cpp"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert f"machine_fmi{fmi}DoStep".encode() in (tmp_path / "simulator_fmu.o").read_bytes()


@pytest.mark.parametrize("positional", [False, True])
def test_command_writes_the_simulator(
    positional: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "which", lambda _: None)
    monkeypatch.chdir(tmp_path)
    given = [str(BENCH), "--fmu", "bench.fmu"] if positional else ["--fmu", str(BENCH)]
    code, printed, error = run(*given, "--dt", "0.002", "--fmi", "3")
    assert (code, error) == (0, "")
    assert printed == (
        "bench.fmu: simulator of bench in steps of 0.002 s, 17 parameters, effects: valve lag; "
        "FMI 3.0, sources only: no compiler for Linux is here\n"
    )
    described = fmpy.read_model_description("bench.fmu")
    assert described.coSimulation.modelIdentifier == "simulator"
    assert float(described.defaultExperiment.stepSize) == 0.002
