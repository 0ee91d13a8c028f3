# SPDX-License-Identifier: MIT
import pickle
from dataclasses import replace

import gap_cases as made
import numpy as np
import pytest

import ehsid
from ehsid.harness.diagnosis.data.floor import floor_of
from ehsid.harness.diagnosis.model.case import LEAST_WINDOW_SAMPLES, WINDOW_SWINGING_S, make_case
from ehsid.harness.diagnosis.model.fit import SUBSTEPS
from ehsid.harness.diagnosis.schema import WINDOW_S
from ehsid.harness.records import Record, make_record
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import PositionController, draw_noise, simulate_closed_loop


def limit_cycle_record(seed: int, names: tuple[str, ...] = made.PRESSURES) -> Record:
    """Record of a position loop whose gain is so high that the oil spring shows a limit cycle."""
    rng = np.random.default_rng(seed)
    reference = 0.15 + multisine(2000, 1e-3, band_hz=(0.5, 3.0), peak=0.01, rng=rng)
    run = simulate_closed_loop(
        made.RIG,
        reference,
        PositionController(3000.0, limit_v=10.0),
        dt_s=1e-3,
        noise=draw_noise(made.RIG, 2000, rng),
    ).run.record
    return make_record(
        {"time_s": run.time_s, **{name: run.column(name) for name in ("command_v", *names)}}
    )


def test_a_case_survives_pickling() -> None:
    case = made.case_of({})
    unpickled = pickle.loads(pickle.dumps(case))
    assert unpickled.outputs == case.outputs
    assert unpickled.rig.values == case.rig.values
    problem = case.problem()
    x = problem.centre()
    assert unpickled.problem().cost(x) == problem.cost(x)


@pytest.mark.slow
def test_records_are_prepared_once_for_all_fits_with_the_same_numbers() -> None:
    case = made.case_of({})
    fine = replace(case, substeps=2 * case.substeps)
    for options in ({}, {"held_out": True}, {"window_s": 0.1, "all_states": True}):
        first, again = case.problem(**options), fine.problem(("load_force",), **options)
        for one, other in zip(first.records, again.records, strict=True):
            assert one is other
        for one, record in zip(
            first.records, made.case_of({}).problem(**options).records, strict=True
        ):
            assert one is not record
            np.testing.assert_array_equal(one.window, record.window)
            np.testing.assert_array_equal(one.aligned, record.aligned)


def test_outputs_that_do_not_move_are_left_out() -> None:
    case = made.case_of({}, ("position_m", "supply_pressure_pa"))
    assert case.outputs == ("position_m",)
    assert case.left_out == ("supply_pressure_pa",)


def test_a_separate_record_is_held_out_completely() -> None:
    training, held_out = made.record({}, 1), made.record({}, 2)
    case = make_case(made.RIG, [training], [held_out])
    assert not case.blocks
    assert case.records == (training, held_out)
    for held_out_part, record in ((False, training), (True, held_out)):
        (compared,) = case.problem(held_out=held_out_part).records
        assert compared.record is record
        # All samples are used, except those at the start.
        assert np.count_nonzero(compared.used) == len(record) - 150


def test_without_a_held_out_record_blocks_are_held_out() -> None:
    # After the start, which is skipped, there are six blocks of two seconds.
    record = made.record({}, 1, seconds=12.4)
    case = make_case(made.RIG, [record])
    assert case.blocks
    assert case.records == (record,)
    (fitted,), (held_out,) = (
        case.problem(held_out=held_out_part).records for held_out_part in (False, True)
    )
    assert not np.any(fitted.used & held_out.used)
    # The first 0.3 s are in neither part.
    np.testing.assert_array_equal(np.flatnonzero(fitted.used | held_out.used), np.arange(150, 6200))
    # One block of each group of three is held out.
    assert np.count_nonzero(held_out.used) == 2000
    # No window is in both parts.
    assert not set(fitted.window[fitted.used]) & set(held_out.window[held_out.used])


@pytest.mark.parametrize("names", [made.PRESSURES, ("position_m",)])
def test_a_record_of_a_limit_cycle_is_compared_in_short_windows(names: tuple[str, ...]) -> None:
    records = [limit_cycle_record(seed, names) for seed in (1, 2)]
    # The command reverses tens of times a second.
    reversals = np.count_nonzero(np.diff(np.sign(records[0].column("command_v"))))
    assert reversals > 50
    case = make_case(made.RIG, records[:1], records[1:])
    assert (case.window_s, case.all_states) == (WINDOW_SWINGING_S, True)
    (compared,) = case.problem().records
    window_starts = np.flatnonzero(np.diff(compared.window, prepend=-1) > 0)
    assert set(np.diff(window_starts)) == {round(WINDOW_SWINGING_S / 1e-3)}
    # Each window starts with all measured states.
    columns = len(names) + 1  # the speed is computed from the position
    assert np.all(np.isfinite(compared.aligned[window_starts, :columns]))


