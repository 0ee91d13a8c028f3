# SPDX-License-Identifier: MIT
"""The command and the Python that do the same as the step Next."""

from __future__ import annotations

from ehsid.harness.catalogue.channels import COMMAND, POSITION

from .model_choice import recursion_of
from .model_equivalent import export_options
from .session import Session

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
    how = export_options(session) if wish.like_model else ["--identify"]
    return [["ehsid", "export", record, *how, *name, *c, *out]]


def next_python(session: Session) -> list[str]:
    """Returns the Python that makes the firmware header."""
    wish = session.settings.firmware
    if not wish.record:
        return ["# Choose a record to make the header of."]
    names, orders, forgetting = (COMMAND, POSITION), "chosen_orders(data)", "ehsid.FRatio()"
    imported = ["from ehsid.harness.models.identification import IoData"]
    if wish.like_model:
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
        f"path = Path({f'records/{wish.record}.parquet'!r})",
        f"data = IoData.from_record(read_record(path), {names[0]!r}, {names[1]!r})",
        f"header = header_of_record(path, data, {orders}, forgetting={forgetting}, "
        f"name={wish.name!r}, c={wish.c})",
        f"Path({HEADERS[wish.c]!r}).write_text(header.text, encoding='utf-8')",
    ]
