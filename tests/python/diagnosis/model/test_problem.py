# SPDX-License-Identifier: MIT
import warnings

import numpy as np
import pytest
from scipy.fft import dct
from servo_records import BENCH, DT_S

from ehsid.harness.diagnosis import (
    Problem,
    calibration_parameters,
    effect_parameters,
    fit,
    noise_floor,
)
from ehsid.harness.diagnosis.deciding import LEAST_TOLERANCE, TOLERANCE
from ehsid.harness.diagnosis.model.comparison import Compared, compare, varying_outputs
from ehsid.harness.diagnosis.model.linear import Linear
from ehsid.harness.diagnosis.model.spectrum import BANDS
from ehsid.harness.records import make_record
from ehsid.harness.rigs import Rig
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import draw_noise, simulate

RIG = Rig(
    "bench",
    "ehs",
    BENCH.values,
    sensors={
        "position_noise_m": 5e-6,
        "pressure_a_noise_pa": 1e4,
        "pressure_b_noise_pa": 1e4,
        "spool_noise": 1e-3,
    },
)
# Values that differ from those of the rig by about one standard deviation each.
TRUE = {
    "fluid.bulk_modulus_pa": 0.9e9,
    "load.viscous_friction_n_s_m": 1200.0,
    "valve.rated_flow_m3_s": 6.8e-4,
    "supply.pressure_pa": 12.3e6,
}


def compared_record(values: dict[str, float], seed: int = 0, seconds: float = 4.0) -> Compared:
    rng = np.random.default_rng(seed)
    n = round(seconds / DT_S)
    command = multisine(n, DT_S, band_hz=(0.5, 25.0), rms=2.0, rng=rng)
    run = simulate(
        RIG, command, dt_s=DT_S, values=values, substeps=8, noise=draw_noise(RIG, n, rng)
    )
    return compare(run.record)


def problem(record: Compared, extra: tuple = (), substeps: int = 4, white: bool = False) -> Problem:
    floors = {name: noise_floor(column).value for name, column in record.outputs.items()}
    return Problem(
        RIG,
        [record],
        [*calibration_parameters(RIG), *extra],
        outputs=varying_outputs(record, floors),
        floors=floors,
        substeps=substeps,
        white=white,
    )


def test_outputs_that_are_noise_do_not_count() -> None:
    record = compared_record({})
    # The supply pressure is constant; spool and chamber pressures vary.
    assert problem(record).outputs == ("position_m", "pressure_a_pa", "pressure_b_pa", "spool")


@pytest.mark.slow
@pytest.mark.parametrize("white", [False, True])
def test_gradient_is_that_of_the_cost(white: bool) -> None:
    record = compared_record(TRUE)
    subject = problem(record, white=white)
    x = subject.centre()
    step = subject.step(x)
    assert step.cost == pytest.approx(subject.cost(x), rel=1e-12)
    scale = np.array([min(p.sigma, 1.0) for p in subject.parameters])
    by_differences = np.empty_like(x)
    for index in range(x.size):
        shift = np.zeros_like(x)
        shift[index] = 1e-4 * scale[index]
        ends = [subject.cost(x + sign * shift) for sign in (1.0, -1.0)]
        by_differences[index] = (ends[0] - ends[1]) / 2e-4
    # In units of sigma the derivatives of the cost are up to 1e3, the third ones up to 2e4. Central
    # differences over 1e-4 sigma therefore have an error of 3e-5; rounding adds less.
    np.testing.assert_allclose(step.gradient * scale, by_differences, rtol=0.0, atol=2e-4)


@pytest.fixture(scope="module")
def two_record_problem() -> Problem:
    """Problem with two records of different length; the last window of the second is shorter."""
    records = [compared_record(TRUE, 1, 3.3), compared_record({}, 2, 2.5)]
    floors = {"position_m": 5e-6, "pressure_a_pa": 1e4, "spool": 1e-3}
    parameters = calibration_parameters(RIG)
    return Problem(RIG, records, parameters, outputs=tuple(floors), floors=floors, substeps=4)


def test_squares_of_the_windows_add_up_to_the_errors(two_record_problem: Problem) -> None:
    subject = two_record_problem
    errors = subject.errors(subject.centre())
    squares, counts = subject.window_squares(errors)
    # 3 s are 6 windows of 0.5 s; 2.2 s are 4 windows and another of 0.2 s.
    np.testing.assert_array_equal(counts, [500.0] * 10 + [200.0])
    assert squares.shape == (11, 3)
    for column, name in enumerate(subject.outputs):
        assert squares[:, column].sum() == pytest.approx(np.sum(errors[name] ** 2), rel=1e-12)
        # The first window of the second record is summed directly.
        by_hand = np.sum(errors[name][3000:3500] ** 2)
        assert squares[6, column] == pytest.approx(by_hand, rel=1e-12)


