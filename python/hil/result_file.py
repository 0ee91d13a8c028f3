# SPDX-License-Identifier: MIT
"""Content of `hil.json`: the results of the runs with the hardware in the loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import ehsid

from .answers import Identity
from .comparison import Agreement, rmse
from .configuration import POLICIES
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
class Control:
    """The controller of a run.

    Attributes
    ----------
    position_control
        whether the target controlled the position.
    gain_fixed_v_m, gain_v_m
        configured gain, and gain at the end, V/m.
    velocity_gain_m_s_v
        velocity gain at the end, computed from the parameters, m/s/V; 0 if they give none.
    share_retuned, share_at_limit
        shares of the samples whose gain came from the estimate, and whose command was at its limit.
    """

    position_control: bool
    gain_fixed_v_m: float
    gain_v_m: float
    velocity_gain_m_s_v: float
    share_retuned: float
    share_at_limit: float


@dataclass(frozen=True)
class Run:
    """A run; what changes during it is given as it was at the end.

    Attributes
    ----------
    name, rig
        name of the run and of the simulated rig.
    dt_s, samples, seconds
        sampling time, s, number of samples, and duration on the wall clock, s.
    change, change_at_sample
        factors on values of the rig, by full name, and the sample from which on they act.
    forgetting, orders
        forgetting policy and orders of the estimator, as text.
    parameters
        estimates by name.
    rmse_m
        RMSE of the innovation, m.
    forgetting_factor, fit_percent, converged, residuals_white, resets, status
        as in the answer to the last sample.
    controller
        what the controller did.
    equal_to_host, samples_that_differ, largest_difference
        comparison of the estimates with those of the host, bit for bit: number of samples that
        differ, and largest difference of a parameter as a share of its size.
    line
        errors on the line that were corrected.
    target_resets_before_samples
        numbers of the samples before which the target was reset and configured anew.
    estimator_begun_before_samples
        numbers of the samples before which the user let the estimator begin anew.
    """

    name: str
    rig: str
    dt_s: float
    samples: int
    seconds: float
    change: Mapping[str, float]
    change_at_sample: int | None
    forgetting: str
    orders: str
    parameters: Mapping[str, Parameter]
    rmse_m: float
    forgetting_factor: float
    fit_percent: float
    converged: bool
    residuals_white: bool
    resets: int
    status: str
    controller: Control
    equal_to_host: bool
    samples_that_differ: int
    largest_difference: float
    line: Counters
    target_resets_before_samples: tuple[int, ...]
    estimator_begun_before_samples: tuple[int, ...]


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


def _run(name: str, run: RunResult, agreement: Agreement) -> Run:
    plan, last = run.plan, run.results[-1]
    estimator, controller = plan.configuration.estimator, plan.configuration.controller
    samples = len(run.results)
    estimates = zip(
        estimator.orders.names, agreement.theta[-1], agreement.replay.deviation[-1], strict=True
    )
    return Run(
        name=name,
        rig=plan.rig.name,
        dt_s=plan.dt_s,
        samples=samples,
        seconds=round(run.seconds, 3),
        change=dict(plan.change),
        change_at_sample=plan.change_at,
        forgetting=repr(estimator.forgetting),
        orders=str(estimator.orders),
        parameters={
            parameter: Parameter(float(value), float(deviation))
            for parameter, value, deviation in estimates
        },
        rmse_m=rmse(run),
        forgetting_factor=last.forgetting_factor,
        fit_percent=last.fit_percent,
        converged=last.converged,
        residuals_white=last.residuals_white,
        resets=last.resets,
        status=ehsid.Status(last.status).name,
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
    )
