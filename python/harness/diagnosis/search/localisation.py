# SPDX-License-Identifier: MIT
"""Place of the structural gap by subsystem, regime, frequency and time, with contradictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...catalogue.parameters import effects
from ..model.case import Case
from ..schema import SUBSYSTEM_TAKES_PART, SUBSYSTEMS, Equation, Where
from .candidates import FittedCandidate
from .maps import maps

# A subsystem with a twentieth of the gap hardly takes part in it.
SUBSYSTEM_SMALL = 0.05

# Parts whose shares are at least this share of the largest one explain the gap alike.
ALIKE = 0.5


def localise(
    case: Case,
    calibrated: FittedCandidate,
    best: FittedCandidate | None,
    *,
    equations: Sequence[Equation] = (),
    shares: Mapping[str, float] | None = None,
    laws: Sequence[tuple[str, float]] = (),
    others: Sequence[tuple[Sequence[str], float]] = (),
) -> Where:
    """Combines the shares of the equations, the selected effects and the maps of the gap.

    Parameters
    ----------
    case
        rig and records.
    calibrated
        the fit without effects.
    best
        the fit with the selected effects; None, or a fit without effects, where there are none.
    equations
        what each equation lacks beside the rig without effects.
    shares
        share of the held-out gain by id of the effect; by default all are equal.
    laws
        subsystem and share of the held-out gain of each law without a name.
    others
        sets that the data cannot tell from the selected one, with the odds of each against it.
    """
    problem = case.problem(held_out=True)
    floors = {name: floor.value for name, floor in case.floors.items()}
    mapped = maps(problem.records, problem.errors(calibrated.x), floors, case.rig)
    of_equations = _by_subsystem(equations)
    selected = best.effects if best is not None else ()
    if selected or laws:
        answers = [(_effect_shares(selected, shares, laws), 1.0)]
        answers += [(_effect_shares(effects, None), odds) for effects, odds in others]
        subsystem = _mean(answers)
        notes = _contradictions(subsystem, of_equations)
    else:
        subsystem, notes = of_equations, _undecided(of_equations)
    all_subsystems = {name: subsystem.get(name, 0.0) for name in SUBSYSTEMS} if subsystem else {}
    return Where(
        all_subsystems,
        mapped.regimes,
        mapped.frequency,
        mapped.time,
        tuple(equations),
        tuple(notes),
    )


def _by_subsystem(equations: Sequence[Equation]) -> dict[str, float]:
    subsystem: dict[str, float] = {}
    for equation in equations:
        subsystem[equation.subsystem] = subsystem.get(equation.subsystem, 0.0) + equation.share
    return subsystem


def _effect_shares(
    selected: Sequence[str],
    shares: Mapping[str, float] | None,
    laws: Sequence[tuple[str, float]] = (),
) -> dict[str, float]:
    """Returns the shares of the subsystems of these effects; a negative share counts as zero."""
    weights = {effect: max(shares.get(effect, 0.0), 0.0) if shares else 1.0 for effect in selected}
    total = sum(weights.values()) + sum(share for _, share in laws)
    if total <= 0.0:
        weights, total = dict.fromkeys(selected, 1.0), float(len(selected))
    parts = [(effects()[effect].subsystem, weight) for effect, weight in weights.items()]
    subsystem: dict[str, float] = {}
    for name, weight in (*parts, *laws):
        subsystem[name] = subsystem.get(name, 0.0) + weight / total
    return subsystem


def _mean(answers: Sequence[tuple[Mapping[str, float], float]]) -> dict[str, float]:
    """Returns the mean of the shares of several answers, each with its weight."""
    total = sum(weight for _, weight in answers)
    return {
        name: sum(shares.get(name, 0.0) * weight for shares, weight in answers) / total
        for name in SUBSYSTEMS
    }


def _contradictions(named: Mapping[str, float], of_equations: Mapping[str, float]) -> list[str]:
    """Returns a sentence where the equation that asks most for a term has no effect named in it.

    An equation counts alone, so that a second effect beside a larger one does not show there.
    """
    missing = [
        name
        for name, share in of_equations.items()
        if share >= SUBSYSTEM_TAKES_PART and share == max(of_equations.values())
    ]
    missing = [name for name in missing if named.get(name, 0.0) < SUBSYSTEM_SMALL]
    return [
        "With a single term of free form, the gap would rather be explained in another part of the "
        f"machine: {name}, {100.0 * of_equations[name]:.0f} %."
        for name in missing
    ]


def _undecided(of_equations: Mapping[str, float]) -> list[str]:
    """Returns a sentence where several parts of the machine explain the gap alike."""
    if not of_equations:
        return ["No term of any equation would explain a part of the gap."]
    largest = max(of_equations.values())
    near = [name for name, share in of_equations.items() if share >= ALIKE * largest]
    if len(near) == 1:
        return []
    return [
        "The data do not show in which of these parts of the machine the gap lies: "
        f"{', '.join(near)}."
    ]
