# SPDX-License-Identifier: MIT
"""The command and the Python that do the same as a step of the page."""

from __future__ import annotations

import os
import shlex

from ehsid.harness.catalogue.channels import COMMAND, POSITION
from ehsid.harness.catalogue.parameters import POLICIES

from .model_tasks import recursion_of
from .session import RIG, Session

HEADERS = {False: "firmware/servo_configuration.hpp", True: "firmware/servo_configuration.h"}


def commands(session: Session, step: str) -> list[str]:
    """Returns the commands of a step, to be run in the folder of the session."""
    return [shlex.join(command) for command in _COMMANDS[step](session)]


def shown_commands(session: Session, step: str) -> str:
    """Returns the commands of a step with the change into the folder of the session."""
    return "\n".join([f"cd {shlex.quote(os.fspath(session.folder))}", *commands(session, step)])


def python(session: Session, step: str) -> str:
    """Returns the Python of a step, to be run in the folder of the session."""
    return "\n".join(_PYTHON[step](session)) + "\n"


def _record(entry_id: str) -> str:
    return f"records/{entry_id}.parquet"


def _halves(session: Session) -> tuple[list[str], list[str]]:
    """Returns the records to be fitted, and those that are held out."""
    entries = session.settings.records
    return (
        [_record(entry.id) for entry in entries if not entry.held_out],
        [_record(entry.id) for entry in entries if entry.held_out],
    )


def _load_commands(session: Session) -> list[list[str]]:
    return [["ehsid", "import", entry.file] for entry in session.settings.records]


def _map_commands(session: Session) -> list[list[str]]:
    made = []
    for entry in session.settings.records:
        maps = [word for key, value in entry.maps.items() for word in ("--map", f"{key}={value}")]
        step = [] if entry.dt_s is None else ["--dt", f"{entry.dt_s:.12g}"]
        made.append(["ehsid", "import", entry.file, *maps, *step, "--out", _record(entry.id)])
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
    records = [_record(entry.id) for entry in session.settings.records]
    return [["ehsid", "rig", "check", RIG, *records, "--out", "check"]]


def _gap_commands(session: Session) -> list[list[str]]:
    fitted, held_out = _halves(session)
    validate = ["--validate", *held_out] if held_out else []
    return [["ehsid", "gap", *fitted, "--rig", RIG, *validate, "--out", "gap"]]


def _load_python(session: Session) -> list[str]:
    read = [f"print(ehsid.read({entry.file!r}).summary())" for entry in session.settings.records]
    return ["import ehsid", "", *read]


def _map_python(session: Session) -> list[str]:
    lines = ["import ehsid", ""]
    for entry in session.settings.records:
        maps = f", maps={entry.maps!r}" if entry.maps else ""
        step = "" if entry.dt_s is None else f", dt_s={entry.dt_s!r}"
        lines.append(f"ehsid.read({entry.file!r}{maps}{step}).save({_record(entry.id)!r})")
    return lines


def _rig_python(session: Session) -> list[str]:
    rig = session.settings.rig
    given = {name: text for name, text in rig.answers.items() if text.strip()}
    if not given:
        return ["import ehsid", "", f"print(ehsid.Rig.read({RIG!r}).summary())"]
    said = {"double_rod": rig.double_rod, "hoses": rig.hoses} if rig.plant == "ehs" else {}
    over = {"drop_over": "both"} if rig.plant == "ehs" and rig.drop_over_both else {}
    options = {"name": session.name, **{name: True for name, yes in said.items() if yes}, **over}
    answers = {name.replace("-", "_"): text for name, text in given.items()}
    return [
        "import ehsid",
        "",
        "rig = ehsid.Rig.new(",
        f"    {rig.plant!r},",
        *(f"    {name}={value!r}," for name, value in (options | answers).items()),
        ")",
        f"rig.save({RIG!r})",
    ]


def _check_python(session: Session) -> list[str]:
    return [
        "import ehsid",
        "from ehsid.harness.fitness import check_rig",
        "",
        f"rig = ehsid.Rig.read({RIG!r})",
        f"for path in {[_record(entry.id) for entry in session.settings.records]!r}:",
        "    for finding in check_rig(ehsid.read(path).result, rig.result).findings:",
        "        print(finding.check, finding.status, finding.text)",
    ]


def _gap_python(session: Session) -> list[str]:
    fitted, held_out = _halves(session)
    validate = f", validate={held_out!r}" if held_out else ""
    return [
        "import ehsid",
        "",
        f"found = ehsid.diagnose({fitted!r}, {RIG!r}{validate})",
        "print(found.summary())",
        "found.save('gap')",
    ]


