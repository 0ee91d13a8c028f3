# SPDX-License-Identifier: MIT
"""Diagnosis of a fleet, and the ranking of its machines by structural gap and shared effects."""

from __future__ import annotations

import contextlib
import functools
import io
import json
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

import ehsid

from .base.error_words import error_words
from .base.exchange import sha256_of
from .base.files import is_incomplete, temporary_folder
from .base.parallel import run_surviving
from .diagnosis.job import (
    DIAGNOSIS,
    ERROR,
    RESULT,
    Diagnose,
    Job,
    Outcome,
    Write,
    check_room,
    failure,
    keep,
    one_line,
    run_job,
)
from .diagnosis.options import DiagnosisOptions
from .diagnosis.schema import DiagnosisFile, Estimate, read_diagnosis_file
from .records import NO_HINTS, Hints
from .records.kinds import FOLDER_ENDINGS, records_in

RIG = "rig.toml"
INPUTS = "inputs.json"
HELD_OUT = "validate"
# Machines with more bytes in their files are read by this process, which sends the channels only.
MOST_SENT = 64_000_000

# Reads the folder of a machine; raises a ValueError or OSError with a message where it cannot.
Read = Callable[[Path], Job]


def machine_folders(folder: Path) -> list[Path]:
    """Returns the sub-folders by name, one for each machine; hidden ones are left out.

    Raises
    ------
    ValueError
        there is no such folder, or it has no sub-folder.
    """
    if not folder.is_dir():
        raise ValueError(
            f"{folder}: there is no such folder: expected one with a sub-folder for each machine"
        )
    machines = sorted(
        path for path in folder.iterdir() if path.is_dir() and not path.name.startswith(".")
    )
    if not machines:
        raise ValueError(f"{folder}: has no sub-folders; expected one for each machine, with {RIG}")
    return machines


def record_files(folder: Path) -> tuple[list[Path], list[Path]]:
    """Returns the records of a machine to fit, and the held-out ones, both sorted by name.

    Raises
    ------
    ValueError
        there is no rig file, or no record to fit.
    """
    if not (folder / RIG).is_file():
        raise ValueError(f"{folder}: has no {RIG}: expected it beside the records")
    records = records_in(folder)
    held_out = [path for path in records if path.name.lower().startswith(HELD_OUT)]
    fitted = [path for path in records if path not in held_out]
    if not fitted:
        also = f" beside those that start with '{HELD_OUT}' and are held out" if held_out else ""
        endings = ", ".join(f".{ending}" for ending in FOLDER_ENDINGS)
        raise ValueError(f"{folder}: has no record{also}: expected at least one ({endings})")
    return fitted, held_out


def inputs_of(folder: Path, options: DiagnosisOptions, hints: Hints = NO_HINTS) -> bytes:
    """Returns what determines a result, as JSON: digests of files, options, version."""
    files = {path.name: sha256_of(path) for path in sorted(folder.iterdir()) if path.is_file()}
    maps = {channel: [column.name, column.unit] for channel, column in hints.maps.items()}
    plain = {
        "files": files,
        **asdict(options),
        "map": maps,
        "dt_s": hints.dt_s,
        "ehsid_version": ehsid.__version__,
    }
    return (json.dumps(plain, indent=1) + "\n").encode()


def is_finished(result: Path, inputs: Callable[[], bytes]) -> bool:
    """Whether the folder of a result has a diagnosis of the same inputs.

    The inputs are only asked for where there is a diagnosis: to read all files of a large fleet
    takes minutes.
    """
    kept = result / INPUTS
    there = (result / DIAGNOSIS).is_file() and kept.is_file() and kept.read_bytes() == inputs()
    return there and not is_incomplete(result, RESULT)


def unfinished_machines(
    folders: Iterable[Path], out: Path, options: DiagnosisOptions, hints: Hints = NO_HINTS
) -> list[Path]:
    """Returns the machines without a diagnosis of their present files; errors are tried again.

    A machine whose files cannot be read is among them: its diagnosis then says why.
    """

    def finished(folder: Path) -> bool:
        try:
            inputs = functools.partial(inputs_of, folder, options, hints)
            return is_finished(out / folder.name, inputs)
        except OSError:
            return False

    return [folder for folder in folders if not finished(folder)]


def run_fleet(
    folders: Sequence[Path],
    out: Path,
    options: DiagnosisOptions,
    read: Read,
    diagnose: Diagnose,
    write: Write,
    hints: Hints = NO_HINTS,
) -> Iterator[Outcome]:
    """Diagnoses each machine; the files of `write` are in OUT/NAME before an outcome is yielded.

    `hints` are what `read` was told about the records; they belong to the inputs of a result.

    A machine whose process is killed, for example for want of memory, gets an error; the others go
    on.
    """

    def task_of(folder: Path) -> Callable[[], Outcome]:
        return _task(folder, options, read, diagnose, write, hints)

    for folder, found in run_surviving(folders, task_of):
        outcome = found or _killed(folder)
        keep(outcome, out)
        yield outcome


