# SPDX-License-Identifier: MIT
"""What is known of a machine for its controller: sizes with intervals of 90 %, and their origin."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import msgspec

from ..catalogue.channels import COMMAND
from ..catalogue.spellings import ParameterKey
from ..diagnosis.schema import DiagnosisFile, Estimate, read_diagnosis_file
from ..rigs import Rig, read_rig

# Half of a 90 % interval of a normal distribution, in standard deviations.
HALF_90 = 1.6449
REFUSED = {
    "outside_catalogue": "the machine has a cause that no effect of the catalogue describes, which "
    "no table makes up for: take the next experiment of the report, or look where it lies",
    "insufficient_data": "the records did not carry a diagnosis: take those that the report asks "
    "for",
}
# Sets of effects that differ only within a family agree that something is to be made up for.
FAMILIES = (
    {"valve_dead_band", "valve_dead_band_sides"},
    {"valve_null_bias", "valve_dead_band_sides"},
    {"coulomb_friction", "coulomb_friction_sides", "stribeck_friction", "position_friction"},
)


@dataclass(frozen=True)
class Known:
    """A machine as files tell it; at least one of rig and servo is there."""

    name: str
    origin: str
    """Names of the files that it was read from."""
    rig: Rig | None
    """Values and effects, as found."""
    found: Mapping[str, Estimate] = field(default_factory=dict)
    """Values with an interval from the records, by full name."""
    servo: tuple[Estimate, Estimate, Estimate] | None = None
    """K in m/s per `command_unit`, omega_n in rad/s and xi of an estimate."""
    command_unit: str = "V"
    """Unit of the command of the estimate, as in its log."""
    servo_delay: int = 0
    """Delay of the estimate, in samples."""
    notes: tuple[str, ...] = ()

    def size(self, name: str, absent: float = 0.0) -> Estimate:
        """Returns a value of the rig with its interval; one that the rig lacks is `absent`."""
        assert self.rig is not None
        if name not in self.rig.values:
            return Estimate(absent, absent, absent)
        value = self.rig.values[name]
        if name in self.found and all(map(math.isfinite, self.found[name].ci90)):
            low, high = self.found[name].ci90
            return Estimate(value, min(low, value), max(high, value))
        # Without a diagnosis the uncertainty of the rig file counts; no value changes its sign.
        half = abs(value) * min(HALF_90 * self.rig.sigma(name), 0.95)
        return Estimate(value, value - half, value + half)


def read_known(paths: Sequence[Path]) -> Known:
    """Reads a folder of a diagnosis or a rig file, an estimate, or one of each.

    Raises
    ------
    ValueError
        a path is none of these, two are of one kind, or a diagnosis or an estimate cannot carry a
        controller; the message says why.
    OSError
        a file cannot be read.
    """
    machines: list[Known] = []
    servos: list[Known] = []
    for path in paths:
        known = _read(path)
        kind = servos if known.rig is None else machines
        if kind:
            raise ValueError(
                f"{path}: a second one of its kind: expected one diagnosis or rig file, and one "
                "estimate at most; leave one out"
            )
        kind.append(known)
    if not machines or not servos:
        return (machines or servos)[0]
    (machine,), (servo,) = machines, servos
    origin = f"{machine.origin}, {servo.origin}"
    return replace(
        machine,
        origin=origin,
        servo=servo.servo,
        command_unit=servo.command_unit,
        servo_delay=servo.servo_delay,
    )


def _read(path: Path) -> Known:
    for file, read in (("diagnosis.json", _of_diagnosis), ("estimate.json", _of_estimate)):
        if path.name == file or (path / file).is_file():
            return read(path if path.name == file else path / file)
    if path.is_dir():
        raise ValueError(
            f"{path}: has neither diagnosis.json nor estimate.json: expected a folder of `ehsid "
            "gap --out` or `ehsid estimate --out`, or a rig file; name one"
        )
    note = "The sizes and their uncertainty are those of the rig file: no record was compared."
    rig = _rig(path)
    return Known(rig.name, path.name, rig, notes=(note,))


def _rig(path: Path) -> Rig:
    rig = read_rig(path)
    if rig.plant not in ("ehs", "simulator"):
        raise ValueError(
            f'{path}: a plant "{rig.plant}" has no valve with edges: expected "ehs" or '
            '"simulator"; give the estimate.json of `ehsid estimate` alone'
        )
    return rig


def _of_diagnosis(path: Path) -> Known:
    file = read_diagnosis_file(path)
    if file.verdict in REFUSED:
        raise ValueError(
            f"{path}: the verdict is {file.verdict}: {REFUSED[file.verdict]}. Expected a verdict "
            "that says what the machine has"
        )
    rig = _rig(path.parent / "rig.augmented.toml")
    found = {name: one.found for name, one in file.calibration.items()}
    for effect in file.which.effects:
        for name, size in effect.parameters.items():
            found[ParameterKey.of_effect(effect.id, name)] = size
    notes = []
    disputed = _disputed(file)
    if disputed:
        kept = {k: v for k, v in rig.values.items() if ParameterKey(k).effect not in disputed}
        rig = replace(rig, values=kept)
        notes.append(
            f"{', '.join(disputed)}: left out, because causes without it explain the records as "
            "well."
        )
    if rig.tables:
        notes.append("A law without a name, which the diagnosis found, is not made up for.")
    return Known(rig.name, path.name, rig, found, notes=tuple(notes))


def _disputed(file: DiagnosisFile) -> list[str]:
    """Effects of the best set that another set, which explains the records as well, lacks."""
    disputed = []
    for one in file.which.effects:
        alike = {one.id}.union(*(family for family in FAMILIES if one.id in family))
        if not all(alike & set(others) for others in file.which.ambiguity_set):
            disputed.append(one.id)
    return disputed


def _unit_of_command(reading: Mapping[str, Any]) -> str:
    """The unit that a command keeps from its log, as `Record.own_unit`; V without one."""
    kept = (
        one["unit"]
        for one in reading.get("columns", ())
        if one["channel"] == COMMAND and one["factor"] == 1.0
    )
    return next(kept, None) or "V"


def _of_estimate(path: Path) -> Known:
    try:
        file = msgspec.json.decode(path.read_bytes())
        servo = file["servo"]
        sizes = []
        for name in ("gain", "omega_n", "xi"):
            one = servo[name]
            if not one["trusted"] or not one["value"] > 0.0:
                raise ValueError(
                    f"{path}: {name} of the servo is {one['value']}, {one['reason_at_end']}: "
                    "expected K, omega_n and xi above 0 that are trusted; `ehsid estimate` says "
                    "which record shows them"
                )
            sizes.append(Estimate(one["value"], *one["ci90"]))
        gain, omega_n, xi = sizes
        return Known(
            path.absolute().parent.name,
            path.name,
            None,
            servo=(gain, omega_n, xi),
            command_unit=_unit_of_command(file.get("reading", {})),
            servo_delay=servo["delay"],
        )
    except (msgspec.DecodeError, KeyError, TypeError):
        raise ValueError(
            f"{path}: has no servo: expected the estimate.json of `ehsid estimate RECORD --out "
            "FOLDER` with 3 past outputs and inputs, of a record with time; make it again"
        ) from None
