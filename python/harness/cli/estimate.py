# SPDX-License-Identifier: MIT
"""`ehsid estimate`: runs the C++ estimator over a record."""

from __future__ import annotations

import json
from contextlib import nullcontext
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from ehsid.harness.cli.common import (
    about,
    make_table,
    read_io,
    with_reading,
    write_results,
)
from ehsid.harness.cli.console import Console
from ehsid.harness.cli.log_options import Maps, SamplingTime, hints_of
from ehsid.harness.cli.options import (
    AsJson,
    Delay,
    InputColumn,
    OutputColumn,
    PastInputs,
    PastOutputs,
    RecordFile,
    Reset,
)
from ehsid.harness.cli.policy_option import Lambda0, PolicyName, PolicySettings, make_policy
from ehsid.harness.files import result_folder

if TYPE_CHECKING:
    from ehsid.harness.estimation import EstimationResult


class Method(StrEnum):
    """Recursions, by the noise they are right with; docs/which_estimator.md."""

    rls = "rls"
    riv = "riv"
    oe = "oe"
    armax = "armax"


def _table(result: EstimationResult) -> Table:
    rows = [
        (name, f"{entry['value']:.5g}", f"{entry['ci95'][0]:.5g} .. {entry['ci95'][1]:.5g}")
        for name, entry in result.to_dict()["parameters"].items()
    ]
    return make_table(("parameter", "value", "95 % interval"), rows)


def estimate_command(
    record: RecordFile,
    input_name: InputColumn = "command_v",
    output_name: OutputColumn = "position_m",
    na: PastOutputs = 3,
    nb: PastInputs = 3,
    nk: Delay = 1,
    forgetting: Annotated[
        PolicyName, typer.Option(help="forgetting policy; exponential is Eq. (15)")
    ] = "exponential",
    lambda0: Lambda0 = None,
    setting: PolicySettings = None,
    method: Annotated[
        Method,
        typer.Option(
            help="recursion: rls, least squares; riv and oe for a noisy position sensor; armax for "
            "coloured disturbances. All but rls take constant and exponential forgetting"
        ),
    ] = Method.rls,
    reset: Reset = True,
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    as_json: AsJson = False,
    out: Annotated[Path | None, typer.Option(help="folder for estimate.json and .png")] = None,
) -> None:
    """Estimate an ARX model recursively, with the code the firmware runs.

    Example: ehsid estimate rec.csv --na 3 --nb 3 --nk 1 --forgetting exponential --lambda0 0.99
    """
    from ehsid.harness.estimation import estimate
    from ehsid.harness.identification import ArxOrders

    names = ("estimate.json", "estimate.png")
    with (
        nullcontext() if out is None else result_folder(out, "estimate", names, [record]) as folder
    ):
        hints = hints_of(maps, sampling_time)
        data, origin = read_io(record, input_name, output_name, hints)
        # The mean of a record is not the position of rest: running models sum up the difference.
        orders = ArxOrders(na, nb, nk, offset=method is not Method.rls)
        policy = make_policy(forgetting, lambda0, setting)
        with about(record):
            result = estimate(data, orders, forgetting=policy, reset=reset, method=method.value)
        if folder is not None:
            from ehsid.harness.report.model_figures import estimation_figure

            figure = estimation_figure(result, data.dt_s)
            write_results(folder, "estimate", with_reading(result.to_dict(), origin), figure)
    if as_json:
        typer.echo(json.dumps(with_reading(result.to_dict(), origin), allow_nan=False))
        return
    console = Console()
    console.print(f"{result.orders}, {result.method}, {result.forgetting}")
    console.print(_table(result))
    console.print(
        f"one-step fit {result.one_step_fit_percent:.2f} %, simulation fit "
        f"{result.simulation_fit_percent:.2f} %, RMSE {result.rmse:.4g}, resets {result.resets}, "
        f"{'converged' if result.converged else 'not converged'}, "
        f"{result.skipped} of {result.status.size} samples carried no information; "
        f"one-step fit and RMSE leave out the first {result.n_start} equations"
    )
