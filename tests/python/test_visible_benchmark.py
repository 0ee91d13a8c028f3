# SPDX-License-Identifier: MIT
"""benchmarks/gap_visible_blind.py: what counts as found."""

from __future__ import annotations

from dataclasses import replace

import pytest
from scored_cases import BAND, BIAS, case, findings
from sources import ROOT


@pytest.mark.parametrize(
    ("verdict", "sets", "effect", "found"),
    [
        ("effects", ((BIAS,),), BIAS, True),
        ("effects", ((BIAS,),), BAND, False),
        ("ambiguous", ((BIAS,), (BIAS, BAND)), BAND, True),
        ("outside_catalogue", ((BIAS,),), BIAS, False),  # named beside a cause outside
    ],
)
def test_an_effect_is_found_in_any_set_of_an_answer_from_the_catalogue(
    monkeypatch: pytest.MonkeyPatch,
    verdict: str,
    sets: tuple[tuple[str, ...], ...],
    effect: str,
    found: bool,
) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    from gap_visible_blind import Shown

    told = replace(findings(*sets[0], sets=sets), verdict=verdict)
    assert Shown(case(told, BIAS, BAND, kind="two"), effect, 1.0).found == found