def _killed(folder: Path) -> Outcome:
    message = (
        f"{folder}: its process was killed, perhaps for want of memory: take shorter records or "
        "fewer --workers"
    )
    return Outcome(folder.name, {ERROR: f"{message}\n".encode()}, message, 0.0)


def _task(
    folder: Path,
    options: DiagnosisOptions,
    read: Read,
    diagnose: Diagnose,
    write: Write,
    hints: Hints,
) -> Callable[[], Outcome]:
    try:
        inputs = inputs_of(folder, options, hints)
        files = _files_to_send(folder)
        if files is not None:
            sent = Sent(folder.name, str(folder.parent), files, options, inputs)
            return functools.partial(run_sent, sent, read, diagnose, write)
        job = replace(read(folder), options=options)
        return functools.partial(run_machine, job, diagnose, write, inputs)
    except Exception as error:  # whatever a machine has, it does not end the others
        return functools.partial(_unread, folder.name, error)


def _files_to_send(folder: Path) -> dict[str, bytes] | None:
    """Returns the files of a machine by name, or None if they are too large to be sent."""
    files = [path for path in sorted(folder.iterdir()) if path.is_file()]
    if sum(path.stat().st_size for path in files) > MOST_SENT:
        return None
    return {path.name: path.read_bytes() for path in files}


@dataclass(frozen=True)
class Sent:
    """The files of a machine, on their way to where it is diagnosed."""

    name: str
    """Name of the machine."""
    place: str
    """Folder of the fleet on the computer of the user, for messages."""
    files: Mapping[str, bytes]
    """Contents by name."""
    options: DiagnosisOptions
    """The options of the diagnosis."""
    inputs: bytes
    """What determines the result, see `inputs_of`."""


def run_sent(sent: Sent, read: Read, diagnose: Diagnose, write: Write) -> Outcome:
    """Reads the files of a machine here, and diagnoses it.

    The reading costs more than anything else that the computer of the user does for a machine, and
    the workers share it. Messages name the files as the user does.

    Raises
    ------
    ValueError
        the disk of temporary files is full.
    """
    began, said = time.monotonic(), io.StringIO()
    with temporary_folder() as place:
        top = str(place)
        try:
            folder = place / sent.name
            folder.mkdir()
            for name, content in sent.files.items():
                (folder / name).write_bytes(content)
            with contextlib.redirect_stderr(said):
                job = replace(read(folder), options=sent.options)
        except Exception as error:
            check_room(error)
            unread = _unread(sent.name, error)
            text = unread.files[ERROR].replace(top.encode(), sent.place.encode())
            return replace(unread, files={ERROR: text}, word=unread.word.replace(top, sent.place))
    outcome = run_machine(job, diagnose, write, sent.inputs)
    shown = said.getvalue().replace(top, sent.place)
    return replace(outcome, seconds=time.monotonic() - began, said=shown)


def _unread(name: str, error: Exception) -> Outcome:
    """Returns the outcome of a machine that cannot be read: a message, or the whole error."""
    if isinstance(error, ValueError | OSError) and error_words(error) is not None:
        message = one_line(str(error))
        return Outcome(name, {ERROR: f"{message}\n".encode()}, message, 0.0)
    files, message = failure(error)
    return Outcome(name, files, message, 0.0)


def run_machine(job: Job, diagnose: Diagnose, write: Write, inputs: bytes) -> Outcome:
    """Diagnoses one machine and adds a file of the inputs to the files of the result."""
    outcome = run_job(job, diagnose, write)
    return replace(outcome, files=outcome.files | {INPUTS: inputs})


@dataclass(frozen=True)
class FleetEffect:
    """An effect of a machine; `share_of_gap` is its share of the structural gap, in [0, 1]."""

    id: str
    probability: float
    parameters: Mapping[str, Estimate]
    share_of_gap: float


