# SPDX-License-Identifier: MIT
"""What a diagnosis does otherwise where the simulator is the user's."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np
from msgspec.structs import replace as replace_part

from ..base.parallel import threads_only
from ..base.time_to_go import in_words
from ..rigs import Rig
from ..rigs.carried import carried
from ..signals.simulation import measured_states
from ..simulators.runs import opened_runs
from .decision import results
from .decision.inside import Inside, inside_sentences, moved_furthest, outside_shares
from .model.case import Case
from .model.differences import SimulatorEngine
from .options import Effort
from .schema import SUBSYSTEMS, CannotJudge, Remark, Verdict, Where
from .search.candidates import FittedCandidate
from .search.score import left
from .search.search import SearchResult


@contextmanager
def engine_of(rig: Rig) -> Iterator[SimulatorEngine | None]:
    """The simulator of the rig, opened in processes of its own; None where that is ours."""
    if rig.simulator is None:
        yield None
        return
    with opened_runs(rig) as runs, threads_only():
        yield SimulatorEngine(runs)


# Runs of a diagnosis for each record that is fitted, medians on 30 machines; some take four times
# as many.
EXPECTED_RUNS: Mapping[Effort, int] = {"list": 500, "screened": 1000, "full": 2400}
# A run that takes so many times as long as the first one has lost its way.
SLOWEST = 50.0


def forecast(case: Case) -> str:
    """Times one run of each record that is fitted; says how long the diagnosis will take."""
    assert case.engine is not None
    runs = case.engine.runs
    problem = case.problem()
    began = time.perf_counter()
    problem.simulate(problem.centre())
    # The records run side by side.
    seconds = (time.perf_counter() - began) * min(runs.processes, len(case.training))
    runs.limit_runs(SLOWEST * seconds)
    count = EXPECTED_RUNS[case.effort] * len(case.training)
    all_together = in_words(count * seconds / len(case.training) / runs.processes)
    return (
        f"{runs.section.what}: one run of the fitted records takes {seconds:.2g} s. With effort "
        f"'{case.effort}' about {count} runs are expected, {all_together} or more in "
        f"{runs.processes} processes."
    )


def check_direction(case: Case) -> str | None:
    """Says where the simulator moves against the machine; None where both move the same way."""
    assert case.engine is not None
    along = case.engine.runs.measured.speed_per_volt
    for record in case.records:
        speed = measured_states(record)[:, 1]
        command = record.column("command_v")
        with np.errstate(invalid="ignore"):
            together = float(np.corrcoef(speed, command)[0, 1])
        if math.isfinite(together) and together * along < 0.0 and abs(together) > AGAINST:
            return (
                f"record '{record.name}': a positive command moves the machine one way and the "
                "simulator the other way (correlation of speed and command "
                f"{together:+.2f}): correct the sign of the command or of the position, by "
                "'scale' in [simulator.inputs] or [simulator.outputs]"
            )
    return None


# Correlation of speed and command above which a record shows the direction.
AGAINST = 0.3


def not_carried(rig: Rig) -> Iterator[CannotJudge]:
    """Effects that cannot act on the simulator of a user from outside."""
    if rig.simulator is not None:
        for effect, reason in carried(rig).items():
            if reason is not None:
                yield CannotJudge(effect, reason)


def values_that_moved(case: Case, best: FittedCandidate) -> list[Inside]:
    """The values of a user's simulator that could stand in for what it cannot be given."""
    values, _ = results.estimates(case, best)
    parameters = case.parameters(best.effects)
    return moved_furthest(
        case.rig, {each.name: results.in_sigmas(each, values[each.name]) for each in parameters}
    )


def outside_of_simulator(
    case: Case, found: SearchResult, where: Where, inside: Sequence[Inside]
) -> Where:
    """Tells where a cause lies of which a user's simulator shows only what nearly explains it."""
    without = left(case, found.calibrated)
    explained = {
        candidate.effects[0]: max(0.0, without - left(case, candidate))
        for candidate in found.refined
        if len(candidate.effects) == 1
    }
    shares = outside_shares(case.rig, inside, explained)
    told = {name: shares.get(name, 0.0) for name in SUBSYSTEMS} if shares else {}
    return replace_part(where, subsystem=told, notes=())


def simulator_remarks(
    case: Case, verdict: Verdict, inside: Sequence[Inside], share: float
) -> Iterator[Remark]:
    """What a reader must know of the runs of a user's simulator, and of what it cannot be given.

    share: of the tolerance, with which the decision counted the errors.
    """
    if case.engine is None:
        return
    runs = case.engine.runs
    position, pressure = (
        100.0 * share * case.engine.share(name) for name in ("position_m", "pressure_a_pa")
    )
    yield Remark(
        "",
        f"The simulator is {runs.section.what}: {runs.runs} runs. It counts as exact to "
        f"{position:.2g} % of the motion, and in pressures to {pressure:.2g} %; 'tolerance' in "
        "[simulator] sets the first.",
    )
    for message, count in runs.failures.items():
        yield Remark("", f"{count} of the runs of the simulator failed: {message}.")
    if verdict in ("parameters", "outside_catalogue"):
        for sentence in inside_sentences(case.rig, inside):
            yield Remark("", sentence)
