# SPDX-License-Identifier: MIT
"""Which changes of the interface are allowed, and what to do about the others."""

import re
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from changes import Change

# Something deprecated works for at least this many minor versions, beginning with the one that
# deprecates it.
MINOR_VERSIONS = 2


class Version(NamedTuple):
    """A version of ehsid."""

    major: int
    minor: int
    patch: int

    @classmethod
    def of(cls, text: str) -> "Version":
        """Reads "1.2.3"."""
        major, minor, patch = (int(part) for part in text.strip().split("."))
        return cls(major, minor, patch)

    @classmethod
    def of_header(cls, header: Path) -> "Version":
        """Reads version.hpp."""
        text = header.read_text(encoding="utf-8")
        numbers = re.findall(r"#define EHSID_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", text)
        return cls.of(".".join(numbers))

    def __str__(self) -> str:
        return f"{self.major}.{self.minor}.{self.patch}"


@dataclass(frozen=True)
class Deprecated:
    """An entry of deprecated.toml."""

    interface: str
    symbol: str
    since: Version
    instead: str

    def may_go(self, now: Version) -> bool:
        """Was it deprecated long enough?"""
        if now.major != self.since.major:
            return now.major > self.since.major
        return now.minor >= self.since.minor + MINOR_VERSIONS


def read_deprecated(path: Path) -> list[Deprecated]:
    """Reads the list of what is deprecated."""
    with path.open("rb") as file:
        entries = tomllib.load(file).get("deprecated", [])
    return [
        Deprecated(
            entry["interface"], entry["symbol"], Version.of(entry["since"]), entry["instead"]
        )
        for entry in entries
    ]


def may_break(released: Version, now: Version) -> bool:
    """Semantic versioning: a major version may break; before 1.0 a minor version, too."""
    if now.major != released.major:
        return now.major > released.major
    return now.major == 0 and now.minor > released.minor


def problems(
    changes: Iterable[Change], released: Version, now: Version, deprecated: Sequence[Deprecated]
) -> list[str]:
    """Breaks that are not allowed, each with what changed and what to do."""
    if may_break(released, now):
        return []
    found = []
    for change in changes:
        entry = next((one for one in deprecated if _is_of(change, one)), None)
        if not change.breaks or (entry is not None and entry.may_go(now)):
            continue
        found.append(f"{change}\n  {_what_to_do(released, entry)}")
    return found


def _is_of(change: Change, entry: Deprecated) -> bool:
    """Is it the symbol of the entry, or a member, an argument or an overload of it?"""
    rest = change.symbol.removeprefix(entry.symbol)
    same = change.symbol.startswith(entry.symbol) and not re.match(r"\w", rest)
    return change.interface == entry.interface and same


def _what_to_do(released: Version, entry: Deprecated | None) -> str:
    # Before 1.0 a minor version may break, so that it is enough to raise that.
    raised = f"{released.major + 1}.0.0" if released.major else f"0.{released.minor + 1}.0"
    if entry is not None:
        first = Version(entry.since.major, entry.since.minor + MINOR_VERSIONS, 0)
        return (
            f"It is deprecated since {entry.since} and must work until {first}: restore it, or "
            f"raise the version to {raised}."
        )
    return (
        f"Programs for version {released} may stop working: restore it; or keep it beside the new "
        "one and deprecate it (docs/deprecation.md); or raise the version in version.hpp to "
        f"{raised}."
    )
