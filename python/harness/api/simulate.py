# SPDX-License-Identifier: MIT
"""Simulates a rig."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from .. import records
from ..base.arrays import FloatArray
from ..base.files import result_files
from ..catalogue.channels import COMMAND, REQUIRED_COLUMNS
from ..records import read_record
from ..records.writing import format_of, record_bytes
from ..show.model_blocks import run_table
from ..show.page import Told
from ..signals import simulation
from ..signals.excitation.named import SIGNALS
from ..signals.simulation import SimulationRun, draw_noise
from ..signals.simulation.logged_command import logged_command
from ..signals.simulation.signal_options import SignalOptions, as_command, check_start
from .frames import Tabular
from .read import record_of
from .record import Record
from .rig import Rig, RigSource, rig_of
from .shown import Shown
from .wording import in_python, log_reading

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DT_S = 1e-3
DURATION_S = 10.0


class Simulation(Shown, Tabular):
    """A run of the simulator; its frame has time, command and all outputs.

    Attributes
    ----------
    result
        `ehsid.harness.signals.simulation.SimulationRun`.
    rig
        the rig that was simulated.
    """

    def __init__(self, result: SimulationRun, rig: Rig) -> None:
        self.result = result
        self.rig = rig

    @property
    def record(self) -> Record:
        """The run as a record, which every function takes."""
        return Record(self.result.record)

    def plot(self) -> Figure:
        """Returns a figure of command and outputs over time."""
        return self.record.plot()

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes what `ehsid simulate --out` writes, a record and a picture beside it.

        Parameters
        ----------
        path
            file of the record, which is returned; its ending says the format.

        Raises
        ------
        ValueError
            the ending is unknown, the file cannot be written, or there is one that ehsid did not
            write.
        """
        from ..show.plotting import write_figure

        out = Path(path)
        picture = out.with_suffix(".png").name
        with in_python():
            format_of(out)
            with result_files(out, "simulate", [picture]) as new:
                (new / out.name).write_bytes(record_bytes(self.result.record, out.name))
                write_figure(new / picture, self.plot())
        return out

    def _columns(self) -> Mapping[str, FloatArray]:
        record = self.result.record
        assert record.time_s is not None
        return {"time_s": record.time_s, **record.columns}

    def _line(self) -> str:
        record = self.result.record
        return (
            f"{self.rig.name}, {len(record)} samples, every {record.dt_s:.6g} s, "
            f"{self.result.substeps} steps of integration each"
        )

    def _blocks(self) -> Sequence[Told]:
        return [run_table(self.result), self._line()]


def simulate(
    rig: RigSource,
    command: str | os.PathLike[str] | Record | records.Record | npt.ArrayLike,
    *,
    dt_s: float | None = None,
    duration_s: float = DURATION_S,
    amplitude: float | None = None,
    values: Mapping[str, float] | None = None,
    noise: bool = False,
    seed: int = 0,
    position0_m: float | None = None,
) -> Simulation:
    """Simulates a rig on a logged command, on an array, or on a test signal.

    Parameters
    ----------
    rig
        a rig, or the path of a rig file.
    command
        a record with `command_v`, or its path; volts of shape (n,), which need `dt_s`; or the name
        of a test signal: "multisine", "prbs", "steps", "chirp" or "triangle".
    dt_s
        sampling time in seconds, of an array, or of a test signal, which has 0.001 without it.
    duration_s, amplitude
        length in seconds and peak in volts of a test signal; by default the peak is a tenth of the
        rated command.
    values
        values that replace those of the rig, by full name, such as
        {"effects.coulomb_friction.force_n": 400.0}.
    noise
        whether the noise of the sensors, which the rig gives, is added.
    seed
        of the test signal and of the noise.
    position0_m
        start in metres, within the stroke; mid-stroke by default.

    Raises
    ------
    ValueError
        the command is none for this rig, the start is outside the stroke, or the rod reaches an
        end of it; the message says how to mend it.

    Examples
    --------
    >>> import ehsid
    >>> rig = ehsid.Rig.read("examples/rigs/bench.toml")
    >>> run = ehsid.simulate(rig, "steps", duration_s=2.0, amplitude=1.0)
    >>> len(run.record), run.record.dt_s
    (2000, 0.001)
    """
    machine = rig_of(rig)
    room = machine.result
    is_signal = isinstance(command, str) and command in SIGNALS
    with in_python():
        check_start(room, position0_m)
        if is_signal:
            step = DT_S if dt_s is None else dt_s
            options = SignalOptions(str(command), duration_s, step, amplitude, seed)
            volts = as_command(room, options, position0_m)
        else:
            volts, step = _given(machine, command, dt_s)
        result = simulation.simulate(
            room,
            volts,
            dt_s=step,
            position0_m=position0_m,
            values=values,
            keep_inside=is_signal,
            noise=_noise(machine, volts.size, seed) if noise else None,
        )
    return Simulation(result, machine)


def _given(rig: Rig, command: object, dt_s: float | None) -> tuple[FloatArray, float]:
    """Returns the command of a record, of a file or of an array, and its sampling time."""
    if isinstance(command, Record | records.Record | str | os.PathLike):
        if dt_s is not None:
            raise ValueError(
                "dt_s: a record has its own sampling time; leave dt_s out, or read the record with "
                "ehsid.read(path, dt_s=...)"
            )
        return logged_command(_logged(rig, command), rig.result)
    volts = np.asarray(command, dtype=np.float64) if not np.ma.isMaskedArray(command) else command
    if dt_s is None or not 0.0 < dt_s < float("inf"):
        raise ValueError(
            f"dt_s={dt_s}: an array has no time: expected its sampling time in seconds, above 0"
        )
    return simulation.run.checked_samples("command", volts), dt_s


def _logged(rig: Rig, command: Record | records.Record | str | os.PathLike[str]) -> records.Record:
    if isinstance(command, Record | records.Record):
        return record_of(command)
    if isinstance(command, str) and not Path(command).suffix:
        raise ValueError(
            f"command={command!r}: expected a test signal ({', '.join(SIGNALS)}), the path of a "
            "record, a record, or an array of volts"
        )
    layout = rig.result.columns
    record = read_record(command, columns=[COMMAND], required=REQUIRED_COLUMNS, layout=layout)
    log_reading(record)
    return record


def _noise(rig: Rig, samples: int, seed: int) -> FloatArray:
    if not any(rig.result.sensors.values()):
        raise ValueError(
            f"noise=True: the rig '{rig.name}' gives no sensor noise; add position_noise_m to "
            "[sensors] of its file"
        )
    # The noise has another random stream than the test signal, as in `ehsid simulate`.
    return draw_noise(rig.result, samples, np.random.default_rng([seed, 1]))
