# SPDX-License-Identifier: MIT
"""`ehsid gap`: diagnoses why the simulator and the machine disagree, and prints a summary.

The options of a diagnosis on the command line, of every command that diagnoses.

The option --fail-on: a verdict that makes the command end with exit code 3, for CI.
"""

from __future__ import annotations

import functools
import inspect
import typing
from collections.abc import Callable, Collection, Sequence
from importlib import import_module
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..base.files import result_folder
from ..base.parallel import workers as using
from ..catalogue.channels import CHANNELS, POSITION, REQUIRED_COLUMNS
from ..records import NO_HINTS, Hints, Record
from ..records.record import told_apart
from ..rigs import Rig, read_rig
from .console import Console, print_blocks, print_points
from .gap_traces import gap_of_traces, print_traces
from .lazy import effect_ids, verdicts
from .options import RECORD_HELP, AsJson, Maps, SamplingTime, Workers, hints_of, read_shown
from .progress import progress_of

if TYPE_CHECKING:
    from ..diagnosis.options import DiagnosisOptions
    from ..diagnosis.result import Diagnosis
    from ..diagnosis.schema import Remark


def print_diagnosis(
    diagnosis: Diagnosis, folder: Path, console: Console, shown: Collection[Remark] = ()
) -> None:
    """Prints the verdict in a sentence and then its reasons; the details are in the report.

    shown: remarks that the user has seen already, which are not printed again.
    """
    from ..catalogue.parameters import plain_name
    from ..show.gap_words import effect_set, summary_tables, told_reasons, told_remarks
    from ..show.seen_words import seen_sentence
    from ..show.units import percent
    from ..show.verdict_words import VERDICTS

    title = VERDICTS[diagnosis.verdict].title
    console.print(f"\n{title}", style="bold")
    console.print(diagnosis.sentence, style="bold")
    print_points(told_reasons(diagnosis), console)
    for table in summary_tables(diagnosis):
        console.print()
        print_blocks([table], console)
    coming = diagnosis.next_experiment
    if coming is not None:
        rivals = " from ".join(effect_set(tuple(names.split("+"))) for names in coming.separates)
        console.print(
            f"\nNext experiment: {coming.description}; it separates {rivals} with a "
            f"predicted probability of {percent(coming.power)}: "
            f"{folder / 'next_experiment.csv'}",
        )
    if diagnosis.cannot_judge:
        console.print("\nCould not be judged:")
        unjudged = diagnosis.cannot_judge
        print_points((f"{plain_name(effect.id)}: {effect.why}" for effect in unjudged), console)
    small = seen_sentence(diagnosis.could_be_seen)
    if small:
        console.print(f"\nWould not have been seen: {small}; the report has all effects.")
    for remark in told_remarks(diagnosis):
        if remark in shown:
            continue
        sign, style = ("serious", "red") if remark.serious else ("note", None)
        about = f"{remark.record}: " if remark.record else ""
        console.print(f"{sign}: {about}{remark.what}", style=style)
    console.print(f"\nreport: {folder / 'report.html'}", soft_wrap=True)


ExcludedEffects = Annotated[
    list[str] | None,
    typer.Option(
        metavar="ID...",
        help="effects of the catalogue to leave out",
        autocompletion=effect_ids,
    ),
]


EffortOption = Annotated[
    str | None,
    typer.Option(
        metavar="list|screened|full",
        help="how many fits. full: of each effect; screened: of those that one or two runs choose; "
        "list: the same without sets of several effects. Default: full, and screened with your "
        "own simulator",
        show_default=False,
    ),
]


def diagnosis_options(
    exclude_effect: ExcludedEffects = None, effort: EffortOption = None
) -> DiagnosisOptions:
    """Returns what these options say; each argument is an option of the commands.

    Raises
    ------
    ValueError
        an option cannot be used.
    """
    from ..diagnosis.options import DiagnosisOptions

    return DiagnosisOptions(exclude_effect or (), effort)  # type: ignore[arg-type]


def with_diagnosis_options(command: Callable[..., None]) -> Callable[..., None]:
    """Returns a command with the options of a diagnosis, which it gets as the value `options`."""
    chosen = inspect.signature(diagnosis_options).parameters

    @functools.wraps(command)
    def run(**given: Any) -> None:
        options = diagnosis_options(**{name: given.pop(name) for name in chosen})
        command(**given, options=options)

    types = typing.get_type_hints(diagnosis_options, localns=_LATER, include_extras=True)
    types |= typing.get_type_hints(command, localns=_LATER, include_extras=True)
    parameters: list[inspect.Parameter] = []
    for one in inspect.signature(command).parameters.values():
        parameters += chosen.values() if one.name == "options" else [one]
    # Typer reads the options of a command off its signature.
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: types[one.name] for one in parameters}
    return run


# The type is imported only where a command runs: --help shall be fast.
_LATER = {"DiagnosisOptions": object}


EXIT_CODE = 3
ANY = "any"

FailOn = Annotated[
    str | None,
    typer.Option(
        metavar="VERDICT,...",
        help=f"exit code {EXIT_CODE} if the verdict is one of these, for CI; '{ANY}': each but "
        "no_gap. The results are written all the same",
        show_default=False,
        autocompletion=verdicts,
    ),
]


