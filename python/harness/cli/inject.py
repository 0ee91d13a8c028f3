# SPDX-License-Identifier: MIT
"""`ehsid inject`: puts a known effect into the log of a real machine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..base.files import result_files
from ..records.errors import nearest_name
from .console import Console, check_ending
from .lazy import injected_effects
from .options import RECORD_HELP, AsJson, Maps, SamplingTime, hints_of, read_shown

if TYPE_CHECKING:
    from ..signals.injection import Answer


def parse_sizes(
    effects: Sequence[str], texts: Sequence[str], plant: str
) -> dict[str, dict[str, float]]:
    """Returns sizes in SI by effect and parameter, from texts such as "overlap=0.04".

    Raises
    ------
    InjectError
        an effect is named twice, a text has another form, a parameter is set twice, or it belongs
        to none or to several of the effects.
    """
    from ..signals.injection import InjectError, injectable

    sizes: dict[str, dict[str, float]] = {effect: {} for effect in effects}
    if len(sizes) < len(effects):
        twice = next(effect for effect in effects if effects.count(effect) > 1)
        raise InjectError(f"--effect {twice}: name each effect once")
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
        # If no effect can be put in, `inject` reports that, with a list of those that can.
        if not owners and effects:
            continue
        if name not in owners:
            nearest = nearest_name(name, owners)
            hint = f"; did you mean '{nearest}'?" if nearest else ""
            raise InjectError(
                f"--set {text}: expected a parameter of an effect that is named with "
                f"--effect; none has '{name}'{hint}"
            )
        if len(owners[name]) > 1:
            both = " and ".join(owners[name])
            raise InjectError(f"--set {text}: {both} have it; write EFFECT.{name}=NUMBER")
        parameters = sizes[owners[name][0]]
        if name.rpartition(".")[2] in parameters:
            raise InjectError(f"--set {text}: '{name}' is set twice; expected each parameter once")
        parameters[name.rpartition(".")[2]] = value
    return sizes


def _print(answer: Answer, out: Path, console: Console) -> None:
    from ..signals.injection import answer_path

    for effect, sizes in answer.put_in.items():
        text = ", ".join(f"{name} {value:g}" for name, value in sizes.items())
        console.print(f"{effect}: {text}")
    for remark in answer.not_exact:
        console.print(f"not exact: {remark}")
    for remark in answer.remarks:
        console.print(remark)
    before, after = answer.command["largest_v_before"], answer.command["largest_v"]
    console.print(f"largest command: {before:.4g} V before, {after:.4g} V now")
    console.print(f"{out}: {answer.samples['written']} samples; answer in {answer_path(out)}")


def inject_command(
    record_file: Annotated[Path, typer.Argument(metavar="RECORD", help=RECORD_HELP)],
    rig_file: Annotated[Path, typer.Option("--rig", help="rig file of the machine, TOML")],
    out: Annotated[Path, typer.Option(help="record to write, beside it OUT.answer.json")],
    effect: Annotated[
        list[str] | None,
        typer.Option(
            help="transport_delay, gain, position_sensor_delay, position_bias, sensor_backlash, "
            "sensor_lag, sensor_quantisation; behind a valve also valve_dead_band, "
            "valve_hysteresis, valve_null_bias, valve_lag; with pressures pressure_sensor_gain, "
            "pressure_sensor_offset, pressure_sensor_lag; on an axis load_force. Again for more",
            autocompletion=injected_effects,
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
    maps: Maps = None,
    sampling_time: SamplingTime = None,
    as_json: AsJson = False,
) -> None:
    """Put an effect of known size into the log of a real machine, to see whether it is found.

    The machine got the command u; one with the effect would have needed u' with effect(u') = u to
    do the same. The record gets u' and keeps its outputs; effects of the sensor change the position
    alone. In a closed loop u' is what a controller of that machine would have had to send.

    Example: ehsid inject run.csv --rig rig.toml --effect valve_dead_band --set overlap=0.04
    --out run_dead_band.csv
    """
    from ..catalogue.channels import POSITION, REQUIRED_COLUMNS
    from ..rigs import read_rig
    from ..signals.injection import answer_path, inject, write_injected

    check_ending(out)
    beside = [answer_path(out).name]
    with result_files(out, "inject", beside, inputs=[record_file, rig_file]) as folder:
        rig = read_rig(rig_file)
        sizes_by_effect = parse_sizes(effect or [], sizes or [], rig.plant)
        record = read_shown(
            record_file,
            hints_of(maps, sampling_time),
            required=(*REQUIRED_COLUMNS, POSITION),
            layout=rig.columns,
        )
        injected = inject(record, rig, sizes_by_effect)
        write_injected(injected, folder / out.name)
    if as_json:
        typer.echo(answer_path(out).read_text(encoding="utf-8"), nl=False)
    else:
        _print(injected.answer, out, Console())
