# SPDX-License-Identifier: MIT
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import cont2discrete, dlsim
from sources import ROOT

from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.signals.simulation import (
    PositionController,
    SimulationError,
    draw_noise,
    simulate,
    simulate_closed_loop,
    suggested_controller,
    velocity_gain,
    with_integral,
)

RIGS = ROOT / "examples" / "rigs"
DT_S = 1e-3


@pytest.fixture(params=["bench", "axis", "linear"])
def rig(request: pytest.FixtureRequest) -> Rig:
    return read_rig(RIGS / f"{request.param}.toml")


def test_p_loop_is_that_of_the_linear_model() -> None:
    """The loop of the linear rig and a sampled P controller, computed with matrices."""
    rig = read_rig(RIGS / "linear.toml")
    p = {name.removeprefix("linear."): value for name, value in rig.values.items()}
    stiffness = 4.0 * p["bulk_modulus_pa"] / p["volume_m3"]
    loss = p["flow_pressure_m3_s_pa"] + p["leakage_m3_s_pa"]
    a = np.array(
        [
            [0.0, 1.0, 0.0],
            [0.0, 0.0, p["area_m2"] / p["mass_kg"]],
            [0.0, -stiffness * p["area_m2"], -stiffness * loss],
        ]
    )
    b = np.array([[0.0], [0.0], [stiffness * p["flow_gain_m3_s"] * p["spool_gain_1_v"]]])
    a_d, b_d, *_ = cont2discrete((a, b, np.eye(3), np.zeros((3, 1))), DT_S)
    gain = suggested_controller(rig).gain_v_m
    c = np.array([[1.0, 0.0, 0.0]])
    loop = (a_d - b_d * gain @ c, b_d * gain, c, np.zeros((1, 1)), DT_S)
    reference = np.repeat([0.0, 0.01, -0.02, 0.005], 500)
    _, expected, _ = dlsim(loop, reference)
    controller = PositionController(gain)
    run = simulate_closed_loop(rig, reference, controller, dt_s=DT_S).run
    y = run.record.column("position_m")
    assert np.max(np.abs(y - expected[:, 0])) < 2.0 * run.error["position_m"] * np.ptp(y)
    assert run.error["position_m"] < 1e-3


def test_the_record_drives_the_rig_to_the_same_motion(rig: Rig) -> None:
    start = 0.5 * rig.values.get("cylinder.stroke_m", 0.0)
    size = 0.2 if rig.plant == "axis" else 0.005  # the axis has dry friction
    reference = start + size * np.sin(2.0 * np.pi * 0.5 * np.arange(3000) * DT_S)
    closed = simulate_closed_loop(rig, reference, suggested_controller(rig), dt_s=DT_S)
    command = closed.run.record.column("command_v")
    again = simulate(rig, command, dt_s=DT_S, position0_m=start)
    for name in ("position_m", "velocity_m_s"):
        np.testing.assert_array_equal(again.record.column(name), closed.run.record.column(name))
    assert np.ptp(again.record.column("position_m")) > 0.1 * size


def test_the_integral_removes_the_error_of_a_bias() -> None:
    rig = read_rig(RIGS / "bench.toml")
    bias = 0.02
    values = {"effects.valve_null_bias.offset": bias}
    reference = np.full(6000, 0.15)
    errors = {}
    p_controller = suggested_controller(rig)
    for name, controller in (("p", p_controller), ("pi", with_integral(p_controller))):
        closed = simulate_closed_loop(rig, reference, controller, dt_s=DT_S, values=values)
        errors[name] = closed.run.record.column("position_m")[-1] - 0.15
    # A P controller stops where its command equals the bias, except for flow through closed edges.
    error = simulate_closed_loop(rig, reference, p_controller, dt_s=DT_S).run.record.column(
        "position_m"
    )[-1]
    assert errors["p"] - (error - 0.15) == pytest.approx(
        bias * 10.0 / p_controller.gain_v_m, rel=1e-3
    )
    # A double pole at w / 2 = 6.3 1/s leaves exp(-37) after 6 s.
    assert abs(errors["pi"]) < 1e-9


def test_command_stays_within_its_limit_and_the_integral_does_not_wind_up() -> None:
    rig = read_rig(RIGS / "bench.toml")
    reference = np.repeat([0.05, 0.25], [200, 3000])
    controller = with_integral(suggested_controller(rig))
    closed = simulate_closed_loop(rig, reference, controller, dt_s=DT_S)
    command = closed.run.record.column("command_v")
    assert np.abs(command).max() == 10.0
    np.testing.assert_array_equal(closed.limited, np.abs(command) == 10.0)
    assert closed.limited.mean() > 0.1
    # A PI loop overshoots by exp(-2) = 13.5 % of the error at which the command left its limit,
    # limit / gain = 25 mm. With windup, it would overshoot by most of the 200 mm.
    assert closed.run.record.column("position_m").max() - 0.25 < 0.15 * 10.0 / controller.gain_v_m


