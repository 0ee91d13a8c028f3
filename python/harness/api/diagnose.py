# SPDX-License-Identifier: MIT
"""Diagnoses why a simulation and the records of its machine disagree."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

from .. import diagnosis as gap
from .. import records
from ..base.files import result_folder
from ..base.parallel import workers as using
from ..catalogue.channels import CHANNELS, POSITION, REQUIRED_COLUMNS
from ..catalogue.parameters import plain_name
from ..diagnosis.edits import EditTest, Twin, edit_test, parse_edits
from ..diagnosis.options import DiagnosisChoices, DiagnosisOptions
from ..diagnosis.result import diagnosis_file
from ..diagnosis.schema import RESULT_FILES, Estimate
from ..diagnosis.user_simulator import engine_of
from ..records import read_record
from ..records.errors import nearest_name
from ..records.record import told_apart
from ..show.gap_words import summary_tables, told_reasons, told_remarks
from ..show.page import Items, Told
from ..show.units import percent
from ..show.verdict_words import VERDICTS
from ..simulators.callables import rig_around, with_function
from .record import Record, Source, record_of
from .rig import Rig, RigSource, rig_of
from .tables import Shown, Tabular
from .wording import in_python, log_reading, progress_of

if TYPE_CHECKING:
    import numpy.typing as npt
    import polars as pl
    from matplotlib.figure import Figure


class Diagnosis(Tabular, Shown):
    """The findings of `diagnose`.

    Attributes
    ----------
    result
        `ehsid.harness.diagnosis.Diagnosis`, all findings as typed data.
    records
        the records that it rests on.
    rig
        the rig as configured.
    """

    def __init__(self, result: gap.Diagnosis, used: Sequence[records.Record], rig: Rig) -> None:
        self.result = result
        self.records = tuple(map(Record, used))
        self.rig = rig

    @property
    def verdict(self) -> str:
        """One of "no_gap", "parameters", "effects", "ambiguous", "outside_catalogue" and
        "insufficient_data".
        """
        return self.result.verdict

    @property
    def sentence(self) -> str:
        """The verdict in one sentence."""
        return self.result.sentence

    @property
    def effects(self) -> dict[str, dict[str, Estimate]]:
        """The effects that were found, by id: each size in SI with `value`, `low` and `high`.

        The interval from `low` to `high` is one of 90 %.
        """
        return {effect.id: effect.parameters for effect in self.result.effects}

    @property
    def augmented_rig(self) -> Rig:
        """The rig with the estimated values and the effects that were found."""
        return Rig(self.result.augmented_rig)

    def plot(self) -> Figure:
        """Returns a figure of the first held-out record: measured and simulated, and the errors.

        Raises
        ------
        ValueError
            nothing was simulated, because the data are insufficient.
        """
        from ..show.record_figure import run_figure

        if not self.result.runs:
            raise ValueError(
                "there is no simulation to draw: the records do not carry a diagnosis; summary() "
                "says what they lack"
            )
        return run_figure(self.result.runs[0])

    def edit_test(
        self, records: Source | Sequence[Source], effects: Mapping[str, float] | None = None
    ) -> EditTest:
        """Tests whether a change of the machine was what was named: `ehsid gap-edit`.

        Parameters
        ----------
        records
            records that were taken after the change, as for `diagnose`.
        effects
            share of the size that should be left, 0 to 2, by id of a named effect; without it each
            named effect is removed alone, and then all of them.

        Returns
        -------
        The outcome with its `sentence`, and for each edit the gap and the share that is left.

        Raises
        ------
        ValueError
            nothing was named, an id is none of the named effects, or a record cannot be used.
        """
        asked = [f"{effect}={share}" for effect, share in (effects or {}).items()]
        used = [record.result for record in self.records]
        file = diagnosis_file(self.result, used, str(self.rig.source or self.rig.name))
        with in_python():
            twin = Twin(self.rig.name, self.result.augmented_rig, file)
            after = told_apart([read_for(one, self.rig) for one in sources(records)])
            with engine_of(twin.rig) as engine:
                return edit_test(twin, after, parse_edits(asked, twin), engine=engine)[0]

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Writes what `ehsid gap --out` writes, with report.html, and returns the folder.

        Raises
        ------
        ValueError
            the folder cannot be written to, or has files of these names that ehsid did not write.
        """
        from ..show.gap_page import write_diagnosis

        out = Path(folder)
        used = [record.result for record in self.records]
        files = [*(record.source for record in used), self.rig.source]
        inputs = [path for path in files if path is not None]
        with in_python(), result_folder(out, "gap", RESULT_FILES, inputs) as new:
            write_diagnosis(new, self.result, used, str(self.rig.source or self.rig.name))
        return out

    def to_polars(self) -> pl.DataFrame:
        """Returns the held-out samples with their simulations, as in simulation.csv.

        Raises
        ------
        ModuleNotFoundError
            polars is not installed.
        """
        return super().to_polars().fill_nan(None)

    def _columns(self) -> Mapping[str, npt.ArrayLike]:
        from ..show.gap_page import simulation_table

        return simulation_table(self.result.runs)

    def _line(self) -> str:
        title = VERDICTS[self.result.verdict].title
        far = self.result.how_far
        if far is None:
            return f"{self.rig.name}, {title}"
        return (
            f"{self.rig.name}, {title}; gap on held-out data {percent(far.nominal)} as configured, "
            f"{percent(far.augmented)} with what was found"
        )

    def _blocks(self) -> Sequence[Told]:
        found = self.result
        lines: list[Told] = [*summary_tables(found), found.sentence, Items(told_reasons(found))]
        if found.next_experiment is not None:
            lines.append(f"Next experiment: {found.next_experiment.description}.")
        lines += [
            f"Could not be judged: {plain_name(one.id)}: {one.why}" for one in found.cannot_judge
        ]
        for remark in told_remarks(found):
            about = f"{remark.record}: " if remark.record else ""
            lines.append(f"{'serious' if remark.serious else 'note'}: {about}{remark.what}")
        return lines


