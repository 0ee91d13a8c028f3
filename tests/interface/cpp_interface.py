# SPDX-License-Identifier: MIT
"""The interface in C++: the public names of the headers and their signatures."""

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import doxygen
from changes import Change, table_changes

# How the public headers work inside. They may change at any time, as may the simulator in plant/
# and what is in the namespaces `detail` and `bank`; docs/deprecation.md says so.
MACHINERY = (
    *("crc32.hpp", "fields.hpp", "forgetting/evidence.hpp", "forgetting/settings.hpp"),
    *("groups.hpp", "information_account.hpp", "polynomial.hpp", "servo_poles.hpp"),
    *("sliding_sum.hpp", "c_api.h"),
)
PUBLIC_OF_BANK = ("bank/estimator_bank.hpp", "bank/rls_bank.hpp")
# Members for the recursions and for snapshots, which they visit; kInfo has words for people.
INSIDE = ("Contents", "fields", "kInfo", "state", "usable")


def cpp_table(headers: Path) -> dict[str, str]:
    """Names and signatures of the headers in the folder `ehsid`."""
    table: dict[str, str] = {}
    for compound in doxygen.compounds(headers):
        kind, name = compound.get("kind"), doxygen.text_of(compound, "compoundname")
        if kind in ("class", "struct") and _is_public(compound, name):
            table[name] = f"{kind}{_template(compound)}"
        if kind in ("class", "struct", "namespace"):
            for member in doxygen.members(compound):
                if _is_public(member, f"{name}::{doxygen.text_of(member, 'name')}"):
                    table |= dict(_entries(name, member))
        if doxygen.text_of(compound, "compoundname") == "version.hpp":
            macros = [doxygen.text_of(member, "name") for member in doxygen.members(compound)]
            table |= {macro: "macro" for macro in macros if not macro.endswith("_")}
    return table


def cpp_changes(before: dict[str, str], now: dict[str, str]) -> list[Change]:
    """Compares two tables. More arguments are no break where they have defaults."""
    found = table_changes("C++", before, now)
    more = {change.symbol: change for change in found if change.what == "added"}
    return [
        change
        for change in found
        if not (
            change.what == "removed"
            and any(_still_takes(symbol, added.now, change) for symbol, added in more.items())
        )
    ]


def _still_takes(symbol: str, signature: str, removed: Change) -> bool:
    """Does the function `symbol` take the arguments of the removed one, and return the same?"""
    calls = [re.fullmatch(r"(.+?)\((.*)\)(.*)", name) for name in (removed.symbol, symbol)]
    if calls[0] is None or calls[1] is None:
        return False
    old, new = (call.groups() for call in calls if call is not None)
    arguments = len(removed.symbol.split(", ")) if old[1] else 0
    returned, needed = (part.split(", arguments needed: ") for part in (removed.was, signature))
    return (
        old[0] == new[0]
        and old[2] == new[2]
        and new[1].startswith(old[1])
        and returned[0] == needed[0]
        and int(needed[1]) <= arguments
    )


def _is_public(element: ElementTree.Element, name: str) -> bool:
    header = doxygen.file_of(element).removeprefix("ehsid/")
    inside = header.startswith("bank/") and header not in PUBLIC_OF_BANK
    parts = re.sub(r"<.*>", "", name).split("::")
    return (
        parts[0] == "ehsid"
        and header not in MACHINERY
        and not inside
        and not {"detail", "bank", *INSIDE} & set(parts)
        and not any(part.endswith("State") for part in parts)
    )


def _entries(scope: str, member: ElementTree.Element) -> Iterator[tuple[str, str]]:
    name = f"{scope}::{doxygen.text_of(member, 'name')}"
    kind = member.get("kind")
    returned = doxygen.text_of(member, "type")
    if kind == "function":
        parameters = member.findall("param")
        types = ", ".join(doxygen.text_of(parameter, "type") for parameter in parameters)
        needed = sum(parameter.find("defval") is None for parameter in parameters)
        const = " const" if member.get("const") == "yes" else ""
        static = "static " if member.get("static") == "yes" else ""
        signature = f"{static}{returned}{_template(member)}, arguments needed: {needed}"
        yield f"{name}({types}){const}", signature
    elif kind == "enum":
        yield name, "enum"
        number = -1
        for value in member.findall("enumvalue"):
            given = doxygen.text_of(value, "initializer").lstrip("= ")
            number = int(given) if given else number + 1
            yield f"{name}::{doxygen.text_of(value, 'name')}", str(number)
    elif kind == "typedef":
        yield name, f"{returned}{_template(member)}"
    elif kind == "variable":
        start = doxygen.text_of(member, "initializer").lstrip("=")
        yield name, f"{returned} {start}".strip()


def _template(element: ElementTree.Element) -> str:
    parameters = element.findall("templateparamlist/param")
    if not parameters:
        return ""
    words = []
    for parameter in parameters:
        default = doxygen.text_of(parameter, "defval")
        kind = doxygen.text_of(parameter, "type").split(" ")[0]
        words.append(f"{kind}={default}" if default else kind)
    return f" template<{', '.join(words)}>"
