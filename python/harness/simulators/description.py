# SPDX-License-Identifier: MIT
"""What an FMU says of itself: the file modelDescription.xml, read without running anything.

FMI 2.0 and 3.0 for co-simulation. An FMU is a file of others: sizes are checked before anything is
unpacked, and XML that declares entities is refused, since entities can grow without end.
"""

from __future__ import annotations

import math
import re
import stat
import sys
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from platform import machine
from types import MappingProxyType
from xml.etree import ElementTree

XML = "modelDescription.xml"
# A description of a hundred thousand variables has 30 MB.
MOST_XML_BYTES = 64 * 2**20
MOST_FMU_BYTES = 2 * 2**30
# All that an FMU unpacks into: its libraries and its tables.
MOST_UNPACKED_BYTES = 4 * 2**30
MOST_MEMBERS = 100_000

REAL, WHOLE, YES_NO, OTHER = "real", "whole", "yes or no", "other"
_KINDS = {
    "Real": REAL,
    "Float64": REAL,
    "Integer": WHOLE,
    "Enumeration": WHOLE,
    "Int32": WHOLE,
    "Int64": WHOLE,
    "Boolean": YES_NO,
}


class FmuError(ValueError):
    """An FMU that cannot be used as it is; the message is one line without the path of the FMU."""


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU."""

    name: str
    kind: str
    """"real", "whole", "yes or no", or "other" for texts, arrays and other numbers."""
    causality: str
    """Such as "input", "output", "parameter" or "local"."""
    variability: str
    """Such as "continuous", "tunable", "fixed" or "constant"."""
    reference: int
    """Value reference."""
    type_name: str
    """Element of the description, such as "Real" or "Float64"."""
    start: float | None = None
    unit: str | None = None
    initial: str | None = None
    description: str = ""

    @property
    def is_settable(self) -> bool:
        """Whether a program may set it before the start."""
        if self.variability == "constant" or self.causality in (
            "independent",
            "structuralParameter",
        ):
            return False
        if self.causality in ("parameter", "input"):
            return True
        return self.initial in ("exact", "approx") and self.start is not None


@dataclass(frozen=True)
class Description:
    """What an FMU says of itself."""

    version: str
    """Of FMI, such as "2.0"."""
    name: str
    token: str
    """With which it is instantiated: the guid of FMI 2, the instantiation token of FMI 3."""
    identifier: str
    """Name of its library without the ending."""
    variables: Mapping[str, Variable]
    platforms: tuple[str, ...]
    """Platforms for which there is a library, such as "linux64" or "x86_64-linux"."""
    once_per_process: bool = False
    needs_tool: bool = False
    has_state: bool = False
    description: str = ""

    @property
    def major(self) -> int:
        """Version of FMI, 2 or 3."""
        return int(self.version[0])

    @property
    def runs_here(self) -> bool:
        """Whether there is a library for the platform of this Python."""
        return platform_names()[self.major] in self.platforms

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a user should know of the FMU, in whole sentences."""
        remarks = []
        if self.needs_tool:
            remarks.append(
                "the FMU needs the tool that it was exported from: expected that tool, with its "
                "licence, on this machine"
            )
        if self.once_per_process:
            remarks.append("a process can have one instance of the FMU only: each has its own")
        return tuple(remarks)


@cache
def platform_names() -> Mapping[int, str]:
    """Returns the platform of this Python as FMI 2 and as FMI 3 call it."""
    arm = machine().lower() in ("aarch64", "arm64")
    wide = sys.maxsize > 2**32
    systems = {"win32": ("win", "windows"), "darwin": ("darwin", "darwin")}
    short, long = systems.get(sys.platform, ("linux", "linux"))
    chip = "aarch64" if arm else "x86_64" if wide else "x86"
    return MappingProxyType({2: f"{short}{64 if wide else 32}", 3: f"{chip}-{long}"})


