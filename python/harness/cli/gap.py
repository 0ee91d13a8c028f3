# SPDX-License-Identifier: MIT
"""`ehsid gap`: diagnoses why the simulator and the machine disagree."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Annotated

import typer

from ..base.files import result_folder
from ..base.parallel import workers as using
from ..catalogue.channels import CHANNELS, POSITION, REQUIRED_COLUMNS
from ..records import NO_HINTS, Hints, Record
from ..records.record import told_apart
from ..rigs import Rig, read_rig
from .console import Console
from .diagnosis_options import with_diagnosis_options
from .fail_on import FailOn, fail_if, failing_verdicts
from .log_options import Maps, SamplingTime, hints_of, read_shown
from .options import RECORD_HELP, AsJson, RigFile
from .progress import progress_of
from .workers import Workers

if TYPE_CHECKING:
    from ..diagnosis.options import DiagnosisOptions

NEEDED_COLUMNS = (*REQUIRED_COLUMNS, POSITION)


def read_for(rig: Rig, paths: Sequence[Path], hints: Hints = NO_HINTS) -> list[Record]:
    """Reads records, each with all columns of the schema that it has."""
    return [
        read_shown(path, hints, columns=list(CHANNELS), required=NEEDED_COLUMNS, layout=rig.columns)
        for path in paths
    ]


@with_diagnosis_options
def gap_command(
    records: Annotated[
        list[Path],
        typer.Argument(metavar="RECORD...", help=f"to be fitted: {RECORD_HELP}"),
    ],
    rig_file: RigFile,
    out: Annotated[Path, typer.Option(help="folder of the results")],
    validate: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="RECORD...",
            help="records to judge by, never fitted; without: blocks of the records are held out",
        ),
    ] = None,
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    *,
    options: DiagnosisOptions,
    workers: Workers = None,
    fail_on: FailOn = None,
    as_json: AsJson = False,
) -> None:
    """Diagnose the gap between a machine and its simulation: where, which effect, how far.

    Writes report.html, diagnosis.json, simulation.csv, rig.augmented.toml and, where rivals
    remain, next_experiment.csv. Exit code 0 whatever the verdict, 2 for bad input, 3 for a verdict
    of --fail-on.

    Examples: ehsid gap run1.csv --rig rig.toml --validate run2.csv --out diagnosis

    ehsid gap run1.csv --rig rig.toml --out diagnosis --fail-on effects,ambiguous
    """
    from ..diagnosis import STAGES, diagnose
    from ..diagnosis.data.gate import how_read
    from ..diagnosis.schema import RESULT_FILES
    from .gap_summary import print_diagnosis

    failing = failing_verdicts(fail_on)
    with result_folder(out, "gap", RESULT_FILES, [*records, *(validate or []), rig_file]) as folder:
        rig = read_rig(rig_file)
        hints = hints_of(maps, sampling_time)
        fitted, held_out = read_for(rig, records, hints), read_for(rig, validate or [], hints)
        named = told_apart([*fitted, *held_out])
        # How a log was read is shown above, as a table.
        told = [remark for record in named for remark in how_read(record)]
        # The libraries that draw the page take a second to import, which fits beside the diagnosis.
        Thread(target=import_module, args=("ehsid.harness.show.diagnosis_files",)).start()
        with progress_of(f"diagnosing {rig.name}") as progress, using(workers):
            diagnosis = diagnose(
                named[: len(fitted)],
                rig,
                validate=named[len(fitted) :],
                options=options,
                progress=progress,
                begun=lambda stage: progress.stage(STAGES[stage]),
            )
            progress.stage("writing the report")
        from ..show.diagnosis_files import write_diagnosis

        write_diagnosis(folder, diagnosis, named, str(rig_file))
    if as_json:
        typer.echo((out / "diagnosis.json").read_text(encoding="utf-8"), nl=False)
    else:
        print_diagnosis(diagnosis, out, Console(), [] if Console(stderr=True).quiet else told)
    fail_if([diagnosis.verdict] if diagnosis.verdict in failing else [], "this verdict")
