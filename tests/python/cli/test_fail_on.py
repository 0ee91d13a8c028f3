# SPDX-License-Identifier: MIT
"""--fail-on ends a command with exit code 3, after its results are written."""

from __future__ import annotations

import typing

import pytest
import typer

from ehsid.harness.cli.gap import fail_if, failing_verdicts
from ehsid.harness.diagnosis.schema import Verdict


@pytest.mark.parametrize(
    ("text", "named"),
    [
        (None, set()),
        ("effects", {"effects"}),
        ("effects, ambiguous", {"effects", "ambiguous"}),
        ("no_gap", {"no_gap"}),
        ("any", set(typing.get_args(Verdict)) - {"no_gap"}),
        ("any,no_gap", set(typing.get_args(Verdict))),
    ],
)
def test_verdicts_are_named_with_commas(text: str | None, named: set[str]) -> None:
    assert failing_verdicts(text) == named


@pytest.mark.parametrize("text", ["", "effects,", "efects"])
def test_a_word_that_is_no_verdict_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"--fail-on '.*': expected verdicts") as refused:
        failing_verdicts(text)
    assert ("did you mean 'effects'?" in str(refused.value)) == (text == "efects")


def test_what_was_found_is_named_on_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    fail_if([], "this verdict")
    with pytest.raises(typer.Exit) as stopped:
        fail_if(["press1: effects", "saw: ambiguous"], "the results of these machines")
    assert stopped.value.exit_code == 3
    assert capsys.readouterr().err == (
        "ehsid: the exit code is 3, because --fail-on names the results of these machines: press1: "
        "effects; saw: ambiguous\n"
    )
