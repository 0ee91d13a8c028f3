# SPDX-License-Identifier: MIT
"""Simulators in Python: their forms, and their faults in one line with the user's own line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sources import loaded
from user_simulators import FOLDER

from ehsid.harness.rigs import read_rig
from ehsid.harness.rigs.simulator_section import Signal, SimulatorSection
from ehsid.harness.simulators.opening import (
    PythonRecord,
    PythonSteps,
    SimulatorError,
    open_simulator,
)

TIME = np.arange(60) * 1e-3
COMMAND = 5.0 * np.sin(40.0 * TIME)


def section_of(**changes: Any) -> SimulatorSection:
    section = read_rig(FOLDER / "rig_python.toml").simulator
    assert section is not None
    return replace(section, **changes)


def alone(base: Path, name: str = "mine.py:Mine", **changes: Any) -> SimulatorSection:
    """A simulator with a command and a position only."""
    signals = {"inputs": {"command_v": Signal("u")}, "outputs": {"position_m": Signal("y")}}
    return SimulatorSection(python=name, base=base, **{**signals, **changes})


def written(folder: Path, text: str) -> Path:
    (folder / "mine.py").write_text(text, encoding="utf-8")
    return folder


def steps_of(section: SimulatorSection, values: dict[str, float] | None = None) -> PythonSteps:
    stepper = open_simulator(section).start(values or {}, 0.1)
    assert isinstance(stepper, PythonSteps)
    return stepper


def once(section: SimulatorSection) -> None:
    """Open a simulator, start it, and simulate a step or a record."""
    stepper = open_simulator(section).start({"m": 1.0}, 0.1)
    if isinstance(stepper, PythonSteps):
        stepper.step(1e-3, [1.0])
    else:
        assert isinstance(stepper, PythonRecord)
        stepper.run(1e-3, {"command_v": COMMAND})


def fault_of(section: SimulatorSection) -> str:
    with pytest.raises(SimulatorError) as caught:
        once(section)
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


def test_a_function_of_a_whole_record_agrees_with_the_class() -> None:
    by_class = steps_of(section_of(), {"mass": 90.0})
    rows = [by_class.read()]
    rest = [0.0, 1.4e7, 0.0, 0.0]
    rows += [by_class.step(1e-3, [u, *rest]) for u in COMMAND[:-1]]
    by_function = open_simulator(section_of(python="bench_plant.py:simulate")).start(
        {"mass": 90.0}, 0.1
    )
    assert isinstance(by_function, PythonRecord)
    inputs = {
        "command_v": COMMAND,
        "force_n": np.zeros(60),
        "supply_pressure_pa": np.full(60, 1.4e7),
    }
    inputs |= {"flow_a_m3_s": np.zeros(60), "flow_b_m3_s": np.zeros(60)}
    found = by_function.run(1e-3, inputs)
    assert list(found) == ["position_m", "velocity_m_s", "pressure_a_pa", "pressure_b_pa"]
    np.testing.assert_array_equal(np.column_stack(list(found.values())), np.array(rows))


def bench() -> Any:
    return loaded(FOLDER / "bench_plant.py")


@pytest.mark.parametrize(
    ("pick", "kind"),
    [
        (lambda m: m.Bench, PythonSteps),
        (lambda m: m.Bench(), PythonSteps),
        (lambda m: m.simulate, PythonRecord),
    ],
)
def test_a_program_passes_a_class_an_object_or_a_function(
    pick: Callable[[Any], Any], kind: type
) -> None:
    section = section_of(python=None, function=pick(bench()))
    with open_simulator(section) as opened:
        assert isinstance(opened.start({"mass": 90.0}, 0.1), kind)
        assert opened.inputs[:2] == ("command_v", "force_n")


def test_defaults_of_the_inputs_are_those_of_step() -> None:
    with open_simulator(section_of()) as opened:
        assert opened.rest == {
            "force_n": 0.0,
            "supply_pressure_pa": 1.4e7,
            "flow_a_m3_s": 0.0,
            "flow_b_m3_s": 0.0,
        }


MINE = """
class Mine:
    {attributes}
    def reset(self, parameters=None, x0=0.0):
        self.y, self.gain = x0, (parameters or {{}}).get("gain", 1.0)
        return {first}
    def step(self, dt, u):
        self.y += self.gain * dt * u
        return {then}
