# SPDX-License-Identifier: MIT
"""Scripts that no test runs import only what the package has."""

import ast
import importlib
from pathlib import Path

import pytest
from sources import ROOT

SCRIPTS = sorted(
    path
    for pattern in (
        *("benchmarks/*.py", "docs/**/*.py", "examples/*.py", "script/*.py"),
        *("tests/fuzz/*.py", "tests/soak/*.py"),
    )
    for path in ROOT.glob(pattern)
)


def has(module: str, name: str) -> bool:
    if hasattr(importlib.import_module(module), name):
        return True
    try:
        importlib.import_module(f"{module}.{name}")
    except ImportError:
        return False
    return True


def test_scripts_were_found() -> None:
    assert {"benchmarks", "docs", "examples", "script", "tests"} <= {
        path.relative_to(ROOT).parts[0] for path in SCRIPTS
    }


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_script_imports_what_there_is(script: Path) -> None:
    nodes = ast.walk(ast.parse(script.read_text(encoding="utf-8")))
    ours = [
        (node.module, alias.name)
        for node in nodes
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("ehsid")
        for alias in node.names
    ]
    assert not [(module, name) for module, name in ours if not has(module or "", name)]
