# SPDX-License-Identifier: MIT
"""Names of series: which channel they mean, and which unit they end in.

They are compared without regard to case, accents, separators and order of words.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from functools import cache

from ..catalogue.channels import CHANNELS, COMMAND, POSITION, SUPPLY_PRESSURE
from ..catalogue.spellings import (
    BARE_COMMANDS,
    COUNTERS,
    FILLERS,
    OTHER_LENGTHS,
    OTHER_SIGNALS,
    PLACES,
)
from .units import REFERENCE, is_unit_of_another, looks_like_a_unit, pint_unit

# What may end a name without brackets, as in "position_mm"; longer words are words.
_ENDING_WORDS = """
s ms us ns min h m mm cm um in inch pa kpa mpa bar mbar psi v mv n kn mn lbf kgf t kg k c degc degf
percent pct a ma mm/s m/s cm/s
"""
_ENDINGS = frozenset(_ENDING_WORDS.split())
_BRACKETS = re.compile(
    r"^(?P<name>.*?)\s*(?:\[(?P<a>[^\[\]]*)\]|\((?P<b>[^()]*(?:\([^()]*\))?)\))\s*$"
)
_SLASH = re.compile(r"^(?P<name>.+?)\s*(?:\s/\s|\sin\s|,\s)\s*(?P<unit>\S{1,8})\s*$")
# Longer names are not names that anyone gives to a signal.
MAX_NAME = 200
# Letters of the type of a variable in a controller: "fActPos" is a floating point number.
_TYPE_LETTERS = re.compile(r"(?:(?<=[^A-Za-z])|^)(?:lr|fb|st|f|r|n|i)(?=[A-Z][a-z]{2})")


def words(name: str) -> tuple[str, ...]:
    """Returns the words of a name in lower case: "Kolben-Weg", "kolbenWeg" -> kolben, weg."""
    plain = unicodedata.normalize("NFKD", name[:MAX_NAME].replace("ß", "ss"))
    plain = "".join(c for c in plain if not unicodedata.combining(c))
    plain = _TYPE_LETTERS.sub("", plain)
    plain = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z]{2})", " ", plain)
    plain = re.sub(r"(?<=[A-Za-z])(?=\d)", " ", plain)
    return tuple(re.findall(r"[a-z]+|\d+", plain.casefold()))


@cache
def _meant(name: str, *, in_volts: bool) -> frozenset[str]:
    """Returns the channels that a name without a unit means; the most words of it count.

    `in_volts` is whether its unit is one of a command: a command of an axis without a unit may as
    well be the wanted position.
    """
    found = frozenset(channel for channel in CHANNELS if channel == name)
    told = words(name)
    for i, spelling in enumerate([told, *_shorter(told)]):
        if found:
            break
        keys = {tuple(sorted(spelling)), ("".join(spelling),)}
        found = frozenset(one for one, known in _channel_keys().items() if keys & known)
        if i and not in_volts and spelling and set(spelling) <= BARE_COMMANDS:
            found -= {COMMAND}
    return found


def _shorter(told: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Yields the words of a name without fillers, numbers, and the axis, ever fewer."""
    divided = tuple(part for word in told for part in _divided(word))
    for spelling in dict.fromkeys((told, divided)):
        for kept in dict.fromkeys((spelling, _without_places(spelling))):
            for fewer in (kept, tuple(word for word in kept if word not in FILLERS)):
                yield fewer
                letters = tuple(word for word in fewer if not word.isdigit())
                if any(len(word) > 2 for word in letters):  # T1 or V1 may be anything
                    yield letters


def _without_places(told: tuple[str, ...]) -> tuple[str, ...]:
    kept: list[str] = []
    for i, word in enumerate(told):
        numbers_place = word.isdigit() and i > 0 and told[i - 1] in PLACES
        if word not in PLACES and not numbers_place:
            kept.append(word)
    return tuple(kept)


def _divided(word: str) -> tuple[str, ...]:
    """Returns the known words of which a longer word consists: "lageistwert" -> lage, istwert."""
    known = _vocabulary()
    if word in known or word.isdigit():
        return (word,)
    for at in range(len(word) - 3, 2, -1):
        if word[:at] in known:
            rest = _divided(word[at:])
            if all(part in known for part in rest):
                return (word[:at], *rest)
    return (word,)


@cache
def _vocabulary() -> frozenset[str]:
    spelled = {word for keys in _channel_keys().values() for key in keys for word in key}
    return frozenset(
        word for word in {*spelled, *FILLERS, *PLACES, *OTHER_LENGTHS} if len(word) > 2
    )


@cache
def _channel_keys() -> dict[str, frozenset[tuple[str, ...]]]:
    return {
        channel.name: frozenset(
            key
            for spelling in channel.spellings
            for key in ({tuple(sorted(spelling.split())), (spelling.replace(" ", ""),)})
        )
        for channel in CHANNELS.values()
    }


def parts_of(name: str) -> list[str]:
    """Returns a name and, if it is a path such as "Rig/Cylinder.Position", its last part.

    The last part alone would be another signal in "Target.Position", and in "Valve.Position".
    """
    stripped = split_unit(name)[0]
    last = re.split(r"[/\\.:]", stripped)[-1].strip()
    if last in ("", stripped):
        return [name]
    before = words(stripped[: stripped.rindex(last)])
    if _meant(stripped, in_volts=False) or OTHER_SIGNALS.intersection(before):
        return [name]
    return [name, name[name.rindex(last) :]]