"""
FORMS = [
    ('outputs = ("other", "y")', "(0.0, self.y)"),
    ('outputs = ["other", "y"]', "[0.0, self.y]"),
    ("pass", '{"y": self.y, "other": 0.0}'),
    ("pass", "self.y"),
    ("import numpy as np; outputs = ('y',)", "self.np.array([self.y])"),
]


@pytest.mark.parametrize(("attributes", "returned"), FORMS)
def test_outputs_in_every_form_with_scale_and_start(
    tmp_path: Path, attributes: str, returned: str
) -> None:
    text = MINE.format(attributes=attributes, first=returned, then=returned)
    section = alone(
        written(tmp_path, text),
        inputs={"command_v": Signal("u", 2.0, 1.0)},
        outputs={"position_m": Signal("y", 1000.0, 5.0)},
        start={"position_m": Signal("x0", 1000.0, 5.0)},
        constants={"gain": 3.0},
    )
    stepper = steps_of(section)
    assert stepper.read() == [0.1]
    # y = 105 mm + 3 * 0.01 s * (2 * 4 V + 1)
    assert stepper.step(0.01, [4.0])[0] == pytest.approx((105.0 + 0.27 - 5.0) / 1000.0)
    assert stepper.read()[0] == pytest.approx(0.10027)


def test_reset_may_return_nothing_where_read_tells(tmp_path: Path) -> None:
    text = MINE.format(attributes="def read(self): return self.y", first="None", then="self.y")
    section = alone(written(tmp_path, text), start={"position_m": Signal("x0")})
    assert steps_of(section).read() == [0.1]


def test_a_simulator_may_import_what_stands_beside_it(tmp_path: Path) -> None:
    (tmp_path / "beside_the_simulator.py").write_text("GAIN = 2.0\n")
    text = MINE.format(attributes="from beside_the_simulator import GAIN", first="0.5", then="1.5")
    assert steps_of(alone(written(tmp_path, text))).read() == [0.5]


GOOD = MINE.format(attributes="pass", first="self.y", then="self.y")
FAULTS = [
    ("x = 1 / 0", "mine.py:Mine: import failed, line 1 of mine.py: ZeroDivisionError: division by"),
    ("import no_such_module_at_all", "import failed, line 1 of mine.py: ModuleNotFoundError"),
    ("def f(:", "mine.py: invalid syntax"),
    ("raise SystemExit(3)", "import failed, line 1 of mine.py: SystemExit: 3"),
    ("Other = 1", "nothing in mine.py has the name 'Mine'"),
    ("class Mine:\n    pass", "it is a class without reset and step: expected a class with reset"),
    ("Mine = 3", "it is a value: expected a class with reset and step"),
    (GOOD.replace("+=", "+= missing +"), "step failed, line 8 of mine.py: NameError"),
    (GOOD.replace("self, dt, u", "self, dt"), "step failed: TypeError: Mine.step() takes 2"),
    (GOOD.replace("self, parameters=None, x0=0.0", "self"), "reset failed: TypeError"),
    (GOOD.replace("        return self.y\n    def step", "    def step"), "reset returned nothing"),
    (GOOD.replace("return self.y", "return 'far'"), "reset failed: ValueError: could not convert"),
    (GOOD.replace("return self.y", "return self.y, 1.0"), "in the order of an attribute 'outputs'"),
    (GOOD.replace("return self.y", "return {'x': 1.0}"), "reset returned no y: it returned x"),
    (GOOD.replace("    pass", "    outputs = ('x',)"), "its attribute outputs has no y: it has x"),
    (
        GOOD.replace("    pass", "    outputs = ('x', 'y')").replace("self.y\n", "[self.y]\n"),
        "reset returned 1 values: expected 2, those of its attribute outputs",
    ),
    ("def Mine(u, dt, parameters): return 3", "Mine returned a int: expected a dictionary"),
    ("def Mine(u, dt, parameters): return {'x': u}", "Mine returned no y: it returned x"),
    ("def Mine(u, dt, parameters): return {'y': u[1:]}", "of the shape (59,): expected one value"),
    ("def Mine(u, dt): return {'y': u}", "Mine failed: TypeError"),
    ("def Mine(u, dt, parameters): return {'y': ['far'] * 60}", "Mine failed: ValueError"),
]


@pytest.mark.parametrize(("text", "says"), FAULTS)
def test_faults_of_the_user_are_one_line_with_her_line(
    tmp_path: Path, text: str, says: str
) -> None:
    assert says in fault_of(alone(written(tmp_path, text)))


def test_a_file_or_module_that_is_not_there(tmp_path: Path) -> None:
    assert "there is no such file" in fault_of(alone(tmp_path))
    assert "ModuleNotFoundError" in fault_of(alone(tmp_path, "no_module_of_this_name:Mine"))


def test_an_object_of_an_installed_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(tmp_path, GOOD).joinpath("mine.py").rename(tmp_path / "installed_simulator.py")
    monkeypatch.syspath_prepend(str(tmp_path))
    section = alone(tmp_path / "nowhere", "installed_simulator:Mine")
    assert steps_of(section).read() == [0.0]
