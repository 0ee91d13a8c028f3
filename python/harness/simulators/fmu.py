# SPDX-License-Identifier: MIT
"""An FMU as a simulator: unpacked, loaded with FMPy, instantiated, and brought to its start."""

from __future__ import annotations

import ctypes
import os
import shutil
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import mkdtemp
from typing import Any, Self

import numpy as np

from ..base.error_words import install_line, printable
from ..rigs.simulator_section import COMMAND, OUTPUTS, PORTS, Signal, SimulatorSection
from .description import Description, FmuError, Variable, open_archive, read_description
from .steppers import FmuFunctions, SimulatorError

# Type of a variable -> end of the name of the function that sets it, and its C type, by version.
_SETTERS: dict[int, dict[str, tuple[str, Any]]] = {
    2: {
        "Real": ("Real", ctypes.c_double),
        "Integer": ("Integer", ctypes.c_int),
        "Enumeration": ("Integer", ctypes.c_int),
        "Boolean": ("Boolean", ctypes.c_int),
    },
    3: {
        "Float64": ("Float64", ctypes.c_double),
        "Int32": ("Int32", ctypes.c_int32),
        "Int64": ("Int64", ctypes.c_int64),
        "Enumeration": ("Int64", ctypes.c_int64),
        "Boolean": ("Boolean", ctypes.c_bool),
    },
}
# More of what an FMU reports is of no help in a message.
MOST_CHARACTERS = 200


