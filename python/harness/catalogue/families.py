# SPDX-License-Identifier: MIT
"""Which effects contain others: laws of friction, and effects that act as two others together."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from .parameters import effects as catalogue

COULOMB = "coulomb_friction"
# Effects that have a size of its own for each of the two pressure transducers.
OF_EACH_TRANSDUCER = frozenset({"pressure_sensor_gain", "pressure_sensor_offset"})
CONTACT = "contact_spring"


@cache
def friction_laws() -> frozenset[str]:
    """Returns Coulomb friction and all laws of the catalogue that contain it, directly or not."""
    return frozenset(effect for effect in catalogue() if COULOMB in _with_simpler(effect))


def spelled_out(effects: Sequence[str]) -> tuple[str, ...]:
    """Returns the effects, with two in the place of one that acts as the two together.

    Unequal overlaps are a dead band and a null bias; friction of another size in each direction is
    Coulomb friction and a constant force, except at rest. Few records tell them apart.
    """
    return tuple(each for effect in effects for each in _two_of(effect) or (effect,))


def effect_families(effects: Sequence[str]) -> frozenset[str]:
    """Returns the set of effects, spelled out and with all laws of friction counted as one."""
    return frozenset(
        "friction" if effect in friction_laws() else effect for effect in spelled_out(effects)
    )


def law_count(effects: Sequence[str]) -> int:
    """Returns the number of effects, with a law that contains another counted as two or three.

    Stribeck friction is Coulomb friction and its rise towards rest. Both have to earn their name.
    An effect that acts nearly as two others counts as one more than they do: where the records do
    not show the difference, the two have the name, because they are the more common causes. An
    error of each of two transducers is two errors. A contact is a spring, and begins somewhere: it
    counts as a spring over the whole stroke does, which contains a force.
    """
    return sum(_law_count(effect) for effect in effects)


def _law_count(effect: str) -> int:
    if _two_of(effect):
        return 3
    two = catalogue()[effect].contains is not None or effect in {*OF_EACH_TRANSDUCER, CONTACT}
    return 2 if two else 1


def repeats_a_law(effects: Sequence[str]) -> bool:
    """Whether two of the effects have a law in common, of which each could take any share."""
    laws = [law for effect in effects for law in {*_with_simpler(effect), *_two_of(effect)}]
    return len(set(laws)) < len(laws)


@cache
def _with_simpler(effect: str) -> tuple[str, ...]:
    """An effect and the laws that it contains, directly or not."""
    info = catalogue().get(effect)
    return (
        (effect,)
        if info is None or info.contains is None
        else (effect, *_with_simpler(info.contains))
    )


@cache
def _two_of(effect: str) -> tuple[str, ...]:
    """The two effects that an effect acts as; none for most."""
    info = catalogue().get(effect)
    if info is None or info.contains is None or info.together_with is None:
        return ()
    return (info.contains, info.together_with)
