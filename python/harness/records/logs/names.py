# SPDX-License-Identifier: MIT
"""Names of series, compared without regard to case, accents, separators and order of words."""

from __future__ import annotations

import re
import unicodedata
from functools import cache

from ehsid.harness.catalogue.channels import CHANNELS
from ehsid.harness.catalogue.spellings import COUNTERS, FILLERS
from ehsid.harness.records.logs.units import (
    is_unit_of_another,
    pint_unit,
    split_ending,
    split_unit,
)

# Longer names are not names that anyone gives to a signal.
MAX_NAME = 200


def words(name: str) -> tuple[str, ...]:
    """Returns the words of a name in lower case: "Kolben-Weg", "kolbenWeg" -> kolben, weg."""
    plain = unicodedata.normalize("NFKD", name[:MAX_NAME].replace("ß", "ss"))
    plain = "".join(c for c in plain if not unicodedata.combining(c))
    plain = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", plain)
    plain = re.sub(r"(?<=[A-Za-z])(?=\d)", " ", plain)
    return tuple(re.findall(r"[a-z]+|\d+", plain.casefold()))


def _keys(spelling: tuple[str, ...]) -> set[tuple[str, ...]]:
    """Returns what the spellings of one name share: its words sorted, and run together."""
    found = {tuple(sorted(spelling)), ("".join(spelling),)}
    fewer = tuple(word for word in spelling if word not in FILLERS)
    if fewer and fewer != spelling:
        found |= {tuple(sorted(fewer)), ("".join(fewer),)}
    return found


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
    """Returns a name and, if it is a path such as "Rig/Cylinder.Position", its last part."""
    stripped = split_unit(name)[0]
    last = re.split(r"[/\\.:]", stripped)[-1].strip()
    return [name] if last in ("", stripped) else [name, name[name.rindex(last) :]]


def says(name: str, channel: str) -> str | bool:
    """Returns the unit in a name that means `channel`, True if it has none; False if it is other.

    The unit is in the notation of pint. True also stands for a unit that is not understood, which
    `unknown_unit` tells.
    """
    label, unit_text = split_unit(name)
    if name == channel:
        return True
    named = label == channel or bool(_keys(words(label)) & _channel_keys()[channel])
    if named and unit_text is not None:
        unit = pint_unit(unit_text, channel)
        return unit or _is_of_name(name, unit_text) or not is_unit_of_another(unit_text)
    if named or _keys(words(name)) & _channel_keys()[channel]:
        return True
    label, unit_text = split_ending(name)
    if unit_text is None or not _keys(words(label)) & _channel_keys()[channel]:
        return False
    return pint_unit(unit_text, channel) or False


def _is_of_name(name: str, bracket: str) -> bool:
    """Whether what stands in brackets is more of the name, as in "Druck (A)" or "Weg (ist)"."""
    more = words(bracket)
    whole = any(_keys(words(name)) & keys for keys in _channel_keys().values())
    return bool(more) and (whole or all(word in FILLERS or word.isdigit() for word in more))


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


def is_counter(name: str) -> bool:
    """Whether a name is that of a column that numbers the rows."""
    return " ".join(words(split_unit(name)[0])) in COUNTERS
