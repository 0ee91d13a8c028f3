# SPDX-License-Identifier: MIT
"""`ehsid estimate`: runs the C++ estimator over a record, or over all records of a folder."""

from __future__ import annotations

import json
from contextlib import nullcontext
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..base.files import result_folder
from ..catalogue.parameters import RECORD_POLICY, SERVO_ORDERS
from ..show.model_file_names import ESTIMATION_FILES
from .console import Console, about, note, print_blocks, refuse
from .next_command import Given, export_line, print_next, print_tries
from .options import (
    RECORD_HELP,
    AsJson,
    Delay,
    InputColumn,
    Maps,
    Offset,
    OutputColumn,
    PastInputs,
    PastOutputs,
    Reset,
    SamplingTime,
    check_signals,
    hints_of,
    read_io,
    show_origin,
)
from .policy_option import Lambda0, PolicyName, PolicySettings, make_policy, policy_words
from .progress import progress_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..models.estimation import Estimates, Recursion
    from ..models.estimation.spread import Named
    from ..models.identification import IoData
    from ..records import Hints, Origin


# Records that are in memory at once, and run side by side: as many as the widest registers take.
BATCH = 16


def is_folder_of_records(path: Path) -> bool:
    """Whether the path is a folder, and not one that is a single log (a ROS 2 bag)."""
    return path.is_dir() and not (path / "metadata.yaml").is_file()


def estimate_folder(
    folder: Path,
    signals: tuple[str, str],
    recursion: Recursion,
    hints: Hints,
    out: Path | None,
    as_json: bool,
) -> None:
    """Estimates all records of a folder; `signals` are the names of their input and output.

    Raises
    ------
    ValueError
        an option cannot be used, the folder has no record, or `out` is the folder itself.
    """
    from ..records import RecordError
    from ..records.kinds import FOLDER_ENDINGS, records_in
    from ..show.estimates_page import FILES, write_estimates

    check_signals(*signals)
    recursion.estimator()  # Settings that do not fit each other are refused once, not by each file.
    files = records_in(folder)
    if not files:
        endings = ", ".join(f".{ending}" for ending in FOLDER_ENDINGS)
        raise RecordError(
            folder,
            "this is a directory without records",
            expected=f"a record file, or a directory with some ({endings})",
            mend="name one of the files in it, or the directory of the records",
        )
    if out is not None and out.resolve() == folder.resolve():
        raise ValueError(
            f"--out {out}: is the folder of the records, of which the next run would take the "
            "results for records: expected another folder; name one"
        )
    with nullcontext() if out is None else result_folder(out, "estimates", FILES) as made:
        found = _estimates(files, signals, recursion, hints)
        if made is not None:
            write_estimates(found, made)
    if as_json:
        from ..base.encoding import json_text

        typer.echo(json_text(found), nl=False)
        return
    _print(found, Console())
    if out is not None:
        Console().print(f"\nreport: {out / FILES[0]}", soft_wrap=True)


def _estimates(
    files: Sequence[Path], signals: tuple[str, str], recursion: Recursion, hints: Hints
) -> Estimates:
    """Returns the estimates of all files that can be used; ends the program if none can."""
    from ..models.estimation import compare

    named: list[Named] = []
    failed: dict[str, str] = {}
    origins: list[tuple[str, Origin]] = []
    with progress_of(f"{len(files)} records") as progress:
        for start in range(0, len(files), BATCH):
            batch = files[start : start + BATCH]
            named += _batch(batch, signals, recursion, hints, failed, origins)
            progress((start + len(batch)) / len(files))
    _show_origins(origins)
    for message in failed.values():
        note(f"{message}; it is left out")
    if not named:
        refuse(f"{files[0].parent}: none of {len(files)} files could be used")
    return compare(named, failed)


def _batch(
    files: Sequence[Path],
    signals: tuple[str, str],
    recursion: Recursion,
    hints: Hints,
    failed: dict[str, str],
    origins: list[tuple[str, Origin]],
) -> list[Named]:
    """Estimates these files; adds messages and what was taken for what in logs, by name."""
    from ..models.estimation import estimate_all
    from ..models.estimation.spread import Named
    from ..models.identification import IdentificationError, IoData
    from ..records import read_record

    data: dict[Path, IoData] = {}
    reading: dict[Path, Origin] = {}
    for file in files:
        try:
            record = read_record(file, columns=list(signals), hints=hints)
            data[file] = IoData.from_record(record, *signals)
        except ValueError as error:
            failed[file.name] = str(error)
            continue
        if record.origin is not None:
            reading[file] = record.origin
            origins.append((file.name, record.origin))
    named = []
    for file, found in zip(data, estimate_all(list(data.values()), recursion), strict=True):
        if isinstance(found, IdentificationError):
            failed[file.name] = f"{file}: {found}"
        else:
            origin = reading.get(file)
            plain = None if origin is None else origin.to_dict()
            named.append(Named(file.name, data[file].dt_s, found, plain))
    return named


def _show_origins(origins: Sequence[tuple[str, Origin]]) -> None:
    """Shows on stderr what was taken for what: once for all logs that were read in the same way."""
    console = Console(stderr=True)
    alike: dict[Origin, list[str]] = {}
    for name, origin in origins:
        alike.setdefault(origin, []).append(name)
    for origin, names in alike.items():
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        show_origin(f"{names[0]}{more}", origin, console)


