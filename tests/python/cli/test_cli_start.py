# SPDX-License-Identifier: MIT
"""Start of the command: what the overview says, and which libraries are imported for what."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import json
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import Result
from sources import ROOT
from typer.testing import CliRunner

import ehsid
from ehsid.harness.cli import GROUPS, VERBS, cli
from ehsid.harness.cli.lazy import Verb

EXAMPLES = ROOT / "examples"
RECORD = str(EXAMPLES / "data" / "hydraulic_crane.csv")
CRANE = [RECORD, "--input", "valve_opening", "--output", "oil_pressure"]
BENCH = str(EXAMPLES / "rigs" / "bench.toml")

DRAWING = {"matplotlib", "bokeh", "jinja2", "panel", "tornado"}
LOGS = {"asammdf", "fastexcel", "h5py", "matio", "mcap", "nptdms", "rosbags"}
HEAVY = (
    DRAWING
    | LOGS
    | {"control", "distributed", "joblib", "numba", "pandas", "pint", "polars", "scipy"}
)

# In a process of its own: this one has imported everything.
RUN = """
import json, sys
from ehsid.harness.cli import main
codes = []
for words in json.loads(sys.argv[1]):
    sys.argv[1:] = words
    try:
        main()
        codes.append(None)
    except SystemExit as stop:
        codes.append(stop.code)
print(json.dumps([codes, sorted(sys.modules)]), file=sys.stderr)
"""


def imported_by(*commands: list[str]) -> set[str]:
    """Return the names of all modules that are there when the commands have ended well."""
    program = [sys.executable, "-c", RUN, json.dumps(commands)]
    outcome = subprocess.run(program, capture_output=True, text=True, check=False)
    codes, modules = json.loads(outcome.stderr.splitlines()[-1])
    assert len(codes) == len(commands)
    assert set(codes) <= {None, 0}, outcome.stderr
    return set(modules)


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb.name)
def test_the_overview_has_the_first_line_of_the_docstring(verb: Verb) -> None:
    module = importlib.import_module(verb.module)
    told = inspect.getdoc(getattr(module, f"{verb.stem}_command"))
    assert told is not None
    assert verb.summary == told.splitlines()[0]


def test_no_module_of_a_verb_takes_the_place_of_something_else() -> None:
    package = importlib.import_module("ehsid.harness.cli")
    for verb in VERBS:
        module = importlib.import_module(verb.module)
        assert getattr(importlib.import_module(verb.package), verb.stem) is module
    for name in ("cli", "main", "VERBS", "GROUPS"):
        assert not inspect.ismodule(getattr(package, name)), name


def test_the_overview_lists_every_verb_in_order() -> None:
    text = CliRunner().invoke(cli, ["--help"]).stdout
    places = [text.index(f"│ {verb.name.split()[0]} ") for verb in VERBS]
    assert places == sorted(places)


def test_a_group_lists_its_verbs() -> None:
    text = CliRunner().invoke(cli, ["rig", "--help"]).stdout
    assert GROUPS["rig"] in " ".join(text.split())
    assert text.index("│ new ") < text.index("│ check ")


def test_an_unknown_verb_of_a_group_is_told_with_the_nearest() -> None:
    outcome = CliRunner().invoke(cli, ["rig", "chek"])
    assert outcome.exit_code == 2
    assert "there is no command 'chek'; did you mean 'check'? There are: new, check" in (
        outcome.output
    )


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [["--help"], ["--version"]])
def test_the_overview_imports_no_verb_and_no_library(arguments: list[str]) -> None:
    modules = imported_by(arguments)
    assert not modules & (HEAVY | {"numpy"})
    assert not modules & {verb.module for verb in VERBS}


@pytest.mark.slow
def test_the_help_of_no_verb_imports_a_library() -> None:
    modules = imported_by(*([*verb.name.split(), "--help"] for verb in VERBS))
    assert modules >= {verb.module for verb in VERBS}
    assert not modules & HEAVY


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("arguments", "unused"),
    [
        (["effects"], HEAVY),
        (["identify", *CRANE], HEAVY - {"scipy"} | {"scipy.io"}),
        (["estimate", *CRANE], HEAVY - {"scipy"} | {"scipy.io"}),
        (["export", *CRANE, "--out"], HEAVY - {"scipy", "jinja2"} | {"scipy.io"}),
        (["simulate", BENCH, "--excitation", "steps"], HEAVY - {"scipy"} | {"scipy.io"}),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else "",
)
def test_a_verb_that_draws_nothing_imports_nothing_to_draw_with(
    arguments: list[str], unused: set[str], tmp_path: Path
) -> None:
    if arguments[-1] == "--out":
        arguments = [*arguments, str(tmp_path / "servo.hpp")]
    assert not imported_by(arguments) & unused


@pytest.mark.thorough
def test_identify_imports_what_draws_where_there_is_something_to_draw(tmp_path: Path) -> None:
    assert {"matplotlib", "control"} <= imported_by(["identify", *CRANE, "--out", str(tmp_path)])


def test_the_package_itself_is_light() -> None:
    command = [sys.executable, "-c", "import ehsid, sys; print(*sys.modules)"]
    modules = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    assert "ehsid._core" in modules
    assert not HEAVY & set(modules)


def test_an_unknown_verb_is_told_with_the_nearest() -> None:
    outcome = CliRunner().invoke(cli, ["identfy"])
    assert outcome.exit_code == 2
    assert "there is no command 'identfy'; did you mean 'identify'?" in outcome.output


@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb.needs], ids=lambda verb: verb.name)
def test_a_verb_that_lacks_what_it_needs_says_which_extra_has_it(
    verb: Verb, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr(
        "importlib.util.find_spec", lambda name: None if name == verb.needs else found(name)
    )
    outcome = CliRunner().invoke(cli, [verb.name])
    assert outcome.exit_code == 2
    assert f"'ehsid {verb.name}' needs the package '{verb.needs}'" in outcome.stderr
    assert f"-m pip install 'ehsid[{verb.extra}]'" in outcome.stderr
    assert CliRunner().invoke(cli, [verb.name, "--help"]).exit_code == 0


def raised_in(verb: str, error: BaseException, monkeypatch: pytest.MonkeyPatch) -> Result:
    """Run a command whose function raises this error."""

    def fails() -> None:
        raise error

    (of,) = (one for one in VERBS if one.name == verb)
    monkeypatch.setattr(f"{of.module}.{of.stem}_command", fails)
    return CliRunner().invoke(cli, verb.split())


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb.name)
def test_errors_of_every_verb_end_in_one_place(verb: Verb, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever it is asked for: what its function raises becomes a message."""
    outcome = raised_in(verb.name, ValueError("no such thing"), monkeypatch)
    assert outcome.exit_code == 2
    assert outcome.stderr == "ehsid: no such thing\n"


