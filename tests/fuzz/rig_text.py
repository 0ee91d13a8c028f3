# SPDX-License-Identifier: MIT
"""What holds for the text of a rig file: it is refused with a message, or can be written back."""

from __future__ import annotations

from ehsid.harness.rigs import RigError, parse_rig, rig_text

PARTS = ("name", "plant", "values", "uncertainty", "sensors", "columns")


def check(data: bytes) -> None:
    """Reads the bytes as a rig file.

    Raises
    ------
    AssertionError
        the refusal says nothing, or the rig that was read is not the one that is written.
    """
    text = data.decode("utf-8", "replace")
    try:
        rig = parse_rig(text, source="rig.toml")
    except RigError as error:
        message = str(error)
        if not message.startswith("rig.toml: "):
            raise AssertionError(f"the message does not name the file: {message}") from None
        return
    again = parse_rig(rig_text(rig), source="rig.toml")
    for part in PARTS:
        assert getattr(again, part) == getattr(rig, part), part
