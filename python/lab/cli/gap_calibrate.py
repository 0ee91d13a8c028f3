# SPDX-License-Identifier: MIT
"""`ehsid gap-calibrate`: fits and checks the probabilities of a diagnosis on finished checks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ehsid.harness.base.files import result_folder
from ehsid.harness.base.parallel import workers as using
from ehsid.harness.cli.console import Console
from ehsid.harness.cli.options import AsJson, Workers
from ehsid.harness.cli.progress import stages

if TYPE_CHECKING:
    from ..calibration.machines import Found


def machines_of(checks: list[Path], features: list[Path]) -> Found:
    """Reads the machines of checks and of files of features; shows the progress on stderr.

    Raises
    ------
    ValueError
        nothing is given, nothing is finished, a machine occurs twice, or a file cannot be read.
    """
    from ..calibration.fitting import read_features
    from ..calibration.machines import Found, distinct, read_checks

    if not checks and not features:
        raise ValueError(
            "no machines: expected folders of ehsid gap-check, or --features with a file of an "
            "earlier calibration; name at least one"
        )
    kept = [machine for path in features for machine in read_features(path)]
    with stages() as report:
        found = read_checks(checks, lambda share: report("reading the checks", share))
    machines = distinct([*kept, *found.machines])
    if not machines:
        where = ", ".join(map(str, [*checks, *features]))
        reasons = ", ".join(f"{count} {reason}" for reason, count in found.left_out.items())
        raise ValueError(
            f"{where}: no finished case with probabilities ({reasons or 'no case at all'}): "
            "expected at least one; let ehsid gap-check of this version finish some first"
        )
    return Found(tuple(machines), found.left_out)


def gap_calibrate_command(
    out: Annotated[Path, typer.Option(help="folder of the results")],
    checks: Annotated[
        list[Path] | None,
        typer.Argument(metavar="CHECK_DIR...", help="folders of ehsid gap-check, finished or not"),
    ] = None,
    features: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE...", help="features.jsonl of earlier calibrations"),
    ] = None,
    workers: Workers = None,
    as_json: AsJson = False,
) -> None:
    """Check on machines with known causes whether the probabilities are meant.

    Reads the finished cases of checks; nothing is diagnosed again. It fits the
    constants of the probabilities and compares them with those in use. It checks
    probabilities, sets and intervals by cross-validation, and with each family of
    structure left out.

    Writes calibration.html, calibration.json and features.jsonl. The last one,
    given to --features, does the same again without the checks. The exit code
    is 0 whatever is found, and 2 for input that cannot be used.

    Example: ehsid gap-calibrate check1 check2 --out calibration
    """
    from ..calibration.checking import calibrate
    from ..pages.calibration_page import FILES, JSON, PAGE, calibration_lead, write_calibration

    with result_folder(out, "gap-calibrate", FILES, inputs=features or ()) as folder:
        with using(workers):
            found = machines_of(checks or [], features or [])
        with stages() as report:
            calibration = calibrate(found, lambda share: report("leaving out families", share))
        write_calibration(calibration, found.machines, folder)
    if as_json:
        typer.echo((out / JSON).read_text(encoding="utf-8"), nl=False)
        return
    console = Console()
    for sentence in calibration_lead(calibration):
        console.print(sentence)
    console.print(f"\nreport: {out / PAGE}", soft_wrap=True)
