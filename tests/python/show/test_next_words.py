# SPDX-License-Identifier: MIT
"""Each verdict says what to do now, and an experiment how it is run."""

from __future__ import annotations

import shlex
from typing import get_args

import pytest

from ehsid.harness.diagnosis.schema import Verdict
from ehsid.harness.show.verdict_words import VERDICTS, what_now
from ehsid.harness.show.which_section import (
    again_command,
    experiment_steps,
    experiment_words,
)


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_every_verdict_has_advice_and_names_the_experiment_only_where_there_is_one(
    verdict: Verdict,
) -> None:
    assert set(VERDICTS) == set(get_args(Verdict))
    assert what_now(verdict, experiment=False).endswith(".")
    assert "experiment below" not in what_now(verdict, experiment=False)
    assert "experiment below" in what_now(verdict, experiment=True)


def test_an_undecided_diagnosis_without_an_experiment_asks_for_a_sensor() -> None:
    assert "one more sensor" in what_now("ambiguous", experiment=False)


def test_an_experiment_says_what_it_separates_and_how_surely() -> None:
    words = experiment_words("slow triangle", ["coulomb_friction", "no effect"], 0.934)
    assert words.startswith("Slow triangle. ")
    assert "Coulomb friction from no effect" in words
    assert "93" in words


def test_the_steps_name_the_columns_in_words() -> None:
    send, log = experiment_steps(["command_v", "pressure_a_pa"])
    assert "emergency stop" in send
    assert "pressure A" in log
    assert "pressure_a_pa" not in log


def test_the_command_holds_out_what_was_held_out() -> None:
    words = shlex.split(again_command(["a b.csv"], ["c.csv"], "rig.toml"))
    assert words[2:4] == ["a b.csv", "new.csv"]
    assert words[words.index("--validate") + 1] == "c.csv"
