# SPDX-License-Identifier: MIT
"""The command and the Python that do the same as the step Next."""

from __future__ import annotations

from ehsid.harness.app.session import Session

HEADERS = {False: "firmware/servo_configuration.hpp", True: "firmware/servo_configuration.h"}


def next_commands(session: Session) -> list[list[str]]:
    """Returns the command that makes the firmware header; without a record there is none."""
    wish = session.settings.firmware
    if not wish.record:
        return []
    record = f"records/{wish.record}.parquet"
    name = [] if wish.name == "servo" else ["--name", wish.name]
    c = ["--c"] if wish.c else []
    out = ["--out", HEADERS[wish.c]]
    return [["ehsid", "export", record, "--identify", *name, *c, *out]]


def next_python(session: Session) -> list[str]:
    """Returns the Python that makes the firmware header."""
    wish = session.settings.firmware
    if not wish.record:
        return ["# Choose a record to make the header of."]
    return [
        "from pathlib import Path",
        "import ehsid",
        "from ehsid.harness.deploy.export import chosen_orders, header_of_record",
        "from ehsid.harness.identification import IoData",
        "from ehsid.harness.records import read_record",
        "",
        f"path = Path({f'records/{wish.record}.parquet'!r})",
        "data = IoData.from_record(read_record(path), 'command_v', 'position_m')",
        "header = header_of_record(path, data, chosen_orders(data), forgetting=ehsid.FRatio(), "
        f"name={wish.name!r}, c={wish.c})",
        f"Path({HEADERS[wish.c]!r}).write_text(header.text, encoding='utf-8')",
    ]
