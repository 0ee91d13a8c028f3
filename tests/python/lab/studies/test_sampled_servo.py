# SPDX-License-Identifier: MIT
import numpy as np
import pytest
import scipy.signal

import ehsid
from ehsid.harness.show.page import Table
from ehsid.lab.studies.experiment import ServoReading
from ehsid.lab.studies.linearisation import sample_again
from ehsid.lab.studies.pages.recursive_sections import reading_section
from ehsid.lab.studies.reading import Reading

DT_S = 0.05
VALUE = np.array([[np.nan] * 3, [0.02, 13.0, 0.4], [np.nan] * 3])
THETA = np.arange(18.0).reshape(3, 6)


def reading(*status: str) -> Reading:
    return Reading(np.array([0.5, 1.0, 1.5]), VALUE, np.zeros((3, 3)), status, THETA)


def test_the_last_servo_is_sampled_by_both() -> None:
    found = sample_again(reading("no_gain", "ok", "aliasing"), DT_S)
    assert found is not None
    assert (found.gain, found.omega_n, found.xi) == (0.02, 13.0, 0.4)
    np.testing.assert_array_equal(found.estimate, THETA[1])
    numerator, denominator, _ = scipy.signal.cont2discrete(
        ([0.02 * 169.0], [1.0, 2.0 * 0.4 * 13.0, 169.0, 0.0]), DT_S, method="zoh"
    )
    expected = [*denominator[1:], *numerator[0, 1:]]
    np.testing.assert_allclose(found.by_control, expected, atol=1e-12)
    np.testing.assert_allclose(found.ours, expected, atol=1e-12)
    servo = ehsid.ContinuousServo(gain=0.02, omega_n=13.0, xi=0.4)
    np.testing.assert_array_equal(found.ours, ehsid.discretise(servo, DT_S))


def test_without_a_servo_there_is_nothing_to_sample() -> None:
    assert sample_again(reading("no_gain", "no_gain", "aliasing"), DT_S) is None


def test_the_page_has_them_side_by_side() -> None:
    told = reading("no_gain", "ok", "aliasing")
    found = sample_again(told, DT_S)
    assert found is not None
    section = reading_section(ServoReading(told, None, found))
    (table,) = [block for block in section.blocks if isinstance(block, Table)]
    assert list(table.columns) == ["", "estimate", "ehsid.discretise", "python-control"]
    assert [row[0] for row in table.rows] == ["a1", "a2", "a3", "b1", "b2", "b3"]
    for row, ours in zip(table.rows, found.ours, strict=True):
        assert float(row[2]) == pytest.approx(ours, rel=1e-5)
        assert float(row[3]) == pytest.approx(ours, rel=1e-5)
    assert not [
        b for b in reading_section(ServoReading(told, None, None)).blocks if isinstance(b, Table)
    ]
