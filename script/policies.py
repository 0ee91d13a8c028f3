# SPDX-License-Identifier: MIT
"""Writes the lists of forgetting policies in files that no compiler or program can make by itself.

The policies describe themselves in cpp/include/ehsid/forgetting; this script reads the
descriptions from the compiled module. After a policy was added, and the module compiled and
installed again, `python script/policies.py` writes the C header, the Python signatures and the
documents anew. A test checks that they are as this script writes them.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import ehsid

ROOT = Path(__file__).resolve().parents[1]
POLICIES = ehsid.policies()
CLASSES = [info.policy.__name__ for info in POLICIES]


def c_list() -> str:
    """Returns the macro of the C header that names every policy."""
    names = " \\\n".join(f"  DO({info.id})" for info in POLICIES)
    return f"#define EHSID_EACH_POLICY(DO) \\\n{names}\n"


def c_members() -> str:
    """Returns the members of ehsid_forgetting; a setting of several policies is one member."""
    owners: dict[str, list[str]] = {}
    settings = {}
    for info in POLICIES:
        for setting in info.settings:
            owners.setdefault(setting.member, []).append(info.id)
            settings[setting.member] = setting
    lines = []
    for name, setting in settings.items():
        values = setting.range.removeprefix("in ")
        lines.append(f"  float {name}; /* {', '.join(owners[name])}: {values} */\n")
    return "".join(lines)


def header_list() -> str:
    """Returns the comment of forgetting.hpp: a line for each policy, and one for each setting."""
    text = ""
    for info in POLICIES:
        text += f"//   {info.policy.__name__}: {info.summary}\n"
        for setting in info.settings:
            text += f"//     {setting.member} {setting.range}{unit(setting)}, default "
            text += f"{setting.default:g}: {setting.meaning}\n"
    return text


def stub_classes() -> str:
    """Returns the classes of the policies as the stub of the compiled module has them."""
    union = " | ".join(CLASSES)
    text = f"\nForgetting: TypeAlias = {union}\n"
    if len(text) > 102:  # as the formatter breaks lines of more than 100 characters
        lines = union if len(union) <= 96 else "\n    | ".join(CLASSES)
        text = f"\nForgetting: TypeAlias = (\n    {lines}\n)\n"
    for info in POLICIES:
        text += f"\nclass {info.policy.__name__}:\n    info: ClassVar[PolicyInfo]\n"
        text += "    def __init__(\n        self,\n"
        for setting in info.settings:
            text += f"        {setting.name}: float = {setting.default},\n"
        text += "    ) -> None: ...\n"
        for setting in info.settings:
            text += f"    @property\n    def {setting.name}(self) -> float: ...\n"
        text += "    @property\n    def forgets_the_start(self) -> bool: ...\n"
    return text + "\n"


def table(*rows: tuple[str, ...]) -> str:
    """Returns a table in Markdown; the first row is its head."""
    lines = [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]]) + "\n"


def unit(setting: ehsid.PolicySetting) -> str:
    """Returns the unit of a setting with a space before it; nothing for a pure number."""
    return "" if setting.unit == "1" else f" {setting.unit}"


def policy_table() -> str:
    """Returns the table of the policies."""
    rows = []
    for info in POLICIES:
        settings = "; ".join(
            f"`{setting.name}` {setting.range}{unit(setting)}, default {setting.default:g}: "
            f"{setting.meaning}"
            for setting in info.settings
        )
        rows.append((f"`{info.policy.__name__}`", info.source, info.summary, settings))
    return table(("policy", "source", "in short", "settings"), *rows)


def hil_table() -> str:
    """Returns the table of the policies' numbers and settings in the HIL protocol."""
    rows = []
    for info in POLICIES:
        places = ", ".join(f"{setting.hil_place} {setting.member}" for setting in info.settings)
        rows.append((str(info.number - 1), info.id, places))
    return table(("number", "policy", "place and setting"), *rows)


# File, name of the block in it, what stands in the block.
BLOCKS: list[tuple[str, str, Callable[[], str]]] = [
    ("cpp/include/ehsid/forgetting.hpp", "settings", header_list),
    ("cpp/include/ehsid/c_api.h", "policies", c_list),
    ("cpp/include/ehsid/c_api.h", "settings", c_members),
    ("python/ehsid/_core.pyi", "policies", stub_classes),
    ("docs/estimator.md", "policies", policy_table),
    ("docs/hil_protocol.md", "policies", hil_table),
]


def with_block(text: str, name: str, content: str) -> str:
    """Returns a text with new content between the lines that begin and end the block."""
    first = rf"^[^\n]*\b{name}: written by script/policies\.py[^\n]*\n"
    last = rf"^[^\n]*\bend of {name}\b"
    pattern = rf"(?ms)({first}).*?({last})"
    made, count = re.subn(pattern, lambda block: block[1] + content + block[2], text)
    if count != 1:
        raise ValueError(f"{count} blocks named {name}; expected 1")
    return made


def files() -> dict[str, str]:
    """Returns the complete text of each file, by its path below the root of the project."""
    texts = {path: (ROOT / path).read_text(encoding="utf-8") for path, _, _ in BLOCKS}
    for path, name, content in BLOCKS:
        texts[path] = with_block(texts[path], name, content())
    return texts


if __name__ == "__main__":
    for path, text in files().items():
        (ROOT / path).write_text(text, encoding="utf-8", newline="\n")
