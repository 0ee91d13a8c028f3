# SPDX-License-Identifier: MIT
"""A user's simulator is brought to its start and stepped: all forms of one bench agree."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fmu_loop import run
from user_simulators import FOLDER, description_of, fmu_with, needs_linux64

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.rigs import read_rig
from ehsid.harness.rigs.simulator_section import Signal, SimulatorSection
from ehsid.harness.simulators.opening import (
    Opened,
    PythonRecord,
    SimulatorError,
    open_simulator,
)

pytestmark = needs_linux64
pytest.importorskip("fmpy", reason="FMPy is not installed")

DT = 1e-3
TIME = np.arange(200) * DT
PORTS = {
    "command_v": 8.0 * np.sin(30.0 * TIME) + 1.0,
    "force_n": 4000.0 * np.cos(30.0 * TIME),
    "supply_pressure_pa": 1.3e7 + 1e5 * np.sin(TIME),
    "flow_a_m3_s": np.full(TIME.size, -1e-6),
    "flow_b_m3_s": 1e-6 * np.cos(TIME),
}
VALUES = {"mass": 120.0, "bulk_modulus": 8e8}


def section_of(name: str) -> SimulatorSection:
    section = read_rig(FOLDER / name).simulator
    assert section is not None
    return section


def inputs_of(opened: Opened, *, ports: bool) -> FloatArray:
    return np.column_stack(
        [
            PORTS[name] if ports or name == "command_v" else np.full(TIME.size, opened.rest[name])
            for name in opened.inputs
        ]
    )


def simulated(section: SimulatorSection, *, ports: bool, start: float = 0.1) -> FloatArray:
    with open_simulator(section) as opened:
        stepper = opened.start(VALUES, start)
        assert not isinstance(stepper, PythonRecord)
        return run(stepper, inputs_of(opened, ports=ports), DT)


@pytest.mark.parametrize("ports", [False, True])
@pytest.mark.parametrize("name", ["rig.toml", "rig3.toml"])
def test_fmus_agree_with_the_python_class_bit_for_bit(name: str, ports: bool) -> None:
    expected = simulated(section_of("rig_python.toml"), ports=ports)
    assert abs(expected[-1, 0] - 0.1) > 1e-3
    np.testing.assert_array_equal(simulated(section_of(name), ports=ports)[:, :4], expected)


def test_an_fmu_without_ports_agrees_too() -> None:
    expected = simulated(section_of("rig_python.toml"), ports=False)
    found = simulated(section_of("rig_portless.toml"), ports=False)
    np.testing.assert_array_equal(found[:, 0], expected[:, 0])


@pytest.mark.parametrize("name", ["rig.toml", "rig3.toml", "rig_portless.toml", "rig_python.toml"])
def test_each_start_begins_anew(name: str) -> None:
    with open_simulator(section_of(name)) as opened:
        inputs = inputs_of(opened, ports=False)

        def once(mass: float, start: float) -> FloatArray:
            stepper = opened.start({"mass": mass}, start)
            assert not isinstance(stepper, PythonRecord)
            return run(stepper, inputs, DT)

        first = once(120.0, 0.1)
        assert first[0, 0] == 0.1
        assert not np.array_equal(once(150.0, 0.1), first)
        assert once(120.0, 0.2)[0, 0] == 0.2
        np.testing.assert_array_equal(once(120.0, 0.1), first)


def test_an_fmu_that_cannot_be_reset_is_made_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    from fmpy.fmi2 import FMU2Slave

    def fails(*_: object) -> None:
        raise RuntimeError("no reset")

    expected = simulated(section_of("rig.toml"), ports=True)
    with open_simulator(section_of("rig.toml")) as opened:
        opened.start({"mass": 90.0}, 0.2)
        monkeypatch.setattr(FMU2Slave, "fmi2Reset", fails)
        stepper = opened.start(VALUES, 0.1)
        assert not isinstance(stepper, PythonRecord)
        found = run(stepper, inputs_of(opened, ports=True), DT)
    np.testing.assert_array_equal(found, expected)


def test_one_instance_a_process_that_cannot_be_reset_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from fmpy.fmi2 import FMU2Slave

    def fails(*_: object) -> None:
        raise RuntimeError("no reset")

    once = 'canBeInstantiatedOnlyOncePerProcess="'
    fmu_with(tmp_path / "o.fmu", description_of().replace(f'{once}false"', f'{once}true"'))
    section = replace(section_of("rig.toml"), fmu="o.fmu", base=tmp_path)
    with open_simulator(section) as opened:
        assert opened.once_per_process
        assert "one instance" in opened.remarks[0]
        opened.start(VALUES)
        monkeypatch.setattr(FMU2Slave, "fmi2Reset", fails)
        with pytest.raises(SimulatorError, match=r"^o.fmu: cannot be reset .*a reset that works$"):
            opened.start(VALUES)


def test_scales_and_offsets_stand_between_the_simulator_and_si() -> None:
    section = section_of("rig.toml")
    ours = simulated(section, ports=True)
    # The wiring of another simulator: its command is 2 u + 1, and its position is in mm from 100.
    outputs = {**section.outputs, "position_m": Signal("y", 1000.0, -100.0)}
    ports = {**section.ports, "force_n": Signal("force", -1.0)}
    scaled = replace(section, outputs=outputs, ports=ports)
    mirrored = simulated(scaled, ports=True)
    np.testing.assert_allclose(1000.0 * mirrored[0, 0] - 100.0, 0.1, rtol=1e-12)
    assert not np.allclose(mirrored[:, 2], ours[:, 2])
    original = dict(PORTS)
    try:
        PORTS["force_n"] = -PORTS["force_n"]
        again = simulated(scaled, ports=True)
    finally:
        PORTS.update(original)
    np.testing.assert_array_equal(again[:, 2], ours[:, 2])


def test_constants_are_set(tmp_path: Path) -> None:
    whole = description_of().replace(
        '<ScalarVariable name="valve.damping"',
        '<ScalarVariable name="mode" valueReference="77" causality="parameter" '
        'variability="fixed"><Integer start="1"/></ScalarVariable>\n'
        '    <ScalarVariable name="valve.damping"',
    )
    fmu_with(tmp_path / "o.fmu", whole)
    section = replace(section_of("rig.toml"), base=tmp_path, fmu="o.fmu")
    ours = simulated(section, ports=True)
    damped = simulated(replace(section, constants={"valve.damping": 1.5}), ports=True)
    assert not np.array_equal(ours, damped)
    # The bench has no whole numbers, and says so.
    with pytest.raises(SimulatorError, match=r"^o\.fmu: refuses mode = 2 \(fmi2SetInteger"):
        simulated(replace(section, constants={"mode": 2.0}), ports=True)


def test_what_is_unpacked_is_removed(tmp_path: Path) -> None:
    opened = open_simulator(section_of("rig.toml"), tmp_path)
    opened.start(VALUES)
    assert list(tmp_path.iterdir())
    opened.close()
    opened.close()
    assert not list(tmp_path.iterdir())
    with pytest.raises(SimulatorError, match="is closed"):
        opened.start(VALUES)


@pytest.fixture
def library() -> Iterator[bytes]:
    import zipfile

    with zipfile.ZipFile(FOLDER / "bench3.fmu") as archive:
        yield archive.read("binaries/x86_64-linux/bench3.so")


def opening_of(fmu: Path, of: str = "rig.toml") -> SimulatorError:
    section = replace(section_of(of), fmu=fmu.name, base=fmu.parent)
    before = Path.cwd()
    with pytest.raises(SimulatorError) as caught, open_simulator(section) as opened:
        opened.start({**VALUES})
    assert Path.cwd() == before
    assert len(str(caught.value).splitlines()) == 1
    assert str(caught.value).startswith(f"{fmu.name}: ")
    return caught.value


def test_a_function_that_the_library_lacks_is_named(tmp_path: Path, library: bytes) -> None:
    broken = library.replace(b"fmi3GetClock\0", b"fmi3GetClocj\0")
    assert broken != library
    description = description_of("bench3.fmu")
    fmu = fmu_with(
        tmp_path / "o.fmu",
        description,
        of="bench3.fmu",
        binaries=False,
        more={"binaries/x86_64-linux/bench3.so": broken},
    )
    assert "has no function fmi3GetClock, which FMI 3.0 asks for" in str(
        opening_of(fmu, "rig3.toml")
    )


def test_a_library_that_is_none_is_said(tmp_path: Path) -> None:
    fmu = fmu_with(
        tmp_path / "o.fmu",
        description_of(),
        binaries=False,
        more={"binaries/linux64/bench.so": b"text"},
    )
    error = str(opening_of(fmu))
    assert "its library cannot be loaded" in error
    assert os.sep + "ehsid-fmu-" not in error


def test_an_fmu_that_refuses_to_start_is_said(tmp_path: Path) -> None:
    other = description_of().replace('guid="{', 'guid="{0')
    assert "instantiation failed" in str(opening_of(fmu_with(tmp_path / "o.fmu", other)))


def test_a_value_that_is_refused_is_named(tmp_path: Path) -> None:
    other = description_of().replace(
        'name="mass" valueReference="20"', 'name="mass" valueReference="90"'
    )
    assert "refuses mass = 120 (fmi2SetReal" in str(opening_of(fmu_with(tmp_path / "o.fmu", other)))


def test_without_fmpy_the_line_that_installs_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "fmpy.fmi2", None)
    with pytest.raises(SimulatorError, match=r"FMPy is missing.* pip install 'ehsid\[fmu\]'$"):
        open_simulator(section_of("rig.toml"))