def test_gradients_of_the_windows_add_up_to_that_of_the_cost(two_record_problem: Problem) -> None:
    subject = two_record_problem
    x = subject.centre()
    x[:5] += 0.01
    step, by_window = subject.window_gradients(x)
    # The last window of the second record is shorter and left out.
    assert by_window.shape == (10, x.size)
    # The gradient of the prior, (x - centre) / sigma^2, is not in the windows.
    prior = subject.information() * (x - subject.centre())
    scale = np.max(np.abs(step.gradient))
    np.testing.assert_allclose(by_window.sum(axis=0) + prior, step.gradient, atol=1e-9 * scale)
    expected_step = subject.step(x)
    np.testing.assert_array_equal(step.gradient, expected_step.gradient)
    # The gradient by window from differences of its sums of squares by band, weighted as in the
    # cost: weight_b / 2 d(sum of squares) / dx.
    index = [parameter.name for parameter in subject.parameters].index("fluid.bulk_modulus_pa")
    shift = np.zeros_like(x)
    shift[index] = 1e-4
    powers = [subject.window_powers(subject.coefficients(x + sign * shift)) for sign in (1.0, -1.0)]
    slopes = (powers[0] - powers[1]) / 2e-4
    coefficients = subject.coefficients(x)
    expected = np.zeros(10)
    for column, name in enumerate(subject.outputs):
        weights = subject.likelihoods[name].weights(coefficients[name])
        expected += 0.5 * slopes[:, column] @ weights
    # Central differences over 1e-4 of ln have an error of about 1e-6 of the largest.
    worst = np.max(np.abs(expected))
    assert worst > 1.0
    np.testing.assert_allclose(by_window[:, index], expected, atol=1e-4 * worst)


def test_powers_of_the_windows_are_those_of_the_cost(two_record_problem: Problem) -> None:
    subject = two_record_problem
    coefficients = subject.coefficients(subject.centre())
    powers = subject.window_powers(coefficients)
    assert powers.shape == (10, 3, BANDS)
    sizes = subject.spectrum.sizes
    cost = 0.0
    for column, name in enumerate(subject.outputs):
        mean = powers[:, column].sum(axis=0) / sizes
        np.testing.assert_allclose(mean, subject.spectrum.powers(coefficients[name]), rtol=1e-12)
        cost += subject.likelihoods[name].cost_of(mean)
    assert cost == pytest.approx(subject.fit_cost(coefficients), rel=1e-12)


def test_errors_of_the_sensor_and_a_share_of_the_motion_are_tolerated(
    two_record_problem: Problem,
) -> None:
    subject = two_record_problem
    for name in subject.outputs:
        likelihood = subject.likelihoods[name]
        floor = subject.floors[name]
        # The power of the measured signal in each octave, of both records together.
        blocks = [
            record.outputs[name][record.used][: 500 * count].reshape(count, 500)
            for record, count in zip(subject.records, (6, 4), strict=True)
        ]
        differences = name == "position_m"
        measured = np.concatenate(blocks)
        if differences:  # a free run drifts
            measured = np.diff(measured, axis=1)
        squares = dct(measured, norm="ortho", axis=1) ** 2
        noise = floor**2 * subject.spectrum.noise_gain(differences=differences)
        # The mean level of a pressure is no motion; the mean difference of a position is its drift.
        all_motion = np.mean(squares[:, 0 if differences else 1 : 1 << (BANDS - 1)])
        for band in range(1, BANDS):
            power = np.mean(squares[:, 1 << (band - 1) : 1 << band])
            expected = noise[band] + TOLERANCE**2 * power + LEAST_TOLERANCE**2 * all_motion
            assert likelihood.tolerated[band] == pytest.approx(expected, rel=1e-9)
        assert np.all(likelihood.counts > 0.0)
        # No more are independent than there are.
        assert np.all(likelihood.counts <= subject.spectrum.sizes)


def test_rounding_to_a_coarse_grid_is_tolerated_in_the_octaves_of_its_steps() -> None:
    """A rod that creeps stays on a level for long: that error is far from white."""
    step_m, length = 2e-4, 500
    time_s = np.arange(8 * length) * DT_S
    true = 0.15 + 4e-3 * np.sin(2.0 * np.pi * 0.25 * time_s)
    rounded = step_m * np.round(true / step_m)
    columns = {"time_s": time_s, "command_v": np.zeros(time_s.size), "position_m": rounded}
    record = compare(make_record(columns, name="creep"), skip_s=0.0)
    floor = step_m / np.sqrt(12.0)
    subject = Problem(
        RIG,
        [record],
        calibration_parameters(RIG),
        outputs=("position_m",),
        floors={"position_m": floor},
    )
    tolerated = subject.likelihoods["position_m"].tolerated
    errors = subject.spectrum.transform([record.inside(rounded - true)], differences=True)
    white = floor**2 * subject.spectrum.noise_gain(differences=True)
    powers = subject.spectrum.powers(errors)
    coloured = powers > 2.0 * white
    assert coloured.any()
    # The true rounding errors are no gap, where white noise of this floor would make them one.
    assert np.all(tolerated[coloured] > 0.5 * powers[coloured])


