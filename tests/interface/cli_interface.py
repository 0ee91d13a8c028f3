# SPDX-License-Identifier: MIT
"""The interface of the command line: commands, their arguments and options, exit codes."""

import io
import typing
from contextlib import redirect_stderr
from enum import Enum
from typing import Any

import typer
from changes import Change, table_changes
from typer.testing import CliRunner

from ehsid.harness.cli import VERBS, cli
from ehsid.harness.cli.console import with_verbosity
from ehsid.harness.cli.lazy import Verb, errors_as_messages

NEEDED = "must be given"


def cli_table(verbs: tuple[Verb, ...] = VERBS) -> dict[str, str]:
    """Every command with what it takes, and the exit codes."""
    table = {"ehsid --version": "flag"}
    for verb in verbs:
        called = f"ehsid {verb.name}"
        table[called] = "command"
        hints = typing.get_type_hints(with_verbosity(verb.function()))
        places = 0
        for parameter in verb.load().params:
            takes = _takes(parameter, hints[parameter.name])
            if parameter.param_type_name == "argument":
                places += 1
                names = [f"{called}, argument {places}"]
            else:
                names = [f"{called} {option}" for option in _options(parameter)]
            for name in names:
                table[name] = takes
                table |= {f"{name} {value}": "value" for value in _values(hints[parameter.name])}
    return table | exit_codes()


def exit_codes() -> dict[str, str]:
    """What a script sees after a success, after bad input and after Ctrl-C."""
    run = CliRunner().invoke
    codes = {
        "success": run(cli, ["--version"]).exit_code,
        "a file that is not there": run(cli, ["identify", "no_such_file.csv"]).exit_code,
        "an unknown option": run(cli, ["identify", "--no-such-option"]).exit_code,
    }
    try:
        with redirect_stderr(io.StringIO()), errors_as_messages():
            raise KeyboardInterrupt
    except typer.Exit as ended:
        codes["Ctrl-C"] = ended.exit_code
    return {f"exit code of {case}": str(code) for case, code in codes.items()}


def cli_changes(before: dict[str, str], now: dict[str, str]) -> list[Change]:
    """Compares two tables. What an old command must now be given in addition is a break."""
    found = []
    for change in table_changes("command line", before, now):
        command = change.symbol.split(", argument")[0].split(" -")[0]
        if change.what == "added" and NEEDED in change.now and command in before:
            found.append(Change("command line", "changed", change.symbol, "not there", change.now))
        elif change.what == "changed" and change.was == f"{change.now}, {NEEDED}":
            found.append(Change("command line", "added", change.symbol, change.was, change.now))
        else:
            found.append(change)
    return found


def _takes(parameter: Any, hint: Any) -> str:
    """The values of an option or argument, its default, and whether it must be given."""
    kinds = [kind for kind in _kinds(hint) if kind is not type(None)]
    if kinds == [bool]:
        return "flag"
    words = [" or ".join(_name(kind) for kind in kinds)]
    if parameter.multiple or parameter.nargs != 1:
        words.append("may be repeated")
    if isinstance(parameter.default, str | int | float):
        words.append(f"default {getattr(parameter.default, 'value', parameter.default)}")
    if parameter.required:
        words.append(NEEDED)
    return ", ".join(words)


def _kinds(hint: Any) -> list[Any]:
    """The types behind `list[...]` and `... | None`."""
    parts = [_kinds(part) for part in typing.get_args(hint)]
    return [kind for part in parts for kind in part] or [hint]


def _name(kind: Any) -> str:
    return "one of its values" if _is_enum(kind) else str(getattr(kind, "__name__", kind))


def _values(hint: Any) -> list[str]:
    """The words that an option takes, where it takes only certain ones."""
    return [str(member.value) for kind in _kinds(hint) if _is_enum(kind) for member in kind]


def _is_enum(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Enum)


def _options(parameter: Any) -> list[str]:
    return [*parameter.opts, *parameter.secondary_opts]
