# SPDX-License-Identifier: MIT
"""benchmarks/gap_literature.py and gap_naming.py: what their figures rest on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_checks import made_answers, perfect, write_check
from sources import ROOT


@pytest.fixture(autouse=True)
def _benchmarks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))


def test_both_definitions_of_a_characteristic_are_one() -> None:
    import gap_literature as literature

    machine = literature.machine_of(3, literature.VALVE)
    even = {f"gain_{edge}": 1.0 for edge in ("pa", "at", "pb", "bt")}
    laps = {f"overlap_{edge}": 0.04 for edge in ("pa", "at", "pb", "bt")}
    drop = literature.VALUES["valve.rated_pressure_drop_pa"]
    width = 0.02
    true = literature.true_curve(machine._replace(**even, **laps, round_width=width))
    ours = literature.our_curve(
        {
            "effects.valve_dead_band.overlap": 0.04,
            "effects.valve_flow_saturation.limit": 0.7,
            "effects.valve_null_bias.offset": 0.02,
            "nuisance.edge_rounding": 0.5 * width,
            "nuisance.edge_closing": 1.0,
            "valve.rated_flow_m3_s": machine.flow_gain * drop**machine.flow_exponent,
        }
    )
    # The generator's edges open as ours do that close where their rounding ends.
    np.testing.assert_allclose(ours, true, rtol=0.0, atol=1e-12 * np.abs(true).max())
    # The null bias makes the curve uneven, which a wrong sign of a direction would hide.
    assert ours.max() > -ours.min() * 1.01


def test_leaks_are_counted_by_their_name_and_by_any_cause() -> None:
    from gap_literature import seen_share

    rows = [
        {"verdict": "effects", "sets": [["internal_leakage", "load_force"]]},
        {"verdict": "ambiguous", "sets": [["internal_leakage"], ["external_leakage"]]},
        {"verdict": "no_gap", "sets": []},
    ]
    assert seen_share(rows) == "a cause in 2 of 3, the leak by its name in 1"


def test_figures_of_a_competition(tmp_path: Path) -> None:
    from gap_literature import competition

    answers = made_answers(60)
    found = competition(write_check(tmp_path, answers, perfect))
    faults = [answer["kind"] in ("one", "two", "open") for answer in answers.values()]
    assert found["detected"] == [True] * sum(faults)
    assert found["false"] == [False] * (len(faults) - sum(faults))


def test_the_bound_is_that_of_two_signals_in_white_noise() -> None:
    from gap_naming import bound

    rng, distance, draws = np.random.default_rng(1), 1.8, 40_000
    noise = rng.standard_normal((draws, 3))
    signal = distance * np.array([0.6, 0.0, 0.8])
    wrong = float(np.mean(np.sum((noise + signal) ** 2, axis=1) < np.sum(noise**2, axis=1)))
    # 4 deviations of a share of 0.18 of 40,000 draws are 0.008.
    assert float(bound(np.array(0.5 * distance**2))) == pytest.approx(wrong, abs=0.008)


@pytest.mark.parametrize(
    ("scores", "expected"),
    [
        ((9.0, 0.0, 0.0), "right"),
        ((0.0, 9.0, 0.0), "wrong"),
        ((5.0, 5.0, 0.0), "set"),
        ((0.0, 0.0, 5.0), "none"),
    ],
)
def test_the_answer_loses_least(scores: tuple[float, float, float], expected: str) -> None:
    from gap_naming import answer

    assert answer(*scores) == expected


def test_whitened_noise_has_variance_one() -> None:
    from dataclasses import replace

    from gap_naming import PAIRS, White
    from gap_visible import record_of

    from ehsid.harness.diagnosis.model.case import make_case

    setting = PAIRS[0].setting
    rig, record = setting.rig(), record_of(setting, 1, {})
    case = make_case(rig, [record])
    problem = replace(case, training=case.records, blocks=False).problem()
    white, rng = White(problem, rig), np.random.default_rng(2)
    outputs = problem.records[0].outputs
    noisy = {
        name: outputs[name] + white.deviation[name] * rng.standard_normal(outputs[name].size)
        for name in problem.outputs
    }
    found = white(problem.coefficients_of([noisy]))
    # The mean square of N normal numbers has the deviation sqrt(2 / N), that of products 1 / N.
    assert np.mean(found**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / found.size))
    assert abs(np.mean(found[1:] * found[:-1])) < 4.0 / np.sqrt(found.size)


def test_shares_of_a_pair_are_those_of_both_causes() -> None:
    from gap_naming import SHARES, averaged

    points = [
        {"true": true, "D": distance, **dict.fromkeys(SHARES, 0.5), "exact": wrong}
        for true, distance, wrong in (
            ("a", 4.0, 0.0),
            ("a", 1.0, 0.4),
            ("b", 1.0, 0.2),
            ("b", 4.0, 0.0),
        )
    ]
    found = averaged(points, np.array([1.0, 2.0, 4.0]))
    assert found["exact"].tolist() == pytest.approx([0.3, 0.15, 0.0])
