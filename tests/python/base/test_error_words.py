# SPDX-License-Identifier: MIT
"""Errors as messages: those of ehsid are about the input, those of libraries are faults."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import typer
from scipy.optimize import brentq

from ehsid.harness.base.error_words import error_words
from ehsid.harness.cli.console import set_verbosity
from ehsid.harness.cli.lazy import errors_as_messages
from ehsid.harness.records import make_record

LIBRARY: list[Callable[[], object]] = [
    lambda: np.linalg.cholesky(np.array([[-1.0]])),
    lambda: np.linalg.inv(np.zeros((2, 2))),
    lambda: np.linalg.inv(np.zeros(2)),
    lambda: np.pad(np.zeros(2), 1, mode="none"),  # type: ignore[call-overload]
    lambda: brentq(np.cos, 0.0, 1.0, maxiter=0),
    lambda: {}["key"],
]


@pytest.mark.parametrize("call", LIBRARY)
@pytest.mark.parametrize("verbose", [False, True])
def test_an_error_of_a_library_is_one_line_with_its_place(
    call: Callable[[], object], verbose: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    set_verbosity(verbose=verbose, quiet=False)
    try:
        with pytest.raises(typer.Exit) as ended, errors_as_messages():
            call()
    finally:
        set_verbosity(verbose=False, quiet=False)
    shown = capsys.readouterr().err
    assert ended.value.exit_code == 1
    assert ("Traceback" in shown) is verbose
    *_, line = shown.splitlines()
    assert line.startswith("ehsid: a fault of the program in ehsid.harness.cli.lazy")
    assert "please report it" in line


def test_an_error_of_ehsid_is_its_message() -> None:
    with pytest.raises(ValueError, match="time_s") as raised:
        make_record({"time_s": np.zeros(3), "command_v": np.zeros(3)}, name="one")
    assert error_words(raised.value) == str(raised.value)
