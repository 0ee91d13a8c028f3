# SPDX-License-Identifier: MIT
"""Beside which effects the laws of a cause outside of the catalogue are looked for."""

from __future__ import annotations

import dataclasses
from typing import Any, cast

import pytest
from made_candidates import CASE, FLOOR, candidate, chosen, search_result

from ehsid.harness.diagnosis import diagnosis
from ehsid.harness.diagnosis.decision.effect_selection import Selection
from ehsid.harness.diagnosis.job import Pace
from ehsid.harness.diagnosis.search.search import SearchResult

# Errors of a hundred noise floors that the best set leaves: the cause is outside.
LEFT = 100.0 * FLOOR


@pytest.mark.parametrize(
    ("alone", "begins"), [(4.0, ("coulomb_friction", "transport_delay")), (1.01, ())]
)
def test_laws_are_sought_beside_the_best_set_although_it_has_no_name(
    alone: float, begins: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A set that leaves much has no name beside a cause outside; the law may be a part of it.

    alone: errors of the rig without effects over those of the set.
    """
    found = search_result(
        candidate(rms=alone * LEFT), candidate("coulomb_friction", "transport_delay", rms=LEFT)
    )
    selection = chosen(found)
    assert selection.answer.kind == "outside"
    selection = dataclasses.replace(selection, best=found.calibrated)
    assert asked_beside(found, selection, monkeypatch) == [begins]


@pytest.mark.parametrize("linkage", [True, False])
def test_where_a_set_is_named_laws_are_sought_only_if_a_linkage_shows(
    linkage: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = search_result(candidate(rms=LEFT), candidate("transport_delay", rms=FLOOR))
    selection = chosen(found)
    assert selection.answer.kind == "effects"
    monkeypatch.setattr(diagnosis, "shows_linkage", lambda *_: linkage)
    begins = [("transport_delay",)] if linkage else []
    assert asked_beside(found, selection, monkeypatch) == begins


def asked_beside(
    found: SearchResult, selection: Selection, monkeypatch: pytest.MonkeyPatch
) -> list[tuple[str, ...]]:
    """The effects beside which laws were sought; none is found."""
    asked = []
    monkeypatch.setattr(
        diagnosis, "missing_laws", lambda _case, _calibrated, ahead, *_: asked.append(ahead.effects)
    )
    evaluation = diagnosis._Evaluation(
        CASE, found, selection, (), *cast(Any, (None, {}, {}, (), None))
    )
    looked = diagnosis._with_missing_laws(
        evaluation, (), (), Pace(None, may_be_joint=False), cast(Any, lambda *_, **__: None)
    )
    assert looked is evaluation
    return asked
