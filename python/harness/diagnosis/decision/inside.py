# SPDX-License-Identifier: MIT
"""Causes inside a user's simulator: what they look like from outside, and what may then be said.

An effect that needs a port which the simulator lacks cannot be tried. If it is the cause, a value
of the simulator or another effect takes its place: friction becomes viscous friction, a leak a null
bias beside a mass that is wrong. A name and "only values are wrong" therefore need more here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ...catalogue.parameters import effects, plain_name
from ...rigs import Rig
from ...rigs.carried import carried
from ...rigs.simulator_section import own_name
from ..deciding import MOVED_FREELY, MOVED_TOO_FAR, UNCARRIED
from ..schema import Estimate

# Words in the name of a value, and the subsystem whose missing effects it stands in for.
STANDS_FOR: tuple[tuple[str, tuple[str, ...]], ...] = (
    (
        "mechanics",
        ("viscous", "friction", "mass", "inertia", "load", "force", "spring", "stiction"),
    ),
    (
        "hydraulics",
        *(("bulk", "modulus", "oil", "volume", "supply", "pressure", "flow", "leak", "fluid"),),
    ),
)


@dataclass(frozen=True)
class Inside:
    """What speaks for a cause inside of the simulator."""

    subsystem: str
    """Where it then lies."""
    value: str
    """Name of the value that moved too far, as the simulator has it."""
    sigmas: float
    """By how many standard deviations of the rig file."""


def uncarried(rig: Rig) -> dict[str, list[str]]:
    """Effects that need a port which the simulator lacks, by subsystem."""
    missing: dict[str, list[str]] = {}
    if rig.simulator is not None:
        for effect, reason in carried(rig).items():
            part = effects()[effect].subsystem
            # A sensor of what the simulator does not give is not compared either.
            if reason is not None and part != "sensor":
                missing.setdefault(part, []).append(effect)
    return missing


def uncarried_odds(rig: Rig) -> float:
    """Increase of the odds of a cause outside by the effects that cannot be tried, nats, >= 0."""
    count = sum(len(each) for each in uncarried(rig).values())
    return UNCARRIED * count / len(effects())


def stands_for(name: str) -> str | None:
    """Subsystem whose missing effects a value of this name stands in for; None where none is."""
    own = own_name(name)
    if own is None or "valve" in own.lower():
        return None
    return next(
        (part for part, words in STANDS_FOR if any(word in own.lower() for word in words)), None
    )


def moved_furthest(rig: Rig, in_sigmas: Mapping[str, Estimate | None]) -> list[Inside]:
    """Of each subsystem with effects that cannot be tried, the value that moved furthest.

    The furthest of all comes first. in_sigmas: how far each fitted value is from that of the rig
    file, by full name; None where no deviation is known.
    """
    missing = uncarried(rig)
    furthest: dict[str, Inside] = {}
    for name, moved in in_sigmas.items():
        part = stands_for(name)
        if moved is None or part is None or not has_missing_family(missing, part):
            continue
        found = Inside(part, own_name(name) or name, abs(moved.value))
        if part not in furthest or found.sigmas > furthest[part].sigmas:
            furthest[part] = found
    return sorted(furthest.values(), key=lambda each: -each.sigmas)


def evidence_of(moved: Sequence[Inside]) -> float:
    """Evidence for a cause inside of the simulator from values that moved far, nats, >= 0.

    What a set of effects leaves does not count what its values cost: k^2 / 2 at k deviations.
    """
    furthest = moved[0].sigmas if moved else 0.0
    return max(0.0, 0.5 * furthest**2 - 0.5 * MOVED_FREELY**2)


def has_missing_family(missing: Mapping[str, list[str]], part: str) -> bool:
    """Whether more of a subsystem cannot be tried than what no simulator can be given."""
    return any(effect not in NEVER_CARRIED for effect in missing.get(part, []))


# They act inside of any simulator: few machines have them, and other effects do not stand for them.
NEVER_CARRIED = frozenset(
    {"entrained_air", "flexible_load", "line_resonance", "counterbalance_valve"}
)


def inside_sentences(rig: Rig, moved: Sequence[Inside]) -> list[str]:
    """What would look the same as what was found, and which port would tell."""
    missing = {
        part: [each for each in names if each not in NEVER_CARRIED]
        for part, names in uncarried(rig).items()
    }
    sentences = []
    if moved and moved[0].sigmas > MOVED_TOO_FAR:
        inside = moved[0]
        names = ", ".join(plain_name(each) for each in missing[inside.subsystem])
        sentences.append(
            f"The fit moves the value '{inside.value}' of the simulator by {inside.sigmas:.1f} "
            "standard deviations. So much is seldom an error of the rig file: the value rather "
            f"stands in for something that the simulator lacks, such as {names}."
        )
    ports = {
        "mechanics": "an input for a force on the rod",
        "hydraulics": "inputs for flows into "
        "the chambers, outputs of their pressures, and measured pressures",
    }
    for part, port in ports.items():
        if missing.get(part):
            names = ", ".join(plain_name(each) for each in missing[part])
            sentences.append(
                f"Effects of the {part} ({names}) cannot be put into this simulator. They would "
                f"look much like what was fitted; {port} would tell them apart."
            )
    return sentences


# What a carried effect looks like that cannot be the whole cause: friction makes a play about each
# reversal; leaks and loads make a bias, and flow that is lost.
LOOKS_LIKE: Mapping[str, str] = {
    "sensor_backlash": "mechanics",
    "sensor_nonlinearity": "mechanics",
    "valve_hysteresis": "mechanics",
    "spool_stiction": "mechanics",
    "valve_dead_band": "mechanics",
    "valve_dead_band_sides": "hydraulics",
    "valve_null_bias": "hydraulics",
    "valve_flow_saturation": "hydraulics",
    "flow_gain_drift": "hydraulics",
}
# Share of what an effect explains that stays with its own subsystem where it only looks like one
# that cannot be tried.
OWN_SHARE = 0.2
# What a value explains by standing in, over the square of its deviations, as a decrease of `left`.
STANDING_IN = 0.05


def outside_shares(
    rig: Rig, moved: Sequence[Inside], explained: Mapping[str, float]
) -> dict[str, float]:
    """Shares of the subsystems in which a cause lies that nothing of the catalogue explains.

    moved: as `moved_furthest` gives them. explained: what each effect explains alone, as a decrease
    of `left`; of each subsystem the best one counts.
    """
    missing = uncarried(rig)
    weights: dict[str, float] = {}
    for effect, gain in explained.items():
        own, like = effects()[effect].subsystem, LOOKS_LIKE.get(effect)
        stands_in = like is not None and has_missing_family(missing, like)
        shares = {own: OWN_SHARE, like: 1.0 - OWN_SHARE} if like and stands_in else {own: 1.0}
        for part, share in shares.items():
            weights[part] = max(weights.get(part, 0.0), share * gain)
    for each in moved:
        weights[each.subsystem] = weights.get(each.subsystem, 0.0) + STANDING_IN * each.sigmas**2
    total = sum(weights.values())
    return {part: weight / total for part, weight in weights.items()} if total > 0.0 else {}
