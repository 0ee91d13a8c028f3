# SPDX-License-Identifier: MIT
"""Terms of the effects for measured signals, against their equations in numpy and scipy."""

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import brentq
from scipy.signal import lsim

import ehsid
from ehsid.harness.catalogue.parameters import effects, plant_parameters

FloatArray = npt.NDArray[np.float64]
SIGNALS = arrays(np.float64, st.integers(1, 40), elements=st.floats(-2.0, 2.0))


def terms(**sizes: float) -> ehsid.EffectTerms:
    """Terms of the effects with these parameters, written as effect__parameter."""
    values = {f"effects.{name.replace('__', '.')}": size for name, size in sizes.items()}
    assert values.keys() <= plant_parameters().keys()
    return ehsid.EffectTerms([values.get(name, 0.0) for name in plant_parameters()])


def test_without_effects_nothing_is_added() -> None:
    none, signal = terms(), np.linspace(-1.0, 1.0, 7)
    assert none.delay_s == 0.0
    assert none.overlap == none.spool_lag == none.supply_line == none.sensor_error == (0.0, 0.0)
    assert none.contact == none.counterbalance == (0.0, 0.0)
    for same in none.pressure_sensors(signal, signal, 1e-3):
        np.testing.assert_array_equal(same, signal)
    for same in (none.command(signal, 1e-3), none.opening(signal), none.sensor(signal, 1e-3)):
        np.testing.assert_array_equal(same, signal)
    friction = none.friction(signal, signal)
    for zero in (friction, none.load(signal), *none.leakage(signal, signal, 0.0)):
        np.testing.assert_array_equal(zero, 0.0)
    np.testing.assert_array_equal(none.bulk_modulus(1e9, signal), 1e9)


def test_numbers_of_the_effects() -> None:
    all_of_them = terms(
        transport_delay__delay_s=0.004,
        valve_dead_band__overlap=0.03,
        valve_dead_band_sides__overlap_a=0.05,
        valve_dead_band_sides__overlap_b=0.01,
        valve_lag__bandwidth_hz=60.0,
        valve_lag__damping=0.8,
        supply_droop__source_resistance_pa_s_m3=3e9,
        supply_droop__accumulator_capacitance_m3_pa=1e-11,
        line_resonance__frequency_hz=40.0,
        line_resonance__damping=0.1,
        line_resonance__volume_m3=2e-3,
        flexible_load__mass_share=0.3,
        flexible_load__frequency_hz=20.0,
        flexible_load__damping=0.05,
        counterbalance_valve__pressure_pa=2e7,
        counterbalance_valve__pilot_ratio=4.0,
        contact_spring__position_m=0.2,
        contact_spring__stiffness_n_m=1e5,
        sensor_lag__time_constant_s=0.005,
        sensor_backlash__half_width_m=1e-4,
    )
    assert all_of_them.delay_s == 0.004
    assert all_of_them.overlap == (0.03 + 0.05, 0.03 + 0.01)
    assert all_of_them.spool_lag == (60.0, 0.8)
    assert all_of_them.supply_line == (3e9, 1e-11)
    assert all_of_them.pressure_line == (40.0, 0.1, 2e-3)
    assert all_of_them.hanging_load == (0.3, 20.0, 0.05)
    assert all_of_them.counterbalance == (2e7, 4.0)
    assert all_of_them.contact == (0.2, 1e5)
    assert all_of_them.sensor_error == (0.005, 1e-4)


@given(SIGNALS)
def test_forces_add_up(signal: FloatArray) -> None:
    forces = terms(
        load_spring__stiffness_n_m=2e4,
        load_spring__force_at_mid_stroke_n=50.0,
        load_force__force_n=-800.0,
        coulomb_friction__force_n=400.0,
        coulomb_friction_sides__force_extending_n=600.0,
        coulomb_friction_sides__force_retracting_n=300.0,
        position_friction__force_n=100.0,
        position_friction__rise_n_m=-2000.0,
        stribeck_friction__coulomb_n=300.0,
        stribeck_friction__static_n=600.0,
        stribeck_friction__stribeck_velocity_m_s=0.02,
    )
    np.testing.assert_allclose(forces.load(signal), 2e4 * signal - 750.0, rtol=1e-14)
    expected = (
        700.0 + 300.0 * np.exp(-((signal / 0.02) ** 2)) + np.where(signal < 0.0, 300.0, 600.0)
    )
    for from_middle, rising in ((-0.1, 300.0), (0.0, 100.0), (0.04, 20.0), (0.1, 0.0)):
        found = forces.friction(signal, np.full_like(signal, from_middle))
        np.testing.assert_allclose(found, expected + rising, rtol=1e-14)


