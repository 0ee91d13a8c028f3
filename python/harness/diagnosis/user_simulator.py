# SPDX-License-Identifier: MIT
"""What a diagnosis does otherwise where the simulator is the user's."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from msgspec.structs import replace as replace_part

from ..base.parallel import threads_only
from ..catalogue.parameters import effects
from ..rigs import Rig
from ..rigs.carried import carried
from ..simulators.runs import opened_runs
from .decision import results
from .decision.inside import Inside, inside_sentences, moved_furthest, outside_shares
from .decision.posterior import left
from .model.case import Case
from .model.differences import SimulatorEngine
from .schema import SUBSYSTEMS, CannotJudge, Remark, Verdict, Where
from .search.candidates import FittedCandidate
from .search.search import SearchResult


@contextmanager
def engine_of(rig: Rig) -> Iterator[SimulatorEngine | None]:
    """The simulator of the rig, opened in processes of its own; None where that is ours."""
    if rig.simulator is None:
        yield None
        return
    with opened_runs(rig) as runs, threads_only():
        yield SimulatorEngine(runs)


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
    explained: dict[str, float] = {}
    for candidate in found.refined:
        if len(candidate.effects) == 1:
            part = effects()[candidate.effects[0]].subsystem
            gain = without - left(case, candidate)
            explained[part] = max(explained.get(part, 0.0), gain)
    shares = outside_shares(inside, explained)
    told = {name: shares.get(name, 0.0) for name in SUBSYSTEMS} if shares else {}
    return replace_part(where, subsystem=told, notes=())


def simulator_remarks(case: Case, verdict: Verdict, inside: Sequence[Inside]) -> Iterator[Remark]:
    """What a reader must know of the runs of a user's simulator, and of what it cannot be given."""
    if case.engine is None:
        return
    runs = case.engine.runs
    yield Remark(
        "",
        f"The simulator is {runs.section.what}: {runs.runs} runs. It counts as exact to "
        f"{100.0 * case.engine.tolerance:.2g} % of the motion; 'tolerance' in "
        "[simulator] sets that.",
    )
    for message, count in runs.failures.items():
        yield Remark("", f"{count} of the runs of the simulator failed: {message}.")
    if verdict in ("parameters", "outside_catalogue"):
        for sentence in inside_sentences(case.rig, inside):
            yield Remark("", sentence)