@given(
    error=st.floats(-1.0, 1.0),
    integral=st.floats(-1.0, 1.0),
    speed=st.floats(-1.0, 1.0),
    limit=st.floats(0.1, 10.0),
)
def test_clamping_never_integrates_into_the_limit(
    error: float, integral: float, speed: float, limit: float
) -> None:
    controller = PositionController(20.0, 0.5, 3.0, limit)
    command, after = controller.step(integral, error, 0.0, speed, 0.01)
    assert abs(command) <= limit
    unlimited = 20.0 * (error + integral / 0.5) + 3.0 * speed
    if abs(unlimited) <= limit:
        assert command == pytest.approx(unlimited)
        assert after == pytest.approx(integral + 0.01 * error)
    elif unlimited * error > 0.0:
        assert after == integral
    else:
        assert after == pytest.approx(integral + 0.01 * error)


def test_velocity_gain_is_that_of_small_commands(rig: Rig) -> None:
    """The gain is the slope of speed over command, which does not depend on dry friction."""

    def speed(command_v: float) -> float:
        run = simulate(rig, np.full(samples, command_v), dt_s=DT_S)
        return float(run.record.column("velocity_m_s")[-1])

    # The time constant of the axis is mass / friction = 0.46 s; after thirteen of them 2e-6 remain.
    samples = 6000 if rig.plant == "axis" else 2000
    slope = (speed(2.0) - speed(1.0) - speed(-2.0) + speed(-1.0)) / 2.0
    # The gain neglects the viscous friction of the bench: 900 N s/m at 0.06 m/s are 0.15 % of
    # p_s A = 37 kN. Rounded edges and laminar flow have about the same influence.
    assert slope == pytest.approx(velocity_gain(rig), rel=0.005)


def test_the_controller_reads_the_recorded_position() -> None:
    rig = read_rig(RIGS / "bench.toml")
    rig = Rig("noisy", "ehs", rig.values, sensors={"position_noise_m": 2e-5})
    step = 1e-5
    noise = draw_noise(rig, 4000, np.random.default_rng(5))
    closed = simulate_closed_loop(
        rig,
        np.full(4000, 0.15),
        suggested_controller(rig),
        dt_s=DT_S,
        values={"effects.sensor_quantisation.step_m": step},
        noise=noise,
    )
    recorded = closed.run.record.column("position_m")
    np.testing.assert_allclose(recorded / step, np.round(recorded / step), atol=1e-9)
    gain = suggested_controller(rig).gain_v_m
    np.testing.assert_allclose(
        closed.run.record.column("command_v"), gain * (0.15 - recorded), atol=1e-9
    )


def test_noise_has_the_deviation_of_the_sensors() -> None:
    bench = read_rig(RIGS / "bench.toml")
    sensors = {"position_noise_m": 3e-5, "pressure_a_noise_pa": 2e4}
    rig = Rig("noisy", "ehs", bench.values, sensors=sensors)
    command = np.zeros(20_000)
    noise = draw_noise(rig, command.size, np.random.default_rng(2))
    noisy = simulate(rig, command, dt_s=DT_S, noise=noise).record
    clean = simulate(rig, command, dt_s=DT_S).record
    for name, sigma in (("position_m", 3e-5), ("pressure_a_pa", 2e4)):
        # The standard error of a deviation is 1 / sqrt(2 n) = 0.5 %; the tolerance is five of them.
        difference = noisy.column(name) - clean.column(name)
        assert np.std(difference) == pytest.approx(sigma, rel=0.025)
    np.testing.assert_array_equal(noisy.column("spool"), clean.column("spool"))


@pytest.mark.parametrize(
    ("reference", "words"),
    [
        ([0.1, float("nan")], "not finite at sample 2"),
        ([[0.1, 0.1]], "expected at least 2 samples"),
        ([0.1, 0.31], "beyond the stroke of 0 to 0.3 m"),
    ],
)
def test_references_outside_the_stroke_are_refused(reference: list[float], words: str) -> None:
    rig = read_rig(RIGS / "bench.toml")
    with pytest.raises(SimulationError, match=words):
        simulate_closed_loop(rig, reference, suggested_controller(rig), dt_s=DT_S)


@pytest.mark.parametrize(
    "change",
    [
        {"gain_v_m": 0.0},
        {"gain_v_m": math.inf},
        {"integral_time_s": -1.0},
        {"limit_v": 0.0},
        {"feed_forward_v_s_m": math.nan},
    ],
)
def test_invalid_controllers_are_refused(change: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(change))):
        PositionController(**{"gain_v_m": 1.0, **change})
