# SPDX-License-Identifier: MIT
"""What only machines of the grade "field" have: hot oil, dissolving air, clocks, spools, wear."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from reality_runs import drawn_case, own_run

from ehsid.lab.reality import machine as equations
from ehsid.lab.reality.case import make_case, start_state
from ehsid.lab.reality.effects import ADDED_EFFECTS, CATALOGUE, excludes
from ehsid.lab.reality.nominal_rig import FIELD_RANGE, draw_wide_rig
from ehsid.lab.reality.truth import NO_WEAR, Truth
from ehsid.lab.reality.unnamed import FIELD, OUTSIDE
from ehsid.lab.reality.variants import Variants, draw_field_variants, with_variants

FloatArray = npt.NDArray[np.float64]


def rates(t: Truth, state: FloatArray, time: float, command: float = 0.0) -> FloatArray:
    d = np.empty(equations.STATES)
    equations.slope_of(time, state, command, float(state[equations.Y]), t, d)
    return d


def test_oil_that_heats_is_thinner_lighter_and_softer() -> None:
    """17.3 K halve the viscosity, so that they double a leak and halve viscous friction."""
    t = drawn_case(11, "plain", "open", ["heating_oil"]).truth
    t = t._replace(heating_k=math.log(2.0) / 0.04, warming_viscous=0.0, warming_bulk=0.0)
    state = start_state(t, 0.5 * t.stroke_m)
    still, cold, hot = state.copy(), 0.0, 1e3 * t.warming_s
    state[equations.V] = 0.1
    friction = [
        t.mass_kg * (rates(t, state, at) - rates(t, still, at))[equations.V] for at in (cold, hot)
    ]
    assert friction[0] == pytest.approx(-0.1 * t.viscous_n_s_m, rel=1e-9)
    assert friction[1] == pytest.approx(0.5 * friction[0], rel=1e-9)
    # The closed valve passes nothing: what the chamber gains leaks through the piston.
    closed = t._replace(
        round_width=1e-9, overlap_pa=0.1, overlap_at=0.1, overlap_pb=0.1, overlap_bt=0.1
    )
    for at, factor in ((cold, 1.0), (hot, 2.0)):
        p_a, p_b = equations.chamber_pressures(at, still, t)
        gained = rates(closed, still, at)[equations.C_A] * (
            t.dead_volume_a_m3 + 0.5 * t.area_a_m2 * t.stroke_m
        )
        assert gained == pytest.approx(-factor * t.leak_ab_m3_s_pa * (p_a - p_b), rel=1e-9)
    # The same compression is a lower pressure in softer oil: of pressures far above the balance of
    # gas and oil the share is that of the bulk modulus, but for the gas.
    soft = [equations.chamber_pressures(at, still, t)[0] for at in (cold, hot)]
    assert soft[1] / soft[0] == pytest.approx(1.0 - 0.005 * t.heating_k, abs=0.02)


def test_air_dissolves_under_pressure_and_comes_out_faster() -> None:
    t = drawn_case(11, "plain", "open", ["dissolving_air"]).truth
    above, below = 1.1 * t.all_dissolved_pa, 0.25 * t.all_dissolved_pa
    assert equations.free_gas(above, t) == 0.0
    assert equations.free_gas(below, t) == pytest.approx(0.75 * t.dissolving_gas, rel=1e-12)
    assert equations.gas_rate(above, 0.01, t) == pytest.approx(-0.01 / t.dissolving_s, rel=1e-12)
    out = equations.gas_rate(below, 0.0, t)
    assert out == pytest.approx(0.75 * t.dissolving_gas / t.coming_out_s, rel=1e-12)
    assert t.coming_out_s < t.dissolving_s
    # With a machine at rest all is in balance, and what dissolves takes its volume with it.
    state = start_state(t, 0.5 * t.stroke_m)
    assert np.abs(rates(t, state, 0.0)[[equations.G_A, equations.G_B]]).max() < 1e-9
    p_a, p_b = equations.chamber_pressures(0.0, state, t)
    assert state[equations.G_A] == pytest.approx(equations.free_gas(p_a, t), rel=1e-6)
    state[equations.G_A] *= 0.5
    assert equations.chamber_pressures(0.0, state, t)[0] < p_a
    assert equations.chamber_pressures(0.0, state, t)[1] == p_b


@pytest.mark.parametrize("rate", [-2e-3, 2e-3])
def test_a_clock_that_drifts_shows_later_or_earlier_positions(rate: float) -> None:
    """Splines between samples of noise differ from lines by less than the noise, of 5 sigma."""
    other, same = (
        make_case(
            3,
            "plain",
            "open",
            {"logger_clock": {"rate": each}},
            sensors="pressures",
            seconds=4.0,
            excitation=("multisine", "chirp"),
        ).train
        for each in (rate, -1e-15)
    )
    n = other["time_s"].size
    assert n == (same["time_s"].size if rate < 0.0 else int((5000 - 1 - 1000) / 1.002) + 1)
    np.testing.assert_array_equal(other["command_v"], same["command_v"][:n])
    inside = slice(0, n - 10)
    shifted = other["time_s"][inside] * (1.0 + rate)
    expected = np.interp(shifted, same["time_s"], same["position_m"])
    noise = 5.0 * 1.6 * 2e-5 * float(make_stroke())
    np.testing.assert_allclose(other["position_m"][inside], expected, rtol=0.0, atol=noise)
    assert np.abs(other["position_m"][inside] - same["position_m"][inside]).max() > 5.0 * noise


def make_stroke() -> float:
    return drawn_case(3, "plain", "none").healthy.stroke_m


def test_a_spool_with_friction_has_a_hysteresis_of_the_size_of_its_effect() -> None:
    case = drawn_case(5, "plain", "one", ["valve_hysteresis"])
    size = case.answer["effects"]["valve_hysteresis"]["half_width"]
    variants = Variants(spool_friction_way=0.3)
    t = with_variants(case.truth, variants, case.answer["effects"])
    assert t.play == 0.0
    time = np.arange(4000) * 1e-3
    command = 0.3 * np.abs(2.0 * (time % 2.0) - 2.0) - 0.15  # falls in a second, then rises
    spool = own_run(t, start_state(t, 0.5 * t.stroke_m), command)[:, equations.OUT_X]
    falling, rising = 2500, 3500
    assert command[falling] == pytest.approx(command[rising], abs=1e-3)
    # What lags behind a ramp of 0.3 per second lags by 2 zeta / w in both directions.
    behind = 2.0 * 0.3 * 2.0 * t.spool_damping / t.spool_rad_s
    width = spool[falling] - spool[rising]
    assert width - behind == pytest.approx(2.0 * size, rel=0.05)


def test_a_bowed_scale_reads_wrong_between_its_ends() -> None:
    case = drawn_case(11, "plain", "open", ["bowed_scale"])
    start, commands = start_state(case.healthy, 0.3 * case.healthy.stroke_m), np.full(200, 0.2)
    plain, bowed = (
        own_run(t, start, commands)[:, equations.OUT_Y] for t in (case.healthy, case.truth)
    )
    place = plain / case.healthy.stroke_m
    error = 4.0 * case.answer["effects"]["bowed_scale"]["bow_m"] * place * (1.0 - place)
    np.testing.assert_allclose(bowed - plain, error, rtol=0.0, atol=2e-12)


def test_half_of_the_machines_have_worn_edges_that_open_by_less_than_5_percent_too_early() -> None:
    drawn = [draw_field_variants(np.random.default_rng(seed), Variants()) for seed in range(200)]
    worn = [each.worn for each in drawn if each.worn != NO_WEAR]
    assert 72 <= len(worn) <= 128  # four standard errors
    assert all(0.005 <= each <= 0.05 for edges in worn for each in edges)
    healthy = drawn_case(5, "plain", "none").healthy
    t = with_variants(healthy, replace(Variants(), worn=worn[0]), ())
    early = [equations.edge(-t.round_width, t.round_width + each) for each in worn[0]]
    assert all(0.0 < each < 0.05 for each in early)
    assert equations.edge(-t.round_width, t.round_width) == 0.0
    assert t.worn == worn[0]


def test_rigs_are_of_wider_sizes() -> None:
    rigs = [draw_wide_rig(np.random.default_rng(seed), FIELD_RANGE).values for seed in range(300)]
    for name, (low, high), usual in (
        ("cylinder.bore_m", FIELD_RANGE.bore_m, (0.020, 0.100)),
        ("cylinder.stroke_m", FIELD_RANGE.stroke_m, (0.08, 1.0)),
        ("supply.pressure_pa", FIELD_RANGE.supply_pa, (7e6, 28e6)),
    ):
        drawn = [rig[name] for rig in rigs]
        # Rounding to whole millimetres, centimetres or four digits.
        assert min(drawn) >= low - 0.5e-2
        assert max(drawn) <= high * 1.001
        assert min(drawn) < usual[0]
        assert max(drawn) > usual[1]


def test_its_causes_are_drawn_from_both_catalogues_and_two_are_never_of_one_kind() -> None:
    known, outside = set(), set()
    for seed in range(12):
        two = drawn_case(seed, "field", "two", sensors="position").answer["effects"]
        assert not excludes(*two)
        assert not any(name.startswith("pressure_sensor") for name in two)
        known |= set(two)
        outside |= set(drawn_case(seed, "field", "open").answer["effects"])
    assert known <= {*CATALOGUE, *ADDED_EFFECTS}
    assert known & set(ADDED_EFFECTS)
    assert outside <= {*OUTSIDE, *FIELD}
    assert excludes("load_spring", "contact_spring")
    assert not excludes("load_spring", "coulomb_friction")