def of_pybind() -> TypeError:
    try:
        ehsid.ArxEstimator(10**21, 1, 1)
    except TypeError as error:
        return error
    raise AssertionError


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OverflowError("cannot convert float infinity to integer"), "a number is too large"),
        (MemoryError("Unable to allocate 7.45 GiB for an array"), "is not enough (Unable to"),
        (MemoryError(), "is not enough (no more memory)"),
        (RecursionError("maximum recursion depth exceeded"), "the input is nested too deeply"),
        (of_pybind(), "a number does not fit its type"),
    ],
)
def test_unforeseen_numbers_and_sizes_end_in_one_sentence(
    error: Exception, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    outcome = raised_in("effects", error, monkeypatch)
    assert outcome.exit_code == 2
    assert said in outcome.stderr
    assert "expected" in outcome.stderr
    assert outcome.stderr.count("\n") == 1


def test_a_mistake_of_ours_is_no_message(monkeypatch: pytest.MonkeyPatch) -> None:
    outcome = raised_in("effects", TypeError("unsupported operand type(s)"), monkeypatch)
    assert outcome.exit_code == 1
    assert "a fault of the program" in outcome.stderr
    assert "(TypeError: unsupported operand type(s))" in outcome.stderr
    assert outcome.stderr.count("\n") == 1


def test_ctrl_c_in_a_command_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    outcome = raised_in("effects", KeyboardInterrupt(), monkeypatch)
    assert outcome.exit_code == 130
    assert outcome.stderr == "ehsid: interrupted\n"


IN_AN_IMPORT = """
class Interrupts:
    def find_spec(self, name, *_):
        if name == "{}":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interrupts())
"""
IN_TYPER = """
import typer.core
def interrupted(*_):
    raise KeyboardInterrupt
typer.core.TyperGroup.resolve_command = interrupted
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "preparation",
    [
        IN_AN_IMPORT.format("ehsid.harness.cli"),
        IN_AN_IMPORT.format("ehsid.harness.cli.effects"),
        IN_TYPER,
    ],
)
def test_ctrl_c_before_the_command_begins_is_one_line(preparation: str) -> None:
    script = f"""
import sys
{preparation}
sys.argv = ["ehsid", "effects"]
from ehsid.__main__ import main
main()
"""
    command = [sys.executable, "-c", script]
    outcome = subprocess.run(command, capture_output=True, text=True, check=False)
    assert outcome.returncode == 130
    assert outcome.stderr == "ehsid: interrupted\n"


@pytest.mark.slow
def test_a_reader_that_has_gone_is_no_error() -> None:
    command = [
        sys.executable,
        "-c",
        "from ehsid.harness.cli import main; main()",
        "effects",
        "--json",
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""
