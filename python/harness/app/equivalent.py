# SPDX-License-Identifier: MIT
"""The command and the Python that do the same as a step of the page."""

from __future__ import annotations

import os
import shlex

from ehsid.harness.app.equivalent_next import next_commands, next_python
from ehsid.harness.app.model_equivalent import model_commands, model_python
from ehsid.harness.app.session import RIG, Entry, Session


def commands(session: Session, step: str) -> list[str]:
    """Returns the commands of a step, to be run in the folder of the session."""
    return [shlex.join(command) for command in _COMMANDS[step](session)]


def shown_commands(session: Session, step: str) -> str:
    """Returns the commands of a step with the change into the folder of the session."""
    return "\n".join([f"cd {shlex.quote(os.fspath(session.folder))}", *commands(session, step)])


def python(session: Session, step: str) -> str:
    """Returns the Python of a step, to be run in the folder of the session."""
    return "\n".join(_PYTHON[step](session)) + "\n"


def _record(entry: Entry) -> str:
    return f"records/{entry.id}.parquet"


def _halves(session: Session) -> tuple[list[str], list[str]]:
    """Returns the records to be fitted, and those that are held out."""
    entries = session.settings.records
    return (
        [_record(entry) for entry in entries if not entry.held_out],
        [_record(entry) for entry in entries if entry.held_out],
    )


def _load_commands(session: Session) -> list[list[str]]:
    return [["ehsid", "import", entry.file] for entry in session.settings.records]


def _map_commands(session: Session) -> list[list[str]]:
    made = []
    for entry in session.settings.records:
        maps = [word for key, value in entry.maps.items() for word in ("--map", f"{key}={value}")]
        step = [] if entry.dt_s is None else ["--dt", f"{entry.dt_s:.12g}"]
        made.append(["ehsid", "import", entry.file, *maps, *step, "--out", _record(entry)])
    return made


def _rig_commands(session: Session) -> list[list[str]]:
    rig = session.settings.rig
    if not any(rig.answers.values()):
        return []
    given = [
        word for name, text in rig.answers.items() if text.strip() for word in (f"--{name}", text)
    ]
    flags = ["--double-rod"] * rig.double_rod + ["--hoses"] * rig.hoses
    over = ["--drop-over", "both" if rig.drop_over_both else "edge"]
    over = over if rig.answers.get("rated-drop", "").strip() else []
    if rig.plant == "axis":
        flags = over = []
    name = ["--name", session.name]
    return [
        ["ehsid", "rig", "new", "--plant", rig.plant, *name, *given, *flags, *over, "--out", RIG]
    ]


def _check_commands(session: Session) -> list[list[str]]:
    records = [_record(entry) for entry in session.settings.records]
    return [["ehsid", "rig", "check", RIG, *records, "--out", "check"]]


def _gap_commands(session: Session) -> list[list[str]]:
    fitted, held_out = _halves(session)
    validate = ["--validate", *held_out] if held_out else []
    return [["ehsid", "gap", *fitted, "--rig", RIG, *validate, "--out", "gap"]]


def _load_python(session: Session) -> list[str]:
    lines = ["from ehsid.harness.records import read_record", ""]
    for entry in session.settings.records:
        lines += [f"record = read_record({entry.file!r}, required=())", "print(record.origin)"]
    return lines


def _map_python(session: Session) -> list[str]:
    lines = [
        "from ehsid.harness.records import Hints, read_record, write_record",
        "from ehsid.harness.records.logs.mapping import parse_maps",
        "",
    ]
    for entry in session.settings.records:
        maps = [f"{key}={value}" for key, value in entry.maps.items()]
        lines += [
            f"hints = Hints(parse_maps({maps!r}), {entry.dt_s!r})",
            f"record = read_record({entry.file!r}, required=(), hints=hints)",
            f"write_record(record, {_record(entry)!r})",
        ]
    return lines


def _rig_python(session: Session) -> list[str]:
    rig = session.settings.rig
    return [
        "from pathlib import Path",
        "from ehsid.harness.rigs.answers import answered, rig_file_text",
        "",
        f"answers = {rig.answers!r}",
        f"entries = answered({rig.plant!r}, answers, double_rod={rig.double_rod}, "
        f"hoses={rig.hoses}, drop_over_both={rig.drop_over_both})",
        f"text = rig_file_text({session.name!r}, {rig.plant!r}, entries)",
        f"Path({RIG!r}).write_text(text, encoding='utf-8')",
    ]


def _check_python(session: Session) -> list[str]:
    return [
        "from ehsid.harness.records import read_record",
        "from ehsid.harness.rig_check import check_rig",
        "from ehsid.harness.rigs import read_rig",
        "",
        f"rig = read_rig({RIG!r})",
        f"for path in {[_record(entry) for entry in session.settings.records]!r}:",
        "    for finding in check_rig(read_record(path), rig).findings:",
        "        print(finding.check, finding.status, finding.text)",
    ]


def _gap_python(session: Session) -> list[str]:
    fitted, held_out = _halves(session)
    return [
        "from ehsid.harness.gap import diagnose",
        "from ehsid.harness.records import read_record",
        "from ehsid.harness.rigs import read_rig",
        "",
        f"rig = read_rig({RIG!r})",
        f"fitted = [read_record(path) for path in {fitted!r}]",
        f"held_out = [read_record(path) for path in {held_out!r}]",
        "diagnosis = diagnose(fitted, rig, validate=held_out)",
        "print(diagnosis.sentence)",
    ]


_COMMANDS = {
    "load": _load_commands,
    "map": _map_commands,
    "rig": _rig_commands,
    "check": _check_commands,
    "model": model_commands,
    "gap": _gap_commands,
    "next": next_commands,
}
_PYTHON = {
    "load": _load_python,
    "map": _map_python,
    "rig": _rig_python,
    "check": _check_python,
    "model": model_python,
    "gap": _gap_python,
    "next": next_python,
}
