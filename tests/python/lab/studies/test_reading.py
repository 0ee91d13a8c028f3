# SPDX-License-Identifier: MIT
import math

import numpy as np
import pytest
from scipy.signal import lfilter

import ehsid
from ehsid.harness.models.identification import ArxOrders
from ehsid.harness.rigs.new import published_rig
from ehsid.lab.studies.comparison import PLAIN, Contender, Setting
from ehsid.lab.studies.reading import SIGMAS, Reading, oil_spring, read_over_time, read_rig_values

DT_S = 0.05


def test_a_servo_is_read_from_its_record() -> None:
    servo = ehsid.ContinuousServo(gain=0.03, omega_n=20.0, xi=0.2)
    theta = ehsid.discretise(servo, DT_S)
    rng = np.random.default_rng(0)
    u = rng.standard_normal(2000)
    a, b = np.concatenate([[1.0], theta[:3]]), np.concatenate([[0.0], theta[3:]])
    y = lfilter(b, a, u) + lfilter([1.0], a, 1e-5 * rng.standard_normal(u.size))
    setting = Setting(ArxOrders(3, 3, 1), position_scale=0.01, dtype="float64")
    found = read_over_time((u, y), setting, Contender(ehsid.Constant(1.0), options=PLAIN), DT_S)
    assert found.status[-1] == "ok"
    # Four standard deviations: one wrong in 16000, three times.
    error = found.value[-1] - [servo.gain, servo.omega_n, servo.xi]
    assert np.all(np.abs(error) < 4.0 * found.deviation[-1])
    assert np.all(found.deviation[-1] < 0.02 * found.value[-1])
    assert found.time_s[-1] == pytest.approx(100.0)


def test_oil_spring_of_equal_areas_is_the_formula_of_the_paper() -> None:
    """omega_n = A_p sqrt(4 beta_e / (V_t M_t)) at mid-stroke."""
    rig = published_rig().with_values(
        {
            "cylinder.rod_m": 0.0,
            "cylinder.dead_volume_a_m3": 1e-3,
            "cylinder.dead_volume_b_m3": 1e-3,
        }
    )
    v = rig.values
    area = math.pi / 4.0 * v["cylinder.bore_m"] ** 2
    volume = 2e-3 + area * v["cylinder.stroke_m"]
    assert oil_spring(rig, 0.15) == pytest.approx(4.0 * area**2 / volume)


def test_bulk_modulus_and_mass_are_those_of_the_frequency() -> None:
    rig = published_rig()
    v = rig.values
    omega_n = math.sqrt(v["fluid.bulk_modulus_pa"] * oil_spring(rig, 0.15) / v["load.mass_kg"])
    value, deviation = np.array([[0.03, omega_n, 0.1]]), np.array([[1e-3, 0.01 * omega_n, 0.01]])
    reading = Reading(np.array([1.0]), value, deviation, ("ok",), np.zeros((1, 6)))
    found = read_rig_values(reading, rig, 0.15)
    assert found is not None
    assert found.bulk_modulus_pa[0] == pytest.approx(v["fluid.bulk_modulus_pa"])
    assert found.mass_kg[0] == pytest.approx(v["load.mass_kg"])
    # Both go with the square of omega_n, one up and one down.
    up = (1.0 + 0.01 * SIGMAS) ** 2
    assert found.bulk_modulus_pa[2] == pytest.approx(up * v["fluid.bulk_modulus_pa"])
    assert found.mass_kg[1] == pytest.approx(v["load.mass_kg"] / up)
    assert found.bulk_modulus_pa[1] < found.bulk_modulus_pa[0] < found.bulk_modulus_pa[2]
    assert found.mass_kg[1] < found.mass_kg[0] < found.mass_kg[2]


def test_no_reading_says_nothing_of_the_rig() -> None:
    nothing = np.full((1, 3), np.nan)
    reading = Reading(np.array([1.0]), nothing, nothing, ("no_integrator",), np.zeros((1, 6)))
    assert read_rig_values(reading, published_rig(), 0.15) is None
