# SPDX-License-Identifier: MIT
"""Beside which effects the laws of a cause outside of the catalogue are looked for."""

from __future__ import annotations

import dataclasses
from typing import Any, cast

import pytest
from made_candidates import CASE, FLOOR, candidate, chosen, search_result

from ehsid.harness.diagnosis import diagnosis
from ehsid.harness.diagnosis.job import Pace

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
    assert asked == [begins]
