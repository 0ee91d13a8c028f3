# SPDX-License-Identifier: MIT
"""Reads effect values from a command line, written as effect.parameter=number.

Makes the test signal of the options, as a command or as the reference of a closed loop.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ...base.numbers import FloatArray
from ...catalogue.spellings import ParameterKey
from ...records.errors import SAMPLES
from ...rigs import Rig, RigError
from ...rigs.checks import check_values
from ..excitation import fit_to_travel, named_signal
from .controller import PositionController, command_limit, velocity_gain


def parse_settings(texts: Iterable[str]) -> dict[str, float]:
    """Returns values by full name from texts such as "coulomb_friction.force_n=400".

    Raises
    ------
    RigError
        a text has another form, a name is unknown, or a value is outside its range.
    """
    values: dict[str, float] = {}
    problems: list[str] = []
    for text in texts:
        name, equals, number = text.partition("=")
        if not equals or "." not in name:
            problems.append(
                f"'{text}': expected EFFECT.PARAMETER=NUMBER, as coulomb_friction.force_n=400"
            )
            continue
        effect, _, parameter = name.strip().partition(".")
        full = ParameterKey.of_effect(effect, parameter)
        try:
            value = float(number)
        except ValueError:
            problems.append(
                f"'{text}': expected EFFECT.PARAMETER=NUMBER; '{number}' is not a number"
            )
            continue
        problems += check_values({full: value})
        values[full] = value
    if problems:
        raise RigError("--effect", problems)
    return values


@dataclass(frozen=True)
class SignalOptions:
    """The options of a test signal."""

    signal: str
    """Kind of signal: multisine, prbs, steps, chirp or triangle."""
    duration: float
    dt: float
    """Length and sampling time, s."""
    amplitude: float | None
    """Peak, V for a command, m for a reference; None for the default."""
    seed: int
    """Seed of the random numbers."""

    @property
    def samples(self) -> int:
        """Number of samples; not more than a record may have."""
        given = f"--duration {self.duration:g}, --dt {self.dt:g}"
        if not (self.dt > 0.0 and 2.0 * self.dt <= self.duration < math.inf):
            raise ValueError(f"{given}: expected 0 < 2 dt <= duration")
        count = self.duration / self.dt  # infinite where dt is tiny
        if count > SAMPLES.most:
            raise ValueError(
                f"{given}: {count:.3g} samples: expected at most {SAMPLES.most}; take a shorter "
                f"signal or a longer sampling time, or {SAMPLES.remedy}"
            )
        return round(count)

    def make(self, *, default: float, top_hz: float) -> FloatArray:
        """Returns the signal, shape (samples,); its peak is `default` if no amplitude is given."""
        peak = default if self.amplitude is None else self.amplitude
        if not 0.0 < peak < math.inf:
            raise ValueError(f"--amplitude {peak:g}: expected a finite number > 0")
        top_hz = min(top_hz, 0.2 / self.dt)
        return named_signal(
            self.signal, self.samples, self.dt, peak=peak, top_hz=top_hz, seed=self.seed
        )


def start_position(rig: Rig, position0: float | None) -> float:
    """Returns the position in m where a run starts: `position0`, or mid-stroke if it is None."""
    return 0.5 * rig.values.get("cylinder.stroke_m", 0.0) if position0 is None else position0


def check_start(rig: Rig, position0: float | None) -> None:
    """Checks the option --position0.

    Raises
    ------
    ValueError
        the position is not finite, or outside the stroke.
    """
    stroke = rig.values.get("cylinder.stroke_m", math.inf)
    low = -math.inf if stroke == math.inf else 0.0
    if position0 is None or (math.isfinite(position0) and low <= position0 <= stroke):
        return
    expected = "a finite number of metres" if low < 0.0 else f"0 to {stroke:g} m, the stroke"
    raise ValueError(f"--position0 {position0:g}: expected {expected}")


def as_command(
    rig: Rig,
    options: SignalOptions,
    position0: float | None = None,
    speed_per_volt: float | None = None,
) -> FloatArray:
    """The test signal as a command within the limits of the machine, V.

    speed_per_volt: of the rod, m/(s V), where the rig does not tell it.
    """
    limit = command_limit(rig)
    if options.amplitude is not None and options.amplitude > limit:
        raise ValueError(
            f"--amplitude {options.amplitude:g}: expected at most the rated command, {limit:g} V"
        )
    command = options.make(default=0.1 * limit if math.isfinite(limit) else 1.0, top_hz=20.0)
    stroke = rig.values.get("cylinder.stroke_m")
    if stroke is not None and np.abs(command).max() <= limit:
        command = fit_to_travel(
            command,
            options.dt,
            gain_m_s_v=velocity_gain(rig) if speed_per_volt is None else abs(speed_per_volt),
            start_m=start_position(rig, position0),
            stroke_m=stroke,
        )
    peak = float(np.abs(command).max())
    if peak > limit:
        raise ValueError(f"--amplitude {peak:g}: expected at most the rated command, {limit:g} V")
    return command


def as_reference(
    rig: Rig, options: SignalOptions, controller: PositionController, position0: float | None = None
) -> FloatArray:
    """Returns the test signal as a position reference in m around the start position.

    It excites up to twice the bandwidth of the loop, but at least up to 2 Hz.
    """
    bandwidth_hz = controller.gain_v_m * velocity_gain(rig) / (2.0 * math.pi)
    default = 0.03 * rig.values.get("cylinder.stroke_m", 0.3)
    signal = options.make(default=default, top_hz=max(2.0, 2.0 * bandwidth_hz))
    return start_position(rig, position0) + signal
