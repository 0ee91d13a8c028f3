# SPDX-License-Identifier: MIT
"""One run of a user's simulator on a record, with effects of the catalogue around it.

A simulator's state cannot be set, so that a window cannot begin at the measured position. Before
each window the error of the position is fed back into the command (caught), then the feedback ends
and the simulator settles (released); only what follows is compared.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import numpy as np
import numpy.typing as npt

import ehsid

from ..base.numbers import FloatArray
from ..catalogue.channels import CHAMBER_PRESSURES, POSITION
from .opening import Opened, PythonRecord, PythonSteps

_NUMBERS = count()

# Feedback before each window, and rest until it counts, s: measured on five machines, this leaves
# 0.2 % of the motion in the position and 7 % in pressures.
CATCH_S = 0.2
SETTLE_S = 0.06
# The first catch of a simulator whose start position cannot be stated.
FIRST_CATCH_S = 1.0
# The error falls with this rate while it is caught, 1/s.
CATCH_RATE_1_S = 12.0
# Times that a simulator of a whole record is run to find the pulses that catch it.
PULSES = 3


@dataclass(frozen=True, eq=False)
class Told:
    """What runs need of a record of N samples."""

    command_v: FloatArray
    position_m: FloatArray
    """Shape (N,), measured."""
    caught: npt.NDArray[np.uint8]
    """Shape (N,), 1 where the error of the position is fed back."""
    dt_s: float
    number: int = field(default_factory=_NUMBERS.__next__)
    """Of this process: each record has another one."""


@dataclass(frozen=True, eq=False)
class Around:
    """What acts around the simulator, and its own values, in one run."""

    values: FloatArray
    """Shape (P,), as `ehsid.run_fmu` takes them."""
    own: Mapping[str, float]
    """Values of the simulator by its own names."""
    position0_m: float | None
    """Where the run begins; None where that cannot be stated."""
    substeps: int = 1
    gain_v_m: float = 0.0
    mass_kg: float = 0.0
    stiffness_pa_m3: tuple[float, float] = (0.0, 0.0)
    valve: tuple[float, float] = (0.0, 0.0)
    """Natural frequency, Hz, and damping ratio of the simulator's own valve; 0 is unknown."""


def run_around(opened: Opened, told: Told, around: Around) -> FloatArray:
    """Returns the outputs, shape (N, 6), in the order of `ehsid.plant_outputs()`.

    They are NaN for what the simulator does not give, and from where it failed on.
    """
    started = opened.start(around.own, around.position0_m)
    if isinstance(started, PythonRecord):
        return _run_whole(started, told, around)
    # The same for both; what it is stands in the stub of the compiled module.
    shared: dict[str, Any] = {
        "dt_s": told.dt_s,
        "substeps": around.substeps,
        "measured": told.position_m,
        "caught": told.caught,
        "gain": around.gain_v_m,
        "mass": around.mass_kg,
        "stiffness": around.stiffness_pa_m3,
        "valve": around.valve,
    }
    if isinstance(started, PythonSteps):
        outputs, _ = ehsid.run_steps(
            started.read,
            started.step,
            opened.inputs,
            opened.outputs,
            around.values,
            told.command_v,
            **shared,
        )
        return outputs
    outputs, _ = ehsid.run_fmu(
        started.major,
        started.component,
        started.set_real,
        started.get_real,
        started.do_step,
        _variables(opened.inputs, started.input_refs, started.input_scale, started.input_offset),
        _variables(
            opened.outputs, started.output_refs, started.output_scale, started.output_offset
        ),
        around.values,
        told.command_v,
        **shared,
    )
    return outputs


def _variables(
    names: tuple[str, ...],
    references: npt.NDArray[np.uint32],
    scales: FloatArray,
    offsets: FloatArray,
) -> list[tuple[str, int, float, float]]:
    return [
        (name, int(reference), float(scale), float(offset))
        for name, reference, scale, offset in zip(names, references, scales, offsets, strict=True)
    ]


def _run_whole(simulate: PythonRecord, told: Told, around: Around) -> FloatArray:
    """Runs a function of a whole record, which cannot be stepped.

    Each catch is a pulse of the command. Its size follows from the error of the run before: the
    position moves by speed per volt times size times duration.
    """
    sent = ehsid.outside_command(
        around.values,
        told.command_v,
        dt_s=told.dt_s,
        substeps=1,
        valve=around.valve,
    )
    edges = np.flatnonzero(np.diff(told.caught.astype(np.int8), prepend=0, append=0))
    feedback = np.zeros_like(sent)
    outputs = _whole(simulate, told, sent)
    for _ in range(PULSES if around.gain_v_m > 0.0 else 0):
        error = told.position_m - outputs[:, 0]
        moved = 0.0
        for begin, end in edges.reshape(-1, 2).tolist():
            # What the pulse has to move the rod by, less what earlier pulses now move it by.
            missing = float(error[min(end, error.size - 1)]) - moved
            seconds = (end - begin) * told.dt_s
            feedback[begin:end] += missing * around.gain_v_m / (CATCH_RATE_1_S * seconds)
            moved += missing
        outputs = _whole(simulate, told, sent + feedback)
    return _sensed(outputs, told, around)


def _whole(simulate: PythonRecord, told: Told, command_v: FloatArray) -> FloatArray:
    """Outputs, shape (N, 6), as `run_around` gives them."""
    given = simulate.run(told.dt_s, {"command_v": command_v})
    none = np.full(command_v.size, np.nan)
    return np.column_stack([given.get(name, none) for name in ehsid.plant_outputs()])


def _sensed(outputs: FloatArray, told: Told, around: Around) -> FloatArray:
    """The outputs with the effects of the sensors on them: a run of nothing but that."""
    names = [POSITION, *CHAMBER_PRESSURES]
    places = [ehsid.plant_outputs().index(name) for name in names]
    signals = outputs[:, places].tolist()
    now = iter(signals)
    sensed, _ = ehsid.run_steps(
        lambda: next(now),
        lambda _h, _inputs: next(now, signals[-1]),
        ("command_v",),
        tuple(names),
        around.values,
        told.command_v,
        dt_s=told.dt_s,
        substeps=1,
        measured=told.position_m,
        caught=np.zeros(told.command_v.size, np.uint8),
        gain=0.0,
        mass=0.0,
        stiffness=(0.0, 0.0),
        valve=(0.0, 0.0),
    )
    result = outputs.copy()
    result[:, places] = sensed[:, places]
    return result


def catches(
    samples: int, dt_s: float, *, window_s: float, first_s: float
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.uint8]]:
    """Window number of each sample, -1 outside of windows, and 1 where the simulator is caught.

    first_s: length of the first catch.
    """
    catch, settle = max(2, round(CATCH_S / dt_s)), max(1, round(SETTLE_S / dt_s))
    length = max(2, round(window_s / dt_s))
    window = np.full(samples, -1, np.int64)
    caught = np.zeros(samples, np.uint8)
    begin, number, hold = 0, 0, max(catch, round(first_s / dt_s))
    while begin < samples:
        caught[begin : begin + hold] = 1
        start = begin + hold + settle
        window[start : start + length] = number
        begin, number, hold = start + length, number + 1, catch
    return window, caught
