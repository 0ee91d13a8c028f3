# SPDX-License-Identifier: MIT
"""What a diagnosis at work knows, written and read again."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from msgspec.structs import replace as replace_part

from ehsid.harness.diagnosis.result import HeldOutRun, Interim
from ehsid.harness.diagnosis.schema import HowFar, Value
from ehsid.workbench.downsampling import opened
from ehsid.workbench.so_far import (
    ERROR,
    FILE,
    FOLDER,
    FOUND,
    forget,
    found_runs,
    keep,
    keep_found,
    key,
    latest,
)

WINDOW = np.array([-1, 0, 0, 1])
RUN = HeldOutRun(
    "judge",
    0.1 * np.arange(4.0),
    WINDOW,
    np.zeros(4),
    {"position_m": np.array([1.0, 2.0, 3.0, 4.0])},
    {"position_m": np.array([0.0, 0.0, 0.0, 0.0])},
    {"position_m": np.array([9.0, 2.5, 3.5, 4.5])},
    {"position_m": np.array([9.0, 2.1, 3.1, 4.1])},
)
FAR = HowFar(0.5, 0.2, 0.1, (0.01, 0.02), Value.of(None), Value(0.8, (0.7, 0.9)), {})
INTERIM = Interim(
    "together", (RUN,), FAR, ("load_spring",), tuple(((str(i),), 0.1 * i) for i in range(1, 9))
)


def test_what_is_kept_is_read_again(tmp_path: Path) -> None:
    keep(tmp_path, INTERIM, ["values", "alone"])
    found = latest(tmp_path)
    assert found is not None
    folder, known = found
    assert (known.stage, known.past, known.ahead) == (
        "together",
        ["values", "alone"],
        ["load_spring"],
    )
    assert (known.nominal, known.calibrated, known.augmented, known.floor) == (0.5, 0.2, 0.1, 0.02)
    assert [ids for ids, _ in known.sets] == [["1"], ["2"], ["3"], ["4"], ["5"], ["6"]]
    assert [(run.record, run.outputs) for run in known.runs] == [("judge", ["position_m"])]
    measured, error = (
        opened(folder, key(0, 0, kind)).values for kind in ("measured", "calibrated" + ERROR)
    )
    np.testing.assert_array_equal(measured, RUN.measured["position_m"])
    # Outside of windows nothing is simulated.
    np.testing.assert_array_equal(error, [np.nan, 0.5, 0.5, 0.5])


def test_the_last_stage_that_is_whole_counts(tmp_path: Path) -> None:
    keep(tmp_path, replace(INTERIM, stage="alone"), ["values"])
    keep(tmp_path, INTERIM, ["values", "alone"])
    (tmp_path / FOLDER / "02" / FILE).unlink()  # as while it is being written
    found = latest(tmp_path)
    assert found is not None
    assert found[1].stage == "alone"
    forget(tmp_path)
    assert latest(tmp_path) is None


def test_signals_of_a_diagnosis_take_the_place_of_earlier_ones(tmp_path: Path) -> None:
    assert found_runs(tmp_path) == []
    keep_found(tmp_path, [RUN, replace(RUN, record="second")])
    keep_found(tmp_path, [replace(RUN, record="later")])
    assert [(run.record, run.outputs) for run in found_runs(tmp_path)] == [
        ("later", ["position_m"])
    ]
    kept = opened(tmp_path / FOUND, key(0, 0, "nominal")).values
    np.testing.assert_array_equal(kept, [np.nan, 0.0, 0.0, 0.0])
    assert not (tmp_path / FOUND / "1_time.npy").exists()


def test_a_simulation_that_diverges_has_no_gap(tmp_path: Path) -> None:
    keep(tmp_path, replace(INTERIM, how_far=replace_part(FAR, nominal=math.inf)), [])
    found = latest(tmp_path)
    assert found is not None
    assert found[1].nominal is None
    assert found[1].calibrated == 0.2