def test_a_record_that_follows_its_command_is_compared_in_long_windows() -> None:
    case = made.case_of({})
    assert (case.window_s, case.all_states) == (WINDOW_S, False)
    (compared,) = case.problem().records
    window_starts = np.flatnonzero(np.diff(compared.window, prepend=-1) > 0)
    assert set(np.diff(window_starts)) == {round(WINDOW_S / made.DT_S)}
    # Each window starts with the measured position; the other states carry over.
    assert np.all(np.isfinite(compared.aligned[window_starts, 0]))
    assert np.all(np.isnan(compared.aligned[window_starts, 1:]))
    # If only one of the records shows a limit cycle, both have long windows.
    mixed = make_case(made.RIG, [limit_cycle_record(1)], [made.record({}, 2)])
    assert (mixed.window_s, mixed.all_states) == (WINDOW_S, False)


def test_slow_sampling_has_windows_of_enough_samples() -> None:
    records = [made.record({}, seed, seconds=30.0, dt_s=0.1) for seed in (1, 2)]
    case = make_case(made.RIG, records[:1], records[1:])
    assert case.window_s == pytest.approx(LEAST_WINDOW_SAMPLES * 0.1)


def test_steps_of_integration_follow_the_oil_spring() -> None:
    fine = [made.record({}, seed, dt_s=5e-4, seconds=2.0) for seed in (1, 2)]
    assert make_case(made.RIG, fine[:1], fine[1:]).substeps == SUBSTEPS
    coarse = [made.record({}, seed, dt_s=2e-2, seconds=20.0) for seed in (1, 2)]
    case = make_case(made.RIG, coarse[:1], coarse[1:])
    needed = ehsid.plant_substeps("ehs", made.RIG.plant_values(), 2e-2)
    assert case.substeps == needed > SUBSTEPS
    assert case.problem().substeps == needed


def test_floor_is_the_simulated_sensor_noise() -> None:
    case = made.case_of({})
    sigmas = (5e-6, 1e4, 1e4)
    for name, sigma in zip(made.PRESSURES, sigmas, strict=True):
        floor = case.floors[name]
        # There are 20 blocks of 150 samples. The median of |x| has the standard deviation
        # 1.17 sigma / sqrt(n) (asymptotic, normal). Seventh differences are correlated, so that n
        # is about a tenth of the samples. This gives 7 % for the record and 30 % for a block.
        assert floor.low < sigma < floor.high
        assert floor.value == pytest.approx(sigma, rel=0.2)


def test_floor_is_that_of_the_noisiest_training_record() -> None:
    quiet, held_out = made.record({}, 1), made.record({}, 2)
    rng = np.random.default_rng(0)
    columns = {name: quiet.column(name) for name in ("command_v", *made.PRESSURES)}
    columns["position_m"] = columns["position_m"] + 5e-5 * rng.standard_normal(len(quiet))
    noisy = make_record({"time_s": quiet.time_s, **columns})
    expected = floor_of(noisy, "position_m")
    assert expected.value > 5.0 * floor_of(quiet, "position_m").value
    for training in ([quiet, noisy], [noisy, quiet]):
        assert make_case(made.RIG, training, [held_out]).floors["position_m"] == expected
    # The held-out records do not change the noise floor.
    case = make_case(made.RIG, [quiet], [noisy])
    assert case.floors["position_m"] == floor_of(quiet, "position_m")


def test_parameters_are_those_of_the_calibration_and_then_the_effects() -> None:
    case = made.case_of({})
    calibration = [p.name for p in case.parameters()]
    both = [p.name for p in case.parameters(("stribeck_friction", "transport_delay"))]
    assert both[: len(calibration)] == calibration
    assert both[len(calibration) :] == [
        "effects.stribeck_friction.coulomb_n",
        "effects.stribeck_friction.static_n",
        "effects.stribeck_friction.stribeck_velocity_m_s",
        "effects.transport_delay.delay_s",
    ]
    # Edges of the valve differ whether pressures are measured or not.
    position_only = replace(case, outputs=("position_m",))
    assert [p.name for p in position_only.parameters()] == calibration


def test_records_without_information_are_refused() -> None:
    with pytest.raises(ValueError, match="the diagnosis needs a record"):
        make_case(made.RIG, [])
    still = make_record(
        {
            "time_s": np.arange(3000) * 1e-3,
            "command_v": np.zeros(3000),
            "position_m": 0.1 + 1e-6 * np.random.default_rng(0).standard_normal(3000),
        }
    )
    with pytest.raises(ValueError, match="no output moves by more than its noise"):
        make_case(made.RIG, [still])
