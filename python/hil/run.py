# SPDX-License-Identifier: MIT
"""Runs host and target in lock step: the host simulates the servo, the target controls it.

The target also estimates the parameters. This is the mixed-reality scheme of the paper (its section
on real-time implementation) with exchanged roles: the plant is simulated, the controller is real.
The simulated time does not advance while the host waits for an answer, so the result of a run does
not depend on the line and its speed.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.parameters import parameter_keys
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.firmware.configuration import EstimatorConfiguration
from ehsid.harness.signals.simulation.run import OUTPUTS, OUTPUTS_OF, as_measured, prepare

from .answers import Result, SampleAnswer, ServoResult
from .cycles import TICKS
from .frames import HilError, TargetReset
from .messages import Sample, Steer, Stopped
from .plan import Plan
from .recording import Recording
from .session import Counters, Session

POSITION = OUTPUTS.index("position_m")
MOST_RESTARTS = 3


@dataclass(frozen=True, eq=False)
class RunResult:
    """Result of a run of N samples."""

    plan: Plan
    command_v: FloatArray
    position_m: FloatArray
    """Commands that the target sent, V, and positions that it received, m; shape (N,), float32
    numbers."""
    results: tuple[SampleAnswer, ...]
    """The N answers of the target."""
    restarts: tuple[int, ...]
    """Numbers of the samples before which the target was reset and configured anew."""
    counters: Counters
    """Errors on the line during this run."""
    seconds: float
    """Duration of the run on the wall clock, s."""
    begun: Mapping[int, EstimatorConfiguration] = field(default_factory=dict)
    """Settings with which the user let the estimator begin anew, by the number of the sample."""
    machines: Mapping[int, Mapping[str, float]] = field(default_factory=dict)
    """Values of the machine from a sample on, in place of those of the plan, by its number."""

    @property
    def numbers(self) -> npt.NDArray[np.int64]:
        """Numbers of the N samples; they jump where cycles were lost."""
        return np.array([result.number for result in self.results], dtype=np.int64)

    @property
    def arx_results(self) -> list[Result]:
        """The answers, of an estimator of an ARX model."""
        return [result for result in self.results if isinstance(result, Result)]

    @property
    def servo_results(self) -> list[ServoResult]:
        """The answers, of a ServoEstimator."""
        return [result for result in self.results if isinstance(result, ServoResult)]


Progress = Callable[[int, SampleAnswer, Counters], None]


def run_plan(
    plan: Plan,
    session: Session,
    recording: Recording,
    *,
    real_time: bool = False,
    progress: Progress | None = None,
    steer: Steer | None = None,
) -> RunResult:
    """Configures the target, starts it, and carries out the plan.

    A target that was reset during the run is configured anew and continues at the same sample, with
    its initial estimate; the fourth reset ends the run. The valve is closed at every end of the
    run, as far as the target can be reached.

    Parameters
    ----------
    plan
        plan of the run.
    session
        session on an open line; a call of `hello` is not needed before.
    recording
        receives every sample as soon as the target has answered it.
    real_time
        whether to wait for t_k on the wall clock before sample k; if not, the run is as fast as the
        line allows.
    progress
        called after each sample.
    steer
        the user's requests during the run; not for a plan with a change of the plant.

    Raises
    ------
    HilError
        the target does not answer, refuses a request, was reset too often, or answers with values
        that cannot be, or the simulated position is not finite.
    SimulationError
        the rig cannot be simulated.
    """
    start = prepare(
        plan.rig, dt_s=plan.dt_s, position0_m=plan.position0_m, values=plan.values or None
    )
    cycles = plan.cycles
    if cycles is not None:
        # The machine moves on by ticks, with at least as many steps in a cycle.
        start = replace(start, dt_s=plan.dt_s / TICKS, substeps=-(-start.substeps // TICKS))
    plant = start.plant(quantised=False)
    outputs = OUTPUTS_OF[plan.rig.plant]
    n_parameters = plan.configuration.estimator.orders.n_parameters
    speed, times = plan.reference_speed_m_s, plan.times_s
    results: list[SampleAnswer] = []
    positions: list[float] = []
    held_v = 0.0  # the command of the last sample
    restarts: list[int] = []
    begun: dict[int, EstimatorConfiguration] = {}
    machines: dict[int, Mapping[str, float]] = {}
    before = replace(session.counters)
    began = time.monotonic()
    _begin(session, plan, 0)
    try:
        for k in range(plan.samples):
            if cycles is not None and cycles.lost[k]:
                plant.run(np.full(cycles.ticks[k], held_v))
                continue
            shown = as_measured(plant.read(), plan.noise[k], start.values)
            if k == plan.change_at:
                factors = plan.change.items()
                changed = {name: factor * plan.rig.values[name] for name, factor in factors}
                plant = _in_its_state(plan, {**plan.values, **changed}, plant)
            if not np.isfinite(shown[POSITION]):
                raise HilError(
                    f"{plan.name}: the simulated position is not finite from sample {k} on: the "
                    "loop is not stable; take a smaller --bandwidth or a shorter --dt"
                )
            # The record and the target must have the same position, rounded to float32.
            shown[POSITION] = float(np.float32(shown[POSITION]))
            sample = Sample(
                number=k,
                position_m=float(shown[POSITION]),
                reference_m=float(plan.reference_m[k]),
                reference_velocity_m_s=float(speed[k]),
                direct_v=float(plan.direct_v[k]),
            )
            if real_time:
                time.sleep(max(0.0, began + times[k] - time.monotonic()))
            request = None if steer is None else steer(k)
            if isinstance(request, EstimatorConfiguration):
                begun[k] = request
                _begin_anew(session, plan, request, k)
            elif request is not None:
                machines[k] = request
                plant = _in_its_state(plan, request, plant)
            result = _answer(session, plan, sample, restarts)
            if isinstance(result, Result) and len(result.theta) != n_parameters:
                raise HilError(
                    f"{plan.name}: the target answered sample {k} with an estimate of "
                    f"{len(result.theta)} parameters: expected the {n_parameters} of its "
                    "configuration; is the firmware of examples/firmware/servo on it?"
                )
            results.append(result)
            positions.append(sample.position_m)
            counters = _since(session.counters, before)
            recording.add(
                float(times[k]),
                {name: float(shown[OUTPUTS.index(name)]) for name in outputs},
                sample.reference_m,
                result,
                counters,
                len(restarts),
            )
            if cycles is None:
                plant.advance(result.command_v)
            else:
                late = cycles.overrun[k]
                plant.run(np.full(cycles.ticks[k], held_v if late else result.command_v))
            held_v = result.command_v
            if progress is not None:
                progress(k + 1, result, counters)
    except Stopped:
        if not results:
            raise HilError(f"{plan.name}: the run was stopped before its first sample") from None
        plan = plan.cut(len(results))
    except HilError:
        raise  # without further requests the watchdog of the target closes the valve
    except BaseException:
        with suppress(HilError):
            session.stop()
        raise
    with suppress(HilError):  # the run is complete; if this fails, the watchdog closes the valve
        session.stop()
    return RunResult(
        plan,
        np.array([result.command_v for result in results]),
        np.array(positions),
        tuple(results),
        tuple(restarts),
        _since(session.counters, before),
        time.monotonic() - began,
        begun,
        machines,
    )


def _since(now: Counters, before: Counters) -> Counters:
    counts = asdict(before)
    return Counters(**{name: count - counts[name] for name, count in asdict(now).items()})


def _in_its_state(plan: Plan, values: Mapping[str, float], plant: ehsid.Plant) -> ehsid.Plant:
    """Returns a machine with other values in the present state of the machine, its spool at null.

    A spool settles within milliseconds, a tenth of a sample at the sampling time of the experiment.
    What a transport delay holds is lost as well.
    """
    state = dict(zip(OUTPUTS, plant.read(), strict=True))
    # Only some of the outputs have an initial value as a parameter.
    initial = (key for key in parameter_keys() if key.is_initial)
    start: dict[str, float] = {key: float(state[key.parameter]) for key in initial}
    stroke = plan.rig.values.get("cylinder.stroke_m")
    if stroke is not None:  # an end stop yields a little
        key = ParameterKey.of_initial("position_m")
        start[key] = min(max(start[key], 0.0), stroke)
    return prepare(plan.rig, dt_s=plan.dt_s, values={**values, **start}).plant(quantised=False)


def _begin(session: Session, plan: Plan, first: int) -> None:
    session.hello()
    session.configure(plan.configuration)
    session.start(first)


def _begin_anew(
    session: Session, plan: Plan, estimator: EstimatorConfiguration, first: int
) -> None:
    """Lets the estimator begin anew; the valve is closed for the time of three requests."""
    wanted = replace(plan, configuration=replace(plan.configuration, estimator=estimator))
    try:
        session.stop()
        session.configure(wanted.configuration)
        session.start(first)
    except TargetReset:
        _restart(session, wanted, first)


def _answer(session: Session, plan: Plan, sample: Sample, restarts: list[int]) -> SampleAnswer:
    """Returns the answer to a sample; restarts a target that was reset, at most three times."""
    while True:
        try:
            return session.exchange(sample)
        except TargetReset as error:
            if len(restarts) == MOST_RESTARTS:
                raise HilError(
                    f"the target was reset {MOST_RESTARTS + 1} times, now before sample "
                    f"{sample.number}: the run ends; look at its supply and its watchdog"
                ) from error
            restarts.append(sample.number)
            _restart(session, plan, sample.number)


def _restart(session: Session, plan: Plan, first: int) -> None:
    """Configures and starts the target again; a further reset meanwhile counts as the same one."""
    for _ in range(MOST_RESTARTS):
        try:
            return _begin(session, plan, first)
        except TargetReset:
            continue
    raise HilError(f"the target does not stay up: reset again and again before sample {first}")
