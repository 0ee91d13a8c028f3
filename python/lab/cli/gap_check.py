# SPDX-License-Identifier: MIT
"""`ehsid gap-check`: tests how far to trust a diagnosis, on records whose effect is withheld."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import ehsid
from ehsid.harness.base.files import is_incomplete, result_folder
from ehsid.harness.base.parallel import workers as using
from ehsid.harness.cli.console import Console, note, refuse
from ehsid.harness.cli.options import AsJson, Dask, Workers, check_one_place, on
from ehsid.harness.cli.progress import progress_of

from ..blind.making import (
    EXCITATIONS,
    GRADES,
    RESULT,
    SEAL,
    SENSORS,
    Seal,
    Settings,
    make_check,
    verify,
)

if TYPE_CHECKING:
    from ..scoring.score import Score


def made_or_found(out: Path, given: dict[str, Any], workers: int | None) -> Seal:
    """Returns the seal of the check in a folder; makes the check if there is none.

    Raises
    ------
    ValueError
        the existing check has other settings, is of another version of ehsid, or was changed.
    """
    if not (out / SEAL).is_file() or is_incomplete(out, RESULT):
        settings = Settings().with_given(given)
        with progress_of(f"making {settings.count} cases") as progress, using(workers):
            return make_check(out, settings, progress)
    seal = verify(out)
    wanted = seal.settings.with_given(given)
    differences = seal.settings.differences(wanted)
    if differences:
        raise ValueError(
            f"--out {out}: the check there has {'; '.join(differences)}; leave these options away "
            "to go on with it, or name a new folder"
        )
    if seal.ehsid_version != ehsid.__version__:
        raise ValueError(
            f"--out {out}: the check there was made by ehsid {seal.ehsid_version}, this is "
            f"{ehsid.__version__}; name a new folder"
        )
    return seal


def run_cases(out: Path, seal: Seal, dask: str | None, workers: int | None) -> None:
    """Runs the diagnosis on all cases of a check that have no result yet."""
    from ehsid.harness.cli.progress import shown
    from ehsid.harness.diagnosis import diagnose

    from ..blind.running import run_check, unfinished_cases

    todo, count = len(unfinished_cases(out)), seal.settings.count
    if not todo:
        return
    if todo < count:
        note(f"{count - todo} of {count} cases are finished; going on")
    with on(dask, workers):
        for _ in shown(run_check(out, seal, diagnose), todo, count):
            pass


def gap_check_command(
    out: Annotated[Path, typer.Option(help="folder of the check; the same again: goes on with it")],
    count: Annotated[int | None, typer.Option(help="number of cases; default 40")] = None,
    seed: Annotated[
        int | None, typer.Option(help="of the cases; another seed: all others; default 1")
    ] = None,
    grade: Annotated[
        list[str] | None,
        typer.Option(help=f"{', '.join(GRADES)}; may be repeated; default: all, equal shares"),
    ] = None,
    sensors: Annotated[
        str | None, typer.Option(help=f"of all cases: {', '.join(SENSORS)}; default: a mix")
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(help="length of each record; default: drawn, 8 to 20 s")
    ] = None,
    exclude_truth: Annotated[
        bool | None,
        typer.Option(
            "--exclude-truth",
            help="only cases with one effect, diagnosed without it: no other one must be named",
        ),
    ] = None,
    excitations: Annotated[
        str | None,
        typer.Option(help=f"of grade wide: {', '.join(EXCITATIONS)}; default: all"),
    ] = None,
    workers: Workers = None,
    dask: Dask = None,
    as_json: AsJson = False,
) -> None:
    """Check the diagnosis on machines whose effect is withheld: make, seal, run, score.

    Finished cases are kept: after a kill or Ctrl-C the same command goes on where it was. Answers
    are sealed before the first case runs. Needs numba: the extra `lab`.

    Writes cases, answers.json, seal.json, results, score.json, report.html and pictures. Exit
    code 0 whatever the score, 2 for input that cannot be used.

    Example: ehsid gap-check --out check --count 40 --seed 5
    """
    from ..pages.check_page import FILES

    check_one_place(dask, workers)  # before all cases are made
    given = {
        "count": count,
        "seed": seed,
        "grades": tuple(grade) if grade else None,
        "sensors": sensors,
        "seconds": seconds,
        "exclude_truth": exclude_truth,
        "excitations": excitations,
    }
    with result_folder(out, "gap-check", FILES) as folder:
        try:
            seal = made_or_found(out, given, workers)
        except ImportError as error:  # The message says which extra is missing.
            refuse(str(error))
        note(f"answers sealed, sha256 {seal.answers_sha256}")
        run_cases(out, seal, dask, workers)
        score = _score(out, folder, workers)
    if as_json:
        typer.echo((out / "score.json").read_text(encoding="utf-8"), nl=False)
    else:
        _print(score, out / "report.html", Console())


def _score(out: Path, folder: Path, workers: int | None) -> Score:
    """Scores a check and writes its report into `folder`.

    `verify` runs again first, because the files could have changed during the run.
    """
    from ..pages.check_page import write_page
    from ..scoring.score import score_folder

    verify(out)
    with progress_of("scoring") as progress, using(workers):
        score = score_folder(out, progress)
    write_page(score, folder)
    return score


def _print(score: Score, page: Path, console: Console) -> None:
    from ehsid.harness.base.time_to_go import in_words

    from ..pages.check_words import lead

    for sentence in lead(score):
        console.print(sentence)
    spent = sum(case.findings.seconds for case in score.cases if case.findings.seconds > 0.0)
    console.print(f"{in_words(spent)} of one core in all")
    console.print(f"\nreport: {page}", soft_wrap=True)