@given(SIGNALS)
def test_openings_are_bent_in_the_order_of_the_catalogue(signal: FloatArray) -> None:
    valve = terms(valve_null_bias__offset=0.02, valve_flow_saturation__limit=0.6)
    expected = 0.6 * np.tanh((signal + 0.02) / 0.6)
    np.testing.assert_allclose(valve.opening(signal), expected, rtol=1e-14, atol=1e-300)


@given(SIGNALS, st.floats(1e-3, 0.2))
def test_play_stays_within_its_width_and_moves_only_at_its_ends(
    signal: FloatArray, half_width: float
) -> None:
    spool = terms(valve_hysteresis__half_width=half_width).command(signal, 1e-3)
    away = signal - spool
    assert np.all(np.abs(away) <= half_width + 1e-15)
    moved = np.flatnonzero(np.diff(spool, prepend=0.0))
    np.testing.assert_allclose(np.abs(away[moved]), half_width, rtol=0.0, atol=1e-15)


def test_the_flow_drifts_from_the_start_and_never_below_a_share() -> None:
    time_s = np.array([0.0, 2.0, 19.0, 30.0])
    shares = terms(flow_gain_drift__rate_1_s=-0.05).flow_share(time_s)
    np.testing.assert_allclose(shares, [1.0, 0.9, 0.05, 0.05], rtol=1e-14)
    np.testing.assert_array_equal(terms().flow_share(time_s), 1.0)


THRESHOLD, REST_S, DT_S = 0.04, 0.2, 1e-3


def sticking(command: FloatArray) -> FloatArray:
    spool = terms(spool_stiction__threshold=THRESHOLD, spool_stiction__rest_s=REST_S)
    return spool.command(command, DT_S)


def test_a_spool_that_rested_long_comes_free_at_the_whole_threshold() -> None:
    ramp = np.arange(400) * 4e-4  # 0.4 a second, faster than it can stick again
    spool = sticking(ramp)
    first = np.flatnonzero(spool)[0]
    assert ramp[first - 1] <= THRESHOLD < ramp[first]
    # In the sample in which it comes free it moves by a part; from then on it follows.
    assert 0.0 < spool[first] <= ramp[first]
    np.testing.assert_array_equal(spool[first + 1 :], ramp[first + 1 :])


@pytest.mark.parametrize("rest", [20, 100, 400])
def test_the_threshold_grows_over_the_time_at_rest(rest: int) -> None:
    limit = THRESHOLD * (1.0 - np.exp(-rest * DT_S / REST_S))
    for share, moves in ((0.99, False), (1.01, True)):
        # The spool is at the first command one sample later, and rests from there on.
        spool = sticking(np.array([*np.full(rest + 1, 0.3), 0.3 + share * limit]))
        assert spool[1] == spool[-2] == 0.3
        assert (spool[-1] > 0.3) == moves


def test_a_slow_ramp_goes_on_in_jumps_as_long_as_the_law_says() -> None:
    rate = 0.05  # a second: THRESHOLD / REST_S is four times as much
    spool = sticking(np.arange(20000) * rate * DT_S)
    moves = np.flatnonzero(np.diff(spool) > 0.0)
    starts = moves[np.diff(moves, prepend=-9) > 2] * DT_S
    rests = np.diff(starts)[1:]
    # It rests until rate t = THRESHOLD (1 - exp(-t / REST_S)).
    expected = brentq(lambda t: rate * t - THRESHOLD * (1.0 - np.exp(-t / REST_S)), 0.05, 10.0)
    np.testing.assert_allclose(rests, expected, atol=3.0 * DT_S)


@given(SIGNALS)
def test_a_spool_that_sticks_is_never_farther_away_than_its_threshold(signal: FloatArray) -> None:
    spool = sticking(signal)
    moved = np.diff(spool, prepend=0.0) != 0.0
    assert np.all(np.abs(signal - spool)[~moved] <= THRESHOLD * (1.0 + 1e-12))
    # It moves towards the command, and not beyond.
    before = np.concatenate([[0.0], spool[:-1]])
    assert np.all(np.abs(signal - spool) <= np.abs(signal - before) + 1e-15)


