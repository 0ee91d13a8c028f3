# SPDX-License-Identifier: MIT
"""All that a controller takes of a machine, as constants and tables with unit and source."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..diagnosis.schema import Estimate
from ..signals.simulation import PositionController
from .controller import LEAST_RAMP, NOISES, CompensatedController, TableSide
from .drive import Drive, drive_of
from .known import Known, read_known
from .loop import Gains, Servo, gains_of
from .valve import Valve, valve_of

VALVE, SPEED, LOOP = (f"Merritt 1967, ch. {chapter}" for chapter in (5, 6, 8))
INVERSE = "Jelali, Kroll 2003, ch. 7"
FRICTION = "Armstrong-Helouvry et al. 1994"
SERVO = "Ghazali et al. 2011, Eq. (5)"
MARGIN = "Astrom, Hagglund 2006, sec. 4.6"
SAFE = "Tao, Kokotovic 1996"
OWN, TOLD = "docs/apply.md", "rig file"
SOURCES = (
    "H. E. Merritt, Hydraulic Control Systems, Wiley 1967.",
    "M. Jelali, A. Kroll, Hydraulic Servo-systems, Springer 2003.",
    "K. J. Astrom, T. Hagglund, Advanced PID Control, ISA 2006.",
    "G. Tao, P. V. Kokotovic, Adaptive Control of Systems with Actuator and Sensor Nonlinearities, "
    "Wiley 1996.",
    "B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models, analysis tools and "
    "compensation methods for the control of machines with friction, Automatica 30(7), 1994.",
    "R. Ghazali et al., Recursive parameter estimation for discrete-time model of an "
    "electro-hydraulic servo system, Int. J. Physical Sciences 6(30), 2011.",
)
# A margin without a crossing; no format for controllers has an infinity.
NO_CROSSING = 999.0


@dataclass(frozen=True)
class Constant:
    """A number for a controller."""

    name: str
    value: float
    low: float | None
    high: float | None
    """Interval of 90 %; None for a number that was chosen or computed without one."""
    unit: str
    """"1" for shares of the rated command or of full opening, and for other plain numbers."""
    meaning: str
    source: str
    """Equation or publication."""


@dataclass(frozen=True)
class Table:
    """Columns of 100 numbers each, by names that end in their unit; without one they are shares."""

    name: str
    columns: dict[str, list[float]]
    meaning: str
    source: str


@dataclass(frozen=True)
class Commissioning:
    """What a commissioner takes home."""

    name: str
    """Of the machine."""
    origin: str
    """Files that it rests on."""
    speed: float
    """From 0, calm, to 1, fast."""
    cycle_s: float
    """Cycle time of the controller, s."""
    constants: list[Constant] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)
    """What is not given, and why."""
    notes: list[str] = field(default_factory=list)

    def add(self, name: str, value: Estimate | float, unit: str, meaning: str, source: str) -> None:
        """Adds a constant, with its interval where it has one."""
        low = high = None
        if isinstance(value, Estimate):
            if value.low != value.high:
                low, high = sorted(value.ci90)
            value = value.value
        number = min(value, NO_CROSSING) if math.isinf(value) else value
        self.constants.append(Constant(name, number, low, high, unit, meaning, source))


@dataclass(frozen=True, eq=False)
class Design:
    """The parts of a design, for figures and for a simulation; None for what was refused."""

    known: Known
    valve: Valve | None
    drive: Drive | None
    servo: Servo | None
    gains: Gains | None
    """P with velocity feed-forward."""
    placed: Gains | None
    """The pole placement."""
    result: Commissioning

    def controller(self) -> PositionController:
        """Returns the controller of the tables and of P, for a simulation.

        Raises
        ------
        ValueError
            tables or gains were refused.
        """
        if self.valve is None or self.drive is None or self.gains is None:
            raise ValueError(
                f"{self.known.name}: no controller without its tables and gains: "
                + "; ".join(map(": ".join, self.result.refused.items()))
            )
        extending, retracting = (
            TableSide(
                self.drive.direction(side).velocity,
                self.drive.direction(side).opening,
                np.abs(self.valve.side(side).inverse_opening),
                self.valve.side(side).safe_command,
            )
            for side in (1, -1)
        )
        return CompensatedController(
            self.gains.position,
            feed_forward_v_s_m=self.gains.feed_forward,
            limit_v=self.valve.rated_command,
            extending=extending,
            retracting=retracting,
            ramp_m_s=_ramp(self.known, self.drive, self.gains),
        )


def _ramp(known: Known, drive: Drive, gains: Gains) -> float:
    """Velocity up to which the command is on a straight line about null, m/s."""
    noise = 0.0 if known.rig is None else known.rig.sensors.get("position_noise_m", 0.0)
    fastest = max(drive.extending.speed.value, drive.retracting.speed.value)
    return max(NOISES * noise * gains.pole, LEAST_RAMP * fastest)


def design(paths: Sequence[Path], *, speed: float = 0.5, cycle_s: float = 1e-3) -> Design:
    """Designs what a controller needs, from what the files tell of a machine.

    Parameters
    ----------
    paths
        folder of a diagnosis or rig file, estimate, or one of each; see `read_known`.
    speed
        of the loop, from 0, calm, to 1, fast.
    cycle_s
        cycle time of the controller, s, 1e-5 to 0.1.

    Raises
    ------
    ValueError
        as `read_known`, speed or cycle time are out of their range, or the valve never opens.
    """
    if not 0.0 <= speed <= 1.0:
        raise ValueError(f"--speed {speed:g}: expected 0, calm, to 1, fast; take one between")
    if not 1e-5 <= cycle_s <= 0.1:
        raise ValueError(f"--cycle {cycle_s:g}: expected 0.00001 to 0.1 s; give it in seconds")
    known = read_known(paths)
    result = Commissioning(known.name, known.origin, speed, cycle_s, notes=list(known.notes))
    valve = None if known.rig is None else valve_of(known)
    drive = None if valve is None else drive_of(known)
    servo = None if drive is None else drive.servo
    if known.servo is not None:
        gain, omega_n, xi = known.servo
        servo = Servo(gain, omega_n, xi, known.servo_delay * cycle_s)
    if valve is None:
        result.refused["valve"] = "an estimate has no edges: name a diagnosis or a rig file, too"
    else:
        _add_valve(result, valve)
    if drive is not None:
        _add_drive(result, drive)
    elif valve is not None:
        result.refused["speeds and friction"] = (
            "a simulator of yours does not tell areas and pressures: what was found stands in "
            "rig.augmented.toml"
        )
    unit = known.command_unit
    if servo is not None:
        _add_servo(result, servo, unit)
    gains = _gains(result, servo, unit, placed=False)
    placed = _gains(result, servo, unit, placed=True)
    if gains is not None and drive is not None:
        meaning = "straight line of the command about null"
        result.add("ramp_velocity", _ramp(known, drive, gains), "m/s", meaning, OWN)
    return Design(known, valve, drive, servo, gains, placed, result)


def _gains(result: Commissioning, servo: Servo | None, unit: str, *, placed: bool) -> Gains | None:
    """Designs one loop; adds its constants, or the reason why it is refused.

    unit: of the command.
    """
    what = "pole placement" if placed else "P with velocity feed-forward"
    if servo is None:
        result.refused[what] = "K, omega_n and xi are not known: name an estimate.json, too"
        return None
    gains = gains_of(servo, result.cycle_s, result.speed, placed=placed)
    if isinstance(gains, str):
        result.refused[what] = gains
        return None
    p, source = ("placed", INVERSE) if placed else ("p", LOOP)
    add, of_velocity = result.add, f"{unit} s/m"
    add(f"{p}_pole", gains.pole, "1/s", "position errors decay as exp(-pole t)", source)
    add(f"{p}_pole_fastest", gains.fastest, "1/s", "the pole at speed 1", MARGIN)
    add(f"{p}_gain_position", gains.position, f"{unit}/m", "of the position error", source)
    add(f"{p}_feed_forward", gains.feed_forward, of_velocity, "of the reference's velocity", source)
    if gains.damping is not None:
        meaning = "subtracted, of the velocity"
        add(f"{p}_gain_velocity", gains.velocity, of_velocity, meaning, source)
        meaning = "subtracted, of the acceleration"
        add(f"{p}_gain_acceleration", gains.acceleration, f"{unit} s^2/m", meaning, source)
        add(f"{p}_damping", gains.damping, "1", "of the pair of the oil spring", source)
    for where, one in (("worst", gains.worst), ("middle", gains.middle)):
        of = f"{where} of the interval"
        add(f"{p}_gain_margin_{where}", one.gain_db, "dB", of, MARGIN)
        add(f"{p}_phase_margin_{where}", one.phase_deg, "deg", of, MARGIN)
    return gains


def _add_valve(result: Commissioning, valve: Valve) -> None:
    add = result.add
    add("rated_command", valve.rated_command, "V", "of which commands are shares", TOLD)
    add("overlap_extending", valve.overlap_a, "1", "of the edges that extend", VALVE)
    add("overlap_retracting", valve.overlap_b, "1", "of the edges that retract", VALVE)
    add("null_bias", valve.bias, "1", "opening at zero command", VALVE)
    add("null_command", valve.null, "1", "command in the middle between the edges", VALVE)
    for one, way in ((valve.extending, "extending"), (valve.retracting, "retracting")):
        add(f"edge_{way}", one.edge, "1", "command at which the edges begin to open", VALVE)
        add(f"margin_{way}", one.margin, "1", "already taken off the inverse", SAFE)
    add("hysteresis", valve.hysteresis, "1", "half the width of the loop; noted only", VALVE)
    if valve.limit is not None:
        add("saturation", valve.limit, "1", "largest opening", VALVE)
    for one, way in ((valve.extending, "extending"), (valve.retracting, "retracting")):
        characteristic = {
            "command": one.command,
            "opening": one.opening,
            "opening_low": one.opening_low,
            "opening_high": one.opening_high,
        }
        inverse = {
            "opening": one.inverse_opening,
            "command": one.safe_command,
            "command_exact": one.inverse_command,
            "command_low": one.inverse_low,
            "command_high": one.inverse_high,
        }
        for kind, columns, text, of in (
            ("valve", characteristic, "opening over command, {}, with the band of 90 %", VALVE),
            (
                "inverse",
                inverse,
                "command for an opening, {}: the exact inverse less the margin of its edge",
                INVERSE,
            ),
        ):
            plain = {name: column.tolist() for name, column in columns.items()}
            result.tables.append(Table(f"{kind}_{way}", plain, text.format(way), of))
    result.notes.extend(valve.notes())


def _add_drive(result: Commissioning, drive: Drive) -> None:
    add = result.add
    ratio = drive.extending.speed.value / drive.retracting.speed.value
    add("area_ratio", drive.area_a / drive.area_b, "1", "cap side over rod side", TOLD)
    add("velocity_ratio", ratio, "1", "extending over retracting, at one opening", SPEED)
    for one, way in ((drive.extending, "extending"), (drive.retracting, "retracting")):
        add(f"speed_{way}", one.speed, "m/s", "at full opening, without friction", SPEED)
        add(f"stall_{way}", one.stall_n, "N", "force that stops the rod", SPEED)
        add(f"coulomb_{way}", one.coulomb, "N", "dry friction while the rod slides", FRICTION)
        columns = {"velocity_m_s": one.velocity, "opening": one.opening, "friction_n": one.force}
        text = f"opening that a velocity needs, {way}, with friction and leakage; without signs"
        plain = {name: column.tolist() for name, column in columns.items()}
        result.tables.append(Table(f"feed_forward_{way}", plain, text, SPEED))
    add("static_friction", drive.static, "N", "dry friction at rest", FRICTION)
    add("stribeck_velocity", drive.stribeck_velocity, "m/s", "0 without such a fall", FRICTION)
    add("viscous_friction", drive.viscous, "N s/m", "friction over velocity", FRICTION)
    add("breakaway_opening", drive.breakaway, "1", "feeds the leakage until the rod slides", SPEED)


def _add_servo(result: Commissioning, servo: Servo, unit: str) -> None:
    add = result.add
    add("gain", servo.gain, f"m/(s {unit})", "K, velocity for a command", SERVO)
    add("omega_n", servo.omega_n, "rad/s", "natural frequency of the oil spring", SERVO)
    add("xi", servo.xi, "1", "damping of the oil spring", SERVO)
    if servo.valve_rad_s is not None:
        add("spool", servo.valve_rad_s, "rad/s", "natural frequency of the spool", VALVE)
    delay = servo.delay_s + 1.5 * result.cycle_s
    add("delay", delay, "s", "of the machine, and one and a half cycles", OWN)
