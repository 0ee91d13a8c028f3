# SPDX-License-Identifier: MIT
"""Derives from the maps whether a claim holds, does not hold, or holds only for some conditions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from .claims import Judged, ResetJudged
from .evidence import Comparison, Finding

# A claim holds if it holds in at least this share of the conditions. It fails if it holds in at
# most one minus this share.
NEARLY = 0.9


class Verdict(StrEnum):
    """Verdict on a claim over a map of conditions."""

    holds = "holds"
    fails = "does not hold"
    partly = "holds only for some"


@dataclass(frozen=True)
class Level:
    """One value of a condition, and the shares of its cells in which a claim holds or fails."""

    value: str
    holds: float
    fails: float


@dataclass(frozen=True)
class ClaimVerdict:
    """Verdict on one claim, with the shares of the map that support it.

    Attributes
    ----------
    claim
        the claim in words.
    verdict
        verdict over the whole map.
    holds, fails, equal
        shares of the map, 0 to 1, where the claim holds, where it fails, and where there is no
        difference; in the rest the runs decide nothing or no contender settles.
    levels
        shares for each value of a condition, by name of the condition.
    """

    claim: str
    verdict: Verdict
    holds: float
    fails: float
    equal: float
    levels: dict[str, tuple[Level, ...]]

    def where(self) -> str:
        """Lists the values of each condition at which the claim nearly always or never holds."""
        parts = []
        for name, levels in self.levels.items():
            good = [level.value for level in levels if level.holds >= NEARLY]
            bad = [level.value for level in levels if level.holds <= 1.0 - NEARLY]
            if good and len(good) < len(levels):
                parts.append(f"holds for {name} {', '.join(good)}")
            if bad and len(bad) < len(levels):
                parts.append(f"does not for {name} {', '.join(bad)}")
        return "; ".join(parts) or "no single condition decides"


def _share(findings: Sequence[Finding], wanted: Finding) -> float:
    return sum(finding is wanted for finding in findings) / len(findings)


def _verdict(claim: str, cells: Sequence[tuple[dict[str, str], Comparison]]) -> ClaimVerdict:
    findings = [comparison.finding for _, comparison in cells]
    holds = _share(findings, Finding.holds)
    verdict = Verdict.partly
    if holds >= NEARLY:
        verdict = Verdict.holds
    elif holds <= 1.0 - NEARLY:
        verdict = Verdict.fails
    levels = {}
    for name in cells[0][0]:
        values = dict.fromkeys(condition[name] for condition, _ in cells)
        levels[name] = tuple(
            Level(
                value,
                *(
                    _share([c.finding for at, c in cells if at[name] == value], wanted)
                    for wanted in (Finding.holds, Finding.fails)
                ),
            )
            for value in values
        )
    return ClaimVerdict(
        claim,
        verdict,
        holds,
        _share(findings, Finding.fails),
        _share(findings, Finding.equal),
        levels,
    )


def _condition(judged: Judged) -> dict[str, str]:
    at = judged.condition
    return {
        "P0": f"{at.p0:g}",
        "noise": f"{at.noise:.3g}",
        "input": at.input.value,
        "lambda0": f"{at.lambda0:g}",
    }


CLAIMS: dict[str, Callable[[Judged], Comparison]] = {
    "The varying factor converges faster than lambda = 1": lambda judged: judged.faster,
    "The varying factor is calmer than lambda = 0.99 once converged": lambda judged: judged.calmer,
    "The varying factor has the lowest RMSE of the three": lambda judged: judged.lower_rmse,
}
RESET_CLAIM = "After a change the reset brings the estimate back sooner"


def verdicts(judged: Sequence[Judged], resets: Sequence[ResetJudged]) -> list[ClaimVerdict]:
    """Returns one verdict for each claim of the paper on the varying forgetting factor."""
    first_claims = [
        _verdict(claim, [(_condition(cell), of(cell)) for cell in judged])
        for claim, of in CLAIMS.items()
    ]
    reset_cells = [
        ({"noise": f"{cell.noise:.3g}", "factor": f"{cell.factor:g}"}, cell.sooner)
        for cell in resets
    ]
    return [*first_claims, _verdict(RESET_CLAIM, reset_cells)]
