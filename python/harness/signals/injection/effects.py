# SPDX-License-Identifier: MIT
"""Effects that can be injected into a log, with their ranges and plants."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from ...catalogue.parameters import acts_on
from ...catalogue.parameters import effects as catalogue
from ...records.errors import nearest_name
from ...rigs import Rig

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

# Effects that are not in the catalogue. `GAIN_OF` and the answer say what they correspond to.
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
    for effect in (*COMMAND, *POSITION):
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
    if effect in COMMAND or effect in POSITION:
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
