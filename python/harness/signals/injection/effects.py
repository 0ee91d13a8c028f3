# SPDX-License-Identifier: MIT
"""Effects that can be injected into a log, with their ranges and plants.

Result of one injection step, and the notes for the user about it.

Pre-images of effects on the command path: u' with effect(u') = u, in units of rated command.

Applies effects of a sensor, as the simulator computes them, to a logged position in m.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ehsid import EffectTerms

from ...base.numbers import FloatArray
from ...catalogue.parameters import acts_on, plant_parameters
from ...catalogue.parameters import effects as catalogue
from ...catalogue.spellings import effect_values
from ...records.errors import nearest_name
from ...rigs import Rig


class Note(NamedTuple):
    """A sentence about a step; `exact` is False where the step is only approximate."""

    text: str
    exact: bool = True


class Step(NamedTuple):
    """The signal after an injection step, and notes about the step."""

    signal: FloatArray
    notes: list[Note]


def rms(signal: FloatArray) -> float:
    """Root mean square of a signal, in the unit of the signal."""
    return float(np.sqrt(np.mean(np.square(signal))))


Range = tuple[float, float]
Sizes = Mapping[str, float]


class InjectError(ValueError):
    """An effect, a size or a record that cannot be used; the message says how to correct it."""


QUANTISATION = "sensor_quantisation"


def _with_place(*places: str) -> tuple[str, ...]:
    return tuple(info.id for info in catalogue().values() if info.log_place in places)


# Effects on the command, injected by their pre-images from the machine back to the controller: the
# reversed order of the command path in the catalogue. A load force of an axis and the gain of the
# drive act behind the whole command path.
COMMAND = (*_with_place("command_of_axis"), "gain", *reversed(_with_place("command")))

# Effects on the logged position, in the order of the sensor in the catalogue. A delayed reading is
# a reading of the sensor before quantisation.
POSITION = (
    "position_bias",
    *(effect for effect in _with_place("position") if effect != QUANTISATION),
    "position_delay",
    QUANTISATION,
)

# Effects on the logged chamber pressures, in the order of the catalogue.
PRESSURES = _with_place("pressures")

# Effects under names that are not in the catalogue. The answer says what they correspond to.
OWN: Mapping[str, Mapping[str, Range]] = MappingProxyType(
    {
        "gain": {"factor": (0.2, 5.0)},
        "position_delay": {"delay_s": (0.0, 0.2)},
        "position_bias": {"offset_m": (-1.0, 1.0)},
    }
)

# The value of the rig that a gain of the command multiplies.
GAIN_OF = MappingProxyType(
    {
        "ehs": "valve.rated_flow_m3_s",
        "axis": "axis.force_per_volt",
        "linear": "linear.flow_gain_m3_s",
    }
)

# Effects of the rig with which the gain does not commute: they depend on the size of the command.
_GAIN_DOES_NOT_PASS = (
    "valve_hysteresis",
    "valve_null_bias",
    "valve_flow_saturation",
    "valve_dead_band",
    "valve_dead_band_sides",
)


def does_not_pass(effect: str) -> tuple[str, ...]:
    """Returns the effects of the rig with which an injected effect does not commute.

    An effect on the command is injected in front of all the effects of the machine in the log, an
    effect on the position behind them.
    """
    if effect == "gain":
        return _GAIN_DOES_NOT_PASS
    return catalogue()[effect].does_not_commute if effect in catalogue() else ()


def injectable(plant: str) -> dict[str, dict[str, Range]]:
    """Returns the ids of the effects for a log of this plant, with the range of each parameter."""
    known = catalogue()
    ranges: dict[str, dict[str, Range]] = {}
    for effect in (*COMMAND, *POSITION, *PRESSURES):
        if effect in OWN:
            ranges[effect] = dict(OWN[effect])
        # A force is equivalent to a command of a motor, but not to a command of a valve.
        elif known[effect].log_place == "command_of_axis" and plant != "axis":
            continue
        elif acts_on(known[effect], plant):
            ranges[effect] = {p.name: (p.minimum, p.maximum) for p in known[effect].parameters}
    return ranges


def check(effects: Mapping[str, Sizes], rig: Rig) -> None:
    """Checks that all these effects can be injected into a log of this rig.

    Raises
    ------
    InjectError
        an effect or a size cannot be used; the message lists all problems.
    """
    if not effects:
        raise InjectError(
            f"no effect is named; name one with --effect; there are: "
            f"{', '.join(injectable(rig.plant))}"
        )
    problems = []
    for effect, sizes in effects.items():
        if effect not in injectable(rig.plant):
            problems.append(_cannot(effect, rig.plant))
        elif effect in rig.effects():
            problems.append(
                f"{rig.name} has '{effect}' already: a diagnosis would change its size and not "
                f"name it; take it out of the rig, or put in another effect"
            )
        else:
            problems += _check_sizes(effect, sizes, injectable(rig.plant)[effect])
    if problems:
        raise InjectError("; ".join(problems))


def _cannot(effect: str, plant: str) -> str:
    there = injectable(plant)
    listed = f"into a log of plant '{plant}' can be put: {', '.join(there)}"
    if effect in (*COMMAND, *POSITION, *PRESSURES):
        return f"'{effect}' does not act on plant '{plant}'; {listed}"
    if effect in catalogue():
        return f"'{effect}' changes what the machine does, so that no log can be given it; {listed}"
    nearest = nearest_name(effect, there)
    hint = f", did you mean '{nearest}'?" if nearest else ""
    return f"'{effect}' is not known{hint}; {listed}"


def _check_sizes(effect: str, sizes: Sizes, ranges: Mapping[str, Range]) -> list[str]:
    expected = ", ".join(f"{name} ({low:g} to {high:g})" for name, (low, high) in ranges.items())
    problems = [
        f"'{effect}' has no parameter '{name}'; expected: {expected}"
        for name in sizes
        if name not in ranges
    ]
    for name, (low, high) in ranges.items():
        if name not in sizes:
            problems.append(f"'{effect}': {name} is missing: expected {low:g} to {high:g}")
        elif not low <= sizes[name] <= high:
            problems.append(f"'{effect}.{name}' = {sizes[name]:g}: expected {low:g} to {high:g}")
        elif not any(sizes.values()):
            problems.append(f"'{effect}.{name}' = 0: that is no effect")
    return problems


def before_dead_band(command: FloatArray, extending: float, retracting: float) -> Step:
    """Returns the pre-image of a dead band: u' = u + extending or u - retracting, by the sign of u.

    The dead band passes u' - extending above that overlap, u' + retracting below the negative of
    the other, else 0. At u = 0 every u' within the band is a pre-image. The function takes the
    middle of the band: it needs no memory, and it stays inside the band even if a diagnosis
    estimates the band a little too small.
    """
    signs = np.sign(command)
    jumps = int(np.count_nonzero(np.diff(signs[signs != 0.0])))
    middle, half_width = 0.5 * (extending - retracting), 0.5 * (extending + retracting)
    return Step(
        command + (middle + half_width * signs),
        [
            Note(
                f"the command changes its sign {jumps} times and then jumps by "
                f"{2.0 * half_width:g} of rated"
            )
        ],
    )


def before_bias(command: FloatArray, offset: float) -> Step:
    """Returns the pre-image of a bias u' + offset: u' = u - offset."""
    return Step(command - offset, [])


def before_gain(command: FloatArray, factor: float) -> Step:
    """Returns the pre-image of a gain, factor u': u' = u / factor."""
    return Step(command / factor, [])


def before_play(command: FloatArray, half_width: float) -> Step:
    """Returns the pre-image of play with half width h: u' for which w = u.

    The play is w_k = min(max(w_{k-1}, u'_k - h), u'_k + h), w_{-1} = 0. Where u rises,
    u' = u + h, because the play pushes w from below. Where u falls, u' = u - h. Where u rests,
    every u' within h of u is a pre-image, and u' rests, too. Before the first move u' = u = 0.
    """
    move = np.sign(np.diff(command, prepend=0.0))
    last = np.maximum.accumulate(np.where(move != 0.0, np.arange(move.size), 0))
    side = move[last]
    turns = int(np.count_nonzero(np.diff(move[move != 0.0])))
    return Step(
        command + half_width * side,
        [
            Note(
                f"the command turns {turns} times, however little, and then jumps by "
                f"{2.0 * half_width:g} of rated"
            )
        ],
    )


def behind_bias(position: FloatArray, offset_m: float) -> Step:
    """Adds the offset to the position."""
    return Step(position + offset_m, [])


def behind_sensor(
    position: FloatArray, effect: str, sizes: Mapping[str, float], dt_s: float
) -> Step:
    """Applies an effect of the catalogue on the sensor, which rested before the first sample.

    Parameters
    ----------
    position
        logged position, m, shape (N,); it is taken to be linear between the samples.
    effect, sizes
        id of the effect, and its parameters by their own names.
    dt_s
        sampling time, s.
    """
    terms = _terms(effect, sizes)
    lag_s, _ = terms.sensor_error
    notes = [Note("noise that was in the position has gone through the lag, too")] if lag_s else []
    return Step(terms.sensor(position, dt_s), notes)


def behind_pressure_sensors(
    pressures: tuple[FloatArray, FloatArray], effect: str, sizes: Sizes, dt_s: float
) -> tuple[Step, Step]:
    """Applies an effect of the catalogue on the sensors of the chamber pressures, as above.

    pressures: at the cap and at the rod side, Pa, shape (N,) each.
    """
    readings = _terms(effect, sizes).pressure_sensors(*pressures, dt_s)
    notes = []
    if "time_constant_s" in sizes:
        notes.append(Note("noise that was in the pressures has gone through the lag, too"))
    return Step(readings[0], notes), Step(readings[1], [])


def _terms(effect: str, sizes: Sizes) -> EffectTerms:
    values = effect_values(effect, sizes)
    return EffectTerms(np.array([values.get(name, 0.0) for name in plant_parameters()]))
