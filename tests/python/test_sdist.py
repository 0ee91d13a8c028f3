# SPDX-License-Identifier: MIT
"""The source distribution: all that a build needs, nothing that only the repository needs."""

import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
from sources import ROOT

pytestmark = pytest.mark.thorough


def tracked(*folders: str) -> set[str]:
    """Files of the folders that git knows or would add."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "--", *folders]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return {name for name in listed.stdout.splitlines() if (ROOT / name).is_file()}


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sdist")
    build = "import sys, scikit_build_core.build as b; print(b.build_sdist(sys.argv[1]))"
    command = [sys.executable, "-c", build, str(folder)]
    subprocess.run(command, cwd=ROOT, capture_output=True, check=True)
    (archive,) = folder.glob("*.tar.gz")
    with tarfile.open(archive) as file:
        file.extractall(folder, filter="data")
    return folder / archive.name.removesuffix(".tar.gz")


@pytest.fixture(scope="module")
def files(unpacked: Path) -> set[str]:
    return {str(path.relative_to(unpacked)) for path in unpacked.rglob("*") if path.is_file()}


@pytest.mark.slow
def test_everything_a_build_reads_is_there(files: set[str]) -> None:
    sources = tracked("cpp", "bindings", "cmake", "python")
    top = {"CMakeLists.txt", "LICENSE", "README.md", "pyproject.toml"}
    assert sources
    assert sources | top <= files


def test_examples_and_documents_are_there(files: set[str]) -> None:
    texts = {name for name in tracked("docs") if name.endswith(".md")}
    assert texts
    assert texts | tracked("examples") <= files


def test_nothing_is_there_that_only_the_repository_needs(files: set[str]) -> None:
    unwanted = (".", "benchmarks/", "build/", "dist/", "script/", "tests/")
    assert not [name for name in files if name.startswith(unwanted) and name != ".gitignore"]
    docs = {name for name in files if name.startswith("docs/") and not name.endswith(".md")}
    assert docs == {name for name in tracked("docs/schemas") if name.endswith(".json")}


def test_cmake_configures_it_as_pip_does(unpacked: Path, tmp_path: Path) -> None:
    """Fails where a CMake file reads something that is not there."""
    options = ["EHSID_BUILD_BINDINGS=ON", "EHSID_BUILD_TESTS=OFF", "EHSID_INSTALL=OFF"]
    pybind11 = "import pybind11; print(pybind11.get_cmake_dir())"
    found = subprocess.run(
        [sys.executable, "-c", pybind11], capture_output=True, text=True, check=True
    )
    options += [f"pybind11_DIR={found.stdout.strip()}", f"Python_EXECUTABLE={sys.executable}"]
    command = ["cmake", "-G", "Ninja", "-S", str(unpacked), "-B", str(tmp_path)]
    command += [f"-D{option}" for option in options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
