# SPDX-License-Identifier: MIT
"""Simulates a rig.

One input and one output, of whatever the caller has.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from .. import records
from ..base.error_words import printable
from ..base.files import result_files
from ..base.numbers import FloatArray
from ..catalogue.channels import CHANNELS, COMMAND, REQUIRED_COLUMNS, TIME
from ..models.identification import IoData
from ..records import Origin, read_record
from ..records.record import format_of, record_bytes
from ..show.model_blocks import run_table
from ..show.page import Told
from ..signals import simulation
from ..signals.excitation.shapes import SIGNALS
from ..signals.simulation import SimulationRun, draw_noise
from ..signals.simulation.outside import opened_outside, simulate_outside
from ..signals.simulation.run import logged_command
from ..signals.simulation.settings import SignalOptions, as_command, check_start
from .record import Record, Source, record_of
from .rig import Rig, RigSource, rig_of
from .tables import Shown, Tabular
from .wording import in_python, log_reading

if TYPE_CHECKING:
    from matplotlib.figure import Figure


DT_S = 1e-3
DURATION_S = 10.0


class Simulation(Shown, Tabular):
    """A run of the simulator; its frame has time, command and the outputs.

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
    with in_python(), ExitStack() as stack:
        check_start(room, position0_m)
        step, volts = DT_S if dt_s is None else dt_s, None
        if not is_signal:
            volts, step = _given(machine, command, dt_s)
        runs = stack.enter_context(opened_outside(room, position0_m))
        if volts is None:
            options = SignalOptions(str(command), duration_s, step, amplitude, seed)
            speed = None if runs is None else runs.measured.speed_per_volt
            volts = as_command(room, options, position0_m, speed)
        settings: dict[str, Any] = {
            "dt_s": step,
            "position0_m": position0_m,
            "values": values,
            "keep_inside": is_signal,
            "noise": _noise(machine, volts.size, seed) if noise else None,
        }
        if runs is None:
            result = simulation.simulate(room, volts, **settings)
        else:
            result = simulate_outside(runs, volts, **settings)
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


Arrays = tuple[npt.ArrayLike, npt.ArrayLike, float | None]
"""Input, output and sampling time in seconds."""


@dataclass(frozen=True)
class Signals:
    """Input and output with what is known of them."""

    data: IoData
    """The samples."""
    name: str
    """Of the record."""
    origin: Origin | None = None
    """How a log became the record; None for a record or arrays."""
    source: Path | None = None
    """File of the record; None for one in memory."""

    @property
    def inputs(self) -> list[Path]:
        """Files that no result may replace."""
        return [] if self.source is None else [self.source]

    @property
    def output_label(self) -> str:
        """Name of the output with its unit, for an axis."""
        name = self.data.output_name
        return f"{name} in {CHANNELS[name].unit}" if name in CHANNELS else printable(name)


def signals_of(
    source: Source | Arrays | npt.ArrayLike,
    input: str,
    output: str,
    arrays: Sequence[object] = (),
) -> Signals:
    """Returns input and output of a record, or of arrays.

    Parameters
    ----------
    source
        as `read` takes it, a record, or the tuple (u, y, dt_s). Of a file only the two columns are
        read, as the commands do.
    input, output
        names of the columns; for arrays, of the signals in messages.
    arrays
        what follows the first of plain arrays: (y, dt_s), where `source` is u.

    Raises
    ------
    ValueError
        the record has a problem or lacks a column; both names are the same, or that of the time.
    """
    if arrays or isinstance(source, tuple):
        given = cast(tuple[Any, ...], (source, *arrays) if arrays else source)
        if len(given) != 3:
            raise ValueError(
                f"{len(given)} arguments or entries of a tuple: expected u, y, dt_s, with None for "
                "dt_s where the sampling time is not known; pass options by name"
            )
        u, y, dt_s = given
        number = isinstance(dt_s, int | float | np.number)
        if dt_s is not None and not (number and 0.0 < dt_s < float("inf")):
            raise ValueError(f"dt_s = {dt_s!r}: expected a sampling time in seconds, above 0")
        return Signals(IoData.from_arrays(u, y, dt_s=dt_s), "arrays")
    if input == output or TIME in (input, output):
        raise ValueError(
            f"input={input!r}, output={output!r}: expected two columns, neither of them the time; "
            "name the command as the input and the measured signal as the output"
        )
    if isinstance(source, str | os.PathLike):
        record = read_record(source, columns=[input, output])
        log_reading(record)
    else:
        record = record_of(cast(Source, source))
    data = IoData.from_record(record, input, output)
    return Signals(data, record.name, record.origin, record.source)


@contextmanager
def about(signals: Signals) -> Iterator[None]:
    """Puts the file or the name of the record in front of the message of a ValueError."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{signals.source or signals.name}: {error}") from error