def test_valves_at_the_ports_open_at_their_pressures() -> None:
    pressure = np.linspace(1e4, 12e6, 1000)
    other, tank = np.full(1000, 5e6), 2e5
    ports = terms(
        relief_valve__pressure_pa=8e6,
        relief_valve__flow_gain_m3_s_pa=3e-10,
        makeup_check__pressure_pa=3e4,
        makeup_check__flow_gain_m3_s_pa=2e-9,
    )
    out = 3e-10 * np.maximum(pressure - 8e6, 0.0) - 2e-9 * np.maximum(1.7e5 - pressure, 0.0)
    assert out.min() < 0.0 < out.max()
    for flows in (ports.leakage(pressure, other, tank), ports.leakage(other, pressure, tank)[::-1]):
        np.testing.assert_allclose(flows[0], out, rtol=1e-12, atol=1e-18)
        np.testing.assert_array_equal(flows[1], 0.0)


def test_leakages_add_up_and_air_softens_the_oil() -> None:
    a, b, tank = np.linspace(1e5, 9e6, 9), np.linspace(8e6, 2e5, 9), 2e5
    oil = terms(
        internal_leakage__coefficient_m3_s_pa=2e-11,
        external_leakage__coefficient_a_m3_s_pa=1e-11,
        external_leakage__coefficient_b_m3_s_pa=3e-11,
        entrained_air__volume_fraction=0.01,
    )
    from_a, from_b = oil.leakage(a, b, tank)
    np.testing.assert_allclose(from_a, 2e-11 * (a - b) + 1e-11 * (a - tank), rtol=1e-13)
    np.testing.assert_allclose(from_b, 2e-11 * (b - a) + 3e-11 * (b - tank), rtol=1e-13)
    air = 0.01 * (101325.0 / a) ** (1.0 / 1.3)
    expected = 1.1e9 * (1.0 + air) / (1.0 + air * 1.1e9 / (1.3 * a))
    np.testing.assert_allclose(oil.bulk_modulus(1.1e9, a), expected, rtol=1e-13)


def test_a_sensor_lags_as_scipy_says_and_stores_whole_steps() -> None:
    time_s = np.arange(500) * 1e-3
    path = 0.1 + 0.02 * np.sin(2.0 * np.pi * 3.0 * time_s)
    _, lagging, _ = lsim(([1.0], [0.008, 1.0]), path - path[0], time_s, interp=True)
    found = terms(sensor_lag__time_constant_s=0.008).sensor(path, 1e-3)
    np.testing.assert_allclose(found, path[0] + lagging, rtol=0.0, atol=1e-12)
    steps = terms(sensor_quantisation__step_m=1e-3).sensor(path, 1e-3) / 1e-3
    np.testing.assert_allclose(steps, np.round(path / 1e-3), rtol=0.0, atol=1e-9)


def test_sensors_are_late_and_wrong_as_numpy_and_scipy_say() -> None:
    time_s = np.arange(500) * 1e-3
    path = 0.1 + 0.02 * np.sin(2.0 * np.pi * 3.0 * time_s)
    late = terms(position_sensor_delay__delay_s=0.0073).sensor(path, 1e-3)
    expected = np.interp(time_s - 0.0073, time_s, path)
    np.testing.assert_allclose(late, expected, rtol=0.0, atol=1e-15)
    a, b = 5e6 + 1e7 * path, 6e6 - 2e7 * path
    wrong = terms(
        pressure_sensor_gain__gain_a=1.05,
        pressure_sensor_offset__offset_a_pa=-1e5,
        pressure_sensor_offset__offset_b_pa=3e5,
        pressure_sensor_lag__time_constant_s=0.006,
    ).pressure_sensors(a, b, 1e-3)
    # The gain of the rod side is not told, and is one.
    for found, shown in zip(wrong, (1.05 * a - 1e5, b + 3e5), strict=True):
        _, lagging, _ = lsim(([1.0], [0.006, 1.0]), shown - shown[0], time_s, interp=True)
        np.testing.assert_allclose(found, shown[0] + lagging, rtol=1e-12)


@given(SIGNALS, st.floats(-0.9, 0.9), st.floats(0.01, 2.0))
def test_an_uneven_scale_is_undone(signal: FloatArray, share: float, period: float) -> None:
    """share: the largest slope of the error, below one, so that readings rise with the position."""
    amplitude = share * period / (2.0 * np.pi)
    scale = terms(
        sensor_nonlinearity__amplitude_m=float(np.clip(amplitude, -5e-3, 5e-3)),
        sensor_nonlinearity__period_m=period,
    )
    readings = scale.sensor(signal, 1e-3)
    expected = signal + np.clip(amplitude, -5e-3, 5e-3) * np.sin(2.0 * np.pi * signal / period)
    np.testing.assert_allclose(readings, expected, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(scale.position_of(readings), signal, rtol=0.0, atol=1e-13)


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match="values"):
        ehsid.EffectTerms([1.0, 2.0])
    with pytest.raises(ValueError, match="pressure_b"):
        terms().leakage(np.zeros(3), np.zeros(4), 0.0)
    with pytest.raises(ValueError, match="pressure_b"):
        terms().pressure_sensors(np.zeros(3), np.zeros(4), 1e-3)
    with pytest.raises(ValueError, match="from_middle"):
        terms().friction(np.zeros(3), np.zeros(4))


