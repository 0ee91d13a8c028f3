# SPDX-License-Identifier: MIT
"""What the sources of the four houses import, read off their text; files of no package."""

import ast
import runpy
from pathlib import Path
from types import SimpleNamespace

ROOT = Path(__file__).resolve().parents[2]
PYTHON = ROOT / "python"
HARNESS = PYTHON / "harness"


def loaded(path: Path) -> SimpleNamespace:
    """Return what a file defines that is in no package."""
    return SimpleNamespace(**runpy.run_path(str(path)))


def imported(path: Path) -> set[str]:
    """Return the full names of all modules that a file below `python` imports, anywhere in it."""
    package = ("ehsid", *path.relative_to(PYTHON).parts[:-1])
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else ()
            module = ".".join((*above, *(node.module or "").split("."))).rstrip(".")
            # `from . import a` is about a, and not about the package that both are in.
            names |= {f"{module}.{alias.name}" for alias in node.names}
            names |= {module} if node.module else set()
    return names


def imported_below(room: Path) -> set[str]:
    """Return what a folder or a module imports."""
    files = [module] if (module := room.with_suffix(".py")).is_file() else room.rglob("*.py")
    return set().union(*(imported(path) for path in files))
