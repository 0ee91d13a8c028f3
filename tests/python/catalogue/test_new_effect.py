# SPDX-License-Identifier: MIT
"""One effect more: one file and its name in the catalogue, and every room knows it.

The project is copied, the effect is added as docs/simulator.md says, and the module is compiled:
without the banks of estimators, which know no effect, and with the simulator for one kind of
processor only. Both together would take three quarters of the time.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from sources import ROOT

HERE = Path(__file__).parent
SIZE = 4e7
COPIED = ("CMakeLists.txt", "LICENSE", "README.md", "bindings", "cmake", "cpp", "examples/rigs")
COPIED_FOR_DOCUMENTS = ("docs/effects/make.py", "tests/python/plant_*.py", "python")


def copy_of_the_project(folder: Path) -> None:
    for pattern in (*COPIED, *COPIED_FOR_DOCUMENTS):
        for source in ROOT.glob(pattern):
            target = folder / source.relative_to(ROOT)
            target.parent.mkdir(parents=True, exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, target)
            else:
                shutil.copy(source, target)


def exchange(path: Path, *pairs: tuple[str, str]) -> None:
    text = path.read_text(encoding="utf-8")
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")


def add_the_effect(folder: Path) -> None:
    plant = folder / "cpp" / "include" / "ehsid" / "plant"
    shutil.copy(HERE / "hard_spring.hpp", plant / "effects")
    include = "#include <ehsid/plant/effects/internal_leakage.hpp>"
    exchange(
        plant / "catalogue.hpp",
        (include, f"#include <ehsid/plant/effects/hard_spring.hpp>\n{include}"),
        ("LoadForce<Scalar>,", "LoadForce<Scalar>, HardSpring<Scalar>,"),
    )


def leave_out_the_banks(folder: Path) -> None:
    bindings = folder / "bindings"
    exchange(bindings / "module.cpp", ("ehsid::bindings::bind_estimator_bank(m);", ""))
    exchange(
        bindings / "CMakeLists.txt",
        ("bind_estimator_bank.cpp", ""),
        ("ehsid_banks ehsid_plant", "ehsid_plant"),
    )


def compiled(folder: Path) -> Path:
    """Return the folder of the package ehsid with the further effect."""
    pybind11 = subprocess.run(
        [sys.executable, "-c", "import pybind11; print(pybind11.get_cmake_dir())"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout.strip()
    build = folder / "build"
    options = {
        "CMAKE_BUILD_TYPE": "Debug",  # simulator for one kind of processor
        "CMAKE_CXX_FLAGS_DEBUG": "-O1 -DNDEBUG",
        "EHSID_BUILD_BINDINGS": "ON",
        "EHSID_BUILD_TESTS": "OFF",
        "EHSID_INSTALL": "OFF",
        "pybind11_DIR": pybind11,
        "Python_EXECUTABLE": sys.executable,
    }
    configure = ["cmake", "-G", "Ninja", "-S", str(folder), "-B", str(build)]
    configure += [f"-D{name}={value}" for name, value in options.items()]
    for command in (configure, ["cmake", "--build", str(build), "--target", "ehsid_core"]):
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
    package = folder / "site" / "ehsid"
    shutil.copytree(folder / "python" / "ehsid", package)
    shutil.copytree(folder / "python" / "harness", package / "harness")
    (module,) = build.rglob("_core*.so")
    shutil.copy(module, package)
    return package.parent


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("project")
    copy_of_the_project(folder)
    add_the_effect(folder)
    leave_out_the_banks(folder)
    command = [sys.executable, str(HERE / "use_hard_spring.py"), str(folder), str(folder / "out")]
    done = subprocess.run(
        command,
        env={**os.environ, "PYTHONPATH": str(compiled(folder))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    found["page"] = (folder / "out" / "report.html").read_text(encoding="utf-8")
    found["diagnosis"] = json.loads((folder / "out" / "diagnosis.json").read_text(encoding="utf-8"))
    return found


@pytest.mark.thorough
def test_it_is_simulated(seen: dict[str, Any]) -> None:
    assert seen["change_m"] > 1e-4


@pytest.mark.thorough
def test_it_is_diagnosed(seen: dict[str, Any]) -> None:
    assert seen["verdict"] == "effects"
    assert seen["effects"] == {"hard_spring": pytest.approx(SIZE, rel=0.2)}
    assert ["hard_spring"] in seen["tried"]
    assert "[effects.hard_spring]" in seen["augmented"]


@pytest.mark.thorough
def test_a_record_that_does_not_show_it_is_named(seen: dict[str, Any]) -> None:
    (why,) = seen["cannot_judge"]
    assert "of the stroke only" in why


@pytest.mark.thorough
def test_it_is_reported(seen: dict[str, Any]) -> None:
    assert [one["id"] for one in seen["diagnosis"]["which"]["effects"]] == ["hard_spring"]
    assert "hard spring" in seen["page"]
    assert "Duffing" in seen["page"]


@pytest.mark.thorough
def test_it_is_documented(seen: dict[str, Any]) -> None:
    assert seen["document"].startswith("## hard_spring")
    assert "Duffing" in seen["document"]
    assert "a force of 1 % at the end of the stroke" in seen["document"]


@pytest.mark.thorough
def test_a_log_cannot_be_given_it(seen: dict[str, Any]) -> None:
    assert "'hard_spring' changes what the machine does" in seen["refusal"]
