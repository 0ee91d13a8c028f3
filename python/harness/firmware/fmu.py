# SPDX-License-Identifier: MIT
"""The estimator as an FMU for co-simulation, FMI 2.0 or 3.0, with its sources.

A step of the FMU takes one sample. The archive has the C99 sources of the estimator, a wrapper with
the functions of FMI, and for Linux a library that the C compiler of this machine made of them.
"""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import zipfile
from pathlib import Path

import ehsid

from ..base.files import temporary_folder
from .configuration import EstimatorConfiguration
from .fmi_functions import FMI2, fmi3
from .source import PRECISIONS, Sources, templates

STEM = "servo_estimator"
"""Name of the sources of the estimator in the archive, without .c and .h."""

FLAGS = ["-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden"]
"""With these the results have the bits of Python."""

EARLIEST = (1980, 1, 1, 0, 0, 0)
"""Time of every file, so that the same export makes the same bytes."""

BUILD = """<?xml version="1.0" encoding="UTF-8"?>
<fmiBuildDescription fmiVersion="3.0">
  <BuildConfiguration modelIdentifier="{name}">
    <SourceFileSet language="C99" compiler="gcc" compilerOptions="-ffp-contract=off">
      <SourceFile name="fmu.c"/>
      <SourceFile name="{stem}.c"/>
    </SourceFileSet>
    <Library name="m"/>
  </BuildConfiguration>
</fmiBuildDescription>
"""


def fmu_files(
    configuration: EstimatorConfiguration,
    sources: Sources,
    *,
    name: str,
    fmi: int = 2,
    dtype: str = "float32",
    dt_s: float | None = None,
) -> dict[str, str]:
    """Returns the text files of the FMU by their place in the archive.

    Parameters
    ----------
    configuration
        settings and seed.
    sources
        what `render_sources` made of the configuration, with this name and dtype and the stem STEM.
    name
        identifier of the model.
    fmi
        version, 2 or 3.
    dtype
        precision; in FMI 3.0 the variables are Float32 or Float64, in 2.0 always double.
    dt_s
        sampling time, s; with it a step of another size is refused.
    """
    scaling = configuration.scaling
    real = {"float32": "Float32", "float64": "Float64"}[dtype]
    token = hashlib.sha256(f"{fmi}{dt_s!r}{sources.header}{sources.source}".encode()).hexdigest()
    values = {
        "x": name,
        "X": name.upper(),
        "stem": STEM,
        "version": ehsid.__version__,
        "fmi": fmi,
        "token": token[:32],
        "dtype": dtype,
        "dt_s": dt_s,
        "scaling": scaling,
        "start_command": float(scaling.command_offset),
        "start_position": float(scaling.position_offset),
        "orders": configuration.orders,
        "n": configuration.orders.n_parameters,
        "functions": FMI2 if fmi == 2 else fmi3(real),
        "description": f"Online estimator: {configuration.orders}, {configuration.forgetting!r}",
        **PRECISIONS[dtype],
    }
    made = {
        "modelDescription.xml": templates().get_template("fmu_description.xml.j2").render(values),
        "sources/fmu.c": templates().get_template("fmu.c.j2").render(values),
        f"sources/{STEM}.c": sources.source,
        f"sources/{STEM}.h": sources.header,
    }
    if fmi == 3:
        made["sources/buildDescription.xml"] = BUILD.format(name=name, stem=STEM)
    return made


def library_place(name: str, fmi: int) -> str | None:
    """Returns the place of the library of this machine in the archive; None if it is no Linux."""
    machine = {"x86_64": "x86_64", "aarch64": "aarch64"}.get(platform.machine())
    if platform.system() != "Linux" or machine is None or (fmi == 2 and machine != "x86_64"):
        return None
    return f"binaries/{'linux64' if fmi == 2 else f'{machine}-linux'}/{name}.so"


def write_fmu(path: Path, files: dict[str, str], *, name: str, fmi: int = 2) -> bool:
    """Writes the archive, and returns whether it has a library for this machine.

    Without a C compiler `cc`, or on another system than Linux, it has the sources only.

    Parameters
    ----------
    path
        the archive.
    files
        what `fmu_files` made.
    name, fmi
        as in `fmu_files`.

    Raises
    ------
    ValueError
        the compiler refuses the sources.
    """
    place, compiler = library_place(name, fmi), shutil.which("cc")
    content = {file: text.encode() for file, text in files.items()}
    if place is not None and compiler is not None:
        content[place] = _compiled(compiler, files)
    with zipfile.ZipFile(path, "w") as archive:
        for file, data in content.items():
            entry = zipfile.ZipInfo(file, EARLIEST)
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, data, zipfile.ZIP_DEFLATED)
    return place in content


def _compiled(compiler: str, files: dict[str, str]) -> bytes:
    """Returns the bytes of the shared library of the sources."""
    with temporary_folder() as folder:
        for file, text in files.items():
            if file.endswith((".c", ".h")):
                (folder / Path(file).name).write_text(text, encoding="utf-8")
        command = [compiler, *FLAGS, "fmu.c", f"{STEM}.c", "-o", "made.so", "-lm"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise ValueError(
                f"{compiler} does not compile the sources of the FMU: {done.stderr.strip()[:500]}"
            )
        return (folder / "made.so").read_bytes()