def failing_verdicts(text: str | None) -> frozenset[str]:
    """Returns the verdicts that an option names.

    Raises
    ------
    ValueError
        one of the words is no verdict.
    """
    if text is None:
        return frozenset()
    from ..diagnosis.schema import Verdict
    from ..records.errors import nearest_name

    known: tuple[str, ...] = typing.get_args(Verdict)
    found: set[str] = set()
    for word in map(str.strip, text.split(",")):
        if word == ANY:
            found.update(verdict for verdict in known if verdict != "no_gap")
        elif word in known:
            found.add(word)
        else:
            nearest = nearest_name(word, [*known, ANY])
            hint = f"; did you mean '{nearest}'?" if nearest else ""
            raise ValueError(
                f"--fail-on '{word}': expected verdicts with commas between them, of "
                f"{', '.join(known)}, or {ANY}{hint}"
            )
    return frozenset(found)


def fail_if(found: Sequence[str], of: str) -> None:
    """Ends the program with exit code 3 if verdicts were found that must not be.

    Parameters
    ----------
    found
        what was found of the verdicts that the user named, each with its place.
    of
        what `found` has, for the message.
    """
    if found:
        typer.echo(
            f"ehsid: the exit code is {EXIT_CODE}, because --fail-on names {of}: "
            f"{'; '.join(found)}",
            err=True,
        )
        raise typer.Exit(EXIT_CODE)


NEEDED_COLUMNS = (*REQUIRED_COLUMNS, POSITION)


def read_for(rig: Rig | None, paths: Sequence[Path], hints: Hints = NO_HINTS) -> list[Record]:
    """Reads records, each with all columns of the schema that it has."""
    return [
        read_shown(
            path,
            hints,
            columns=list(CHANNELS),
            required=NEEDED_COLUMNS,
            layout=None if rig is None else rig.columns,
        )
        for path in paths
    ]


@with_diagnosis_options
def gap_command(
    records: Annotated[
        list[Path],
        typer.Argument(metavar="RECORD...", help=f"to be fitted: {RECORD_HELP}"),
    ],
    out: Annotated[Path, typer.Option(help="folder of the results")],
    rig_file: Annotated[
        Path | None,
        typer.Option("--rig", help="rig file, TOML; with --simulated it may be left out"),
    ] = None,
    simulated: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="TRACE...",
            help="what your own simulation gave for the command of each record, where the "
            "simulator itself is not at hand",
        ),
    ] = None,
    validate: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="RECORD...",
            help="records to judge by; without: blocks of the records are held out",
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

    ehsid gap run1.csv --simulated sim1.csv --out traces
    """
    from ..diagnosis.data.gate import how_read
    from ..diagnosis.schema import RESULT_FILES

    failing = failing_verdicts(fail_on)
    if rig_file is None and not simulated:
        raise ValueError(
            "--rig is missing: expected a rig file, or --simulated with a trace of your own "
            "simulation; `ehsid rig new` writes a rig file"
        )
    if simulated and validate:
        raise ValueError(
            "--validate does not go with --simulated: expected all records with their traces; "
            "every third block of them is held out"
        )
    inputs = [*records, *(validate or []), *(simulated or []), *([rig_file] if rig_file else [])]
    with result_folder(out, "gap", RESULT_FILES, inputs) as folder:
        rig = None if rig_file is None else read_rig(rig_file)
        hints = hints_of(maps, sampling_time)
        fitted, held_out = read_for(rig, records, hints), read_for(rig, validate or [], hints)
        named = told_apart([*fitted, *held_out])
        # How a log was read is shown above, as a table.
        told = [remark for record in named for remark in how_read(record)]
        # The libraries that draw the page take a second to import, which fits beside the diagnosis.
        Thread(target=import_module, args=("ehsid.harness.show.gap_page",)).start()
        with using(workers):
            if simulated:
                diagnosis = gap_of_traces(
                    fitted, simulated, rig, folder, str(rig_file or ""), options
                )
            else:
                assert rig is not None
                diagnosis = _diagnosed(named, len(fitted), rig, folder, str(rig_file), options)
    if as_json:
        typer.echo((out / "diagnosis.json").read_text(encoding="utf-8"), nl=False)
    elif simulated:
        print_traces(diagnosis, out, Console())
    else:
        print_diagnosis(diagnosis, out, Console(), [] if Console(stderr=True).quiet else told)
    fail_if([diagnosis.verdict] if diagnosis.verdict in failing else [], "this verdict")


def _diagnosed(
    records: Sequence[Record],
    fitted: int,
    rig: Rig,
    folder: Path,
    rig_file: str,
    options: DiagnosisOptions,
) -> Diagnosis:
    """Diagnoses the first records by the others, and writes the results."""
    from ..diagnosis import STAGES, diagnose

    with progress_of(f"diagnosing {rig.name}") as progress:
        diagnosis = diagnose(
            records[:fitted],
            rig,
            validate=records[fitted:],
            options=options,
            progress=progress,
            begun=lambda stage: progress.stage(STAGES[stage]),
            note=progress.note,
        )
        progress.stage("writing the report")
    from ..show.gap_page import write_diagnosis

    write_diagnosis(folder, diagnosis, records, rig_file)
    return diagnosis