def _model_commands(session: Session) -> list[list[str]]:
    """Returns the commands, to be run in the folder of the session."""
    choice, entry = session.settings.model, session.modelled()
    if entry is None:
        return []
    record = _record(entry.id)
    columns = ["--input", choice.input_name, "--output", choice.output_name]
    tried = ["--orders", choice.orders, "--delays", choice.delays]
    estimator = [*_export_options(session), "--method", choice.method]
    return [
        ["ehsid", "identify", record, *columns, *tried, "--out", "model"],
        ["ehsid", "estimate", record, *estimator, "--out", "model"],
    ]


def _export_options(session: Session) -> list[str]:
    """Returns columns, orders, forgetting and reset as options of `estimate` and `export`."""
    choice = session.settings.model
    members = {one.name: one.member for one in POLICIES[choice.policy].settings}
    settings = [
        word
        for name, value in choice.settings.items()
        for word in ("--setting", f"{members[name]}={value:.12g}")
    ]
    orders = ["--na", f"{choice.na}", "--nb", f"{choice.nb}", "--nk", f"{choice.nk}"]
    columns = ["--input", choice.input_name, "--output", choice.output_name]
    reset = [] if choice.reset else ["--no-reset"]
    return [*columns, *orders, "--forgetting", choice.policy, *settings, *reset]


def _model_python(session: Session) -> list[str]:
    """Returns the Python, to be run in the folder of the session."""
    choice, entry = session.settings.model, session.modelled()
    if entry is None:
        return []
    recursion = recursion_of(choice)
    names = f"input={choice.input_name!r}, output={choice.output_name!r}"
    reset = "" if choice.reset else ", reset=False"
    return [
        "import ehsid",
        "",
        f"record = ehsid.read({_record(entry.id)!r})",
        "model = ehsid.identify(",
        f"    record, {names}, orders={choice.orders!r}, delays={choice.delays!r}",
        ")",
        "print(model.summary())",
        "model.save('model')",
        "found = ehsid.estimate(",
        f"    record, {names}, na={choice.na}, nb={choice.nb}, nk={choice.nk},",
        f"    forgetting=ehsid.{recursion.forgetting!r}, method={choice.method!r}{reset},",
        ")",
        "print(found.summary())",
        "found.save('model')",
    ]


def _next_commands(session: Session) -> list[list[str]]:
    """Returns the command that makes the firmware header; without a record there is none."""
    firmware = session.settings.firmware
    if not firmware.record:
        return []
    record = _record(firmware.record)
    name = [] if firmware.name == "servo" else ["--name", firmware.name]
    c = ["--c"] if firmware.c else []
    out = ["--out", HEADERS[firmware.c]]
    how = _export_options(session) if firmware.like_model else ["--identify"]
    return [["ehsid", "export", record, *how, *name, *c, *out]]


def _next_python(session: Session) -> list[str]:
    """Returns the Python that makes the firmware header."""
    firmware = session.settings.firmware
    if not firmware.record:
        return ["# Choose a record to make the header of."]
    names, orders, forgetting = (COMMAND, POSITION), "chosen_orders(data)", "ehsid.FRatio()"
    imported = ["from ehsid.harness.models.identification import IoData"]
    if firmware.like_model:
        choice, recursion = session.settings.model, recursion_of(session.settings.model)
        names = (choice.input_name, choice.output_name)
        orders = f"ArxOrders({choice.na}, {choice.nb}, {choice.nk}, offset=True)"
        forgetting = f"ehsid.{recursion.forgetting!r}, reset={choice.reset}"
        imported = ["from ehsid.harness.models.identification import ArxOrders, IoData"]
    return [
        "from pathlib import Path",
        "import ehsid",
        "from ehsid.harness.firmware import chosen_orders, header_of_record",
        *imported,
        "from ehsid.harness.records import read_record",
        "",
        f"path = Path({_record(firmware.record)!r})",
        f"data = IoData.from_record(read_record(path), {names[0]!r}, {names[1]!r})",
        f"header = header_of_record(path, data, {orders}, forgetting={forgetting}, "
        f"name={firmware.name!r}, c={firmware.c})",
        f"Path({HEADERS[firmware.c]!r}).write_text(header.text, encoding='utf-8')",
    ]


_COMMANDS = {
    "load": _load_commands,
    "map": _map_commands,
    "rig": _rig_commands,
    "check": _check_commands,
    "model": _model_commands,
    "gap": _gap_commands,
    "next": _next_commands,
}
_PYTHON = {
    "load": _load_python,
    "map": _map_python,
    "rig": _rig_python,
    "check": _check_python,
    "model": _model_python,
    "gap": _gap_python,
    "next": _next_python,
}