def read_description(path: Path) -> Description:
    """Reads the description of an FMU without running it.

    Raises
    ------
    FmuError
        the file is no FMU for co-simulation of FMI 2 or 3, or is damaged or hostile.
    """
    with open_archive(path) as archive:
        names = archive.namelist()
        if XML not in names:
            raise FmuError(f"has no {XML}: expected an FMU; export it again")
        if archive.getinfo(XML).file_size > MOST_XML_BYTES:
            raise FmuError(
                f"its {XML} has {archive.getinfo(XML).file_size} bytes: expected at most "
                f"{MOST_XML_BYTES}; export it with fewer variables"
            )
        try:
            text = archive.read(XML)
        except (zipfile.BadZipFile, zlib.error, OSError, EOFError, NotImplementedError) as error:
            raise FmuError(_damaged(error)) from None
        except RuntimeError:
            raise FmuError(
                "is encrypted: expected an FMU that can be read; export it again"
            ) from None
    return parse_description(text, _platforms(names))


def open_archive(path: Path) -> zipfile.ZipFile:
    """Opens the archive of an FMU, and checks names and sizes before anything is unpacked.

    Raises
    ------
    FmuError
        there is no such file, it is no archive, a name leaves the folder, or it is too large.
    """
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise FmuError("is a directory: expected a file, packed as FMUs are (zip)")
        if not stat.S_ISREG(status.st_mode):
            raise FmuError("is a device or a pipe: expected an FMU, a regular file")
        if status.st_size > MOST_FMU_BYTES:
            raise FmuError(f"has {status.st_size} bytes: expected at most {MOST_FMU_BYTES}")
        archive = zipfile.ZipFile(path)
    except FileNotFoundError:
        raise FmuError("there is no such file: expected an FMU; check the path") from None
    except (OSError, ValueError) as error:
        if isinstance(error, FmuError):
            raise
        reason = error.strerror if isinstance(error, OSError) else error
        raise FmuError(f"cannot be read ({reason}): check the path") from None
    except (zipfile.BadZipFile, NotImplementedError) as error:
        raise FmuError(_damaged(error)) from None
    try:
        _check_members(archive)
    except FmuError:
        archive.close()
        raise
    return archive


def _damaged(error: Exception) -> str:
    reason = " ".join(str(error).split())
    return f"is no FMU, or damaged ({reason}): expected a zip archive; export or copy it again"


def _check_members(archive: zipfile.ZipFile) -> None:
    members = archive.infolist()
    if len(members) > MOST_MEMBERS:
        raise FmuError(f"has {len(members)} files in it: expected at most {MOST_MEMBERS}")
    size = sum(member.file_size for member in members)
    if size > MOST_UNPACKED_BYTES:
        raise FmuError(f"unpacks into {size} bytes: expected at most {MOST_UNPACKED_BYTES}")
    for member in members:
        parts = re.split(r"[/\\]", member.filename)
        if ".." in parts or parts[0] == "" or ":" in parts[0]:
            raise FmuError(
                f"has a file {member.filename[:60]!r}, which leaves its folder: expected names "
                "below it; it is damaged, or made to do harm"
            )


def _platforms(names: list[str]) -> tuple[str, ...]:
    """Returns the platforms for which there is a library."""
    found = re.compile(r"binaries/([^/]+)/[^/]+\.(?:so|dll|dylib)")
    matches = (found.fullmatch(name) for name in names)
    return tuple(dict.fromkeys(match[1] for match in matches if match is not None))


