# SPDX-License-Identifier: MIT
"""A target in this process, for users without a board: controller and estimator of the firmware.

It does what examples/firmware/servo does with an estimator of an ARX model, but needs no line.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import ehsid

from .answers import Done, Identity, Result
from .comparison import ESTIMATED
from .configuration import POLICIES, Configuration
from .messages import VERSION, Hello, Sample, State
from .session import Counters, Request, Session

BOARD = "this computer"
MOST_PARAMETERS = 13  # na and nb up to 6, and the offset
FIT_WINDOW = 1000  # samples, as in ehsid/fit.hpp


class HostTarget(Session):
    """A session with a target that answers at once; nothing is lost on the way to it.

    Its requests come in the order of `run_plan`, and none is refused for its state.
    """

    def __init__(self) -> None:
        self.counters = Counters()
        self.identity: Identity | None = None
        self._servo, self._attempts, self._timeout_s = False, 1, 1.0

    def _ask(
        self, request: Request, wanted: type[Any], what: str, attempts: int | None = None
    ) -> Any:
        del wanted, what, attempts
        match request:
            case Hello():
                major, minor, patch = map(int, ehsid.__version__.split(".")[:3])
                policies = frozenset(range(len(POLICIES)))
                parameters = frozenset(range(MOST_PARAMETERS + 1))
                return Identity(VERSION, (major, minor, patch), policies, parameters, BOARD)
            case Configuration():
                if request.servo is not None:
                    raise ValueError(f"{BOARD} as the target has no ServoEstimator: take a board")
                self._loop = _Loop(request)
            case Sample():
                return self._loop.sample(request)
        return Done(State.READY)


class _Loop:
    """Controller and estimator between two configurations; see control_loop.cpp of the firmware."""

    def __init__(self, configuration: Configuration) -> None:
        self._orders = configuration.estimator.orders
        self._estimator = configuration.estimator.estimator()
        self._settings = configuration.controller
        self._gain = self._settings.fixed_gain_v_m
        self._trusted = 0.0  # velocity gain of an estimate that has settled, m/(s V); 0 without one
        self._fit = _Fit()

    def sample(self, now: Sample) -> Result:
        """Returns command and estimate of a sample."""
        settings, estimator = self._settings, self._estimator
        estimated = settings.retune and self._trusted > 0.0
        self._gain = self._retuned() if estimated else settings.fixed_gain_v_m
        volts = now.direct_v
        if settings.position_control:
            volts += self._gain * (now.reference_m - now.position_m)
            volts += settings.feed_forward_v_s_m * now.reference_velocity_m_s
        limit = settings.command_limit_v
        command_v = float(np.float32(min(max(volts, -limit), limit)))
        status = estimator.step(command_v, now.position_m)
        # Before it has its first samples, the estimator has no innovation.
        innovation_m = estimator.innovation if math.isfinite(estimator.innovation) else 0.0
        if status in ESTIMATED:
            self._fit.update(now.position_m, innovation_m)
        theta = tuple(map(float, estimator.theta_hat))
        velocity_gain = self._velocity_gain(theta)
        self._trusted = velocity_gain if estimator.settled and not ehsid.is_error(status) else 0.0
        return Result(
            number=now.number,
            command_v=command_v,
            gain_v_m=self._gain,
            velocity_gain_m_s_v=velocity_gain,
            status=int(status),
            converged=estimator.converged,
            gain_estimated=estimated,
            limited=abs(command_v) >= float(np.float32(limit)),
            residuals_white=estimator.residuals_white,
            resets=estimator.resets,
            innovation_m=innovation_m,
            forgetting_factor=estimator.forgetting_factor,
            fit_percent=self._fit.percent,
            excitation=estimator.excitation,
            residual_variance_m2=estimator.residual_variance,
            step_cycles=0,
            bad_frames=0,
            repeated=0,
            trips=0,
            theta=theta,
        )

    def _retuned(self) -> float:
        """Returns the gain from the estimate, V/m, at most one step from the last one."""
        settings = self._settings
        wanted = settings.bandwidth_rad_s / self._trusted
        wanted = min(max(wanted, settings.gain_min_v_m), settings.gain_max_v_m)
        step = settings.gain_step * settings.fixed_gain_v_m
        return min(max(wanted, self._gain - step), self._gain + step)

    def _velocity_gain(self, theta: tuple[float, ...]) -> float:
        """Returns the steady velocity per volt of the model, m/(s V); 0 where it gives none."""
        na, nb = self._orders.na, self._orders.nb
        # K = B(1) / (T C(1)) with A(x) = (1 - x) C(x), hence C(1) = -A'(1)
        steady = -sum((i + 1) * theta[i] for i in range(na))
        whole = sum(theta[na : na + nb])
        gain = whole / (self._settings.sample_time_s * steady) if steady else 0.0
        return gain if math.isfinite(gain) and gain > 0.0 else 0.0


class _Fit:
    """Fit one step ahead of the last samples; `FitMonitor` of the firmware."""

    def __init__(self) -> None:
        self._samples, self._mean, self._variance, self._square = 0, 0.0, 0.0, 0.0

    def update(self, output: float, innovation: float) -> None:
        self._samples = min(self._samples + 1, FIT_WINDOW)
        share, away = 1.0 / self._samples, output - self._mean
        self._mean += share * away
        self._variance = (1.0 - share) * (self._variance + share * away**2)
        self._square += share * (innovation**2 - self._square)

    @property
    def percent(self) -> float:
        if not self._variance > 0.0:
            return 0.0
        return 100.0 * (1.0 - math.sqrt(self._square / self._variance))