MACHINE = ehsid.MachineScale(
    force_n=37e3,
    rated_flow_m3_s=6.3e-4,
    full_flow_m3_s=8.3e-4,
    pressure_pa=12e6,
    stroke_m=0.3,
    has_valve=True,
)


@pytest.mark.parametrize("effect", ehsid.effects(), ids=lambda effect: effect.id)
def test_an_effect_tells_all_that_is_asked_of_it(effect: ehsid.EffectInfo) -> None:
    ranges = {one.name: (one.minimum, one.maximum) for one in effect.parameters}
    for text in (effect.equation, effect.source, effect.excitation, effect.sensors):
        assert len(text) > 3
    assert len(effect.least_size) > 20
    for start in effect.starts(MACHINE):
        assert start.keys() == ranges.keys()
        assert all(low <= start[name] <= high for name, (low, high) in ranges.items())
    # The smaller of the sizes at which a fit starts may be one that every servo has.
    assert not effect.starts(MACHINE) or effect.matters(effect.starts(MACHINE)[-1], MACHINE)
    assert {*effect.does_not_commute} <= effects().keys()
    assert {*(effect.nuisance or "").split()} <= plant_parameters().keys()
    for pair in effect.not_below:
        assert {*pair} <= ranges.keys()


@pytest.mark.parametrize(
    "effect", [one for one in ehsid.effects() if one.contains], ids=lambda effect: effect.id
)
def test_a_law_that_contains_another_becomes_it(effect: ehsid.EffectInfo) -> None:
    """Grown from the simpler law, it has the force of that law within a half."""
    assert effect.contains is not None
    simple = effects()[effect.contains].starts(MACHINE)[0]
    starts = effect.grown(simple, MACHINE)
    assert starts
    for grown in starts:
        again = effect.simplified(grown)
        assert again.keys() == simple.keys()
        for name, size in simple.items():
            assert again[name] == pytest.approx(size, rel=0.5)
        for larger, smaller in effect.not_below:
            assert grown[larger] >= grown[smaller]


SPEEDS = np.linspace(-0.5, 0.5, 101)


# A line holds litres of oil and swings at some Hz. It cannot act as a large accumulator,
# whose gas gives way far more, nor as a source that is hardly felt.
IN_COMMON = {
    "accumulator_capacitance_m3_pa": (1e-11, 1e-11),
    "source_resistance_pa_s_m3": (1e9, 5e10),
}


@pytest.mark.slow
@given(share=st.floats(1e-4, 0.5))
def test_a_law_that_contains_another_can_act_as_it_does(share: float) -> None:
    """At the sizes of `same`, all terms are those of the simpler law; see `grown`."""
    for effect in (one for one in ehsid.effects() if one.contains):
        assert effect.contains is not None
        simple = {
            p.name: float(np.clip(share * p.maximum, *IN_COMMON.get(p.name, (0.0, p.maximum))))
            for p in effects()[effect.contains].parameters
        }
        same = effect.same(simple)
        assert same.keys() == {one.name for one in effect.parameters}
        for one in effect.parameters:
            assert one.minimum <= same[one.name] <= one.maximum
        assert effect.simplified(same) == pytest.approx(simple)
        rich = terms(**{f"{effect.id}__{name}": size for name, size in same.items()})
        plain = terms(**{f"{effect.contains}__{name}": size for name, size in simple.items()})
        assert rich.overlap == plain.overlap
        np.testing.assert_allclose(rich.load(SPEEDS), plain.load(SPEEDS), rtol=1e-14)
        for from_middle in (-0.1, 0.0, 0.1):
            place = np.full_like(SPEEDS, from_middle)
            np.testing.assert_allclose(
                rich.friction(SPEEDS, place), plain.friction(SPEEDS, place), rtol=1e-14
            )


def test_an_effect_that_contains_none_cannot_be_simplified() -> None:
    for become in ("simplified", "same"):
        with pytest.raises(ValueError, match="contains no simpler effect"):
            getattr(effects()["load_force"], become)({"force_n": 1.0})
    with pytest.raises(ValueError, match="force_n"):
        effects()["stribeck_friction"].same({})
    with pytest.raises(ValueError, match="force_n"):
        effects()["load_force"].matters({}, MACHINE)