def parse_description(text: bytes, platforms: tuple[str, ...] = ()) -> Description:
    """Reads the text of modelDescription.xml.

    Raises
    ------
    FmuError
        it is not XML, declares entities, or describes no FMU for co-simulation of FMI 2 or 3.
    """
    if re.search(rb"<!\s*(DOCTYPE|ENTITY)", text, re.IGNORECASE) or b"\0" in text[:64]:
        raise FmuError(
            f"its {XML} declares a document type or entities, or is not UTF-8: no FMU needs them; "
            "it is damaged, or made to do harm"
        )
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, LookupError, RecursionError) as error:
        raise FmuError(f"its {XML} is not XML ({error}): export the FMU again") from None
    version = root.get("fmiVersion", "")
    if root.tag != "fmiModelDescription" or not version:
        raise FmuError(f"its {XML} describes no FMU: expected fmiModelDescription, fmiVersion")
    if not re.fullmatch(r"[23]\.\d[\w.+-]*", version):
        raise FmuError(
            f"is of FMI {version[:20]}: expected co-simulation of FMI 2.0 or 3.0; export it as that"
        )
    part = root.find("CoSimulation")
    if part is None:
        others = [
            name for name in ("ModelExchange", "ScheduledExecution") if root.find(name) is not None
        ]
        kind = {"ModelExchange": "model exchange", "ScheduledExecution": "scheduled execution"}
        what = " and ".join(kind[name] for name in others)
        raise FmuError(
            f"is for {what or 'nothing'} only: expected an FMU for co-simulation, which has its "
            "solver in it; export it as that"
        )
    identifier = part.get("modelIdentifier", "")
    if not re.fullmatch(r"[A-Za-z_]\w*", identifier, re.ASCII):
        raise FmuError(
            f"its modelIdentifier is {identifier[:40]!r}: expected the name of a library"
        )
    modern = version.startswith("3")
    variables = _variables(root, modern)
    return Description(
        version=version,
        name=root.get("modelName", identifier),
        token=root.get("instantiationToken" if modern else "guid", ""),
        identifier=identifier,
        variables=MappingProxyType(variables),
        platforms=platforms,
        once_per_process=_is_true(part.get("canBeInstantiatedOnlyOncePerProcess")),
        needs_tool=_is_true(part.get("needsExecutionTool")),
        has_state=_is_true(part.get("canGetAndSetFMUState" if modern else "canGetAndSetFMUstate")),
        description=" ".join(root.get("description", "").split()),
    )


def _is_true(text: str | None) -> bool:
    return text in ("true", "1")


def _variables(root: ElementTree.Element, modern: bool) -> dict[str, Variable]:
    units = _declared_units(root, modern)
    found: dict[str, Variable] = {}
    for element in root.iterfind("ModelVariables/*"):
        typed = (
            element if modern else next((one for one in element if one.tag != "Annotations"), None)
        )
        name = element.get("name")
        if name is None or typed is None:
            continue
        kind = _KINDS.get(typed.tag, OTHER)
        if element.find("Dimension") is not None:
            kind = OTHER
        reference = element.get("valueReference", "")
        if not (reference.isascii() and reference.isdigit() and int(reference[:11]) < 2**32):
            raise FmuError(f"its variable {name[:60]!r} has no value reference: export it again")
        unit = typed.get("unit") or units.get(typed.get("declaredType", ""))
        causality = element.get("causality", "local")
        found[name] = Variable(
            name=name,
            kind=kind,
            causality=causality,
            variability=element.get("variability", "continuous" if kind == REAL else "discrete"),
            reference=int(reference),
            type_name=typed.tag,
            start=_start(typed.get("start"), kind),
            unit=unit,
            initial=element.get("initial", "exact" if causality == "parameter" else None),
            description=" ".join(element.get("description", "").split()),
        )
    return found


def _declared_units(root: ElementTree.Element, modern: bool) -> dict[str, str]:
    """Returns the unit of each declared type of real numbers."""
    if modern:
        types = [(one.get("name"), one.get("unit")) for one in root.iterfind("TypeDefinitions/*")]
    else:
        types = [
            (one.get("name"), real.get("unit"))
            for one in root.iterfind("TypeDefinitions/SimpleType")
            for real in one.iterfind("Real")
        ]
    return {name: unit for name, unit in types if name and unit}


def _start(text: str | None, kind: str) -> float | None:
    if text is None or kind == OTHER:
        return None
    if kind == YES_NO:
        return 1.0 if _is_true(text) else 0.0
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
