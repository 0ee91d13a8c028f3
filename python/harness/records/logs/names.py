# SPDX-License-Identifier: MIT
"""Names of series, compared without regard to case, accents, separators and order of words."""

from __future__ import annotations

import re
import unicodedata
from functools import cache

from ehsid.harness.catalogue.channels import CHANNELS
from ehsid.harness.catalogue.spellings import COUNTERS, FILLERS
from ehsid.harness.records.logs.units import pint_unit, split_ending, split_unit

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

    The unit is in the notation of pint.
    """
    label, unit_text = split_unit(name)
    if name == channel:
        return True
    named = label == channel or bool(_keys(words(label)) & _channel_keys()[channel])
    if unit_text is not None:
        unit = pint_unit(unit_text, channel)
        if named and unit is not None:
            return unit
        # What stands in brackets may be more of the name, as in "Druck (A)".
        more = words(unit_text)
        whole = bool(more) and bool(_keys(words(name)) & _channel_keys()[channel])
        return whole or (named and not _is_unit_of_another(unit_text))
    if named:
        return True
    label, unit_text = split_ending(name)
    if unit_text is None or not _keys(words(label)) & _channel_keys()[channel]:
        return False
    return pint_unit(unit_text, channel) or False


def unit_in_name(name: str, channel: str) -> str | None:
    """Returns the unit in the name of a column that is read as `channel`; None without one."""
    for part in parts_of(name):
        said = says(part, channel)
        if isinstance(said, str):
            return said
    bracket = split_unit(name)[1]
    return None if bracket is None else pint_unit(bracket, channel)


def _is_unit_of_another(text: str) -> bool:
    return any(pint_unit(text, other) for other in CHANNELS)


def means(name: str, channel: str) -> bool:
    """Whether a name, or its last part, means a channel."""
    return any(says(part, channel) is not False for part in parts_of(name))


def is_counter(name: str) -> bool:
    """Whether a name is that of a column that numbers the rows."""
    return " ".join(words(split_unit(name)[0])) in COUNTERS
