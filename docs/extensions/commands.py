# SPDX-License-Identifier: MIT
"""Directive `commands`: every command of `ehsid` with its options and examples, from the code.

    ```{commands}
    ```

The texts are those of `ehsid COMMAND --help`, so that the page and the help cannot differ.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from plain_text import as_markdown
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from typer.main import get_command

from ehsid.harness.cli import VERBS, cli

TYPES = {"<int range>": "<int>", "<float range>": "<float>", "<list[str]>": "<str>"}


class Commands(SphinxDirective):
    """Lists the options of `ehsid`, then its commands in the order of `ehsid --help`."""

    def run(self) -> list[nodes.Node]:
        """Returns the sections of all commands."""
        lines = section_of("ehsid", get_command(cli))
        for verb in VERBS:
            lines += section_of(f"ehsid {verb.name}", verb.load())
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def section_of(called: str, command: Any) -> list[str]:
    """Returns the section of one command as MyST."""
    context = command.make_context(called, [], resilient_parsing=True)
    records = [parameter.get_help_record(context) for parameter in command.params]
    described = [(shown_name(names), words) for names, words in records if names != "--help"]
    text, examples = told_apart(command.help)
    return [
        f"({label_of(called)})=",
        f"## `{called}`",
        "",
        *as_markdown(text),
        "",
        *code([synopsis(called, described)]),
        *(["For example:", "", *code(examples)] if examples else []),
        f":::{{program}} {called}\n:::",
        *(line for names, words in described for line in option(names, words)),
        "",
    ]


def label_of(called: str) -> str:
    """Returns the label of the section of a command, e.g. command-rig-new."""
    return "command-" + (called.removeprefix("ehsid ").replace(" ", "-"))


def shown_name(names: str) -> str:
    """Returns the names and the value of an option, or the name of an argument, for the page."""
    for given, shown in TYPES.items():
        names = names.replace(given, shown)
    if not names.startswith("-"):
        names = names.split(" <")[0]
    return names.replace(" / ", ", ")


def synopsis(called: str, described: list[tuple[str, str]]) -> str:
    """Returns how the command is called, with all that it must have."""
    if called == "ehsid":
        return "ehsid [OPTIONS] COMMAND ..."
    needed = [names for names, words in described if "[required]" in words]
    return " ".join((called, *needed, "[OPTIONS]"))


def told_apart(words: str) -> tuple[str, list[str]]:
    """Returns the description in the help of a command, and the examples behind it."""
    described, *rest = re.split(r"\n*\bExamples?:\s+", words.replace("\\[", "["), maxsplit=1)
    examples = re.split(r"\n+(?:Examples?:\s+)?(?=ehsid )", rest[0]) if rest else []
    return described, [re.sub(r"(?<!\\)\n", " ", example) for example in examples]


def option(names: str, words: str) -> list[str]:
    """Returns an option as MyST: what it means, then in a line what holds for its value."""
    meaning, _, limits = words.replace("\\[", "[").rpartition("  [")
    if not meaning:
        meaning, limits = limits, ""
    meaning = meaning[:1].upper() + meaning[1:]
    end = "" if meaning.endswith((".", ":")) else "."
    values = [f"*{as_markdown(limits.removesuffix(']'))[0]}*"] if limits else []
    return [f":::{{option}} {names}", *as_markdown(meaning + end), "", *values, ":::"]


def code(lines: list[str]) -> list[str]:
    """Returns lines that a user types as a block of code."""
    return ["```console", *(f"$ {line}" for line in lines), "```", ""]


def setup(app: Sphinx) -> dict[str, bool]:
    """Adds the directive."""
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
