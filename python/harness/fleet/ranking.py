# SPDX-License-Identifier: MIT
"""Ranking of the machines of a fleet by structural gap, and the effects that they share."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import ehsid

from ..diagnosis.job import DIAGNOSIS, ERROR
from ..diagnosis.schema import DiagnosisFile, Estimate, read_diagnosis_file


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
