# SPDX-License-Identifier: MIT
"""Cases of a check made by hand, with the candidates that the diagnosis tried."""

from ehsid.harness.diagnosis.schema import Candidate
from ehsid.lab.blind.making import Answer
from ehsid.lab.scoring.findings import Findings, NamedEffect
from ehsid.lab.scoring.judging import ScoredCase, judge

BAND, BIAS, LAG = "valve_dead_band", "valve_null_bias", "sensor_lag"


def candidate(
    effects: tuple[str, ...], score: float, fitted: float, held_out: float, free: int
) -> Candidate:
    """A set with its costs, nats, and its number of fitted values."""
    return Candidate(effects, score, 0.0, fitted_cost=fitted, held_out_cost=held_out, free=free)


CANDIDATES = (
    candidate((), 60.0, 100.0, 160.0, 12),
    candidate((BIAS,), 0.0, 41.0, 100.0, 13),
    candidate((BAND,), 4.0, 40.0, 104.0, 13),
    candidate((BAND, LAG), 9.0, 39.0, 109.0, 14),
)
N = 400.0


def case(findings: Findings, *truth: str, kind: str = "one", command: float = 0.5) -> ScoredCase:
    sizes = {one: {"limit": 0.8} if one.endswith("saturation") else {} for one in truth}
    answer = Answer(
        kind, "plain", "ehs", "pressures", ("prbs",), sizes, ("valve",), largest_command=(command,)
    )
    return ScoredCase("a1", answer, findings, judge(answer, findings))


def findings(
    *named: str, candidates: tuple[Candidate, ...] = CANDIDATES, **more: object
) -> Findings:
    verdict = "effects" if named else "no_gap"
    effects = tuple(NamedEffect(effect, 0.9) for effect in named)
    return Findings(verdict, effects, candidates=candidates, **more)  # type: ignore[arg-type]
