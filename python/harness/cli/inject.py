# SPDX-License-Identifier: MIT
"""`ehsid inject`: a known effect put into the log of a real machine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ehsid.harness.cli.common import clear_errors
from ehsid.harness.inject import (
    Answer,
    InjectError,
    answer_path,
    inject,
    injectable,
    write_injected,
)
from ehsid.harness.records import read_record
from ehsid.harness.records.errors import nearest_name
from ehsid.harness.records.schema import REQUIRED_COLUMNS
from ehsid.harness.rigs import read_rig


def parse_sizes(
    effects: Sequence[str], texts: Sequence[str], plant: str
) -> dict[str, dict[str, float]]:
    """Sizes by effect and parameter, from texts such as "overlap=0.04".

    Raises
    ------
    InjectError
        an effect twice, a text of another form, or a parameter of none or of several of them.
    """
    sizes: dict[str, dict[str, float]] = {effect: {} for effect in effects}
    if len(sizes) < len(effects):
        raise InjectError(f"--effect {effects[-1]}: name each effect once")
    there = injectable(plant)
    owners: dict[str, list[str]] = {}
    for effect in effects:
        for name in there.get(effect, {}):
            owners.setdefault(name, []).append(effect)
            owners.setdefault(f"{effect}.{name}", []).append(effect)
    for text in texts:
        name, equals, number = (part.strip() for part in text.partition("="))
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        if not equals or not math.isfinite(value):
            raise InjectError(f"--set {text}: expected PARAMETER=NUMBER, as overlap=0.04")
        # An effect that cannot be put in is told of by `inject`, with all that can.
        if not owners and effects:
            continue
        if name not in owners:
            nearest = nearest_name(name, owners)
            hint = f"; did you mean '{nearest}'?" if nearest else ""
            raise InjectError(f"--set {text}: none of the effects named has '{name}'{hint}")
        if len(owners[name]) > 1:
            both = " and ".join(owners[name])
            raise InjectError(f"--set {text}: {both} have it; write EFFECT.{name}=NUMBER")
        parameters = sizes[owners[name][0]]
        if name.rpartition(".")[2] in parameters:
            raise InjectError(f"--set {text}: '{name}' is set twice")
        parameters[name.rpartition(".")[2]] = value
    return sizes


def _print(answer: Answer, out: Path, console: Console) -> None:
    for effect, sizes in answer.put_in.items():
        told = ", ".join(f"{name} {value:g}" for name, value in sizes.items())
        console.print(f"{effect}: {told}")
    for remark in answer.not_exact:
        console.print(f"not exact: {remark}", highlight=False)
    for remark in answer.remarks:
        console.print(remark, highlight=False)
    before, after = answer.command["largest_v_before"], answer.command["largest_v"]
    console.print(f"largest command: {before:.4g} V before, {after:.4g} V now", highlight=False)
    console.print(f"{out}: {answer.samples['written']} samples; answer in {answer_path(out)}")


def inject_command(
    record_file: Annotated[
        Path, typer.Argument(metavar="RECORD", help="CSV, CSV.gz, Parquet, MAT or NPZ")
    ],
    rig_file: Annotated[Path, typer.Option("--rig", help="rig file of the machine, TOML")],
    out: Annotated[Path, typer.Option(help="record to write, beside it OUT.answer.json")],
    effect: Annotated[
        list[str] | None,
        typer.Option(
            help="transport_delay, gain, position_delay, position_bias, sensor_backlash, "
            "sensor_lag, sensor_quantisation; behind a valve also valve_dead_band, "
            "valve_hysteresis, valve_null_bias, valve_lag; on an axis load_force. Again for more"
        ),
    ] = None,
    sizes: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="PARAMETER=NUMBER",
            help="size of the effect, SI; EFFECT.PARAMETER=NUMBER where two effects have it",
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="print the answer instead of a summary")
    ] = False,
) -> None:
    """Put an effect of known size into the log of a real machine, to see whether it is found.

    The machine got the command u; one with the effect would have needed u' with effect(u') = u to
    do the same. The record gets u' and keeps its outputs; effects of the sensor change the position
    alone. In a closed loop u' is what a controller of that machine would have had to send.

    Example: ehsid inject run.csv --rig rig.toml --effect valve_dead_band --set overlap=0.04
    --out run_dead_band.csv
    """
    with clear_errors():
        rig = read_rig(rig_file)
        asked = parse_sizes(effect or [], sizes or [], rig.plant)
        record = read_record(
            record_file, required=(*REQUIRED_COLUMNS, "position_m"), layout=rig.columns
        )
        if out.exists() and out.samefile(record_file):
            raise InjectError(f"--out {out}: this is the record itself; give another name")
        injected = inject(record, rig, asked)
        answer = write_injected(injected, out)
    if as_json:
        typer.echo(answer.read_text(encoding="utf-8"), nl=False)
    else:
        _print(injected.answer, out, Console())