def _print(found: Estimates, console: Console) -> None:
    from ..show.estimates_page import coefficient_table, estimates_lead

    print_blocks([*estimates_lead(found), coefficient_table(found)], console)


class Method(StrEnum):
    """Recursions, by the noise they are right with; docs/which_estimator.md."""

    rls = "rls"
    riv = "riv"


def estimate_command(
    record: Annotated[
        Path, typer.Argument(help=f"{RECORD_HELP}; or a folder of them, which are then compared")
    ],
    input_name: InputColumn = "command_v",
    output_name: OutputColumn = "position_m",
    na: PastOutputs = SERVO_ORDERS[0],
    nb: PastInputs = SERVO_ORDERS[1],
    nk: Delay = SERVO_ORDERS[2],
    offset: Offset = True,
    forgetting: Annotated[
        PolicyName, typer.Option(help="forgetting policy; exponential is Eq. (15)")
    ] = RECORD_POLICY,
    lambda0: Lambda0 = None,
    setting: PolicySettings = None,
    method: Annotated[
        Method,
        typer.Option(
            help="recursion: rls, least squares; riv for a noisy position sensor, which takes "
            "constant and exponential forgetting"
        ),
    ] = Method.rls,
    reset: Reset = True,
    textbook: Annotated[
        bool,
        typer.Option("--textbook", help="Eqs. (12)-(14) as printed: no guards and no reset"),
    ] = False,
    start_variance: Annotated[
        float,
        typer.Option(
            help="variance of each parameter at the start, in units of sigma^2", min=1e-9, max=1e12
        ),
    ] = 1e6,
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    as_json: AsJson = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="folder for the results: estimate.json and .png; for many records estimates.html, "
            ".json and .csv"
        ),
    ] = None,
) -> None:
    """Estimate a servo and its ARX model, with the code the firmware runs.

    K, omega_n and xi come from the estimator for a servo with a noisy position
    sensor, each with a 90 % interval and the share of the record in which it
    can be trusted; the coefficients come from recursive least squares. Orders
    other than --na 3 --nb 3, or a record without time, have no servo.

    With a folder, each record is estimated as it would be alone, and K,
    omega_n, xi and the coefficients of all are compared: their range, and the
    records far from the others. A file that cannot be used is named and left
    out; the exit code is 2 if none can be used. Text is read from .csv, .tsv
    and .tab; a .txt may be a note.

    Examples: ehsid estimate run.csv --out results

    ehsid estimate rec.csv --input u --output y --na 2 --nb 2 --nk 1

    ehsid estimate logs --out results
    """
    import ehsid

    from ..base.parallel import single_threaded_algebra
    from ..models.estimation import Recursion
    from ..models.identification import ArxOrders

    hints = hints_of(maps, sampling_time)
    recursion = Recursion(
        ArxOrders(na, nb, nk, offset=offset),
        make_policy(forgetting, lambda0, setting),
        reset=reset and not textbook,
        guards=ehsid.RlsOptions.textbook() if textbook else None,
        start_variance=start_variance,
        method=method.value,
    )
    with single_threaded_algebra():
        if is_folder_of_records(record):
            estimate_folder(record, (input_name, output_name), recursion, hints, out, as_json)
        else:
            given = Given(record, input_name, output_name, maps or (), sampling_time)
            # `ehsid export` has no other recursion, and no estimator without guards.
            exported = method is Method.rls and not textbook
            policy = policy_words(forgetting, lambda0, setting) if exported else None
            _estimate_record(given, recursion, policy, hints, out, as_json)


def _estimate_record(
    given: Given,
    recursion: Recursion,
    policy: list[str] | None,
    hints: Hints,
    out: Path | None,
    as_json: bool,
) -> None:
    """Estimates one record; `policy` is the forgetting as options of the export, None without."""
    from ..base.encoding import to_plain
    from ..models.estimation import estimate
    from ..models.estimation.advice import advice_words, advise
    from ..records.record import with_reading
    from ..show.model_blocks import estimate_told

    record = given.record
    with (
        nullcontext()
        if out is None
        else result_folder(out, "estimate", ESTIMATION_FILES, [record]) as folder
    ):
        data, origin = read_io(record, given.input_name, given.output_name, hints)
        with about(record):
            result = estimate(data, **vars(recursion))
        advice = advise(data, recursion, result)
        following = ""
        if result.converged and policy is not None:
            reset = [] if recursion.reset else ["--no-reset"]
            following = export_line(given, recursion.orders, [*policy, *reset])
        if folder is not None:
            from ..show.model_figures import write_estimation

            write_estimation(folder, result, data.dt_s, origin, advice)
    if as_json:
        plain = {
            **with_reading(result.to_dict(), origin),
            "advice": to_plain(advice),
            "next_command": following or None,
        }
        typer.echo(json.dumps(plain, allow_nan=False))
        return
    console = Console()
    print_blocks(estimate_told(result, given.input_name, given.output_name).blocks(), console)
    print_tries(advice_words(advice), console)
    print_next(following, console)
