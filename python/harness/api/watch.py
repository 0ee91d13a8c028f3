# SPDX-License-Identifier: MIT
"""Watches machines over months: what changed in their dated logs, and when."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from .. import rigs
from ..base.files import result_folder
from ..base.parallel import workers as using
from ..records import Record
from ..show.page import Table, Told
from ..show.watch_page import CHANGES, FILES, change_rows, life_figure, watch_lead, write_watch
from ..watch import watching
from ..watch.store import FILE, opened
from ..watch.tracking import WEAR
from .diagnose import read_for
from .rig import Rig
from .tables import Shown, Tabular
from .wording import in_python, progress_of

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.figure import Figure


class Watch(Shown, Tabular):
    """The findings of `watch`.

    Attributes
    ----------
    machines
        of each machine its name, its logs, and the courses of its quantities with their changes:
        `ehsid.harness.watch.watching.WatchedMachine`.
    """

    def __init__(self, told: watching.Watch) -> None:
        self._told = told
        self.machines = told.machines

    def plot(self, machine: str | None = None) -> Figure:
        """Returns a figure of the courses of a machine, by default of the first one.

        Raises
        ------
        ValueError
            there is no such machine, or its logs are too few.
        """
        names = [each.name for each in self.machines]
        if machine is not None and machine not in names:
            raise ValueError(f"there is no machine '{machine}': expected one of {', '.join(names)}")
        one = self.machines[names.index(machine) if machine else 0]
        if not one.quantities:
            raise ValueError(f"{one.name}: {one.logs} logs are too few to draw a course")
        return life_figure(one.quantities, one.oil_temperature)

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Writes watch.html and watch.json, and returns the folder.

        Raises
        ------
        ValueError
            the folder cannot be written to, or has files of these names that ehsid did not write.
        """
        out = Path(folder)
        with in_python(), result_folder(out, "watch", FILES) as made:
            write_watch(self._told, made)
        return out

    def _columns(self) -> Mapping[str, npt.ArrayLike]:
        """Returns a row for each log and quantity."""
        rows = [
            (machine.name, one.name, one.unit, *of_log)
            for machine in self.machines
            for one in machine.quantities
            for of_log in zip(one.dates, one.values, one.deviations, one.pooled, strict=True)
        ]
        names = ("machine", "quantity", "unit", "date", "value", "deviation", "pooled")
        return {name: [row[place] for row in rows] for place, name in enumerate(names)}

    def _line(self) -> str:
        return " ".join(watch_lead(self._told))

    def _blocks(self) -> Sequence[Told]:
        return [*watch_lead(self._told), Table("", CHANGES, change_rows(self._told))]


def watch(
    folder: str | os.PathLike[str],
    history: str | os.PathLike[str],
    *,
    track: Sequence[str] = WEAR,
    workers: int | None = None,
    progress: bool = True,
) -> Watch:
    """Watches machines over months: when something changed, by how much, and what could be seen.

    Parameters
    ----------
    folder
        has rig.toml and the dated logs of a machine, or a sub-folder with them for each machine.
    history
        folder of history.sqlite, as `--out` of `ehsid watch`; it is made where there is none, and
        new logs are added.
    track
        ids of the effects whose sizes are watched.
    workers
        number of processes; None takes one for each core.
    progress
        whether to show the progress: a bar on a terminal, else the logger `ehsid`.

    Raises
    ------
    ValueError
        the folder has no machine, a rig file is wrong, a log has no date in its name, an effect is
        not in the catalogue, or the file is no history. Logs that cannot be used are no error.

    Examples
    --------
    >>> import ehsid
    >>> ehsid.watch("press7", "history").plot()  # doctest: +SKIP
    >>> ehsid.watch("examples/rigs", "history")  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
    ValueError: examples/rigs: has no rig.toml
    """
    with in_python():
        machines = watching.logs_in(Path(folder), track)
        Path(history).mkdir(parents=True, exist_ok=True)
        with opened(Path(history) / FILE) as known:
            new = watching.new_logs(machines, known)
            showing = progress_of(f"fitting {len(new)} logs") if new and progress else nullcontext()
            with showing as report, using(workers):
                for count, _ in enumerate(watching.fit_and_keep(new, known, _read), 1):
                    if report is not None:
                        report(count / len(new))
            return Watch(watching.told_of(machines, known))


def _read(path: Path, rig: rigs.Rig) -> Record:
    return read_for(path, Rig(rig))
