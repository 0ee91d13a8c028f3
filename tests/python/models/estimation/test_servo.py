# SPDX-License-Identifier: MIT
"""A record read as a servo: K, omega_n and xi with their intervals, whatever the sensor adds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.models.estimation.servo import ServoValue, estimate_servo
from ehsid.harness.models.identification.data import IoData
from ehsid.harness.records import read_record

GAIN, OMEGA_N, XI, DT_S, COUNT = 0.03, 40.0, 0.4, 0.01, 4000


def servo_run(
    *, friction: bool = False, most: float = 10.0, noise_m: float = 5e-6
) -> tuple[FloatArray, FloatArray]:
    """Returns command in V and position in m of a P loop with steps; 20 Euler steps a sample.

    With friction the valve has a dead band of 3 % of 10 V, and a tenth of the command that is left
    goes into overcoming friction whenever it turns. Commands end at +-most.
    """
    random = np.random.default_rng(5)
    command, position = np.zeros(COUNT), np.zeros(COUNT)
    x = v = a = 0.0
    for k in range(COUNT):
        position[k] = x + random.normal(0.0, noise_m)
        target = 0.02 if k % 120 < 60 else -0.02
        command[k] = np.clip(150.0 * (target - position[k]), -most, most)
        acting = command[k]
        if friction:
            acting = np.sign(acting) * max(abs(acting) - 0.3, 0.0)
        for _ in range(20):
            loss = 0.1 * np.tanh(v / 1e-3) if friction else 0.0
            a += DT_S / 20 * (OMEGA_N**2 * (GAIN * (acting - loss) - v) - 2 * XI * OMEGA_N * a)
            v += DT_S / 20 * a
            x += DT_S / 20 * v
    return command, position


def test_a_command_in_per_cent_has_a_gain_per_per_cent(tmp_path: Path) -> None:
    command, position = servo_run()
    columns = zip(DT_S * np.arange(COUNT), 10.0 * command, 1e3 * position, strict=True)
    lines = ["Time [s],Command [%],Position [mm]", *(",".join(map(str, row)) for row in columns)]
    log = tmp_path / "log.csv"
    log.write_text("\n".join(lines))
    data = IoData.from_record(read_record(log), "command_v", "position_m")
    path = estimate_servo(data, 1)
    assert path is not None
    gain = next(iter(path))
    assert gain.unit == "m/s per percent"
    told = gain.to_dict()
    assert told["ci90"][0] < 0.1 * GAIN < told["ci90"][1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bias_v", "offset_m", "late"),
    [(0.0, 0.0, 0), (0.3, 0.0, 0), (0.0, 0.5, 0), (0.0, 0.0, 1), (0.0, 0.0, 6)],
)
def test_null_bias_an_offset_and_a_late_sensor_change_nothing(
    bias_v: float, offset_m: float, late: int
) -> None:
    command, position = servo_run()
    # The valve's null is elsewhere: the logged command is larger by the bias.
    logged = position[: COUNT - late] + offset_m
    found = ehsid.estimate(command[late:] + bias_v, logged, DT_S)
    servo = found.servo
    assert servo is not None
    told = servo.to_dict()
    for name, value, apart in (("gain", GAIN, 0.02), ("omega_n", OMEGA_N, 0.05)):
        assert told[name]["value"] == pytest.approx(value, rel=apart)
        assert told[name]["trusted"]
    assert told["xi"]["value"] == pytest.approx(XI, abs=0.05)
    assert told["delay"] == 1 + late
    frame = found.to_polars()
    assert frame["K"].to_list()[servo.gain.at] == told["gain"]["value"]
    assert frame["K_trusted"].mean() == told["gain"]["trusted_share"]
    for words in (f"K {told['gain']['value']:.4g} ± ", " y/s per u, trusted; omega_n "):
        assert words in repr(found)


def test_a_servo_with_dead_band_and_friction_has_an_interval_and_no_word_of_moving_more() -> None:
    command, position = servo_run(friction=True, most=2.0)
    found = ehsid.estimate(command, position, DT_S)
    told = found.servo.to_dict()["gain"] if found.servo else {}
    low, high = told["ci90"]
    # Dead band and friction take .4 of commands up to 2 V: the one K is 20 % lower at least.
    assert low < 0.95 * GAIN
    assert high - low > 0.02 * GAIN
    words = found.summary()
    assert "faster" not in words
    assert "K of the servo is known" in words or "At the end K" in words


def test_nothing_is_tried_where_the_servo_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    found = ehsid.estimate(*servo_run(), DT_S)
    assert not found.converged
    monkeypatch.delattr("ehsid.harness.models.estimation.advice.replay")
    assert "K of the servo is known" in found.summary()


@pytest.mark.parametrize(
    ("first", "end", "told_at", "reason"),
    [(10, 13, 99, "not_precise"), (10, 40, 39, "not_precise"), (97, 100, 99, "trusted")],
    ids=["for a moment", "for a while", "at the end"],
)
def test_a_value_is_trusted_at_the_end_or_for_more_than_a_moment(
    first: int, end: int, told_at: int, reason: str
) -> None:
    trusted = np.zeros(100, dtype=np.bool_)
    trusted[first:end] = True
    share, path = (end - first) / 100, np.arange(100.0)
    positive = ServoValue("K", "", path, 2.0 * path, trusted, share, ehsid.TrustReason[reason])
    for one in (positive, positive.told):
        assert one.to_dict() == {
            "value": float(told_at),
            "ci90": [0.0, 3.0 * told_at],
            "trusted": bool(trusted[told_at]),
            "reason_at_end": reason,
            "trusted_share": share,
        }
    assert replace(positive, path=-path).to_dict()["ci90"] == [-3.0 * told_at, 0.0]


@pytest.mark.parametrize(("na", "dt_s"), [(2, DT_S), (3, None)])
def test_what_is_no_servo_or_has_no_time_is_not_read_as_one(na: int, dt_s: float | None) -> None:
    command, position = servo_run()
    found = ehsid.estimate(command, position, dt_s, na=na)
    assert found.servo is None
    assert found.result.to_dict()["servo"] is None
