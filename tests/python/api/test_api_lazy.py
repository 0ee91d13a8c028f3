# SPDX-License-Identifier: MIT
"""`import ehsid` imports nothing that is not used, and shows all names all the same."""

import ast
import importlib
import subprocess
import sys
import types
from pathlib import Path

import pytest
from sources import ROOT

import ehsid

NAMES = {
    *("Diagnosis", "Estimation", "Identification", "Record", "Rig", "Simulation"),
    *("Hunt", "Watch", "diagnose", "estimate", "hunt", "identify", "read", "simulate", "watch"),
}
# Rooms whose names are imported from the room itself, and not from its modules.
ROOMS = (
    *("diagnosis", "fitness", "models/estimation", "models/identification", "records", "rigs"),
    *("signals/excitation", "signals/simulation"),
)
HEAVY = ("control", "matplotlib", "pandas", "pint", "polars", "rich", "scipy")


def modules_after(code: str) -> set[str]:
    script = f"import sys\n{code}\nprint('\\n'.join(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    return set(done.stdout.split())


def test_import_alone_loads_no_library_and_no_room() -> None:
    loaded = modules_after("import ehsid")
    assert "ehsid._core" in loaded
    assert not loaded & {*HEAVY, "numpy", "ehsid.harness"}


def test_a_rig_needs_no_library_of_plots_and_frames() -> None:
    path = ROOT / "examples" / "rigs" / "bench.toml"
    loaded = modules_after(f"import ehsid; repr(ehsid.Rig.read({str(path)!r}))")
    assert "ehsid.harness.rigs" in loaded
    assert not loaded & {"control", "matplotlib", "pandas", "polars", "scipy"}


def test_all_names_are_listed_and_stay_the_same_object() -> None:
    assert set(dir(ehsid)) >= NAMES | {"ArxEstimator", "Exponential"}
    for name in NAMES:
        value = getattr(ehsid, name)
        assert getattr(ehsid, name) is value
        assert value.__name__ == name


def test_only_what_is_for_people_is_listed() -> None:
    names = set(dir(ehsid)) - {"__doc__", "__version__"}
    assert names == set(ehsid.__all__)
    compiled = {name for name in vars(ehsid._core) if not name.startswith("_")}
    assert names == NAMES | compiled
    for name in names:
        assert not isinstance(getattr(ehsid, name), types.ModuleType), name


@pytest.mark.thorough
def test_a_star_imports_the_names_for_people() -> None:
    script = "from ehsid import *; read, ArxEstimator; print('TYPE_CHECKING' in globals())"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("False\n", "")


@pytest.mark.parametrize("room", ROOMS)
def test_what_a_room_shows_is_what_it_exports(room: str) -> None:
    module = importlib.import_module(f"ehsid.harness.{room.replace('/', '.')}")
    shown = {
        name
        for name, value in vars(module).items()
        if not name.startswith("_") and not isinstance(value, types.ModuleType)
    }
    assert shown - {"annotations"} == set(getattr(module, "__all__", ()))


def test_no_name_hides_one_of_the_compiled_module() -> None:
    assert not NAMES & set(vars(ehsid._core))


def test_editors_see_the_names_that_python_has() -> None:
    tree = ast.parse(Path(ehsid.__file__).read_text(encoding="utf-8"))
    # A type checker believes that a module with __getattr__ has every name, misspelt ones too.
    functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert functions == {"__dir__"}
    block, *_ = (node for node in tree.body if isinstance(node, ast.If))
    seen = {
        alias.asname: node.module
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert seen == {name: f"ehsid.harness.api.{module}" for name, module in ehsid._LAZY.items()}
    assert set(seen) == NAMES


def test_another_name_is_none_of_the_package() -> None:
    with pytest.raises(AttributeError, match="has no attribute 'raed'"):
        ehsid.raed  # noqa: B018
