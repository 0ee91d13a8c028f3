# SPDX-License-Identifier: MIT
"""Header of a `ServoEstimator`: its settings, and a self-test for the target."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import ehsid

from ..base.exchange import sha256_of
from ..models.estimation.advice import servo_words
from ..models.estimation.servo import MOST_DELAY, ServoPath, estimate_servo
from ..models.identification import IdentificationError, IoData
from .header import check_name, comment, template

TEST_SAMPLES = 600
LEAST_ROOM = 4
"""kMaxDelay of ehsid::ServoEstimator where nothing else is asked for."""


@dataclass(frozen=True)
class ServoSettings:
    """Settings of a `ServoEstimator`, with its names and defaults."""

    dt_s: float
    delay: int = 1
    drift: float = 0.02
    tolerance: float = 0.1

    @classmethod
    def chosen(cls, dt_s: float, chosen: Mapping[str, float]) -> ServoSettings:
        """Returns the defaults with some of delay, drift and tolerance replaced.

        Raises
        ------
        ValueError
            a setting is out of its range; the message names it.
        """
        delay = chosen.get("delay", 1)
        if delay not in range(1, MOST_DELAY + 1):
            raise ValueError(
                f"delay {delay:g}: expected a whole number of samples, 1 to {MOST_DELAY}"
            )
        others = {name: number for name, number in chosen.items() if name != "delay"}
        made = cls(dt_s, int(delay), **others)
        made.estimator()  # checks the others
        return made

    def __str__(self) -> str:
        return (
            f"ServoEstimator, {self.dt_s:.6g} s, delay {self.delay}, drift {self.drift:g}, "
            f"tolerance {self.tolerance:g}"
        )

    def estimator(self) -> ehsid.ServoEstimator:
        """Returns a new estimator in float32, as on the target."""
        return ehsid.ServoEstimator(
            self.dt_s, delay=self.delay, drift=self.drift, tolerance=self.tolerance
        )


@dataclass(frozen=True)
class ServoHeader:
    """A header for a firmware, and the servo of the record that it was made from."""

    text: str
    settings: ServoSettings
    servo: ServoPath
    tested: str

    @property
    def words(self) -> list[str]:
        """Says why values cannot be trusted at the end of the record, and what to do."""
        return servo_words(self.servo)

    @property
    def summary(self) -> str:
        """What the header holds, and what the estimator finds in the record, in one line."""
        return f"{self.settings}; in the record {self.servo}; {self.tested}"


def self_test_values(settings: ServoSettings) -> list[float]:
    """Returns value and half width of K, omega_n and xi after the self-test of the header.

    It computes a servo with the operations of the header, in its order, in float32.
    """
    estimator = settings.estimator()
    position = velocity = np.float32(0.0)
    random = 1
    for k in range(TEST_SAMPLES):
        random = (random * 1664525 + 1013904223) % 2**32
        noise = np.float32(random >> 16) * np.float32(2.0**-24)
        command = np.float32(1.0 if k // 50 % 2 == 0 else -1.0)
        estimator.step(float(command), float(position + noise))
        velocity = velocity + np.float32(0.25) * (command - velocity)
        position = position + np.float32(0.0625) * velocity
    told = estimator.servo()
    values = (told.gain, told.omega_n, told.xi)
    return [number for value in values for number in (value.value, value.half_width)]


def render_servo_header(
    settings: ServoSettings, *, name: str, c: bool = False, provenance: Sequence[str] = ()
) -> str:
    """Returns the text of the header, in C++ or in C99 for ehsid/c_api.h.

    Raises
    ------
    ValueError
        the name or a setting cannot be used.
    """
    settings.estimator()  # raises ValueError where a setting is out of its range
    return template("servo.h.j2" if c else "servo.hpp.j2").render(
        name=check_name(name),
        version=ehsid.__version__,
        provenance=[comment(line).replace("*/", "*_") for line in provenance],
        settings=settings,
        room=max(settings.delay, LEAST_ROOM),
        samples=TEST_SAMPLES,
        told=[] if c else self_test_values(settings),
    )


def servo_header_of_record(
    source: Path, data: IoData, chosen: Mapping[str, float], *, name: str = "servo", c: bool = False
) -> ServoHeader:
    """Runs the estimator over a record, and returns the header that configures it.

    Parameters
    ----------
    source, data, name, c
        as in `header_of_record`.
    chosen
        settings other than the defaults: some of delay, drift and tolerance. Without a delay that
        of the record.

    Raises
    ------
    IdentificationError
        the sampling time of the record is not known.
    ValueError
        the name or a setting cannot be used.
    """
    if data.dt_s is None:
        raise IdentificationError(
            "the sampling time of the record is not known, and a servo needs it; give --dt"
        )
    settings = ServoSettings.chosen(data.dt_s, chosen)
    servo = estimate_servo(data, settings.delay)
    assert servo is not None  # the sampling time is known
    if "delay" not in chosen:
        settings = replace(settings, delay=servo.delay)
    provenance = [
        f"Record {source.name}, {data.n_samples} samples at {data.dt_s:.6g} s,",
        f"sha256 {sha256_of(source)};" if source.is_file() else "a folder;",
        f"command: {data.input_name}, position: {data.output_name}, in the units of the record.",
        f"In the record: {servo}.".replace("±", "+-"),  # compilers may expect ASCII
    ]
    text = render_servo_header(settings, name=name, c=c, provenance=provenance)
    tested = "no self-test" if c else f"self-test over {TEST_SAMPLES} samples"
    return ServoHeader(text, settings, servo, tested)
