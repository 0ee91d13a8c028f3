# SPDX-License-Identifier: MIT
"""Every bad input gets one message, changes nothing, and stands in bad_input/README.md."""

from __future__ import annotations

import hashlib
import re
import resource
import runpy
import shlex
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest
from bad_input import folders, options, records, rigs
from bad_input.case import Case, Content, Outcome, command
from bad_input.catalogue import GROUPS
from bad_input.inputs import BENCH
from bad_input.records import BadRecord
from sources import ROOT

MAKE = runpy.run_path(str(ROOT / "tests" / "python" / "bad_input" / "make.py"))
DOCUMENT = (ROOT / "tests" / "python" / "bad_input" / "README.md").read_text("utf-8")
ROWS = Counter(DOCUMENT.splitlines())
# Processor time and memory that no refusal takes. The first one in a process imports libraries,
# which takes most of both.
MOST_SECONDS = 20.0
MOST_BYTES = 2**30
# What was expected, or what the user can do.
REMEDY = re.compile(
    r"[Ee]xpected|[Tt]o fix it|did you mean|must (not )?be|move it away|another|give|leave|make|"
    r"see out/|rename|take|can be put|name |write|use |add |start |build |remove it|needs|"
    r"goes with|plugged in"
)
EVERY = [
    pytest.param(case, id=f"{group.__name__.rpartition('.')[2]}-{i}-{case.wrong}")
    for group in GROUPS
    for i, case in enumerate(group.CASES)
]


def contents(folder: Path) -> dict[str, str]:
    """What there is in a folder, by name: the digest of each file, the kind of all else."""
    there = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_symlink():
            there[name] = f"link to {path.readlink()}"
        elif path.is_file():
            there[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        else:
            there[name] = "folder" if path.is_dir() else "other"
    return there


def most_memory() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def given(case: Case, folder: Path) -> Outcome:
    """Gives the input to ehsid and checks what holds for every one of them."""
    case.make(folder)
    before, began, used = contents(folder), time.process_time(), most_memory()
    outcome = case.outcome(folder)
    assert time.process_time() - began < MOST_SECONDS
    assert most_memory() - used < MOST_BYTES
    after = {
        name: what
        for name, what in contents(folder).items()
        if name.split("/")[0] not in case.writes
    }
    assert after == before
    assert outcome.kind == case.kind, outcome
    assert "Traceback" not in outcome.message
    if outcome.kind == "exit code 2":
        assert REMEDY.search(outcome.message), outcome.message
    return outcome


@pytest.mark.slow
@pytest.mark.parametrize("case", EVERY)
def test_bad_input(case: Case, tmp_path: Path) -> None:
    row = MAKE["row"](case, given(case, tmp_path))
    assert row in ROWS, "another message than in README.md: python tests/python/bad_input/make.py"


def test_the_document_has_the_catalogue_and_nothing_else() -> None:
    """The rows that the tests above compare, and all that stands around them."""
    rows = iter([line for line in DOCUMENT.splitlines() if line.startswith("| ")])
    kept = [line for line in rows if not line.startswith("| what is wrong")]
    assert len(kept) == len(EVERY) >= 200
    rest = iter(kept)
    assert MAKE["document"](lambda case: next(rest)) == DOCUMENT


def test_there_are_enough_of_each_kind() -> None:
    for group in GROUPS:
        assert len(group.CASES) >= 15, group.TITLE
        calls = [(case.wrong, case.call) for case in group.CASES]
        assert len(set(calls)) == len(calls), group.TITLE


def shown(bad: BadRecord) -> str:
    """The message that the document has of a record."""
    begin = MAKE["row"](bad.case("identify"), Outcome("exit code 2", "|")).rpartition("\\|")[0]
    (row,) = (row for row in ROWS if row.startswith(begin))
    return row.removeprefix(begin).removesuffix(" |")


# `simulate` does not read the position.
OF_THE_POSITION = (
    *("columns of unequal lengths", "a matrix for a column", "a number for a column"),
    "no such column",
)


@pytest.mark.thorough
@pytest.mark.parametrize("verb", [verb for verb in records.LINES if verb != "identify"])
def test_a_bad_record_gets_its_message_from_every_command(verb: str, tmp_path: Path) -> None:
    bad = list(records.BAD)
    if verb == "simulate":
        bad = [record for record in bad if record.wrong not in OF_THE_POSITION]
    if verb == "estimate":  # it takes a folder of records
        bad = [record for record in bad if record.wrong != "a folder"]
    if verb == "gap --validate":  # its good record would be beyond the limits too
        bad = [record for record in bad if not record.environment]
    for i, record in enumerate(bad):
        (tmp_path / str(i)).mkdir()
        outcome = given(record.case(verb), tmp_path / str(i))
        assert MAKE["row"](record.case("identify"), outcome) in ROWS


@pytest.mark.slow
def test_bad_records_of_a_fleet_are_named_with_their_machines(tmp_path: Path) -> None:
    bad = [
        record
        for record in records.BAD
        if isinstance(record.content, str | bytes)
        and record.name.endswith(records.ENDINGS)
        and not record.environment
    ]
    files: dict[str, Content] = {}
    for i, record in enumerate(bad):
        files[f"machines/m{i}/rig.toml"] = BENCH
        files[f"machines/m{i}/{record.name}"] = record.content
    line = "ehsid gap-fleet machines --out out --workers 1"
    fleet = command("bad records", line, files=files, writes=("out",))
    said = given(fleet, tmp_path).message.splitlines()
    for i, record in enumerate(bad):
        (line,) = (line for line in said if f", m{i}: " in line)
        for part in shown(record).split("..."):  # words of a library, and of the command
            assert re.sub(r"\\(.)", r"\1", part).strip(" .") in " ".join(line.split()), line


@pytest.mark.thorough
@pytest.mark.parametrize("verb", [verb for verb in rigs.LINES if verb != "simulate"])
def test_a_bad_rig_gets_its_message_from_every_command(verb: str, tmp_path: Path) -> None:
    for i, rig in enumerate(rigs.BAD):
        (tmp_path / str(i)).mkdir()
        outcome = given(rig.case(verb), tmp_path / str(i))
        assert MAKE["row"](rig.case("simulate"), outcome) in ROWS


IN_A_PROCESS = (
    records.CASES[0],
    rigs.CASES[0],
    options.CASES[0],
    options.CASES[8],
    folders.CASES[0],
)


@pytest.mark.thorough
@pytest.mark.parametrize("case", IN_A_PROCESS, ids=lambda case: case.wrong)
def test_a_process_of_its_own_ends_as_it_does_here(case: Case, tmp_path: Path) -> None:
    here, there = tmp_path / "here", tmp_path / "there"
    for folder in (here, there):
        folder.mkdir()
    said = given(case, here).message
    case.make(there)
    arguments = [sys.executable, "-m", "ehsid", *shlex.split(case.call)[1:]]
    ended = subprocess.run(arguments, cwd=there, capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert ended.stderr == f"ehsid: {said}\n"


def test_a_subinterpreter_gets_an_exception() -> None:
    """NumPy and the compiled module are of one interpreter: another one must not crash."""
    program = """
import sys, _interpreters as interpreters
one = interpreters.create()
print(interpreters.exec(one, "import ehsid"))
"""
    if sys.version_info < (3, 13):
        program = """
import _xxsubinterpreters as interpreters
try:
    interpreters.run_string(interpreters.create(), "import ehsid")
except interpreters.RunFailedError as error:
    print(error)
"""
    ended = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60
    )
    assert ended.returncode == 0, ended.stderr
    assert "ImportError" in ended.stdout, ended.stdout
