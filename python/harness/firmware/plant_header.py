# SPDX-License-Identifier: MIT
"""The headers of the compiled simulator as one text, which compiles without the rest of ehsid."""

from __future__ import annotations

import re
from pathlib import Path

import ehsid

FIRST = "ehsid/plant/servo_plant.hpp"
_INCLUDE = re.compile(r"^#include <(.+)>\n", re.MULTILINE)
_ONCE = re.compile(r"^(// SPDX-License-Identifier: .*|#pragma once)\n", re.MULTILINE)


def headers_folder() -> Path:
    """Returns the folder of the headers, which are installed beside the compiled module."""
    return Path(ehsid.__file__).parent / "include"


def plant_header(namespace: str) -> str:
    """Returns the simulator with all effects of the catalogue as one C++17 header.

    Parameters
    ----------
    namespace
        around all of it, so that simulators of several versions can stand in one program.
    """
    bodies: dict[str, str] = {}
    of_the_language: set[str] = set()

    def add(name: str) -> None:
        text = (headers_folder() / name).read_text(encoding="utf-8")
        for included in _INCLUDE.findall(text):
            if not included.startswith("ehsid/"):
                of_the_language.add(included)
            elif included not in bodies:
                add(included)
        body = _INCLUDE.sub("", _ONCE.sub("", text)).strip("\n")
        bodies[name] = re.sub(r"\n{3,}", "\n\n", body)

    add(FIRST)
    parts = [
        "// SPDX-License-Identifier: MIT",
        f"// The simulator of ehsid {ehsid.__version__}, made of its headers by `ehsid export "
        "--fmu`; do not edit, export again.",
        "/* clang-format off */",
        "#pragma once",
        "",
        "#if !defined(_MSC_VER) && __cplusplus < 201703L",
        '#error "expected a compiler for C++17, such as -std=c++17"',
        "#endif",
        "",
        *(f"#include <{name}>" for name in sorted(of_the_language)),
        "",
        f"namespace {namespace} {{",
        *(f"\n// {name}\n{body}" for name, body in bodies.items()),
        f"\n}}  // namespace {namespace}\n",
    ]
    return "\n".join(parts)