def diagnose(
    records: Source | Sequence[Source],
    rig: RigSource | None = None,
    *,
    simulator: Callable[..., Any] | None = None,
    validate: Source | Sequence[Source] = (),
    workers: int | None = None,
    progress: bool = True,
    **options: Unpack[DiagnosisChoices],
) -> Diagnosis:
    """Diagnoses the gap between a machine and its simulation: where, which effect, how far.

    Parameters
    ----------
    records
        records to fit, each a record, a path, or columns in memory with `command_v` and
        `position_m`; one of them needs no list.
    rig
        a rig, or the path of a rig file. It can be left out beside a simulator that tells its
        names and values itself.
    simulator
        your own simulator in place of ours: a class or an object with `reset` and `step`, or a
        function of a whole record; see docs/user_simulator.md. With a rig of plant "simulator" it
        takes the place of the program that the rig file names.
    validate
        records to judge by; without them blocks of the others are held out. They are fitted only
        if they show what the others do not; a remark then says so.
    workers
        number of processes; None takes one for each core.
    progress
        whether to show the progress: a bar on a terminal, else the logger `ehsid`.
    **options
        `exclude`: ids of effects that are not searched for. `effort`: "list", "screened" or "full",
        how many fits the search makes. `limits`: what the next experiment may not pass, an
        `ehsid.harness.diagnosis.Limits`.

    Raises
    ------
    TypeError
        there is no such argument; the message has the nearest name.
    ValueError
        a record or the rig has a problem, an id is not in the catalogue, or a record is given
        twice. Data that do not carry a diagnosis are no error: the verdict says so.

    Examples
    --------
    >>> import ehsid
    >>> rig = ehsid.Rig.read("examples/rigs/bench.toml")
    >>> run = ehsid.simulate(rig, "triangle", duration_s=0.1)
    >>> ehsid.diagnose(run.record, rig, progress=False).verdict
    'insufficient_data'
    """
    known = {*signature(diagnose).parameters, *DiagnosisChoices.__annotations__} - {"options"}
    for name in options.keys() - known:
        near = nearest_name(name, known)
        raise TypeError(
            f"diagnose() has no argument {name!r}: "
            + (f"did you mean {near!r}?" if near else f"expected one of {', '.join(sorted(known))}")
        )
    with in_python():
        machine = _machine(rig, simulator, [*sources(records), *sources(validate)])
        chosen = DiagnosisOptions(**options)
        fitted = [read_for(one, machine) for one in sources(records)]
        held_out = [read_for(one, machine) for one in sources(validate)]
        named = told_apart([*fitted, *held_out])
        showing = progress_of(f"diagnosing {machine.name}") if progress else nullcontext()
        with showing as report, using(workers):
            result = gap.diagnose(
                named[: len(fitted)],
                machine.result,
                validate=named[len(fitted) :],
                options=chosen,
                progress=report,
            )
    return Diagnosis(result, named, machine)


def _machine(
    rig: RigSource | None, simulator: Callable[..., Any] | None, given: Sequence[Source]
) -> Rig:
    """Returns the rig, with the simulator of the user in it."""
    if simulator is None:
        if rig is None:
            raise ValueError(
                "rig is missing: expected a rig, the path of a rig file, or simulator=..."
            )
        return rig_of(rig)
    if rig is not None:
        return Rig(with_function(rig_of(rig).result, simulator))
    used = [
        read_record(one) if isinstance(one, str | os.PathLike) else record_of(one) for one in given
    ]
    return Rig(rig_around(simulator, used))


def sources(given: Source | Sequence[Source]) -> Sequence[Source]:
    """Returns records as a list, also where only one is given."""
    return given if isinstance(given, list | tuple) else [given]  # type: ignore[list-item]


def read_for(source: Source, rig: Rig) -> records.Record:
    """Returns a record; of a file the columns of the schema, in the layout of the rig."""
    if not isinstance(source, str | os.PathLike):
        return record_of(source)
    record = read_record(
        source,
        columns=list(CHANNELS),
        required=(*REQUIRED_COLUMNS, POSITION),
        layout=rig.result.columns,
    )
    log_reading(record)
    return record
