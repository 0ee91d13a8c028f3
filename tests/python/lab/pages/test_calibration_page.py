# SPDX-License-Identifier: MIT
"""The page of a calibration says what its figures say."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from made_machines import made_calibration

from ehsid.harness.show.page import Table
from ehsid.lab.calibration.checking import Calibration
from ehsid.lab.pages.calibration_page import (
    calibration_lead,
    calibration_page,
    constants_table,
    families_table,
    intervals_table,
    sets_table,
)

pytestmark = pytest.mark.slow


@pytest.fixture
def found(made_once: Any) -> Any:
    return made_once("calibration", made_calibration)


@pytest.mark.thorough
def test_constants_far_from_the_fitted_ones_are_marked_and_said(found: Calibration) -> None:
    near, far = (
        replace(found.constants[0], deviation=1.9),
        replace(found.constants[1], deviation=-2.1),
    )
    table = constants_table([near, far])
    assert list(table.marked) == [1]
    assert table.rows[1][0] == "LEAST_LEFT"
    lead = " ".join(calibration_lead(replace(found, constants=(near, far))))
    assert "from their fitted values are the constants in use: LEAST_LEFT." in lead
    calm = " ".join(calibration_lead(replace(found, constants=(near,))))
    assert "from their fitted values" not in calm


@pytest.mark.thorough
def test_the_lead_begins_with_the_worst_family_and_ends_with_the_limit(found: Calibration) -> None:
    first, *_, last = calibration_lead(found)
    worst = found.families[0]
    assert f"{worst.trait}: {worst.family}" in first
    assert "and for no others" in last
    assert "No family" in calibration_lead(replace(found, families=()))[0]


def test_truths_that_were_never_weighed_are_said(found: Calibration) -> None:
    assert found.never_weighed == 1
    assert any("In 1 machine with known effects" in one for one in calibration_lead(found))
    whole = calibration_lead(replace(found, never_weighed=0))
    assert not any("not among the weighed" in one for one in whole)


def test_what_is_missed_is_marked(found: Calibration) -> None:
    missed = replace(found.sets[0].coverage, value=0.5, low=0.4, high=0.6)
    sets = (found.sets[1], replace(found.sets[0], coverage=missed))
    assert 1 in sets_table(sets).marked
    families = (replace(found.families[0], coverage=missed), *found.families[1:])
    assert 0 in families_table(families).marked
    of_sizes = found.intervals[0].each[0]
    held = replace(of_sizes.in_use, value=0.9, low=0.86, high=0.94)
    not_held = replace(of_sizes.in_use, value=0.5, low=0.4, high=0.6)
    both = replace(
        found.intervals[0],
        each=(replace(of_sizes, in_use=held), replace(of_sizes, in_use=not_held)),
    )
    assert list(intervals_table([both]).marked) == [1]


def test_a_class_with_too_few_machines_says_so(found: Calibration) -> None:
    few = replace(found.sets[0], threshold=float("inf"))
    assert sets_table([few]).rows[0][-1] == "too few machines"


def test_the_page_begins_with_the_families_and_counts_all_cases(found: Calibration) -> None:
    page = calibration_page(found)
    assert page.sections[0].title == "Families that were left out"
    (machines,) = (block for block in page.sections[-1].blocks if isinstance(block, Table))
    counts = {row[1]: int(str(row[2])) for row in machines.rows if row[0] != "left out"}
    assert sum(counts.values()) == 2 * found.machines  # by kind and by sensors
    assert ("left out", "insufficient data", "4") in machines.rows
