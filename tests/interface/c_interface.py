# SPDX-License-Identifier: MIT
"""The interface in C: prototypes and numbers of c_api.h, and sizes as a compiler has them.

Sizes and offsets are those of a machine with pointers of 64 bits and the usual alignment.
"""

import re
import subprocess
import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import doxygen

HEADER = "c_api.h"
PARAMETERS = range(2, 14)
# Macros that give a number for a number of parameters.
SIZES = ("EHSID_STORAGE_WORDS", "EHSID_STORAGE_BYTES", "EHSID_SNAPSHOT_BYTES")


def c_table(headers: Path, compiler: str = "cc") -> dict[str, str]:
    """Names of c_api.h in the folder `ehsid`: what they are, and the numbers behind them."""
    table: dict[str, str] = {}
    asked: list[tuple[str, str]] = []
    for compound in doxygen.compounds(headers):
        name = doxygen.text_of(compound, "compoundname")
        if doxygen.file_of(compound).endswith(HEADER) and compound.get("kind") == "struct":
            asked += _questions_of_struct(name, compound, table)
        elif compound.get("kind") == "file" and name == HEADER:
            for member in doxygen.members(compound):
                asked += _questions_of_member(member, table)
    asked += [(f"{name}({n})", f"(long long){name}({n})") for name in SIZES for n in PARAMETERS]
    return table | _answers(headers, asked, compiler)


def _questions_of_struct(
    name: str, struct: ElementTree.Element, table: dict[str, str]
) -> list[tuple[str, str]]:
    table[f"struct {name}"] = "struct"
    asked = [
        (f"sizeof({name})", f"(long long)sizeof({name})"),
        (f"alignment of {name}", f"(long long)offsetof(struct {{ char c; {name} s; }}, s)"),
    ]
    for member in doxygen.members(struct):
        field = doxygen.text_of(member, "name")
        array = doxygen.text_of(member, "argsstring")
        table[f"{name}.{field}"] = f"{doxygen.text_of(member, 'type')}{array}"
        asked.append((f"offset of {name}.{field}", f"(long long)offsetof({name}, {field})"))
    return asked


def _questions_of_member(
    member: ElementTree.Element, table: dict[str, str]
) -> list[tuple[str, str]]:
    name, kind = doxygen.text_of(member, "name"), member.get("kind")
    if kind == "function":
        types = (doxygen.text_of(part, "type") for part in member.findall("param"))
        table[f"{name}()"] = f"{doxygen.text_of(member, 'type')} ({', '.join(types)})"
    elif kind == "enum":
        values = [doxygen.text_of(value, "name") for value in member.findall("enumvalue")]
        return [(value, f"(long long){value}") for value in values]
    elif kind == "define" and member.find("param") is not None:
        table[f"{name}()"] = "macro"
    elif kind == "define" and re.fullmatch(r"\d+", doxygen.text_of(member, "initializer")):
        return [(name, f"(long long){name}")]
    return []


def _answers(headers: Path, asked: list[tuple[str, str]], compiler: str) -> dict[str, str]:
    """Compiles a program that prints the numbers, and the list of the forgetting policies."""
    lines = [f'  printf("%s\\t%lld\\n", "{symbol}", {value});' for symbol, value in asked]
    source = "\n".join(
        [
            "#include <ehsid/c_api.h>",
            "#include <stdio.h>",
            '#define SHOW(policy) printf("policy %s\\tof EHSID_EACH_POLICY\\n", #policy);',
            "int main(void) {",
            *lines,
            "  EHSID_EACH_POLICY(SHOW)",
            "  return 0;",
            "}",
        ]
    )
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "sizes"
        command = [compiler, "-x", "c", "-std=c99", f"-I{headers.parent}", "-", "-o", str(program)]
        built = subprocess.run(command, input=source, text=True, capture_output=True, check=False)
        if built.returncode != 0:
            raise RuntimeError(f"c_api.h does not compile:\n{built.stderr}")
        printed = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    return dict(line.split("\t") for line in printed.splitlines())
