# SPDX-License-Identifier: MIT
"""Content of `hil.json`: the results of the runs with the hardware in the loop."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np

import ehsid
from ehsid.harness.models.estimation.servo import ServoPath

from .answers import Identity, Result
from .comparison import Agreement, rmse
from .configuration import POLICIES
from .cycles import Cycles
from .run import RunResult
from .session import Counters

# Name of a run, its result, and how it agrees with the host.
Runs = Sequence[tuple[str, RunResult, Agreement]]


@dataclass(frozen=True)
class Target:
    """The target: its board, the versions of firmware and protocol, and the estimators it holds."""

    board: str
    firmware: str
    protocol: int
    policies: tuple[str, ...]
    parameters: tuple[int, ...]


@dataclass(frozen=True)
class Parameter:
    """A parameter at the end of a run, in the units of the signals."""

    value: float
    standard_deviation: float


@dataclass(frozen=True)
class ServoFigures:
    """K, omega_n or xi of a servo: the last one that was trusted, or else that of the end."""

    value: float | None
    ci90: tuple[float, float] | None
    """The value and its 90 % interval; null before there is one."""
    trusted: bool
    """Whether it was trusted, at the end or for a tenth of the samples."""
    reason_at_end: str
    trusted_share: float
    """Why it is not trusted at the end, or "trusted"; share of the samples at which it was."""


@dataclass(frozen=True)
class ServoFound:
    """What a ServoEstimator told: K in m/s per V, omega_n in rad/s, xi; delay in samples."""

    gain: ServoFigures
    omega_n: ServoFigures
    xi: ServoFigures
    delay: int


@dataclass(frozen=True)
class CyclesFound:
    """The cycles of a run where they were not regular."""

    jitter: float
    lost: float
    overrun: float
    """Largest deviation of a cycle's time as a share of the sampling time, and shares of cycles
    lost and late, as asked for."""
    cycles: int
    cycles_lost: int
    cycles_overrun: int
    """Number of all cycles, of those that did not run, and of those whose command came late."""
    shortest_s: float
    longest_s: float
    deviation_s: float
    """Shortest and longest time of a cycle, and the standard deviation of these times, s."""


@dataclass(frozen=True)
class MachineChange:
    """A change of the simulated machine by the user during a run."""

    before_sample: int
    """Number of the sample before which the machine was changed."""
    time_s: float
    """Time of this sample, s."""
    values: Mapping[str, float]
    """All values in which the machine differs from its rig file from there on, by full name, such
    as effects.valve_dead_band.overlap; none where it is as the file says."""


@dataclass(frozen=True)
class Control:
    """The controller of a run."""

    position_control: bool
    """Whether the target controlled the position."""
    gain_fixed_v_m: float
    gain_v_m: float
    """Configured gain, and gain at the end, V/m."""
    velocity_gain_m_s_v: float
    """Velocity gain at the end, computed from the parameters, m/s/V; 0 if they give none. Of a
    servo it is K."""
    share_retuned: float
    share_at_limit: float
    """Shares of the samples whose gain came from the estimate, and whose command was at its limit.
    """


@dataclass(frozen=True)
class Run:
    """A run; what changes during it is given as it was at the end."""

    name: str
    rig: str
    """Name of the run and of the simulated rig."""
    dt_s: float
    samples: int
    seconds: float
    """Sampling time, s, number of samples, and duration on the wall clock, s."""
    change: Mapping[str, float]
    change_at_sample: int | None
    """Factors on values of the rig, by full name, and the sample from which on they act."""
    forgetting: str | None
    orders: str | None
    """Forgetting policy and orders of the estimator, as text; null for a ServoEstimator."""
    parameters: Mapping[str, Parameter]
    """Estimates by name; none for a ServoEstimator."""
    rmse_m: float
    """RMSE of the innovation, m; null for a ServoEstimator."""
    forgetting_factor: float
    fit_percent: float
    converged: bool | None
    residuals_white: bool | None
    """As in the answer to the last sample; null for a ServoEstimator."""
    resets: int
    status: str
    """How often the estimator has begun anew, and the status of the last sample."""
    servo: ServoFound | None
    """What a ServoEstimator told; null for another estimator."""
    controller: Control
    """What the controller did."""
    equal_to_host: bool
    samples_that_differ: int
    largest_difference: float
    """Comparison of the estimates with those of the host, bit for bit: number of samples that
    differ, and largest difference of a parameter as a share of its size."""
    line: Counters
    """Errors on the line that were corrected."""
    target_resets_before_samples: tuple[int, ...]
    """Numbers of the samples before which the target was reset and configured anew."""
    estimator_begun_before_samples: tuple[int, ...]
    """Numbers of the samples before which the user let the estimator begin anew."""
    cycles: CyclesFound | None
    """The cycles; null where all were regular."""
    machine_changes: tuple[MachineChange, ...] = ()
    """What the user changed of the simulated machine, in order; only the page Live can do it."""


@dataclass(frozen=True)
class Provenance:
    """How the runs were made, and how long all of them took on the wall clock, s.

    `rig` is the rig file of the controller, `actual` that of the simulated machine where it is
    another, and `effects` has the values of the machine that the controller does not know, by full
    name. `loop` is experiment, open or position.
    """

    ehsid_version: str
    rig: str
    actual: str | None
    effects: Mapping[str, float]
    line: str
    loop: str
    seed: int
    seconds: float


@dataclass(frozen=True)
class HilFile:
    """Content of the file; `equal_to_host`: all estimates are those of the host, bit for bit."""

    schema_version: Literal[1]
    target: Target
    equal_to_host: bool
    runs: tuple[Run, ...]
    provenance: Provenance


def hil_file(identity: Identity, runs: Runs, provenance: Provenance) -> HilFile:
    """Returns the content of the file."""
    return HilFile(
        schema_version=1,
        target=Target(
            identity.board,
            ".".join(map(str, identity.firmware)),
            identity.version,
            tuple(POLICIES[i].__name__ for i in sorted(identity.policies) if i < len(POLICIES)),
            tuple(sorted(identity.parameters)),
        ),
        equal_to_host=all(agreement.equal for *_, agreement in runs),
        runs=tuple(_run(*run) for run in runs),
        provenance=provenance,
    )


def _found(servo: ServoPath) -> ServoFound:
    gain, omega_n, xi = (ServoFigures(**value.to_dict()) for value in servo)
    return ServoFound(gain, omega_n, xi, servo.delay)


def _cycles(cycles: Cycles) -> CyclesFound:
    times = cycles.durations_s
    return CyclesFound(
        **asdict(cycles.options),
        cycles=times.size,
        cycles_lost=int(np.sum(cycles.lost)),
        cycles_overrun=int(np.sum(cycles.overrun)),
        shortest_s=float(times.min()),
        longest_s=float(times.max()),
        deviation_s=float(np.std(times)),
    )


def _run(name: str, run: RunResult, agreement: Agreement) -> Run:
    plan, last = run.plan, run.results[-1]
    estimator, controller = plan.configuration.estimator, plan.configuration.controller
    samples, servo = len(run.results), agreement.servo
    arx = last if isinstance(last, Result) else None
    names = estimator.orders.names if arx else ()
    estimates = zip(names, agreement.theta[-1], agreement.replay.deviation[-1], strict=True)
    return Run(
        name=name,
        rig=plan.rig.name,
        dt_s=plan.dt_s,
        samples=samples,
        seconds=round(run.seconds, 3),
        change=dict(plan.change),
        change_at_sample=plan.change_at,
        forgetting=repr(estimator.forgetting) if arx else None,
        orders=str(estimator.orders) if arx else None,
        parameters={
            parameter: Parameter(float(value), float(deviation))
            for parameter, value, deviation in estimates
        },
        rmse_m=rmse(run),
        forgetting_factor=arx.forgetting_factor if arx else math.nan,
        fit_percent=arx.fit_percent if arx else math.nan,
        converged=arx.converged if arx else None,
        residuals_white=arx.residuals_white if arx else None,
        resets=arx.resets if arx else servo.resets if servo else 0,
        status=ehsid.Status(last.status).name,
        servo=_found(servo) if servo else None,
        controller=Control(
            controller.position_control,
            controller.fixed_gain_v_m,
            last.gain_v_m,
            last.velocity_gain_m_s_v,
            sum(result.gain_estimated for result in run.results) / samples,
            sum(result.limited for result in run.results) / samples,
        ),
        equal_to_host=agreement.equal,
        samples_that_differ=agreement.different.size,
        largest_difference=agreement.largest,
        line=run.counters,
        target_resets_before_samples=run.restarts,
        estimator_begun_before_samples=tuple(sorted(run.begun)),
        cycles=None if plan.cycles is None else _cycles(plan.cycles),
        machine_changes=tuple(
            MachineChange(sample, float(plan.times_s[sample]), dict(values))
            for sample, values in sorted(run.machines.items())
        ),
    )