def test_of_a_limit_cycle_the_phase_is_tolerated(two_record_problem: Problem) -> None:
    """A frequency that is wrong by TOLERANCE turns coefficient k by pi k TOLERANCE in a window."""
    calm = two_record_problem
    swinging = Problem(
        RIG,
        calm.records,
        calm.parameters,
        outputs=calm.outputs,
        floors=calm.floors,
        substeps=4,
        swinging=True,
    )
    time = np.linspace(0.0, 1.0, 1001)
    for name in calm.outputs:
        more = swinging.likelihoods[name].tolerated - calm.likelihoods[name].tolerated
        measured = calm.spectrum.transform(
            [record.inside(record.outputs[name]) for record in calm.records],
            differences=name == "position_m",
        )
        motion = calm.spectrum.powers(measured)
        for band in range(1, BANDS):
            coefficient = 1 << (band - 1)
            right = np.cos(np.pi * coefficient * time)
            wrong = np.cos(np.pi * coefficient * (1.0 + TOLERANCE) * time)
            # At the end of the window the phase is off by this; the error is largest near there.
            largest = np.max(np.abs(right - wrong))
            share = np.sqrt((more[band] + TOLERANCE**2 * motion[band]) / motion[band])
            assert share == pytest.approx(TOLERANCE * (1.0 + np.pi * coefficient), rel=1e-6)
            assert largest <= share
        assert more[0] == pytest.approx(0.0, abs=1e-9 * motion[0])


def test_hessian_is_positive_and_symmetric() -> None:
    subject = problem(compared_record(TRUE))
    hessian = subject.step(subject.centre()).hessian
    np.testing.assert_allclose(hessian, hessian.T, rtol=1e-9)
    assert np.linalg.eigvalsh(hessian).min() > 0.0


def test_calibration_estimates_the_rig_of_a_record() -> None:
    record = compared_record(TRUE)
    subject = problem(record)
    # The minimum is narrow where errors are noise: it takes 24 steps.
    result = fit(subject, subject.centre(), iterations=40)
    assert result.converged
    values = dict(zip([parameter.name for parameter in subject.parameters], result.x, strict=True))
    for parameter in subject.parameters:
        true_value = TRUE.get(parameter.name)
        if true_value is not None:
            deviation = parameter.value(values[parameter.name]) / true_value - 1.0
            assert abs(deviation) < 0.02, parameter.name
    # The remaining errors are the simulated white noise.
    errors = subject.errors(result.x)
    assert np.std(errors["position_m"]) == pytest.approx(5e-6, rel=0.1)
    assert np.std(errors["pressure_a_pa"]) == pytest.approx(1e4, rel=0.1)


@pytest.mark.slow
def test_the_size_of_an_effect_is_estimated_and_reduces_the_cost() -> None:
    record = compared_record({**TRUE, "effects.coulomb_friction.force_n": 400.0})
    without_effect = problem(record)
    calibrated = fit(without_effect, without_effect.centre())
    effect = effect_parameters("coulomb_friction", {"force_n": 150.0})
    with_effect = problem(record, tuple(parameter for parameter, _ in effect))
    result = fit(with_effect, np.concatenate([calibrated.x, [x for _, x in effect]]))
    # The difference is hundreds of nats; a standard error is about one.
    assert calibrated.cost - result.cost > 100.0
    assert with_effect.parameters[-1].value(result.x[-1]) == pytest.approx(400.0, rel=0.05)


def test_bounds_hold() -> None:
    record = compared_record({"fluid.bulk_modulus_pa": 0.2e9})
    subject = problem(record)
    result = fit(subject, subject.centre())
    assert np.all(result.x >= subject.low)
    assert np.all(result.x <= subject.high)


def test_centred_errors_have_no_mean_in_any_window() -> None:
    record = compared_record({}, seconds=2.0)
    rng = np.random.default_rng(1)
    errors = rng.standard_normal((len(record.record), 3)) + 5.0
    centred = record.centred(errors)
    windows = record.window[record.used]
    for number in np.unique(windows):
        assert np.max(np.abs(centred[windows == number].mean(axis=0))) < 1e-12


def test_records_with_gaps_are_refused() -> None:
    time = np.arange(2000) * DT_S
    time[1000:] += 1.0
    columns = {"time_s": time, "command_v": np.zeros(2000), "position_m": np.full(2000, 0.1)}
    with pytest.raises(ValueError, match="cut the record at its gaps"):
        compare(make_record(columns))


def test_sensitivities_that_overflow_give_no_warning() -> None:
    subject = problem(compared_record(TRUE))
    x = subject.centre()
    errors = subject.coefficients(x)
    huge = {name: np.full((error.size, x.size), 1e200) for name, error in errors.items()}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        step = subject.form(x, Linear(subject.spectrum, errors, huge))
    assert not np.isfinite(step.hessian).any()
    assert np.isfinite(step.cost)
