# SPDX-License-Identifier: MIT
"""An FMU for co-simulation, FMI 2.0 or 3.0: description, sources, and the archive of both.

The archive has the sources of a model, a wrapper with the functions of FMI, and for Linux a library
that the compiler of this machine made of them.
"""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import ehsid

from ..base.files import temporary_folder
from .source import templates

COMPILERS = MappingProxyType({"C99": ("cc", "-std=c99"), "C++17": ("c++", "-std=c++17")})
FLAGS = ["-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden"]
"""With these the results have the bits of Python."""

EARLIEST = (1980, 1, 1, 0, 0, 0)
"""Time of every file, so that the same export makes the same bytes."""

BUILD = """<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0">
  <BuildConfiguration modelIdentifier="{name}">
    <SourceFileSet language="{language}" compiler="gcc" compilerOptions="-ffp-contract=off">
{files}    </SourceFileSet>
    <Library name="m"/>
  </BuildConfiguration>
</fmiBuildDescription>
"""


@dataclass(frozen=True)
class Variable:
    """A variable of an FMU; its place in the list, from 1 on, is its value reference."""

    name: str
    causality: str
    """"input", "output" or "parameter"."""
    description: str
    kind: str = "Real"
    """As FMI 2.0 calls it."""
    start: float | bool | None = None
    """Of inputs and parameters."""
    variability: str = "discrete"
    unit: str = ""
    least: float | None = None
    most: float | None = None


@dataclass(frozen=True)
class Model:
    """What an FMU is and does, apart from the version of FMI."""

    name: str
    """Identifier of the model."""
    title: str
    description: str
    variables: Sequence[Variable]
    language: str
    """Of the sources, as FMI 3.0 calls it."""
    sources: Mapping[str, str]
    """Text of each file but that with the functions of FMI."""
    dt_s: float | None
    """Sampling time, s."""
    serialised: bool
    """Whether a state can be written as bytes."""
    units: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    """Exponents of the base units of each unit."""

    def files(
        self, fmi: int, wrapper: str, functions: Sequence[Any], values: Mapping[str, Any]
    ) -> dict[str, str]:
        """Returns the text files of the FMU by their place in the archive.

        Parameters
        ----------
        fmi
            version, 2 or 3.
        wrapper
            name of the file with the functions of FMI, and of its template without .j2.
        functions
            those functions, as in `fmi_functions`.
        values
            what else the templates take.
        """
        endings = (".c", ".cpp")
        compiled = [file for file in (wrapper, *self.sources) if file.endswith(endings)]
        all_values = {
            "x": self.name,
            "model": self.title,
            "version": ehsid.__version__,
            "fmi": fmi,
            "dt_s": self.dt_s,
            "description": self.description,
            "variables": self.variables,
            "outputs": [i for i, one in enumerate(self.variables, 1) if one.causality == "output"],
            "units": self.units,
            "compiled": compiled,
            "serialised": str(self.serialised).lower(),
            "functions": functions,
            **values,
        }
        sources = {f"sources/{file}": text for file, text in self.sources.items()}

        def rendered(token: str) -> dict[str, str]:
            places = {"modelDescription.xml": "fmu_description.xml", f"sources/{wrapper}": wrapper}
            of = templates().get_template
            made = {
                place: of(f"{file}.j2").render(all_values, token=token)
                for place, file in places.items()
            }
            return made | sources

        whole = "".join(rendered("").values())
        made = rendered(hashlib.sha256(whole.encode()).hexdigest()[:32])
        if fmi == 3:
            lines = "".join(f'      <SourceFile name="{file}"/>\n' for file in compiled)
            made["sources/buildDescription.xml"] = BUILD.format(
                name=self.name, language=self.language, files=lines
            )
        return made


def library_place(name: str, fmi: int) -> str | None:
    """Returns the place of the library of this machine in the archive; None if it is no Linux."""
    machine = {"x86_64": "x86_64", "aarch64": "aarch64"}.get(platform.machine())
    if platform.system() != "Linux" or machine is None or (fmi == 2 and machine != "x86_64"):
        return None
    return f"binaries/{'linux64' if fmi == 2 else f'{machine}-linux'}/{name}.so"


def write_fmu(path: Path, files: dict[str, str], *, name: str, fmi: int = 2) -> bool:
    """Writes the archive, and returns whether it has a library for this machine.

    Without a compiler, `cc` or `c++`, or on another system than Linux, it has the sources only.

    Parameters
    ----------
    path
        the archive.
    files
        what `Model.files` made.
    name, fmi
        identifier of the model, and version of FMI.

    Raises
    ------
    ValueError
        the compiler refuses the sources.
    """
    place = library_place(name, fmi)
    language = "C++17" if any(file.endswith(".cpp") for file in files) else "C99"
    compiler = shutil.which(COMPILERS[language][0])
    content = {file: text.encode() for file, text in files.items()}
    if place is not None and compiler is not None:
        content[place] = _compiled([compiler, COMPILERS[language][1]], files)
    with zipfile.ZipFile(path, "w") as archive:
        for file, data in content.items():
            entry = zipfile.ZipInfo(file, EARLIEST)
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, data, zipfile.ZIP_DEFLATED)
    return place in content


def _compiled(compiler: list[str], files: dict[str, str]) -> bytes:
    """Returns the bytes of the shared library of the sources."""
    with temporary_folder() as folder:
        sources = [Path(file).name for file in files if file.endswith((".c", ".cpp"))]
        for file, text in files.items():
            if file.startswith("sources/"):
                (folder / Path(file).name).write_text(text, encoding="utf-8")
        command = [*compiler, *FLAGS, *sources, "-o", "made.so", "-lm"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise ValueError(
                f"{compiler[0]} does not compile the sources of the FMU: "
                f"{done.stderr.strip()[:500]}"
            )
        return (folder / "made.so").read_bytes()


def held_in_words(compiled: bool, fmi: int) -> str:
    """Returns what an archive holds, in words; `compiled` is what `write_fmu` returned."""
    only = "sources only: no compiler for Linux is here"
    return f"FMI {fmi}.0, {'sources and a library for Linux' if compiled else only}"
