# SPDX-License-Identifier: MIT
"""Tells what is known while a diagnosis is at work."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from types import MappingProxyType

import numpy as np

from .deciding import WORSE_HELD_OUT
from .decision import results
from .decision.evidence import left
from .model.case import Case
from .pace import Known, Pace
from .result import Interim, Stage
from .search.candidates import FittedCandidate
from .search.gap_reduction import mean_gap
from .search.likelihood_gain import above_floor
from .search.search import Look

Watch = Callable[[Interim], None]
Begun = Callable[[Stage], None]
LOGGER = logging.getLogger("ehsid")

STAGES: MappingProxyType[Stage, str] = MappingProxyType(
    {
        "values": "fitting the values of the rig",
        "alone": "trying each effect alone, briefly",
        "at length": "fitting the best effects at length",
        "together": "trying effects together",
        "deciding": "weighing the explanations",
        "laws": "looking for laws that the catalogue lacks",
        "where": "telling where the gap lies",
        "experiment": "designing the experiment that separates the explanations",
    }
)


def look_for(watch: Watch | None, begun: Begun | None, pace: Pace, case: Case) -> Look:
    """Returns what is called at the begin of each stage.

    It sets the pace, tells `begun` the stage, and tells `watch` what is known.
    """

    def look(
        stage: Stage,
        nominal: FittedCandidate,
        calibrated: FittedCandidate,
        fitted: Sequence[FittedCandidate],
        /,
        *,
        tasks: int = 0,
    ) -> None:
        LOGGER.info("%s", STAGES[stage])
        if begun is not None:
            begun(stage)
        ahead = fitted[0]
        apart = left(case, ahead, "held out") - left(case, ahead, "fitted")
        known = Known(
            above_floor(case, calibrated), above_floor(case, ahead), apart > WORSE_HELD_OUT, tasks
        )
        pace.begin(stage, known)
        if watch is None:
            return
        runs, how_far = results.held_out_results(case, nominal, calibrated, ahead)
        gaps: dict[tuple[str, ...], float] = {}
        for candidate in fitted:
            gap = mean_gap(candidate.sums)
            if candidate.effects and np.isfinite(gap):
                gaps[candidate.effects] = min(gap, gaps.get(candidate.effects, gap))
        sets = sorted(gaps.items(), key=lambda one: one[1])
        watch(Interim(stage, runs, how_far, ahead.effects, tuple(sets)))

    return look
