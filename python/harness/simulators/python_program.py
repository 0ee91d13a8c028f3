# SPDX-License-Identifier: MIT
"""A simulator in Python: a class that is stepped, or a function that simulates a whole record.

What goes wrong in the user's file becomes one line with the exception and its line.
"""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import os
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, Self

import numpy as np

from ..base.numbers import FloatArray
from ..rigs.simulator_section import COMMAND, OUTPUTS, PORTS, Signal, SimulatorSection
from .source import Place, read_place
from .steppers import PythonRecord, PythonSteps, SimulatorError

EXPECTED = "expected a class with reset and step, or a function of a whole record"


class OpenedPython:
    """An opened class, object or function."""

    once_per_process = False
    remarks: tuple[str, ...] = ()

    def __init__(self, section: SimulatorSection) -> None:
        self._section = section
        self._what = section.what
        self._file = ""
        found: Any = section.function if section.function is not None else self._loaded()
        is_stepped = all(callable(getattr(found, name, None)) for name in ("reset", "step"))
        if isinstance(found, type) and is_stepped:
            with self._running(f"{found.__name__}()"):
                found = found()
        elif isinstance(found, type) or not (is_stepped or callable(found)):
            kind = "class without reset and step" if isinstance(found, type) else "value"
            raise SimulatorError(self._what, f"it is a {kind}: {EXPECTED}")
        self._found: Any = found
        self._is_stepped = is_stepped
        inputs = {**section.inputs, **section.ports}
        self.inputs = (COMMAND, *(name for name in PORTS if name in section.ports))
        self.outputs = tuple(name for name in OUTPUTS if name in section.outputs)
        self._in = [inputs[name] for name in self.inputs]
        self._out = [section.outputs[name] for name in self.outputs]
        self.rest = self._rest()
        if is_stepped:
            self._check_names()

    def start(
        self, values: Mapping[str, float], position_m: float | None = None
    ) -> PythonSteps | PythonRecord:
        """Brings the simulator to its start with values by its own names."""
        settings: dict[str, Any] = {}
        parameters = {**self._section.constants, **values}
        if parameters:
            settings["parameters"] = parameters
        begin = self._section.start.get("position_m")
        if begin is not None and position_m is not None:
            settings[begin.name] = begin.scale * position_m + begin.offset
        return self._steps(settings) if self._is_stepped else PythonRecord(self._record(settings))

    def close(self) -> None:
        """Forgets the object."""
        self._found = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _loaded(self) -> Any:
        """Returns what the section names; the user's module runs."""
        place = read_place(self._section.python or "")
        if place is None:
            raise SimulatorError(self._what, "expected FILE.py:NAME, or MODULE:NAME")
        with self._running("import"):
            found: Any = self._module(place)
        for part in place.name.split("."):
            if not hasattr(found, part):
                raise SimulatorError(
                    self._what, f"nothing in {place.where} has the name '{place.name}': {EXPECTED}"
                )
            found = getattr(found, part)
        return found

    def _module(self, place: Place) -> ModuleType:
        if not place.is_file:
            self._file = place.where
            return importlib.import_module(place.where)
        path = Path(os.path.normpath(self._section.base / place.where)).absolute()
        if not path.is_file():
            raise SimulatorError(self._what, f"{path}: there is no such file; check the path")
        self._file = str(path)
        name = f"_ehsid_simulator_{path.stem}"
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        # So that it can import what stands beside it, as when Python runs it.
        if str(path.parent) not in sys.path:
            sys.path.insert(0, str(path.parent))
        spec.loader.exec_module(module)
        return module

    @contextmanager
    def _running(self, call: str) -> Iterator[None]:
        """Turns what the user's program raises into one line."""
        try:
            yield
        except SimulatorError:
            raise
        except (Exception, SystemExit) as error:
            raise self._failed(call, error) from None

    def _failed(self, call: str, error: BaseException) -> SimulatorError:
        if isinstance(error, SyntaxError):
            return SimulatorError(
                self._what, f"line {error.lineno} of {error.filename}: {error.msg}"
            )
        frames = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in frames if frame.filename == self._file]
        here = str(Path(__file__).parent)
        others = [frame for frame in frames if not frame.filename.startswith((here, "<frozen"))]
        place = ""
        if own or others:
            frame = (own or others)[-1]
            place = f", line {frame.lineno} of {Path(frame.filename).name}"
        text = f": {error}" if str(error) else ""
        return SimulatorError(
            self._what,
            f"{call} failed{place}: {type(error).__name__}{text}; correct the simulator, or the "
            "names in the rig file",
        )

    def _rest(self) -> dict[str, float]:
        """Returns the defaults of the inputs in the signature of `step`."""
        if not self._is_stepped:
            return {}
        try:
            known = inspect.signature(self._found.step).parameters
        except (TypeError, ValueError):
            return {}
        return {
            name: (float(known[signal.name].default) - signal.offset) / signal.scale
            for name, signal in zip(self.inputs, self._in, strict=True)
            if signal.name in known and isinstance(known[signal.name].default, int | float)
        }

    def _check_names(self) -> None:
        for attribute, signals in (("inputs", self._in), ("outputs", self._out)):
            names = getattr(self._found, attribute, None)
            if names is None:
                continue
            missing = [one.name for one in signals if one.name not in names]
            if missing:
                raise SimulatorError(
                    self._what,
                    f"its attribute {attribute} has no {', '.join(missing)}: it has "
                    f"{', '.join(map(str, names)) or 'none'}; correct the rig file",
                )

    def _steps(self, settings: Mapping[str, Any]) -> PythonSteps:
        found, step = self._found, self._found.step
        with self._running("reset"):
            given = found.reset(**settings)
            if given is None and callable(getattr(found, "read", None)):
                given = found.read()
        pick = self._picker(given, "reset")
        out = [(signal.scale, signal.offset) for signal in self._out]
        scales = [(signal.scale, signal.offset) for signal in self._in]
        ports = [signal.name for signal in self._in[1:]]

        def si(raw: Any) -> list[float]:
            return [(float(v) - o) / s for v, (s, o) in zip(pick(raw), out, strict=True)]

        with self._running("reset"):
            latest = [si(given)]

        def advance(dt_s: float, inputs: Sequence[float]) -> list[float]:
            try:
                command, *rest = (s * x + o for x, (s, o) in zip(inputs, scales, strict=True))
                raw = step(dt_s, command, **dict(zip(ports, rest, strict=True)))
                latest[0] = si(raw)
            except Exception as error:
                raise self._failed("step", error) from None
            return latest[0]

        return PythonSteps(read=lambda: latest[0], step=advance)

    def _picker(self, given: Any, call: str) -> Callable[[Any], list[Any]]:
        """Returns what takes the outputs of this simulator out of what it returns."""
        names = [signal.name for signal in self._out]
        if isinstance(given, Mapping):
            self._check_keys(given, names, call)
            return lambda raw: [raw[name] for name in names]
        own = getattr(self._found, "outputs", None)
        if own is None and len(names) == 1 and np.ndim(given) == 0 and given is not None:
            return lambda raw: [raw]
        if own is None or given is None or np.ndim(given) != 1:
            raise SimulatorError(
                self._what,
                f"{call} returned {_kind(given)}: expected the outputs, as a dictionary by name, "
                "or as a sequence in the order of an attribute 'outputs'",
            )
        if len(given) != len(own):
            raise SimulatorError(
                self._what,
                f"{call} returned {len(given)} values: expected {len(own)}, those of its attribute "
                "outputs",
            )
        places = [list(own).index(name) for name in names]
        return lambda raw: [raw[place] for place in places]

    def _check_keys(self, given: Mapping[str, Any], names: Sequence[str], call: str) -> None:
        missing = [name for name in names if name not in given]
        if missing:
            raise SimulatorError(
                self._what,
                f"{call} returned no {', '.join(missing)}: it returned "
                f"{', '.join(map(str, given)) or 'nothing'}; correct the rig file",
            )

    def _record(
        self, settings: Mapping[str, Any]
    ) -> Callable[[float, Mapping[str, FloatArray]], dict[str, FloatArray]]:
        name = getattr(self._found, "__name__", "the function")

        def run(dt_s: float, inputs: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
            command, *ports = (
                signal.scale * np.asarray(inputs[contract]) + signal.offset
                for contract, signal in zip(self.inputs, self._in, strict=True)
            )
            more = dict(settings)
            if ports:
                of = (signal.name for signal in self._in[1:])
                more["ports"] = dict(zip(of, ports, strict=True))
            with self._running(name):
                given = self._found(command, dt_s, **more)
            if not isinstance(given, Mapping):
                raise SimulatorError(
                    self._what,
                    f"{name} returned {_kind(given)}: expected a dictionary, name -> values",
                )
            self._check_keys(given, [signal.name for signal in self._out], name)
            return {
                contract: self._column(name, signal, given[signal.name], command.size)
                for contract, signal in zip(self.outputs, self._out, strict=True)
            }

        return run

    def _column(self, call: str, signal: Signal, given: Any, samples: int) -> FloatArray:
        with self._running(call):
            values = np.asarray(given, dtype=np.float64)
        if values.shape != (samples,):
            raise SimulatorError(
                self._what,
                f"{call} returned {signal.name} of the shape {values.shape}: expected one value "
                f"for each of the {samples} samples",
            )
        return (values - signal.offset) / signal.scale


def _kind(given: Any) -> str:
    return "nothing" if given is None else f"a {type(given).__name__}"
