# SPDX-License-Identifier: MIT
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex

from ehsid.harness.diagnosis.result import HeldOutRun
from ehsid.harness.diagnosis.schema import Gaps, HowFar, Value
from ehsid.harness.show.gap_words import SIMULATIONS
from ehsid.harness.show.plotting import ROLES
from ehsid.harness.show.record_figure import gap_picture, run_figure

NOTHING = Value.of(None)


def run_with_a_gap(at_s: float) -> HeldOutRun:
    """20 s in windows of 0.5 s; as configured the pressure is off from `at_s` on for 2 s."""
    time = 0.01 * np.arange(2000)
    still = {"position_m": np.zeros(2000), "pressure_a_pa": np.zeros(2000)}
    off = {**still, "pressure_a_pa": 1e5 * ((time >= at_s) & (time < at_s + 2.0))}
    return HeldOutRun("run", time, np.arange(2000) // 50, time, still, off, still, still)


def gaps(position: float, pressure: float) -> HowFar:
    """The simulator as configured has these gaps, and all others have none."""
    own = {
        "position_m": Gaps(position, 0.0, 0.0),
        "pressure_a_pa": Gaps(pressure, 0.0, 0.0),
    }
    return HowFar(0.2, 0.0, 0.0, (0.0, 0.0), NOTHING, NOTHING, own)


def test_a_diagnosis_begins_with_the_stretch_in_which_its_gap_shows() -> None:
    runs = [run_with_a_gap(30.0), run_with_a_gap(13.0)]
    (picture,) = gap_picture(runs, gaps(0.1, 0.3), SIMULATIONS)
    caption = picture.caption.replace("\N{NO-BREAK SPACE}", " ")
    assert "its gap is 30 % before and 0 % after, and that of all outputs 20 % and 0 %" in caption
    signals, _ = picture.figure.axes  # of one output, and its errors
    assert "pressure A" in signals.get_ylabel()
    assert signals.get_xlim() == pytest.approx((13.0, 15.0), abs=0.02)


def test_the_output_is_the_one_whose_gap_shrinks_most() -> None:
    (picture,) = gap_picture([run_with_a_gap(3.0)], gaps(0.4, 0.3), SIMULATIONS)
    assert "position" in picture.figure.axes[0].get_ylabel()


def test_a_stretch_does_not_reach_over_what_is_not_compared() -> None:
    run = run_with_a_gap(13.0)
    alone = replace(run, window=np.where(np.abs(run.time_s - 14.25) < 0.25, 0, -1))
    (picture,) = gap_picture([alone], gaps(0.1, 0.3), SIMULATIONS)
    assert picture.figure.axes[0].get_xlim()[0] == pytest.approx(14.0, abs=0.02)


def test_nothing_is_shown_where_nothing_was_simulated() -> None:
    assert gap_picture([], gaps(0.1, 0.3), SIMULATIONS) == []
    assert gap_picture([run_with_a_gap(3.0)], None, SIMULATIONS) == []


def test_each_simulation_has_the_colour_of_its_role() -> None:
    upper = run_figure(run_with_a_gap(3.0)).axes[0]
    labels = {"measured": "measured", **SIMULATIONS}
    drawn = {str(line.get_label()): to_hex(line.get_color()) for line in upper.lines}
    assert drawn == {label: ROLES["light"][role] for role, label in labels.items()}