@dataclass(frozen=True)
class Machine:
    """A machine and a summary of its diagnosis."""

    name: str
    """Name of its folder."""
    verdict: str
    sentence: str
    """Verdict of its diagnosis, and the verdict as a sentence."""
    nominal: float
    calibrated: float
    augmented: float
    """Gaps on held-out data, nrmse: of the simulator as configured, with fitted values, and with
    effects; NaN where not judged."""
    noise_floor: tuple[float, float]
    """Lowest and highest noise floor, nrmse."""
    structural: float
    """Calibrated gap above the highest noise floor, nrmse, not below zero; NaN where not judged."""
    effects: tuple[FleetEffect, ...]
    """Effects that the diagnosis named."""
    ambiguity_set: tuple[tuple[str, ...], ...]
    """Sets of ids that explain the records equally well, the named one first."""
    cannot_judge: Mapping[str, str]
    """By id of an effect, why the records do not allow to judge it."""
    why: tuple[str, ...]
    """Reasons of the verdict."""

    @property
    def judged(self) -> bool:
        """Whether there is a structural gap by which the machine can be ranked."""
        return math.isfinite(self.structural)

    @property
    def rivals(self) -> tuple[str, ...]:
        """Ids of effects that were not named, but explain the records equally well."""
        named = {effect.id for effect in self.effects}
        others = (effect for group in self.ambiguity_set for effect in group)
        return tuple(dict.fromkeys(effect for effect in others if effect not in named))


@dataclass(frozen=True)
class Shared:
    """An effect, the machines in which it was named, and those in which it is a rival only.

    Both lists are in the order of the structural gap, largest first.
    """

    id: str
    named: tuple[str, ...]
    rival: tuple[str, ...]


@dataclass(frozen=True)
class Fleet:
    """The machines of a fleet in order, and the effects that they share; what `fleet.json` has."""

    schema_version: Literal[1]
    """Version of the file."""
    ehsid_version: str
    """Version of ehsid that ranked the machines."""
    ranked: tuple[Machine, ...]
    """Machines that were judged, the largest structural gap first."""
    not_judged: tuple[Machine, ...]
    """Machines whose records do not allow a judgement."""
    failed: Mapping[str, str]
    """Error messages of machines that could not be diagnosed, by name."""
    shared: tuple[Shared, ...]
    """Effects, the most common first."""


def read_fleet(out: Path, names: Iterable[str], refused: Mapping[str, str] | None = None) -> Fleet:
    """Reads the results of these machines and ranks the machines.

    `refused` has the messages of the other machines, which were not diagnosed, by name.

    Raises
    ------
    ValueError
        a result cannot be read.
    """
    machines, failed = [], dict(refused or {})
    for name in names:
        folder = out / name
        if (folder / DIAGNOSIS).is_file():
            machines.append(_read(folder / DIAGNOSIS))
        elif (folder / ERROR).is_file():
            lines = (folder / ERROR).read_text(encoding="utf-8").strip().splitlines()
            failed[name] = lines[-1] if lines else "no message"
    ranked = sorted(
        (machine for machine in machines if machine.judged),
        key=lambda machine: (-machine.structural, machine.name),
    )
    return Fleet(
        schema_version=1,
        ehsid_version=ehsid.__version__,
        ranked=tuple(ranked),
        not_judged=tuple(machine for machine in machines if not machine.judged),
        failed=failed,
        shared=_shared(ranked),
    )


def _read(path: Path) -> Machine:
    try:
        return machine_of(path.parent.name, read_diagnosis_file(path))
    except ValueError as error:
        raise ValueError(f"{error}; remove its folder and start again") from None


def machine_of(name: str, file: DiagnosisFile) -> Machine:
    """Returns the summary of a diagnosis."""
    how_far, which = file.how_far, file.which
    low, high = how_far.noise_floor
    calibrated = how_far.calibrated
    judged = file.verdict != "insufficient_data"
    return Machine(
        name=name,
        verdict=file.verdict,
        sentence=file.sentence,
        nominal=how_far.nominal,
        calibrated=calibrated,
        augmented=how_far.augmented,
        noise_floor=(low, high),
        structural=max(0.0, calibrated - high) if judged else math.nan,
        effects=tuple(
            FleetEffect(
                effect.id,
                effect.probability,
                effect.parameters,
                min(1.0, max(0.0, effect.share_of_shrinkage)),
            )
            for effect in which.effects
        ),
        ambiguity_set=which.ambiguity_set,
        cannot_judge={effect.id: effect.why for effect in which.cannot_judge},
        why=file.reasons,
    )


def _shared(ranked: Sequence[Machine]) -> tuple[Shared, ...]:
    named: dict[str, list[str]] = {}
    rival: dict[str, list[str]] = {}
    for machine in ranked:
        for effect in machine.effects:
            named.setdefault(effect.id, []).append(machine.name)
        for effect_id in machine.rivals:
            rival.setdefault(effect_id, []).append(machine.name)
    shared = [
        Shared(effect, tuple(named.get(effect, ())), tuple(rival.get(effect, ())))
        for effect in {**named, **rival}
    ]
    return tuple(sorted(shared, key=lambda it: (-len(it.named), -len(it.rival), it.id)))
