# SPDX-License-Identifier: MIT
"""Makes the tables of messages in docs/hil_protocol.md: python docs/hil/make_tables.py"""

import re
from enum import IntFlag
from pathlib import Path

from ehsid.harness.base.files import write_text
from ehsid.hil.frames import Field, Message
from ehsid.hil.messages import MESSAGES, Kind

DOCUMENT = Path(__file__).parents[1] / "hil_protocol.md"


def table(messages: list[Message], title: str) -> str:
    """One row for each field; the kind, the name and the length stand in the first row of each."""
    lines = [f"| kind | message | {title} | field | type | unit | meaning |", "|---" * 7 + "|"]
    for message in messages:
        size = f"{message.layout.size}{'' if message.fixed == message.fields else ' or more'}"
        first = [f"0x{message.kind:02X}", f"**{Kind(message.kind).name.lower()}**"]
        first.append(message.states or size)
        for field in message.fields or (Field("", "u8", meaning="no body"),):
            cells = [*first, *described(field)]
            lines.append(f"| {' | '.join(cells)} |".replace("  ", " "))
            first = ["", "", ""]
    return "\n".join(lines)


def described(field: Field) -> tuple[str, str, str, str]:
    """Name, type, unit and meaning of a field, for the table."""
    if not field.name:
        return "", "", "", field.meaning
    count = "" if field.count == 1 else f"{field.count} "
    meaning = ": ".join(filter(None, (field.group, field.meaning)))
    if field.values is not None:
        bits = issubclass(field.values, IntFlag)
        numbers = [f"bit {i}" if bits else str(v.value) for i, v in enumerate(field.values)]
        names = [(value.name or "").lower().replace("_", " ") for value in field.values]
        meaning = ", ".join(f"{a} {b}" for a, b in zip(numbers, names, strict=True))
    return f"`{field.name}`", f"{count}{field.type}", field.unit, meaning


TABLES = {
    "requests": table([m for m in MESSAGES if m.states], "carried out in"),
    "answers": table([m for m in MESSAGES if not m.states], "bytes"),
}


def with_tables(text: str) -> str:
    """The document with its tables made anew."""
    for name, made in TABLES.items():
        begin = f"<!-- {name}: made by docs/hil/make_tables.py -->\n"
        text = re.sub(f"{begin}.*?<!-- end -->", f"{begin}{made}\n<!-- end -->", text, flags=re.S)
    return text


if __name__ == "__main__":
    write_text(DOCUMENT, with_tables(DOCUMENT.read_text(encoding="utf-8")))
    print(DOCUMENT)
