# SPDX-License-Identifier: MIT
"""Cases of the grade "wide": ranges of what is drawn, commands with rests, families."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reality_runs import drawn_case

from ehsid.lab.blind.making import ANSWERS, Settings, make_check, read_answers
from ehsid.lab.reality import make_case
from ehsid.lab.reality.batch import draw_sampling_time
from ehsid.lab.reality.excitation import (
    EXCITATION_SETS,
    EXCITATIONS,
    MOVEMENTS,
    TRAVEL,
    draw_excitations,
    draw_movement,
    draw_task,
    weak_loop,
)
from ehsid.lab.reality.noise import draw_logger
from ehsid.lab.reality.nominal_rig import LAG, draw_wide_rig
from ehsid.lab.reality.variants import draw_structure, draw_variants

SHORT: dict[str, Any] = {"seconds": 1.0}
SEEDS = st.integers(0, 2**32)
FAMILIES = {
    "rods": {"single", "double"},
    "flow law": {"square root", "exponent to 0.525", "exponent to 0.54"},
    "seals": {"LuGre", "Dahl", "Bouc-Wen"},
    "supply": {"accumulator", "relief valve"},
    "edges": {"even", "uneven", "unequal ends"},
    "hysteresis": {"none", "play", "Prandtl-Ishlinskii"},
    "noise": {"nearly white", "coloured"},
    "timing": {"late by 0.5 %", "late by 2 %"},
    "air": {"below 100 ppm", "from 100 ppm on"},
    "clock": {"to 1 ms", "1 to 5 ms", "above 5 ms"},
    "bore": {"to 40 mm", "40 to 80 mm", "above 80 mm"},
}


# Sums of the positions, m, and last commands, V, of 0.5 s, as they were before there was the grade
# "wide". The command is a whole number of steps of the converter, so it is exact.
BEFORE: tuple[tuple[str, str, int, float, float], ...] = (
    ("plain", "one", 1, 88.07780299999999, -0.28564453125),
    ("hard", "two", 2, 184.58703, -0.2484130859375),
    ("hard", "open", 3, 59.89429, 0.65521240234375),
    ("confusable", "none", 4, 172.058742, 0.97015380859375),
    ("slow", "params", 5, 38.388012, -4.161376953125),
)


@pytest.mark.slow
@pytest.mark.parametrize(("grade", "kind", "seed", "positions", "command"), BEFORE)
def test_the_other_grades_are_as_before(
    grade: Any, kind: Any, seed: int, positions: float, command: float
) -> None:
    case = make_case(seed, grade, kind, seconds=0.5, sensors="position")
    assert float(case.validate["position_m"].sum()) == pytest.approx(positions, rel=1e-9)
    assert float(case.validate["command_v"][-1]) == pytest.approx(command, rel=1e-9)


@given(seed=SEEDS)
def test_rigs_are_those_of_servo_drives(seed: int) -> None:
    rig = draw_wide_rig(np.random.default_rng(seed))
    v = rig.values
    cap = math.pi / 4.0 * v["cylinder.bore_m"] ** 2
    annulus = cap - math.pi / 4.0 * v["cylinder.rod_m"] ** 2
    mid = 0.5 * v["cylinder.stroke_m"]
    stiffness = v["fluid.bulk_modulus_pa"] * (
        cap**2 / (v["cylinder.dead_volume_a_m3"] + cap * mid)
        + annulus**2 / (v["cylinder.dead_volume_b_m3"] + annulus * mid)
    )
    natural = math.sqrt(stiffness / v["load.mass_kg"])
    figures = {
        "bore": (v["cylinder.bore_m"], 0.02, 0.1),
        "stroke": (v["cylinder.stroke_m"], 0.08, 1.0),
        "ratio": (annulus / cap, 0.45, 1.0),
        "pressure": (v["supply.pressure_pa"], 7e6, 28e6),
        "frequency": (natural / (2.0 * math.pi), 15.0, 150.0),
        "damping": (
            0.5 * v["load.viscous_friction_n_s_m"] / v["load.mass_kg"] / natural,
            0.01,
            0.3,
        ),
        "flow": (v["valve.rated_flow_m3_s"] * 60e3, 5.0, 250.0),
        "strokes a second": (rig.speed_m_s / rig.stroke_m, 0.3, 4.0),
        "lag": (v.get(LAG[0], 50.0), 50.0, 140.0),
    }
    for name, (value, low, high) in figures.items():
        # Rounding of the rod to 0.1 mm changes the annulus of the least bore, 20 mm, by 0.8 %.
        assert 0.99 * low <= value <= 1.01 * high, name
    assert v["valve.rated_command_v"] in (5.0, 10.0)
    assert v["valve.rated_pressure_drop_pa"] in (0.5e6, 3.5e6, 7e6)


def test_a_quarter_of_the_rods_is_double_and_half_of_the_lags_is_stated() -> None:
    rigs = [draw_wide_rig(np.random.default_rng(seed)).values for seed in range(400)]
    double = np.mean([rig["cylinder.rod_m"] == 0.0 for rig in rigs])
    stated = np.mean([LAG[0] in rig for rig in rigs])
    # The standard error of a share of 0.5 of 400 is 0.025; the tolerance is four of them. Double
    # rods are drawn again more often, as they need a larger valve.
    assert 0.15 <= double <= 0.35
    assert 0.4 <= stated <= 0.6


@given(seed=SEEDS, dt_s=st.sampled_from((5e-4, 1e-3, 2e-3, 4e-3)))
def test_loggers_are_late_by_two_per_cent_at_most(seed: int, dt_s: float) -> None:
    rng = np.random.default_rng(seed)
    rig = draw_wide_rig(rng)
    logger = draw_logger(rng, rig, dt_s)
    share = logger.largest_late_s / dt_s
    assert 0.001 <= share <= 0.005 or 0.01 <= share <= 0.02
    # Steps stay below the noise, whose least deviation is 1.2e-5 of the stroke, or the resolution
    # would be an effect; the error of a step is its size over sqrt(12).
    assert logger.position_step_m / math.sqrt(12.0) < 0.5 * 1.2e-5 * rig.stroke_m
    assert logger.pressure_step_pa <= 1.25 * rig.values["supply.pressure_pa"] / 2**12
    assert 2.0**-15 <= logger.command_step <= 2.0**-11


@given(seed=SEEDS)
def test_structure_lies_between_plain_and_hard(seed: int) -> None:
    rig = draw_wide_rig(np.random.default_rng(seed))
    plain, between, hard = (
        draw_structure(np.random.default_rng(seed), rig, severity) for severity in (0.0, 0.4, 1.0)
    )
    for name, value in plain.items():
        low, high = sorted((value, hard[name]))
        assert low <= between[name] <= high, name
    assert between["bulk_slope"] == pytest.approx(
        plain["bulk_slope"] ** 0.6 * hard["bulk_slope"] ** 0.4
    )


@given(seed=SEEDS)
def test_variants_keep_the_size_of_an_effect(seed: int) -> None:
    variants = draw_variants(np.random.default_rng(seed))
    if any(variants.play_weights):
        widths, weights = np.array(variants.play_shares), np.array(variants.play_weights)
        assert weights.sum() == pytest.approx(1.0)
        assert weights @ widths == pytest.approx(1.0)
        assert 3 <= np.count_nonzero(weights) <= 5
        assert np.all(widths[weights > 0.0] > 0.0)
    assert abs(variants.lap_difference) <= 0.2
    assert 1.0 <= variants.dahl_exponent <= 2.0
    assert variants.relief_loss < 0.02


def test_shares_of_the_variants() -> None:
    drawn = [draw_variants(np.random.default_rng(seed)) for seed in range(1000)]
    shares = {
        "Dahl": (np.mean([one.seals == "Dahl" for one in drawn]), 0.25),
        "Bouc-Wen": (np.mean([one.seals == "Bouc-Wen" for one in drawn]), 0.25),
        "operator": (np.mean([one.play_weights[0] > 0.0 for one in drawn]), 0.5),
        "unequal ends": (np.mean([one.lap_difference != 0.0 for one in drawn]), 0.5),
        "relief valve": (np.mean([one.relief_flow > 0.0 for one in drawn]), 0.3),
    }
    for name, (share, expected) in shares.items():
        # Four standard errors of a share of 0.5 of 1000.
        assert share == pytest.approx(expected, abs=0.063), name


@given(
    seed=SEEDS,
    kind=st.sampled_from(MOVEMENTS),
    dt_s=st.sampled_from((5e-4, 4e-3)),
    size=st.floats(0.6, 1.0),
    crossing_s=st.floats(0.14, 1.9),
)
def test_movements_have_long_rests(
    seed: int, kind: Any, dt_s: float, size: float, crossing_s: float
) -> None:
    samples = round(9.0 / dt_s)
    speed = draw_movement(np.random.default_rng(seed), kind, samples, dt_s, size, crossing_s)
    assert speed.shape == (samples,)
    assert 0.0 < np.abs(speed).max() <= size
    rests = np.diff(np.flatnonzero(np.concatenate(([1.0], speed, [1.0])))) - 1
    # A stick's dead zone and the ends of the other movements add some samples to the rests.
    assert 0.1 * samples - 1 <= rests.sum() <= (0.6 if kind == "joystick" else 0.45) * samples
    # Six rests of 10 % of 9 s, of weights of 0.5 to 1.5: the longest is above their mean.
    assert rests.max() * dt_s >= 0.9 / 6.0 - 2.0 * dt_s


@given(
    seed=SEEDS,
    kind=st.sampled_from(EXCITATION_SETS["all"]),
    dt_s=st.sampled_from((1e-3, 4e-3)),
    is_open=st.booleans(),
)
def test_references_stay_within_the_travel(
    seed: int, kind: Any, dt_s: float, is_open: bool
) -> None:
    rng = np.random.default_rng(seed)
    rig = draw_wide_rig(rng)
    weak_rad_s = weak_loop(rig) if is_open else None
    task = draw_task(rng, rig, kind, round(5.0 / dt_s), dt_s, False, weak_rad_s)
    # The working point is 0.42 to 0.58 of the stroke.
    least = (0.42 - TRAVEL) * rig.stroke_m
    assert least - 1e-9 <= task.reference.min() <= task.reference.max()
    assert task.reference.max() <= rig.stroke_m - least + 1e-9
    if kind in MOVEMENTS:  # the other kinds lose their mean; the controller limits the command
        assert np.abs(task.forward).max() <= 1.0
    # The loop is slower than the decay of the oil spring, 2 zeta omega.
    assert 0.0 < task.gain * rig.speed_m_s <= 0.6 * rig.damping_1_s + 1e-9


@pytest.mark.parametrize("among", EXCITATION_SETS)
def test_excitations_are_two_of_their_set(among: Any) -> None:
    pairs = [draw_excitations(np.random.default_rng(seed), among) for seed in range(400)]
    assert all(first != second for first, second in pairs)
    assert {kind for pair in pairs for kind in pair} == set(EXCITATION_SETS[among])
    share = np.mean([kind in EXCITATIONS for pair in pairs for kind in pair])
    # Four standard errors of a share of 0.4 of 800.
    assert share == pytest.approx(0.4, abs=0.07)


def test_training_and_validation_share_no_kind() -> None:
    assert not set(EXCITATION_SETS["training"]) & set(EXCITATION_SETS["validation"])
    for among in ("training", "validation"):
        case = drawn_case(3, "wide", among=among)  # type: ignore[arg-type]
        used = {*case.answer["excitation"], case.answer["transfer_excitation"]}
        assert len(used) == 3
        assert used <= set(EXCITATION_SETS[among])  # type: ignore[index]


def test_wide_cases_of_other_machines_or_sets_of_other_grades_are_refused() -> None:
    with pytest.raises(ValueError, match="grade 'wide' has hydraulic servos only"):
        make_case(1, "wide", plant="axis", **SHORT)
    with pytest.raises(ValueError, match="--excitations training: only grade 'wide' has sets"):
        make_case(1, "hard", among="training", **SHORT)


def test_sampling_times() -> None:
    drawn = [draw_sampling_time(seed, "wide") for seed in range(400)]
    assert set(drawn) == {5e-4, 1e-3, 2e-3, 4e-3}
    # Each has 100 of 400; four standard errors are 35.
    assert min(drawn.count(dt_s) for dt_s in set(drawn)) >= 65


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_answers_name_the_families(seed: int) -> None:
    answer = drawn_case(seed, "wide", effects=["valve_hysteresis"]).answer
    families = dict(answer["families"])
    assert families.pop("excitation") == "+".join(sorted(answer["excitation"]))
    assert set(families) == set(FAMILIES)
    for trait, family in families.items():
        assert family in FAMILIES[trait]
    assert families["hysteresis"] != "none"
    assert 0.0 <= answer["severity"] <= 1.0


@pytest.mark.slow
def test_families_follow_the_machine() -> None:
    for seed in range(12):
        case = drawn_case(seed, "wide", "none")
        seals = case.answer["families"]["seals"]
        assert (case.truth.dahl_exponent > 0.0) == (seals == "Dahl")
        assert (case.truth.bouc_wen_power > 0.0) == (seals == "Bouc-Wen")
        relief = case.answer["families"]["supply"] == "relief valve"
        assert (case.truth.pump_flow_m3_s > 0.0) == relief
        assert case.truth == case.healthy


@pytest.mark.slow
def test_stribeck_friction_is_never_of_dahls_law() -> None:
    seals = set()
    for seed in range(12):
        case = drawn_case(seed, "wide", effects=["stribeck_friction"])
        assert case.truth.dahl_exponent == 0.0
        seals.add(case.answer["families"]["seals"])
    assert seals == {"LuGre", "Bouc-Wen"}


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.thorough) for seed in range(1, 4))]
)
def test_the_supply_droops_only_where_that_is_the_effect(seed: int) -> None:
    case = make_case(seed, "wide", effects=["load_force"], sensors="pressures+supply", seconds=4.0)
    for record in (case.train, case.validate):
        # 2 %, the hum of up to 0.4 %, and six deviations of the noise of 0.16 %.
        least = record["supply_pressure_pa"].min() / case.truth.source_pa
        assert least > 1.0 - 0.02 - 0.004 - 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    "among", ["training", pytest.param("validation", marks=pytest.mark.thorough)]
)
def test_a_check_takes_its_commands_from_one_set(tmp_path: Path, among: str) -> None:
    settings = Settings(count=2, grades=("wide",), seconds=2.0, excitations=among)
    make_check(tmp_path / "check", settings)
    answers = read_answers(tmp_path / "check" / ANSWERS)
    drawn = {kind for answer in answers.values() for kind in answer.excitation}
    assert drawn <= {*EXCITATION_SETS[among]}  # type: ignore[index]
    for answer in answers.values():
        assert answer.grade == "wide"
        assert answer.families["excitation"] == "+".join(sorted(answer.excitation))
