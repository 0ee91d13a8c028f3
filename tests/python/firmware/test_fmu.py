# SPDX-License-Identifier: MIT
"""The exported FMU: valid, the bits of Python, states, sources that compile alone, the command."""

import shutil
import subprocess
import zipfile
from pathlib import Path

import make_trace
import numpy as np
import pytest
from compiled_sources import STRICT, in_python
from test_export import COLUMNS, CRANE, run
from test_source import GOLDEN, needs_gcc

from ehsid.harness.firmware import (
    STEM,
    EstimatorConfiguration,
    GoldenTrace,
    fmu_files,
    render_sources,
    write_fmu,
)
from ehsid.harness.models.identification import ArxOrders

fmpy = pytest.importorskip("fmpy")
pytestmark = [pytest.mark.slow, needs_gcc]

DT_S = 2.0**-7  # exact sums, so that a step begins at the time of its sample
CONFIGURATION = EstimatorConfiguration(ArxOrders(2, 3, 1, offset=True), **GOLDEN)
NAMES = CONFIGURATION.orders.names
NUMBERS = ("innovation", "lambda", "residual_variance", *NAMES, *(f"std_{name}" for name in NAMES))
FLAGS = ("status", "settled", "converged")


def made_files(fmi: int, dtype: str) -> dict[str, str]:
    command, position = make_trace.signals()
    trace = GoldenTrace.of(CONFIGURATION, command[:30], position[:30], dtype)
    sources = render_sources(CONFIGURATION, trace, name="servo", stem=STEM, dtype=dtype, dt_s=DT_S)
    return fmu_files(CONFIGURATION, sources, name="servo", fmi=fmi, dtype=dtype, dt_s=DT_S)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("fmi", [2, 3])
def test_a_simulation_has_the_bits_of_python(fmi: int, dtype: str, tmp_path: Path) -> None:
    from fmpy.validation import validate_fmu

    path = tmp_path / "estimator.fmu"
    assert write_fmu(path, made_files(fmi, dtype), name="servo", fmi=fmi)
    assert validate_fmu(str(path)) == []
    command, position = make_trace.signals()
    switches = [("enable", bool), ("reset", bool)]
    signals = np.zeros(
        command.size, [*((name, float) for name in ("time", "command", "position")), *switches]
    )
    signals["time"] = np.arange(command.size) * DT_S
    signals["command"], signals["position"] = command, position
    signals["enable"], signals["reset"][150] = True, True
    signals["enable"][60:90] = False
    for given in (signals[["time", "command", "position"]], signals):
        found = fmpy.simulate_fmu(
            str(path), stop_time=command.size * DT_S, output_interval=DT_S, input=given
        )[1:]
        estimator = CONFIGURATION.estimator(dtype)
        made = []
        for sample in given:
            if "reset" in given.dtype.names:
                estimator.enabled = bool(sample["enable"])
                if sample["reset"]:
                    estimator.reset()
            made.append(in_python(estimator, sample["command"][None], sample["position"][None]))
        numbers, flags = (np.concatenate(each) for each in zip(*made, strict=True))
        assert np.array([found[name] for name in NUMBERS], dtype).T.tobytes() == numbers.tobytes()
        assert (flags == np.array([found[name] for name in FLAGS]).T).all()


@pytest.mark.parametrize("fmi", [2, 3])
def test_states_can_be_saved_and_other_steps_are_refused(fmi: int, tmp_path: Path) -> None:
    path = tmp_path / "estimator.fmu"
    write_fmu(path, made_files(fmi, "float32"), name="servo", fmi=fmi)
    described = fmpy.read_model_description(str(path))
    references = {each.name: each.valueReference for each in described.modelVariables}
    slave = fmpy.instantiate_fmu(fmpy.extract(str(path), str(tmp_path / "open")), described)
    if fmi == 2:
        slave.setupExperiment()
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    kind = {2: "Real", 3: "Float32"}[fmi]
    inputs = [references["command"], references["position"]]

    def readings(first: int) -> list[float]:
        signals = np.array(make_trace.signals()).T[first : first + 50]
        for k, sample in enumerate(signals.tolist()):
            getattr(slave, f"set{kind}")(inputs, sample)
            slave.doStep(currentCommunicationPoint=(first + k) * DT_S, communicationStepSize=DT_S)
        return list(getattr(slave, f"get{kind}")([references[name] for name in NUMBERS]))

    state_of = {2: "FMUstate", 3: "FMUState"}[fmi]
    readings(0)
    saved = getattr(slave, f"get{state_of}")()
    serialise, deserialise = {
        2: ("serializeFMUstate", "deSerializeFMUstate"),
        3: ("serializeFMUState", "deserializeFMUState"),
    }[fmi]
    stored = getattr(slave, serialise)(saved)
    first = readings(50)
    assert readings(50) != first
    getattr(slave, f"set{state_of}")(saved)
    assert readings(50) == first
    slave.reset()
    getattr(slave, f"set{state_of}")(getattr(slave, deserialise)(stored))
    assert readings(50) == first
    getattr(slave, f"free{state_of}")(saved)
    with pytest.raises(fmpy.fmi1.FMICallException):
        slave.doStep(currentCommunicationPoint=1.0, communicationStepSize=2.0 * DT_S)
    slave.freeInstance()


@pytest.mark.parametrize("fmi", [2, 3])
def test_the_sources_compile_alone_and_take_a_prefix(fmi: int, tmp_path: Path) -> None:
    for file, text in made_files(fmi, "float64").items():
        (tmp_path / Path(file).name).write_text(text, encoding="ascii")
    for given, expected in (([], ""), ([f"-DFMI{fmi}_FUNCTION_PREFIX=servo_"], "servo_")):
        command = ["gcc", *STRICT, "-O1", *given, "-c", "fmu.c", f"{STEM}.c"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert f"{expected}fmi{fmi}DoStep".encode() in (tmp_path / "fmu.o").read_bytes()


def test_command_writes_an_fmu_with_or_without_a_compiler(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "crane.fmu"
    for more, held in (([], "a library for Linux"), (["--fmi", "3"], "sources only")):
        code, printed, error = run(str(CRANE), *COLUMNS, "--fmu", str(path), *more)
        assert code == 0, error
        assert held in printed
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
        assert {f"sources/{STEM}.c", "sources/fmu.c", "modelDescription.xml"} < set(names)
        assert any(name.startswith("binaries/") for name in names) == (not more)
        monkeypatch.setattr(shutil, "which", lambda _: None)
