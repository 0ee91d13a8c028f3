# SPDX-License-Identifier: MIT
"""The interface of the sources, and that of the last release, which is kept beside this file."""

import json
import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

from c_interface import c_table
from changes import Change, table_changes
from cli_interface import cli_changes, cli_table
from cpp_interface import cpp_changes, cpp_table
from file_interface import file_changes, file_table
from python_interface import python_changes, write_skeletons
from rules import Deprecated, Version, read_deprecated

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
RELEASED = HERE / "released"
HEADERS = ROOT / "cpp" / "include" / "ehsid"

Table = dict[str, str]
# Interface: how its table is made, and how two tables are compared.
TABLES: dict[str, tuple[Callable[[], Table], Callable[[Table, Table], list[Change]]]] = {
    "C++": (lambda: cpp_table(HEADERS), cpp_changes),
    "C": (lambda: c_table(HEADERS), lambda before, now: table_changes("C", before, now)),
    "command line": (cli_table, cli_changes),
    "files": (lambda: file_table(ROOT / "docs" / "schemas"), file_changes),
}
INTERFACES = (*TABLES, "Python")
EXAMPLES = ("cpp", "c")  # programs that must still compile: tests/install


def released_version() -> Version:
    """The version of which the interface is kept."""
    return Version.of((RELEASED / "version.txt").read_text(encoding="utf-8"))


def version() -> Version:
    """The version of the sources."""
    return Version.of_header(HEADERS / "version.hpp")


def deprecated() -> list[Deprecated]:
    """What is deprecated."""
    return read_deprecated(HERE / "deprecated.toml")


def released_table(interface: str) -> Table:
    """The table of the last release."""
    table: Table = json.loads(_file_of(interface).read_text(encoding="utf-8"))
    return table


def changes(interface: str) -> list[Change]:
    """What differs from the last release in one interface."""
    if interface in TABLES:
        make, compare = TABLES[interface]
        return compare(released_table(interface), make())
    with tempfile.TemporaryDirectory() as folder:
        write_skeletons(ROOT / "python", Path(folder))
        return python_changes(RELEASED / "python", Path(folder))


def take() -> None:
    """Keeps the interface of the sources as that of the last release."""
    tables = {interface: make() for interface, (make, _) in TABLES.items()}
    shutil.rmtree(RELEASED, ignore_errors=True)
    write_skeletons(ROOT / "python", RELEASED / "python")
    for language in EXAMPLES:
        no_page = shutil.ignore_patterns("*.md")
        shutil.copytree(
            ROOT / "examples" / language, RELEASED / "examples" / language, ignore=no_page
        )
    for interface, table in tables.items():
        text = json.dumps(table, indent=1, sort_keys=True)
        _file_of(interface).write_text(f"{text}\n", encoding="utf-8")
    (RELEASED / "version.txt").write_text(f"{version()}\n", encoding="utf-8")


def _file_of(interface: str) -> Path:
    name = interface.replace(" ", "_").replace("+", "p").lower()
    return RELEASED / f"{name}.json"