class OpenedFmu:
    """An opened FMU."""

    def __init__(self, section: SimulatorSection, folder: Path | None = None) -> None:
        self._section = section
        self._what = section.what
        try:
            self._description = read_description(section.path)
        except FmuError as error:
            raise SimulatorError(self._what, str(error)) from None
        if not self._description.runs_here:
            raise SimulatorError(
                self._what,
                "has no library for this platform: its platforms are: "
                f"{', '.join(self._description.platforms) or 'none'}; export it for this platform",
            )
        inputs = {**section.inputs, **section.ports}
        self.inputs = (COMMAND, *(name for name in PORTS if name in section.ports))
        self.outputs = tuple(name for name in OUTPUTS if name in section.outputs)
        self._in = [inputs[name] for name in self.inputs]
        self._out = [section.outputs[name] for name in self.outputs]
        self._references = {
            name: self._variable(name).reference for name in (s.name for s in self._in + self._out)
        }
        self.rest = {
            name: (start - signal.offset) / signal.scale
            for name, signal in zip(self.inputs, self._in, strict=True)
            if (start := self._variable(signal.name).start) is not None
        }
        self._reported: list[str] = []
        self._running = False
        self._folder = Path(mkdtemp(prefix="ehsid-fmu-", dir=folder))
        try:
            self._unpack()
            self._fmu = self._load()
        except BaseException:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise

    @property
    def once_per_process(self) -> bool:
        """Whether a process can have one instance of it only."""
        return self._description.once_per_process

    @property
    def description(self) -> Description:
        """What the FMU says of itself."""
        return self._description

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a user should know of it."""
        return self._description.remarks

    def start(self, values: Mapping[str, float], position_m: float | None = None) -> FmuFunctions:
        """Brings the FMU to its start with values by its own names."""
        self._renew()
        settings = {**self._section.constants, **values}
        begin = self._section.start.get("position_m")
        if begin is not None and position_m is not None:
            settings[begin.name] = begin.scale * position_m + begin.offset
        fmu, major = self._fmu, self._description.major
        with self._calling("its initialisation"):
            if major == 2:
                fmu.fmi2SetupExperiment(fmu.component, 0, 0.0, 0.0, 0, 0.0)
            for name, value in settings.items():
                self._set(self._variable(name), value)
            if major == 2:
                fmu.fmi2EnterInitializationMode(fmu.component)
                fmu.fmi2ExitInitializationMode(fmu.component)
            else:
                fmu.fmi3EnterInitializationMode(fmu.component, False, 0.0, 0.0, False, 0.0)
                fmu.fmi3ExitInitializationMode(fmu.component)
        return self._functions()

    def close(self) -> None:
        """Ends the instance, unloads the library, and removes what was unpacked."""
        if self._fmu is None:
            return
        fmu, self._fmu = self._fmu, None
        with suppress(Exception):
            if self._running:
                _function(fmu, self._description.major, "Terminate")(fmu.component)
        with suppress(Exception):
            if self._running:
                fmu.freeInstance()
            else:
                fmu.freeLibrary()
        shutil.rmtree(self._folder, ignore_errors=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _variable(self, name: str) -> Variable:
        found = self._description.variables.get(name)
        if found is None:
            raise SimulatorError(self._what, f"has no variable '{name}'; correct the rig file")
        return found

    def _unpack(self) -> None:
        """Unpacks the FMU, whose names and sizes are checked before."""
        try:
            with open_archive(self._section.path) as archive:
                archive.extractall(self._folder)
        except FmuError as error:
            raise SimulatorError(self._what, str(error)) from None
        except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as why:
            raise SimulatorError(
                self._what, f"is damaged ({why}): export or copy it again"
            ) from None

    def _load(self) -> Any:
        """Returns the FMU with its library loaded: from here on its code may run."""
        try:
            from fmpy.fmi2 import FMU2Slave
            from fmpy.fmi3 import FMU3Slave
        except ImportError:
            raise SimulatorError(
                self._what,
                "FMPy is missing, which loads FMUs: expected the packages of the extra 'fmu'; "
                f"install them: {install_line('fmu')}",
            ) from None
        before = Path.cwd()
        try:
            return (FMU2Slave if self._description.major == 2 else FMU3Slave)(
                guid=self._description.token,
                modelIdentifier=self._description.identifier,
                unzipDirectory=str(self._folder),
                instanceName="ehsid",
            )
        except AttributeError as error:
            # FMPy looks for all functions of the standard, some of which exporters leave out.
            missing = str(error).rpartition(" ")[2].strip("'\"")
            raise SimulatorError(
                self._what,
                f"its library has no function {missing}, which FMI {self._description.version} "
                "asks for: export it again, or for another version of FMI",
            ) from None
        except Exception as error:
            reason = str(error).replace(str(self._folder), "").strip()
            raise SimulatorError(
                self._what, f"its library cannot be loaded ({_shown(reason)})"
            ) from None
        finally:
            os.chdir(before)  # FMPy stays in the folder of a library that cannot be loaded

    def _renew(self) -> None:
        """Resets the instance; makes a new one at first, and where it cannot be reset."""
        if self._fmu is None:
            raise SimulatorError(self._what, "is closed")
        fmu, major = self._fmu, self._description.major
        if self._running:
            try:
                _function(fmu, major, "Reset")(fmu.component)
                return
            except Exception as error:
                if self.once_per_process:
                    raise SimulatorError(
                        self._what,
                        f"cannot be reset ({error}), and a process can have one instance of it "
                        "only: export it with a reset that works",
                    ) from None
                with suppress(Exception):
                    _function(fmu, major, "FreeInstance")(fmu.component)
                self._running = False
        with self._calling("instantiation"):
            try:
                self._instantiate(fmu, log=False)
            except Exception:
                # With its log on, it tells why.
                self._instantiate(fmu, log=True)
        self._running = True

    def _instantiate(self, fmu: Any, *, log: bool) -> None:
        if self._description.major == 2:
            fmu.instantiate(callbacks=self._callbacks(), loggingOn=log)
        else:
            fmu.instantiate(logMessage=self._hear3, loggingOn=log)

    def _callbacks(self) -> Any:
        """Returns the callbacks of FMI 2, with a logger that prints nothing."""
        from fmpy import calloc, fmi2, free

        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._hear2)
        callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(calloc)
        callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
        return callbacks

    def _hear2(self, _env: Any, _name: Any, status: int, _category: Any, message: Any) -> None:
        self._hear(status, message)

    def _hear3(self, _env: Any, status: int, _category: Any, message: Any) -> None:
        self._hear(status, message)

    def _hear(self, status: int, message: bytes | None) -> None:
        """Keeps the last message of the FMU, for the error that may follow."""
        if status > 1 and message:
            self._reported[:] = [message.decode("utf-8", "replace")]

    @contextmanager
    def _calling(self, step: str) -> Iterator[None]:
        self._reported.clear()
        try:
            yield
        except SimulatorError:
            raise
        except Exception as error:
            reported = f"; it reports: {_shown(self._reported[0])}" if self._reported else ""
            raise SimulatorError(
                self._what,
                f"{step} failed ({_shown(str(error)).rstrip('.')}){reported}; check the values in "
                "the rig file",
            ) from None

    def _set(self, variable: Variable, value: float) -> None:
        setters = _SETTERS[self._description.major]
        if variable.type_name not in setters:
            raise SimulatorError(
                self._what, f"'{variable.name}' is a {variable.type_name}: expected a number"
            )
        kind, c_type = setters[variable.type_name]
        number = value if c_type is ctypes.c_double else int(value)
        references, values = (ctypes.c_uint * 1)(variable.reference), (c_type * 1)(number)
        setter = _function(self._fmu, self._description.major, f"Set{kind}")
        sizes = (1,) if self._description.major == 3 else ()
        try:
            setter(self._fmu.component, references, 1, values, *sizes)
        except Exception as error:
            raise SimulatorError(
                self._what, f"refuses {variable.name} = {value:g} ({_shown(str(error))})"
            ) from None

    def _functions(self) -> FmuFunctions:
        fmu, major = self._fmu, self._description.major
        kind = "Real" if major == 2 else "Float64"
        component = fmu.component
        return FmuFunctions(
            major=major,
            component=int(getattr(component, "value", component)),
            set_real=_address(fmu, major, f"Set{kind}"),
            do_step=_address(fmu, major, "DoStep"),
            get_real=_address(fmu, major, f"Get{kind}"),
            input_refs=self._refs(self._in),
            output_refs=self._refs(self._out),
            input_scale=np.array([signal.scale for signal in self._in]),
            input_offset=np.array([signal.offset for signal in self._in]),
            output_scale=np.array([signal.scale for signal in self._out]),
            output_offset=np.array([signal.offset for signal in self._out]),
            keep=self,
        )

    def _refs(self, signals: list[Signal]) -> np.ndarray[Any, np.dtype[np.uint32]]:
        return np.array([self._references[signal.name] for signal in signals], dtype=np.uint32)


def _function(fmu: Any, major: int, name: str) -> Any:
    return getattr(fmu, f"fmi{major}{name}")


def _address(fmu: Any, major: int, name: str) -> int:
    function = getattr(fmu.dll, f"fmi{major}{name}")
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)


def _shown(text: str) -> str:
    """Returns text of others on one line, cut."""
    line = printable(" ".join(text.split()))
    return line if len(line) <= MOST_CHARACTERS else line[: MOST_CHARACTERS - 3] + "..."
