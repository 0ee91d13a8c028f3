# SPDX-License-Identifier: MIT
"""Seeded mutations: small faults in the sources, each of which the tests of every day must find.

    python tests/mutation/mutate.py [--list] [--only TEXT ...]

Each entry of mutations.toml names a file, a text that occurs there once, what stands in its place,
and the tests that must fail then: paths for pytest, or names of programs of ctest. They run in a
copy of the sources below build/mutation, whose build is kept. First the tests run without a
mutation: what fails by itself would kill every mutant. `--only` takes those whose file, room or
number has one of the texts. Exit code 1 where a mutant survived.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import shutil
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
WORK = ROOT / "build" / "mutation"
COPY, SITE = WORK / "sources", WORK / "site"
HOUSES = ("harness", "hil", "lab", "workbench")


class Mutation(NamedTuple):
    """A fault; `tests` are paths for pytest, or else programs of ctest."""

    number: int
    room: str
    file: str
    old: str
    new: str
    tests: list[str]

    def in_place(self, text: str) -> str:
        if text.count(self.old) != 1:
            raise SystemExit(
                f"{self.number}: {self.file} has its text {text.count(self.old)} times"
            )
        return text.replace(self.old, self.new)


def mutations() -> list[Mutation]:
    listed = tomllib.loads(Path(__file__).with_name("mutations.toml").read_text(encoding="utf-8"))
    return [Mutation(number, **entry) for number, entry in enumerate(listed["mutation"], start=1)]


def copy_sources() -> None:
    """Brings the copy to the state of the sources; files that are the same keep their time."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        source, target = ROOT / name, COPY / name
        if not source.is_file():
            continue
        if not target.exists() or target.read_bytes() != source.read_bytes():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(source, target)
    # The package as it would be installed from there, with the module of the one that is.
    shutil.rmtree(SITE, ignore_errors=True)
    (SITE / "ehsid").mkdir(parents=True)
    for path in (COPY / "python" / "ehsid").iterdir():
        (SITE / "ehsid" / path.name).symlink_to(path)
    for house in HOUSES:
        (SITE / "ehsid" / house).symlink_to(COPY / "python" / house)
    found = importlib.util.find_spec("ehsid._core")
    assert found is not None
    assert found.origin is not None
    shutil.copy(found.origin, SITE / "ehsid")


def run(*command: str | Path, fails_with: str = "") -> bool:
    """Whether a command in the copy succeeds; one that must is told with its last lines."""
    environment = os.environ | {"PYTHONPATH": str(SITE), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(command, cwd=COPY, env=environment, capture_output=True, text=True)
    if done.returncode != 0 and fails_with:
        raise SystemExit(f"{fails_with}\n{(done.stdout + done.stderr)[-3000:]}")
    return done.returncode == 0


def build_module(what: str) -> None:
    """Compiles ehsid._core of the copy without optimisation for speed."""
    folder = COPY / "build" / "core"
    if not (folder / "build.ninja").exists():
        import pybind11

        options = {"CMAKE_BUILD_TYPE": "Debug", "CMAKE_CXX_FLAGS_DEBUG": "-O1"}
        options |= {"EHSID_BUILD_BINDINGS": "ON", "EHSID_INSTALL": "OFF"}
        options |= {"pybind11_DIR": pybind11.get_cmake_dir(), "Python_EXECUTABLE": sys.executable}
        stated = [f"-D{name}={value}" for name, value in options.items()]
        run("cmake", "-S", COPY, "-B", folder, "-G", "Ninja", *stated, fails_with=what)
    run("cmake", "--build", folder, fails_with=what)
    (module,) = folder.rglob("_core*.so")
    shutil.copy(module, SITE / "ehsid")


def passes(mutation: Mutation, what: str) -> bool:
    """Whether all tests of a mutation pass in the copy as it is."""
    if mutation.tests[0].startswith("tests/"):
        if mutation.file.startswith("cpp/"):
            build_module(what)
        quiet = ("-q", "-x", "-p", "no:cacheprovider", "-m", "not thorough")
        return run(sys.executable, "-m", "pytest", *quiet, *mutation.tests)
    build = COPY / "build" / "dev"
    if not (build / "build.ninja").exists():
        run("cmake", "--preset", "dev", fails_with=what)
    run("cmake", "--build", build, "--target", *mutation.tests, fails_with=what)
    return run("ctest", "--test-dir", build, "-R", f"^({'|'.join(mutation.tests)})$")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", default=[])
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    chosen = [
        one
        for one in mutations()
        if not options.only
        or any(text in (one.room, str(one.number)) or text in one.file for text in options.only)
    ]
    for one in chosen:
        one.in_place((ROOT / one.file).read_text(encoding="utf-8"))
    if options.list:
        print(
            *(f"{one.number:3d} {one.room}: {one.file}: {one.new.strip()}" for one in chosen),
            sep="\n",
        )
        return 0
    copy_sources()
    known: set[tuple[str, ...]] = set()
    survived = []
    for one in chosen:
        start = time.monotonic()
        if tuple(one.tests) not in known and not passes(one, f"{one.tests}: not built"):
            raise SystemExit(f"{one.tests}: they fail without a mutation")
        known.add(tuple(one.tests))
        path = COPY / one.file
        text = path.read_text(encoding="utf-8")
        try:
            path.write_text(one.in_place(text), encoding="utf-8")
            alive = passes(one, f"{one.number}: it does not compile")
        finally:
            path.write_text(text, encoding="utf-8")
        survived += [one.number] if alive else []
        seconds = time.monotonic() - start
        print(
            f"{one.number:3d} {'SURVIVED' if alive else 'killed  '} {seconds:5.0f} s  {one.file}",
            flush=True,
        )
    print(f"{len(chosen) - len(survived)} of {len(chosen)} killed; survived: {survived or 'none'}")
    return 1 if survived else 0


if __name__ == "__main__":
    sys.exit(main())
