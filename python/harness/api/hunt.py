# SPDX-License-Identifier: MIT
"""Hunts a cause: experiment after experiment on a machine, until one cause is left."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from ..base.files import result_folder
from ..base.parallel import workers as using
from ..diagnosis.options import DiagnosisChoices, DiagnosisOptions
from ..hunt import hunting
from ..hunt.machines import Machine, machine_of
from ..records.record import told_apart
from ..show.hunt_page import EXPERIMENTS, FILES, experiment_rows, hunt_figure, hunt_lead, write_hunt
from ..show.page import Table, Told
from .diagnose import Diagnosis, read_for, sources
from .record import Record, Source
from .rig import Rig, RigSource, rig_of
from .tables import Shown
from .wording import LOGGER, in_python, progress_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Hunt(Shown):
    """The findings of `hunt`.

    Attributes
    ----------
    result
        `ehsid.harness.hunt.hunting.Hunt`: limits, steps and ending as typed data.
    hunted
        the same with the experiments and what came of them, as arrays.
    diagnosis
        the last diagnosis.
    records
        all records, those that were given first.
    """

    def __init__(self, hunted: hunting.Hunted, rig: Rig) -> None:
        self.hunted = hunted
        self.result = hunted.told
        self.rig = rig
        self.diagnosis = Diagnosis(hunted.diagnosis, hunted.records, rig)
        self.records = tuple(map(Record, hunted.records))

    @property
    def ending(self) -> str:
        """One of "cause", "sound", "outside", "nothing_more", "insufficient" and "budget"."""
        return self.result.ending

    @property
    def sentence(self) -> str:
        """Why the hunt ended, in a sentence."""
        return self.result.sentence

    def plot(self) -> Figure:
        """Returns a figure: the position in the experiments, and what is left as the cause."""
        return hunt_figure(self.hunted)

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Writes what `ehsid hunt --out` writes, with hunt.html, and returns the folder.

        Raises
        ------
        ValueError
            the folder cannot be written to, or has files of these names that ehsid did not write.
        """
        out = Path(folder)
        with in_python(), result_folder(out, "hunt", FILES) as made:
            write_hunt(self.hunted, made, str(self.rig.source or self.rig.name))
        return out

    def _line(self) -> str:
        return f"{self.result.machine}: {self.sentence} {self.diagnosis.sentence}"

    def _blocks(self) -> Sequence[Told]:
        return [*hunt_lead(self.result), Table("", EXPERIMENTS, experiment_rows(self.result))]


def hunt(
    machine: object,
    rig: RigSource,
    records: Source | Sequence[Source] = (),
    *,
    budget: int = 3,
    seed: int = 1,
    workers: int | None = None,
    progress: bool = True,
    **options: Unpack[DiagnosisChoices],
) -> Hunt:
    """Hunts a cause: diagnosis, the experiment that tells most, diagnosis, until one is left.

    Parameters
    ----------
    machine
        what the experiments run on: a class or an object with `reset` and `step`, as in
        docs/user_simulator.md; "FILE.py:NAME" of one; or the path of a rig file whose plant plays
        the machine.
    rig
        the machine as it is known: a rig of a plant of ehsid, or the path of a rig file.
    records
        records of the machine that there are; without them the first experiment is a look at the
        whole machine.
    budget
        most experiments, >= 1.
    seed
        of the noise, where a rig file plays the machine.
    workers
        number of processes; None takes one for each core.
    progress
        whether to show the progress: a bar on a terminal, else the logger `ehsid`.
    **options
        as of `ehsid.diagnose`; `limits`: an `ehsid.harness.diagnosis.Limits`, which no experiment
        may pass, by default the stroke, the rated command, and 1.5 times the supply pressure.

    Raises
    ------
    ValueError
        a record, the rig or the machine has a problem, or no experiment can be run within the
        limits.

    Examples
    --------
    >>> import ehsid
    >>> ehsid.hunt("secret.toml", "examples/rigs/bench.toml").plot()  # doctest: +SKIP
    >>> ehsid.hunt("secret.toml", "examples/rigs/bench.toml", budget=0)
    Traceback (most recent call last):
    ValueError: budget=0: expected at least one experiment
    """
    with in_python():
        if budget < 1:
            raise ValueError(f"budget={budget}: expected at least one experiment")
        known_rig = rig_of(rig)
        known = told_apart([read_for(one, known_rig) for one in sources(records)])
        chosen = DiagnosisOptions(**options)
        dt_s = hunting.experiment_dt(known)
        on: Machine = machine_of(machine, dt_s=dt_s, seed=seed)
        showing = progress_of(f"hunting on {on.name}") if progress else nullcontext()
        with showing as report, using(workers):
            hunted = hunting.hunt(
                on,
                known_rig.result,
                known,
                budget=budget,
                options=chosen,
                progress=report,
                note=LOGGER.info,
            )
    return Hunt(hunted, known_rig)
