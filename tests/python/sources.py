# SPDX-License-Identifier: MIT
"""What the sources of the harness import, read off their text."""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HARNESS = ROOT / "python" / "harness"


def imported(source: str) -> set[str]:
    """Return the full names of all modules that a Python text imports, anywhere in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide where a name comes from"
            names |= {node.module or ""} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def imported_below(folder: Path) -> set[str]:
    return set().union(
        *(imported(path.read_text(encoding="utf-8")) for path in folder.rglob("*.py"))
    )