def says(name: str, channel: str) -> str | bool:
    """Returns the unit in a name that means `channel`, True if it has none; False if it is other.

    The unit is in the notation of pint. True also stands for a unit that is not understood, which
    `unknown_unit` tells.
    """
    if name == channel:
        return True
    label, unit_text = split_unit(name)
    unit = None if unit_text is None else pint_unit(unit_text, channel)
    if channel in _meant(label, in_volts=unit not in (None, "1")):
        if unit_text is None:
            return True
        return unit or _is_of_name(name, unit_text) or not is_unit_of_another(unit_text)
    if channel in _meant(name, in_volts=False):
        return True
    label, unit_text = split_ending(name)
    unit = None if unit_text is None else pint_unit(unit_text, channel)
    return unit if unit and channel in _meant(label, in_volts=unit != "1") else False


def _is_of_name(name: str, bracket: str) -> bool:
    """Whether what stands in brackets is more of the name, as in "Druck (A)" or "Weg (ist)"."""
    more = words(bracket)
    left = [word for word in more if word not in FILLERS and not word.isdigit()]
    return bool(more) and (not left or bool(_meant(name, in_volts=False)))


def unknown_unit(name: str, channel: str) -> str | None:
    """Returns the unit in the name of a column that is not understood; None without one."""
    bracket = split_unit(name)[1]
    if bracket is None or unit_in_name(name, channel) is not None or _is_of_name(name, bracket):
        return None
    return bracket


def doubt_of_unit(name: str, unit: str | None, channel: str) -> str | None:
    """Returns what is in doubt about the unit of a column, in words; None where nothing is.

    `unit` is the one that the log states outside of the name, or None.
    """
    stated = (unit or "").strip()
    if not stated:
        unknown = unknown_unit(name, channel)
    else:
        known, said = pint_unit(stated, channel), unit_in_name(name, channel)
        unknown = stated if known is None else None
        if known and said and known != said:
            return f"the log states the unit '{stated}' for '{name}'"
    return None if unknown is None else f"the unit '{unknown}' of '{name}' is not understood"


def stated_unit(name: str, unit: str | None, channel: str) -> str | None:
    """Returns the unit of a channel that the log states, in the notation of pint; None if none."""
    stated = (unit or "").strip() or split_unit(name)[1]
    known = None if stated is None else pint_unit(stated, channel)
    return None if known == "1" else known


def unit_in_name(name: str, channel: str) -> str | None:
    """Returns the unit in the name of a column that is read as `channel`; None without one."""
    for part in parts_of(name):
        said = says(part, channel)
        if isinstance(said, str):
            return said
    bracket = split_unit(name)[1]
    return None if bracket is None else pint_unit(bracket, channel)


def means(name: str, channel: str) -> bool:
    """Whether a name, or its last part, means a channel."""
    return any(says(part, channel) is not False for part in parts_of(name))


def words_of(channel: str) -> frozenset[str]:
    """Returns the words of two or more letters in the names of a channel."""
    spelled = (word for spelling in CHANNELS[channel].spellings for word in spelling.split())
    return frozenset(word for word in spelled if len(word) > 1 and word not in FILLERS)


def says_other(name: str) -> bool:
    """Whether the name of a length says that it is not where the rod is."""
    other = OTHER_LENGTHS.intersection(part for word in words(name) for part in _divided(word))
    return bool(other) or bool(_meant(split_unit(name)[0], in_volts=False) - {POSITION})


def is_counter(name: str) -> bool:
    """Whether a name is that of a column that numbers the rows."""
    return " ".join(words(split_unit(name)[0])) in COUNTERS


def split_unit(name: str) -> tuple[str, str | None]:
    """Returns the name without the unit in brackets or behind a slash, and the unit or None."""
    for pattern in (_BRACKETS, _SLASH):
        match = pattern.match(name)
        if match and match["name"].strip():
            groups = match.groupdict()
            unit = next((groups[key] for key in ("a", "b", "unit") if groups.get(key)), None)
            return match["name"].strip(), unit
    return name, None


def unit_shown(name: str, unit: str | None) -> str | None:
    """Returns the unit of a column that is no channel, as the log writes it; None without one."""
    stated = (unit or "").strip()
    bracket = split_unit(name)[1] or ""
    if stated or (not bracket.isdigit() and (name.endswith("]") or looks_like_a_unit(bracket))):
        return stated or bracket or None
    return None


def without_unit(name: str, channel: str) -> str:
    """Returns the name of a column without its unit; A is none in "Druck (A)"."""
    label, unit = split_unit(name)
    return name if unit is None or pint_unit(unit, channel) is None else label


def split_ending(name: str) -> tuple[str, str | None]:
    """Returns a name such as "position_mm" as ("position", "mm"); (name, None) if none ends it."""
    parts = re.split(r"[_\s]+|(?<!\d)\.", name)
    for count in (2, 1):
        ending = parts[-count:]
        if len(parts) <= count:
            continue
        for unit in (" ".join(ending), "/".join(ending)):
            reference = REFERENCE.fullmatch(unit)
            of = reference["unit"] if reference and len(reference["unit"]) > 1 else unit
            if unit.casefold() in _ENDINGS or (
                of.casefold() in _ENDINGS and pint_unit(unit, SUPPLY_PRESSURE)
            ):
                return "_".join(parts[:-count]), unit
    return name, None
