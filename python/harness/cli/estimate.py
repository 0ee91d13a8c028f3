# SPDX-License-Identifier: MIT
"""`ehsid estimate`: runs the C++ estimator over a record."""

from __future__ import annotations

import json
from contextlib import nullcontext
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..base.files import result_folder
from ..show.model_file_names import ESTIMATION_FILES
from .console import Console, about, print_blocks
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
    hints_of,
    read_io,
)
from .policy_option import Lambda0, PolicyName, PolicySettings, make_policy, policy_words

if TYPE_CHECKING:
    from ..models.estimation import Recursion
    from ..records import Hints


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
    na: PastOutputs = 3,
    nb: PastInputs = 3,
    nk: Delay = 1,
    offset: Offset = True,
    forgetting: Annotated[
        PolicyName, typer.Option(help="forgetting policy; exponential is Eq. (15)")
    ] = "exponential",
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
    from .estimate_folder import estimate_folder, is_folder_of_records

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
