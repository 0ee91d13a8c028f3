# SPDX-License-Identifier: MIT
"""Each kind of break is found in a copy of the sources that has it, and additions are none."""

import copy
import json
import shutil
from pathlib import Path

import interface
import pytest
import typer
from c_interface import c_table
from changes import Change, table_changes
from cli_interface import cli_changes, cli_table
from cpp_interface import cpp_changes, cpp_table
from file_interface import file_changes, schema_table
from python_interface import python_changes, write_skeletons
from rules import Deprecated, Version, problems, read_deprecated

from ehsid.harness.cli.lazy import Verb

doxygen_is_needed = pytest.mark.skipif(
    shutil.which("doxygen") is None, reason="doxygen is not installed"
)


def edit(path: Path, *edits: tuple[str, str]) -> None:
    text = path.read_text(encoding="utf-8")
    for old, new in edits:
        assert text.count(old) >= 1, old
        text = text.replace(old, new, 1)
    path.write_text(text, encoding="utf-8")


def broken(changes: list[Change]) -> set[str]:
    return {f"{change.symbol}: {change.what}" for change in changes if change.breaks}


def added(changes: list[Change]) -> set[str]:
    return {change.symbol for change in changes if not change.breaks}


@pytest.fixture(scope="module")
def headers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Headers with one change of each kind."""
    to = tmp_path_factory.mktemp("include") / "ehsid"
    shutil.copytree(interface.HEADERS, to, ignore=shutil.ignore_patterns("plant"))
    edit(
        to / "arx_estimator.hpp",
        ("bool settled() const", "bool at_rest() const"),
        ("Scalar innovation() const", "double innovation() const"),
        ("bool reset_enabled = true", "bool reset_enabled = false"),
        ("void enable(bool on)", "void enable(bool on, bool at_once = false)"),
        ("  Status step(Scalar command,", "  Status step(Scalar time, Scalar command,"),
    )
    edit(to / "types.hpp", ("no_information = 2", "no_information = 9"))
    edit(to / "fields.hpp", ("#pragma once", "#pragma once\nnamespace ehsid { int added(); }"))
    edit(
        to / "c_api.h",
        ("ehsid_status ehsid_reset(ehsid_estimator* estimator);", ""),
        (
            "ehsid_parameters(const ehsid_estimator* estimator)",
            "ehsid_parameters(ehsid_estimator*)",
        ),
        ("float excitation;", "double excitation;"),
        ("EHSID_FILLING = 1,", "EHSID_FILLING = 12,"),
        ("+ 7 * (n) + 225", "+ 9 * (n) + 225"),
        ("#ifdef __cplusplus\n}", "bool ehsid_added(void);\n\n#ifdef __cplusplus\n}"),
    )
    return to


@pytest.mark.slow
@doxygen_is_needed
def test_cpp(headers: Path) -> None:
    changes = cpp_changes(cpp_table(interface.HEADERS), cpp_table(headers))
    assert broken(changes) == {
        "ehsid::OnlineEstimator::settled() const: removed",
        "ehsid::OnlineEstimator::innovation() const: changed",
        "ehsid::OnlineEstimator::step(Scalar, Scalar): removed",
        "ehsid::EstimatorOptions::reset_enabled: changed",
        "ehsid::Status::no_information: changed",
    }
    assert added(changes) == {
        "ehsid::OnlineEstimator::at_rest() const",
        "ehsid::OnlineEstimator::enable(bool, bool)",
        "ehsid::OnlineEstimator::step(Scalar, Scalar, Scalar)",
    }


@pytest.mark.slow
@doxygen_is_needed
def test_c(headers: Path) -> None:
    changes = table_changes("C", c_table(interface.HEADERS), c_table(headers))
    found = broken(changes)
    assert {
        "ehsid_reset(): removed",
        "ehsid_parameters(): changed",
        "ehsid_report.excitation: changed",
        "sizeof(ehsid_report): changed",
        "alignment of ehsid_report: changed",
        "offset of ehsid_report.resets: changed",
        "EHSID_FILLING: changed",
        "EHSID_STORAGE_BYTES(6): changed",
    } <= found
    assert "sizeof(ehsid_configuration): changed" not in found
    assert added(changes) == {"ehsid_added()"}


def test_python(tmp_path: Path) -> None:
    before, now = tmp_path / "before", tmp_path / "now"
    write_skeletons(interface.ROOT / "python", before)
    shutil.copytree(before, now)
    edit(
        now / "ehsid" / "_core.pyi",
        ("def discretise(", "def discretize("),
        ("lambda0: float=0.99", "lambda0: float=0.98"),
        ("invalid_argument = 8", "invalid_argument = 9"),
        ("def whiteness(self) -> float", "def whiteness(self) -> int"),
        ("def is_error(status: Status)", "def is_error(status: Status, more: int=0)"),
    )
    edit(now / "ehsid" / "harness" / "api" / "tables.py", ("def summary(self)", "def words(self)"))
    edit(now / "ehsid" / "harness" / "api" / "record.py", ("self, path:", "self, where:"))
    changes = python_changes(before, now)
    assert {
        "ehsid.discretise: removed",
        "ehsid.Exponential.__init__: changed",
        "ehsid.Status.invalid_argument: changed",
        "ehsid.ArxEstimator.whiteness: changed",
        "ehsid.Record.save: changed",
        "ehsid.Record.summary: removed",
    } <= broken(changes)
    assert not any("is_error" in name for name in broken(changes))
    assert {"ehsid.discretize", "ehsid.Record.words"} <= added(changes)


class Made(Verb):
    """A command whose function stands here."""

    made = None

    def function(self):
        return self.made


def command(function: object) -> dict[str, str]:
    verb = type("Verb", (Made,), {"made": staticmethod(function)})("made", "A command.")
    return cli_table((verb,))


def before_command(
    record: str = typer.Argument(),
    order: int = typer.Option(3, "--order"),
    out: str = typer.Option("", "--out"),
) -> None:
    """A command."""


def after_command(
    record: str = typer.Argument(),
    order: int = typer.Option(4, "--order"),
    rig: str = typer.Option(..., "--rig"),
    json: bool = typer.Option(False, "--json"),
) -> None:
    """A command."""


def test_command_line() -> None:
    changes = cli_changes(command(before_command), command(after_command))
    assert broken(changes) == {
        "ehsid made --order: changed",
        "ehsid made --out: removed",
        "ehsid made --rig: changed",
    }
    assert added(changes) == {"ehsid made --json"}
    assert cli_changes(cli_table(()), command(before_command))[0].what == "added"
    codes = {"exit code of Ctrl-C": "130"}
    assert broken(cli_changes(codes, {"exit code of Ctrl-C": "1"})) == {
        "exit code of Ctrl-C: changed"
    }


def test_files() -> None:
    path = interface.ROOT / "docs" / "schemas" / "diagnosis.json"
    before = json.loads(path.read_text(encoding="utf-8"))
    now = copy.deepcopy(before)
    top = now["$defs"][now["$ref"].rsplit("/", 1)[-1]] if "$ref" in now else now
    removed, retyped, optional = sorted(top["required"])[:3]
    del top["properties"][removed]
    top["properties"][retyped] = {"type": "boolean"}
    top["required"] = [name for name in top["required"] if name != optional]
    top["properties"]["one_more"] = {"type": "number"}
    changes = file_changes(
        schema_table("diagnosis.json", before), schema_table("diagnosis.json", now)
    )
    assert {
        f"diagnosis.json: {removed}: removed",
        f"diagnosis.json: {retyped}: changed",
        f"diagnosis.json: {optional}: changed",
    } <= broken(changes)
    assert added(changes) == {"diagnosis.json: one_more"}
    back = file_changes(schema_table("diagnosis.json", now), schema_table("diagnosis.json", before))
    assert f"diagnosis.json: {optional}: changed" not in broken(back)


REMOVED = Change("Python", "removed", "ehsid.old.part", "function", "")
OLD = Deprecated("Python", "ehsid.old", Version(1, 2, 0), "ehsid.new")


@pytest.mark.parametrize(
    ("released", "now", "deprecated", "allowed"),
    [
        ("0.1.0", "0.1.3", [], False),
        ("0.1.0", "0.2.0", [], True),
        ("1.2.0", "1.3.0", [], False),
        ("1.2.0", "2.0.0", [], True),
        ("1.2.0", "1.3.0", [OLD], False),
        ("1.3.0", "1.4.0", [OLD], True),
        ("1.3.0", "1.4.0", [Deprecated("C", "ehsid.old", OLD.since, "")], False),
        ("1.3.0", "1.4.0", [Deprecated("Python", "ehsid.ol", OLD.since, "")], False),
    ],
)
def test_a_break_is_allowed_by_version_or_by_deprecation(
    released: str, now: str, deprecated: list[Deprecated], allowed: bool
) -> None:
    found = problems([REMOVED], Version.of(released), Version.of(now), deprecated)
    assert (found == []) is allowed


def test_a_problem_says_what_changed_and_what_to_do() -> None:
    change = Change("C", "changed", "EHSID_FILLING", "1", "12")
    (text,) = problems([change], Version(1, 2, 0), Version(1, 2, 1), [])
    assert "C: EHSID_FILLING: changed: it was `1` and is now `12`" in text
    assert "restore it" in text
    assert "deprecate it" in text
    assert "2.0.0" in text
    (text,) = problems([REMOVED], Version(1, 2, 0), Version(1, 3, 0), [OLD])
    assert "must work until 1.4.0" in text


def test_the_list_of_what_is_deprecated_is_read(tmp_path: Path) -> None:
    path = tmp_path / "deprecated.toml"
    text = (interface.HERE / "deprecated.toml").read_text(encoding="utf-8")
    example = [
        line.removeprefix("# ") for line in text.splitlines() if " = " in line or "[[" in line
    ]
    path.write_text("\n".join(example), encoding="utf-8")
    (entry,) = read_deprecated(path)
    assert entry == Deprecated("Python", "ehsid.old_name", Version(1, 2, 0), "ehsid.new_name")
