# SPDX-License-Identifier: MIT
"""A lesson: records of a simulated machine with one effect that is not told.

All that is random comes from the seed, so that the seed alone says the truth again.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import numpy as np

import ehsid
from ehsid.harness.base.encoding import json_text, read_json
from ehsid.harness.base.files import write_text
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.channels import CHAMBER_PRESSURES, COMMAND, POSITION, TIME
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.records import Record, make_record
from ehsid.harness.records.record import record_bytes
from ehsid.harness.rigs import Rig, RigError, read_rig
from ehsid.harness.signals.excitation import named_signal
from ehsid.harness.signals.simulation import (
    SimulationError,
    command_limit,
    draw_noise,
    inside_stroke,
    simulate,
)
from ehsid.harness.signals.simulation.run import noise_sigma

from .playground import DT_S, effects_of
from .session import RIG, Session

FILE = "lesson.json"
SECONDS = 8.0  # of each record
# Test signal, peak as a share of the rated command, and highest frequency of each record. Together
# they have reversals, rests, slow and fast motion, small and large commands.
RECORDS = (("multisine", 0.3, 15.0), ("triangle", 0.25, 5.0), ("steps", 0.7, 4.0))
# What these records do not have; effects that need it cannot be found in them.
LACKING = frozenset({"long_record", "high_pressures", "low_pressures"})
# A size is between half and twice the typical one.
OCTAVES = 1.0
# What a usual machine has sensors for.
LOGGED = (POSITION, *CHAMBER_PRESSURES)
# An effect shows where its motion is so many times the noise, both as root mean square.
LEAST_SHOWN = 3.0


class Lesson(msgspec.Struct):
    """Content of lesson.json."""

    seed: int
    """Of all that is random."""
    guess: str = ""
    """Id of the effect that the user thinks it is; "" before a guess."""


def new_seed() -> int:
    """Returns a seed that people can write down."""
    return 1 + secrets.randbelow(999_999)


def candidates(rig: Rig) -> list[ehsid.EffectInfo]:
    """Returns the effects that a lesson on this rig can hide."""
    own = set(rig.effects())
    return [
        effect
        for effects in effects_of(rig.plant).values()
        for effect in effects
        if effect.id not in own and not LACKING & set(effect.needs)
    ]


def truth(rig: Rig, seed: int) -> tuple[str, dict[str, float]]:
    """Returns the id of the hidden effect, and its sizes by full name.

    Parameters
    ----------
    rig
        the rig as it is told.
    seed
        of the lesson.
    """
    rng = np.random.default_rng(seed)
    there = candidates(rig)
    effect = there[int(rng.integers(len(there)))]
    while True:
        sizes = {
            str(ParameterKey.of_effect(effect.id, one.name)): _size(one, rng)
            for one in effect.parameters
        }
        try:
            rig.with_values(sizes)
        except RigError:  # sizes that contradict each other, as static below sliding friction
            continue
        return effect.id, sizes


def _size(parameter: ehsid.PlantParameter, rng: np.random.Generator) -> float:
    size = parameter.typical * 2.0 ** rng.uniform(-OCTAVES, OCTAVES)
    if parameter.minimum < 0.0 and rng.random() < 0.5:
        size = -size
    return float(min(max(size, parameter.minimum), parameter.maximum))


def shows(rig: Rig, seed: int) -> bool:
    """Whether the hidden effect moves a logged signal more than its noise."""
    machine = rig.with_values(truth(rig, seed)[1])
    for command, name in _commands(rig, seed):
        try:
            having, without = (
                simulate(one, command, dt_s=DT_S, name=name).record for one in (machine, rig)
            )
        except SimulationError:
            return False
        for signal in LOGGED:
            moved = having.column(signal) - without.column(signal)
            if np.sqrt(np.mean(moved**2)) > LEAST_SHOWN * noise_sigma(rig, signal):
                return True
    return False


def lesson_records(rig: Rig, seed: int) -> list[Record]:
    """Returns the logs of the machine with the hidden effect, with the noise of its sensors.

    Raises
    ------
    SimulationError
        the rig cannot be simulated with the effect.
    """
    machine = rig.with_values(truth(rig, seed)[1])
    records = []
    for number, (command, name) in enumerate(_commands(rig, seed)):
        noise = draw_noise(machine, command.size, np.random.default_rng([seed, number]))
        run = simulate(machine, command, dt_s=DT_S, noise=noise, name=name)
        records.append(_as_logged(run.record))
    return records


def _commands(rig: Rig, seed: int) -> Iterator[tuple[FloatArray, str]]:
    """Yields the command of each record, V, and its name."""
    count, limit = round(SECONDS / DT_S), command_limit(rig)
    for number, (name, share, top_hz) in enumerate(RECORDS):
        command = named_signal(
            name, count, DT_S, peak=share * limit, top_hz=top_hz, seed=seed + number
        )
        yield inside_stroke(rig, command, DT_S), name


def _as_logged(record: Record) -> Record:
    """Returns the record without the signals that a usual machine does not log."""
    kept = {name: record.columns[name] for name in (COMMAND, *LOGGED) if name in record.columns}
    assert record.time_s is not None
    return make_record({TIME: record.time_s, **kept}, name=record.name)


def lesson_task(folder: Path, *, report: Callable[[float], None]) -> None:
    """Draws an effect that shows, and writes its logs and the seed into a session with a rig."""
    rig = read_rig(folder / RIG)
    seed = new_seed()
    while not shows(rig, seed):
        seed = new_seed()
    report(0.5)
    logs = folder / "logs"
    logs.mkdir(exist_ok=True)
    for record in lesson_records(rig, seed):
        path = logs / f"{record.name}.csv"
        path.write_bytes(record_bytes(record, path.name))
    # The last file: with it the session is a lesson.
    write_text(folder / FILE, json_text(Lesson(seed)))
    report(1.0)


def lesson_of(session: Session) -> Lesson | None:
    """Returns the lesson of a session; None for a session that is none."""
    return read_json(session.folder / FILE, Lesson)


def guessed(session: Session, effect: str) -> None:
    """Writes the guess of the user into the lesson of a session."""
    lesson = lesson_of(session)
    assert lesson is not None
    lesson.guess = effect
    write_text(session.folder / FILE, json_text(lesson))
