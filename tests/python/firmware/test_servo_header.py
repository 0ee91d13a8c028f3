# SPDX-License-Identifier: MIT
"""`ehsid export --servo`: a ServoEstimator for the firmware, configured from a record."""

import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import ehsid
from ehsid.harness.cli import cli
from ehsid.harness.firmware import ServoSettings, render_servo_header
from ehsid.harness.firmware.servo import self_test_values

DT_S = 0.01


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """25 rad/s, xi 0.3 and 0.03 m/s per V in a loop, whose command acts three samples later."""
    rng = np.random.default_rng(2)
    rows = np.zeros((3000, 2))
    p = v = a = 0.0
    for k in range(len(rows)):
        rows[k, 1] = p + 5e-6 * rng.normal()
        rows[k, 0] = 60.0 * ((0.02 if k // 80 % 2 == 0 else -0.02) - rows[k, 1])
        for _ in range(20):
            a += DT_S / 20 * (625.0 * (0.03 * rows[max(k - 2, 0), 0] - v) - 15.0 * a)
            v += DT_S / 20 * a
            p += DT_S / 20 * v
    path = tmp_path_factory.mktemp("servo") / "record.csv"
    np.savetxt(path, rows, delimiter=",", header="u,y", comments="")
    return path


def run(record: Path, *words: str, dt: bool = True) -> tuple[int, str, str]:
    columns = ["--input", "u", "--output", "y", *(["--dt", f"{DT_S}"] if dt else [])]
    out = ["--out", str(record.with_name("made.hpp"))]
    ended = CliRunner().invoke(cli, ["export", str(record), "--servo", *columns, *out, *words])
    return ended.exit_code, ended.stdout, ended.stderr


def test_the_header_has_the_delay_of_the_record_and_tells_what_was_found(record: Path) -> None:
    code, said, _ = run(record)
    text = record.with_name("made.hpp").read_text(encoding="utf-8")
    assert code == 0
    assert "delay 3" in said
    found = re.search(r"K (\S+) ± \S+ y/s per u, trusted; omega_n (\S+) ", said)
    assert found is not None, said
    assert [float(number) for number in found.groups()] == pytest.approx([0.03, 25.0], rel=0.05)
    assert "options.delay = 3;" in text
    assert "options.dt_s = 0x1.47ae14p-7F;" in text
    assert text.isascii()


def test_settings_are_those_that_were_given(record: Path) -> None:
    words = [f"--setting={one}" for one in ("delay=5", "drift=0.05", "tolerance=0.25")]
    code, *_ = run(record, "--c", *words)
    text = record.with_name("made.hpp").read_text(encoding="utf-8")
    assert code == 0
    assert ".delay = 5," in text
    assert "/* 0.05 */" in text
    assert ".tolerance = 0x1p-2F," in text


def test_a_record_without_a_sampling_time_is_refused(record: Path) -> None:
    code, _, told = run(record, dt=False)
    assert code == 2
    assert "--dt" in told


def test_the_defaults_are_those_of_the_estimator() -> None:
    # A saved state carries the settings.
    assert ServoSettings(DT_S).estimator().save() == ehsid.ServoEstimator(DT_S).save()


@pytest.mark.parametrize("dt_s", [1e-5, 1e-3, 0.05, 1.0])
@pytest.mark.parametrize("delay", [1, 20])
def test_the_self_test_has_something_to_compare(dt_s: float, delay: int) -> None:
    settings = ServoSettings(dt_s, delay=delay)
    assert np.isfinite(self_test_values(settings)).all()
    assert f"ServoEstimator<float, {max(delay, 4)}>" in render_servo_header(settings, name="x")
