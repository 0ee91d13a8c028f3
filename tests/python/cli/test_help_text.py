# SPDX-License-Identifier: MIT
"""The help of every command fits a terminal, and its examples can be copied."""

from __future__ import annotations

import re
import shlex

import pytest
from typer.testing import CliRunner

from ehsid.harness.cli import GROUPS, VERBS, cli
from ehsid.harness.cli.lazy import Verb
from ehsid.harness.cli.usage import examples_text, help_text


def shown(*words: str) -> str:
    return CliRunner().invoke(cli, [*words, "--help"], env={"COLUMNS": "80"}).stdout


def examples_in(text: str) -> list[list[str]]:
    """The words of each example in a help."""
    below = text.partition("Example")[2].partition("\n")[2]
    lines = re.sub(r"\\ *\n", "", below).splitlines()
    lines = [" ".join(line.split()) for line in lines]
    return [shlex.split(line) for line in lines if line.startswith("ehsid ")]


@pytest.mark.parametrize(
    "words", [[], *([group] for group in GROUPS)], ids=lambda words: str(words)
)
def test_groups_have_examples_and_fit_80_columns(words: list[str]) -> None:
    text = shown(*words)
    assert max(map(len, text.splitlines())) <= 80
    assert len(examples_in(text)) == 2


@pytest.mark.slow
@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb.name)
def test_examples_are_of_the_command_with_options_that_it_has(verb: Verb) -> None:
    text = shown(*verb.name.split())
    assert max(map(len, text.splitlines())) <= 80
    parameters = verb.load().params
    options = {name for one in parameters for name in (*one.opts, *one.secondary_opts)}
    examples = examples_in(text)
    assert examples
    for example in examples:
        assert example[1 : 1 + len(verb.name.split())] == verb.name.split()
        assert {word for word in example if word.startswith("--")} <= options


def test_paragraphs_are_joined_and_examples_come_last() -> None:
    def function() -> None:
        """Do a thing.

        It has
        two lines.

        Examples: ehsid do --one 1
        --two 2

        ehsid do
        """

    assert help_text(function) == (
        "Do a thing.\n\nIt has two lines.\n\nExamples:\nehsid do --one 1 --two 2\nehsid do"
    )


def test_a_long_example_breaks_before_an_option() -> None:
    example = "ehsid do " + " ".join(f"--option-{k} value" for k in range(8))
    heading, *lines = examples_text([example]).split("\n")
    assert heading == "Example:"
    assert len(lines) > 1
    assert max(map(len, lines)) <= 78
    assert all(line.startswith("    --") for line in lines[1:])
    assert shlex.split("\n".join(lines).replace("\\\n", "")) == example.split()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--vresion"], "--vresion: there is no such option; did you mean --version?"),
        (["gap", "--exclude-efect", "x"], "did you mean --exclude-effect?"),
        (["estimate", "r.csv", "--forgetting", "constnt"], "did you mean 'constant'?"),
        (["gap-flet"], "did you mean 'gap-fleet'?"),
    ],
)
def test_misspelt_words_get_the_nearest(arguments: list[str], said: str) -> None:
    outcome = CliRunner().invoke(cli, arguments)
    assert outcome.exit_code == 2
    assert said in outcome.stderr


def test_version_has_a_short_name() -> None:
    assert CliRunner().invoke(cli, ["-V"]).stdout == CliRunner().invoke(cli, ["--version"]).stdout
