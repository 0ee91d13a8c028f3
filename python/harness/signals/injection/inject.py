# SPDX-License-Identifier: MIT
"""Injects effects into a log.

A machine received the command u and moved as recorded. Consider the same machine with one more
effect in front of all its own, which receives u' with effect(u') = u. It would have moved in
exactly the same way. So the record with u' in place of u is a log of that machine. In a closed loop
u' is the command that a controller of that machine would have had to send. An effect of the sensor
changes the position alone.

Writes an injected record and its answer to files.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.files import write_text
from ...base.numbers import FloatArray
from ...catalogue.channels import CHAMBER_PRESSURES, CHANNELS
from ...catalogue.channels import POSITION as POSITION_COLUMN
from ...records import Record, make_record
from ...records.record import record_bytes
from ...rigs import Rig
from . import effects as on_command
from . import effects as on_position
from .effects import (
    COMMAND,
    GAIN_OF,
    OWN,
    POSITION,
    InjectError,
    Note,
    Sizes,
    Step,
    check,
    does_not_pass,
)
from .lag import Answer, before_delay, before_lag, behind_delay, file_of

# Effects behind the spool. A measured spool position must be changed by their pre-images, too.
BEHIND_SPOOL = ("gain", "valve_dead_band", "valve_dead_band_sides", "valve_null_bias")
# Other outputs of a record, against which a delayed position is visible as delayed.
OTHER_OUTPUTS = tuple(
    channel.name
    for channel in CHANNELS.values()
    if channel.moves and channel.name != POSITION_COLUMN
)


# A late position, by its name before it was in the catalogue, and by that of the catalogue.
IN_CATALOGUE = "position_sensor_delay"
LATE_POSITION = ("position_delay", IN_CATALOGUE)


@dataclass(frozen=True, eq=False)
class Injected:
    """Record with the injected effects, and the answer that describes them."""

    record: Record
    answer: Answer


def inject(record: Record, rig: Rig, effects: Mapping[str, Sizes]) -> Injected:
    """Injects effects into a log.

    Parameters
    ----------
    record
        record with time, `command_v` and `position_m`, without gaps.
    rig
        rig of the machine; it gives the plant and the rated command.
    effects
        effects by id (see `injectable`), each with all its parameters, SI. Several effects act
        together, in the order of the catalogue.

    Returns
    -------
    A record of the same columns, shorter by the delays, and the answer.

    Raises
    ------
    InjectError
        an effect or a size cannot be used, the record has gaps or no time, or no machine with these
        effects could have received such a command.
    RecordError
        a column is missing.
    """
    check(effects, rig)
    before, position = record.column("command_v"), record.column("position_m")
    if record.dt_s is None or record.time_s is None:
        raise InjectError(f"{record.name} has no time_s: add the column")
    if len(record.segments) > 1:
        raise InjectError(
            f"{record.name} has {len(record.gaps)} gaps: give one stretch without a gap"
        )
    dt_s, rated = record.dt_s, rated_command_v(rig)
    columns = {"time_s": record.time_s, **record.columns}
    notes = [*_passing(effects, rig)]

    # The command is a fraction of the rated command here.
    sent = before / rated
    for effect in (name for name in COMMAND if name in effects):
        step = _pre_image(effect, effects[effect], sent, rig, dt_s)
        sent = step.signal
        notes += step.notes
        if effect in BEHIND_SPOOL and "spool" in columns:
            columns["spool"] = _pre_image(
                effect, effects[effect], columns["spool"], rig, dt_s
            ).signal
    at_end = before.size - sent.size
    for effect in (name for name in POSITION if name in effects):
        step = _sensor(effect, effects[effect], position, dt_s)
        position = step.signal
        notes += step.notes
    for effect in (name for name in on_position.PRESSURES if name in effects):
        sides = on_position.behind_pressure_sensors(
            _chamber_pressures(record, columns, effect), effect, effects[effect], dt_s
        )
        for name, side in zip(CHAMBER_PRESSURES, sides, strict=True):
            columns[name] = side.signal
            notes += side.notes
    at_start = before.size - position.size
    if at_start + at_end > 0.5 * before.size:
        raise InjectError("the delays are more than half of the record")

    kept = slice(at_start, before.size - at_end)
    columns = {name: column[kept].copy() for name, column in columns.items()}
    columns["command_v"] = (sent * rated)[at_start:]
    columns["position_m"] = position[: position.size - at_end]
    expected, outside, remarks = _expected(effects, rig, record)
    notes += remarks
    limit = math.inf if rig.plant == "axis" else rated
    largest = np.abs(columns["command_v"])
    beyond = float(np.mean(largest > limit))
    if beyond > 0.0:
        notes.append(
            Note(
                f"the command is beyond the rated {rated:g} V for {100.0 * beyond:.2g} % of the "
                f"time, up to {float(largest.max()):.3g} V: a machine with these effects could not "
                "have been sent it"
            )
        )
    answer = Answer(
        put_in={effect: dict(sizes) for effect, sizes in effects.items()},
        effects=expected,
        parameters={GAIN_OF[rig.plant]: effects["gain"]["factor"]} if "gain" in effects else {},
        outside=outside,
        not_exact=tuple(note.text for note in notes if not note.exact),
        remarks=tuple(note.text for note in notes if note.exact),
        rig=rig.name,
        plant=rig.plant,
        source=file_of(record.source),
        sha256=record.sha256,
        command={
            "rated_v": None if math.isinf(limit) else rated,
            "largest_v_before": float(np.abs(before).max()),
            "largest_v": float(largest.max()),
            "share_beyond_rated": beyond,
        },
        samples={
            "source": before.size,
            "dropped_at_start": at_start,
            "dropped_at_end": at_end,
            "written": largest.size,
        },
    )
    return Injected(make_record(columns, name=record.name), answer)


def rated_command_v(rig: Rig) -> float:
    """Command that counts as 1 in the pre-images, V: the rated command, and 1 V for an axis."""
    if rig.plant == "axis":
        return 1.0
    if rig.plant == "linear":
        return 1.0 / rig.values["linear.spool_gain_1_v"]
    return rig.values["valve.rated_command_v"]


def _pre_image(effect: str, sizes: Sizes, signal: FloatArray, rig: Rig, dt_s: float) -> Step:
    match effect:
        case "load_force":
            # gain u' - force = gain u
            return Step(signal + sizes["force_n"] / rig.values["axis.force_per_volt"], [])
        case "gain":
            return on_command.before_gain(signal, sizes["factor"])
        case "valve_dead_band":
            return on_command.before_dead_band(signal, sizes["overlap"], sizes["overlap"])
        case "valve_dead_band_sides":
            return on_command.before_dead_band(signal, sizes["overlap_a"], sizes["overlap_b"])
        case "valve_null_bias":
            return on_command.before_bias(signal, sizes["offset"])
        case "valve_lag":
            return before_lag(signal, sizes["bandwidth_hz"], sizes["damping"], dt_s, limit=1.0)
        case "valve_hysteresis":
            return on_command.before_play(signal, sizes["half_width"])
        case _:
            return before_delay(signal, sizes["delay_s"], dt_s)


def _sensor(effect: str, sizes: Sizes, position: FloatArray, dt_s: float) -> Step:
    match effect:
        case "position_bias":
            return on_position.behind_bias(position, sizes["offset_m"])
        case "position_delay" | "position_sensor_delay":
            return behind_delay(position, sizes["delay_s"], dt_s)
        case _:
            return on_position.behind_sensor(position, effect, sizes, dt_s)


def _chamber_pressures(
    record: Record, columns: Mapping[str, FloatArray], effect: str
) -> tuple[FloatArray, FloatArray]:
    missing = [name for name in CHAMBER_PRESSURES if name not in columns]
    if missing:
        raise InjectError(
            f"'{effect}' acts on the chamber pressures, and {record.name} has no "
            f"{' and no '.join(missing)}: take a record with both"
        )
    cap, rod = (columns[name] for name in CHAMBER_PRESSURES)
    return cap, rod


def _passing(effects: Mapping[str, Sizes], rig: Rig) -> list[Note]:
    """Returns a note for each injected effect that does not commute with an effect of the rig."""
    return [
        Note(
            f"'{effect}' is put on the near side of the '{own}' of the rig file, the catalogue "
            "has them the other way round, and they do not commute",
            exact=False,
        )
        for effect in effects
        for own in does_not_pass(effect)
        if own in rig.effects()
    ]


def _expected(
    effects: Mapping[str, Sizes], rig: Rig, record: Record
) -> tuple[dict[str, dict[str, float]], tuple[str, ...], list[Note]]:
    """Returns the catalogue effects that a diagnosis should find, the ids outside it, and notes."""
    expected = {effect: dict(sizes) for effect, sizes in effects.items() if effect not in OWN}
    outside: list[str] = []
    notes = []
    late = sum(effects[each]["delay_s"] for each in LATE_POSITION if each in effects)
    if late > 0.0:
        expected.pop(IN_CATALOGUE, None)
        if any(name in record.columns for name in OTHER_OUTPUTS):
            expected[IN_CATALOGUE] = {"delay_s": late}
        else:
            before = expected.get("transport_delay", {}).get("delay_s", 0.0)
            expected["transport_delay"] = {"delay_s": before + late}
            notes.append(Note("where nothing else is measured a late position is a late command"))
    if "position_bias" in effects:
        outside.append("position_bias")
        notes.append(
            Note(
                "a bias of the position shows as no effect: it moves the chambers' volumes"
                if rig.plant == "ehs"
                else "a bias of the position shows as no effect: the plant is the same everywhere"
            )
        )
    return expected, tuple(outside), notes


def answer_path(path: str | os.PathLike[str]) -> Path:
    """Path of the answer of a record: in the same folder, its whole name and `.answer.json`."""
    path = Path(path)
    return path.with_name(f"{path.name}.answer.json")


def write_injected(injected: Injected, path: Path) -> None:
    """Writes the record in the format that its extension names, and the answer beside it.

    Raises
    ------
    RecordError
        the format does not allow the name of a column.
    OSError
        the file system refuses to write.
    """
    content = record_bytes(injected.record, path.name)
    path.write_bytes(content)
    plain = injected.answer.plain()
    plain["record"] = {"file": path.name, "sha256": hashlib.sha256(content).hexdigest()}
    write_text(answer_path(path), json.dumps(plain, indent=2, allow_nan=False) + "\n")
