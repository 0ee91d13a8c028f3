# SPDX-License-Identifier: MIT
"""Effects that are made on request: the machine has the term that the catalogue describes."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from reality_runs import drawn_case, own_run

from ehsid import EffectTerms
from ehsid.harness.catalogue.parameters import plant_parameters
from ehsid.lab.reality import machine as equations
from ehsid.lab.reality.case import RealityCase, start_state
from ehsid.lab.reality.effects import ADDED_EFFECTS, CATALOGUE
from ehsid.lab.reality.pressure_sensors import pressure_reading
from ehsid.lab.reality.truth import Truth
from ehsid.lab.reality.unnamed import OUTSIDE, UNNAMED

FloatArray = npt.NDArray[np.float64]


def made(name: str) -> tuple[RealityCase, dict[str, float]]:
    case = drawn_case(11, "plain", "one", [name])
    return case, case.answer["effects"][name]


def rates(t: Truth, state: FloatArray, time: float = 0.0) -> FloatArray:
    d = np.empty(equations.STATES)
    equations.slope_of(time, state, 0.1, float(state[equations.Y]), t, d)
    return d


def moving(t: Truth, share: float, speed: float) -> FloatArray:
    """A state with sliding bristles at a share of the stroke."""
    state = start_state(t, share * t.stroke_m)
    state[equations.V] = speed
    state[equations.Z] = math.copysign(t.coulomb_n / t.bristle_n_m, speed)
    return state


@pytest.mark.thorough
def test_they_are_never_drawn() -> None:
    assert not set(ADDED_EFFECTS) & {*CATALOGUE, *OUTSIDE, *UNNAMED}
    drawn = {
        effect
        for seed in range(60)
        for effect in drawn_case(seed, "plain", "two").answer["effects"]
    }
    assert drawn <= set(CATALOGUE)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [-0.2, 0.2])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_friction_has_its_size_by_direction_and_place(share: float, speed: float) -> None:
    for name in ("coulomb_friction_sides", "position_friction"):
        case, sizes = made(name)
        t = case.truth
        state = moving(t, share, speed)
        smooth = t._replace(coulomb_n=0.0, static_n=0.0)
        lost = t.mass_kg * (rates(smooth, state)[equations.V] - rates(t, state)[equations.V])
        if name == "position_friction":
            from_middle = (share - 0.5) * t.stroke_m
            expected = math.copysign(sizes["force_n"] + sizes["rise_n_m"] * from_middle, speed)
        else:
            expected = sizes["force_extending_n"] if speed > 0 else -sizes["force_retracting_n"]
        # Rounding: the forces of the pressures are some 1e5 N; bristles damp by less than 1e-6 N.
        assert lost == pytest.approx(expected, rel=1e-6)


def test_overlaps_close_the_edges_of_their_side() -> None:
    case, sizes = made("valve_dead_band_sides")
    t, healthy = case.truth, case.healthy
    for opening in (-0.03, 0.01, 0.04):
        state = start_state(t, 0.5 * t.stroke_m)
        state[equations.X] = opening
        side = "overlap_a" if opening > 0.0 else "overlap_b"
        # As a valve whose spool stands nearer to its null by the overlap of that side.
        nearer = state.copy()
        nearer[equations.X] = opening - math.copysign(sizes[side], opening)
        got = rates(t, state)[[equations.C_A, equations.C_B]]
        # The edges of the other side only leak through their rounding.
        least = 1e-3 * np.max(np.abs(rates(healthy, state)[[equations.C_A, equations.C_B]]))
        wanted = rates(healthy, nearer)[[equations.C_A, equations.C_B]]
        if abs(opening) > sizes[side] + 5.0 * t.round_width:
            np.testing.assert_allclose(got, wanted, rtol=0.02, atol=least)
        assert np.all(
            np.abs(got) <= np.abs(rates(healthy, state)[[equations.C_A, equations.C_B]]) + least
        )


def test_the_flow_drifts() -> None:
    case, sizes = made("flow_gain_drift")
    t, healthy = case.truth, case.healthy
    state = start_state(t, 0.4 * t.stroke_m)
    state[equations.X] = 0.3
    time = 7.0
    more = healthy._replace(flow_gain=healthy.flow_gain * (1.0 + sizes["rate_1_s"] * time))
    np.testing.assert_allclose(rates(t, state, time), rates(more, state, time), rtol=1e-12)


@pytest.mark.parametrize("name", ["relief_valve", "makeup_check"])
def test_valves_at_the_ports_open_beyond_their_pressure(name: str) -> None:
    case, sizes = made(name)
    t, healthy = case.truth, case.healthy
    relief = name == "relief_valve"
    cracks = sizes["pressure_pa"] if relief else t.tank_pa - sizes["pressure_pa"]
    away = 2e5 if relief else -2e4
    for beyond in (-away, away):
        state = start_state(t, 0.5 * t.stroke_m)
        for place in (equations.C_A, equations.C_B):
            state[place] = equations.compression(
                cracks + beyond, t.bulk_slope, t.bulk_modulus_0_pa, t.gas_fraction
            )
        less = rates(healthy, state) - rates(t, state)
        through = sizes["flow_gain_m3_s_pa"] * beyond if beyond == away else 0.0
        volume = t.dead_volume_a_m3 + t.area_a_m2 * state[equations.Y]
        # The pressure follows from the compression by a search that ends at some Pa.
        tolerance = 1e-3 * sizes["flow_gain_m3_s_pa"] * abs(away)
        assert less[equations.C_A] * volume == pytest.approx(through, abs=tolerance)


def test_the_load_swings_as_told_with_the_rod_fixed() -> None:
    case, sizes = made("flexible_load")
    t, healthy = case.truth, case.healthy
    assert t.mass_kg + t.second_mass_kg == pytest.approx(healthy.mass_kg, rel=1e-12)
    assert t.second_mass_kg == pytest.approx(sizes["mass_share"] * healthy.mass_kg, rel=1e-12)
    natural = math.sqrt(t.second_spring_n_m / t.second_mass_kg)
    assert natural == pytest.approx(2.0 * math.pi * sizes["frequency_hz"], rel=1e-12)
    damping = t.second_damper_n_s_m / (2.0 * t.second_mass_kg * natural)
    assert damping == pytest.approx(sizes["damping"], rel=1e-12)


def test_the_scale_of_the_sensor_is_uneven() -> None:
    case, sizes = made("sensor_nonlinearity")
    start, commands = start_state(case.healthy, 0.3 * case.healthy.stroke_m), np.full(200, 0.2)
    plain, wavy = (
        own_run(t, start, commands)[:, equations.OUT_Y] for t in (case.healthy, case.truth)
    )
    error = sizes["amplitude_m"] * np.sin(2.0 * math.pi * plain / sizes["period_m"])
    assert np.ptp(error) > 1e-6
    np.testing.assert_allclose(wavy - plain, error, rtol=0.0, atol=2e-12)


def test_a_contact_presses_to_one_side_and_nearly_as_a_spring() -> None:
    case, sizes = made("contact_spring")
    t, healthy = case.truth, case.healthy
    for beyond in (-0.01, 0.05, 0.3):
        position = sizes["position_m"] + beyond * t.stroke_m
        state = moving(healthy, position / t.stroke_m, 0.0)
        less = t.mass_kg * (rates(healthy, state) - rates(t, state))[equations.V]
        expected = sizes["stiffness_n_m"] * max(beyond, 0.0) * t.stroke_m
        assert less == pytest.approx(expected, rel=0.03, abs=1e-6)


def test_a_late_position_is_that_of_some_samples_before() -> None:
    case, sizes = made("position_sensor_delay")
    start, commands = start_state(case.healthy, 0.3 * case.healthy.stroke_m), np.full(200, 0.2)
    on_time, late = (
        own_run(t, start, commands)[:, equations.OUT_Y] for t in (case.healthy, case.truth)
    )
    time = 1e-3 * np.arange(on_time.size)
    expected = np.interp(time - sizes["delay_s"], time, on_time)
    np.testing.assert_allclose(late, expected, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("what", ["gain", "offset", "lag"])
def test_transducers_are_wrong_nearly_as_the_catalogue_says(what: str) -> None:
    """A wrong span is bowed, and a filter has a second stage: neither is much of the error."""
    case, sizes = made(f"pressure_sensor_{what}")
    pressure = case.truth.source_pa * (0.5 + 0.2 * np.sin(12.0 * np.arange(2000) * 1e-3))
    terms = EffectTerms(
        [
            sizes.get(name.rsplit(".", 1)[1], 0.0) * (f".pressure_sensor_{what}." in name)
            for name in plant_parameters()
        ]
    )
    for side, law in zip("ab", terms.pressure_sensors(pressure, pressure, 1e-3), strict=True):
        shown = pressure_reading(pressure, side, case.truth, 1e-3)
        error = np.abs(law - pressure).max()
        assert np.abs(shown - law).max() <= 0.08 * error


def test_a_counterbalance_valve_passes_where_load_and_pilot_lift_it() -> None:
    case, sizes = made("counterbalance_valve")
    t, healthy = case.truth, case.healthy
    supply, setting = t.source_pa, sizes["pressure_pa"]
    # Full lift, and none: at rest it follows where the sum of load and pilot is.
    for own, passes in ((0.5 * supply, 1.0), (0.9 * supply, None)):
        other = supply - own
        lifting = own + sizes["pilot_ratio"] * other - setting
        lifted = equations.lift(own, other, t)
        assert (lifted > 0.0) == (lifting > 0.0)
        if passes is not None and lifting > setting:
            assert lifted == pytest.approx(passes, abs=1e-3)
    for opening in (0.02, 0.3):
        share = equations.through_counterbalance(opening, 1.0, t) / opening
        assert 0.97 < share < 1.0
        assert equations.through_counterbalance(opening, 0.0, t) == 0.0
        assert equations.through_counterbalance(opening, 0.0, healthy) == opening
