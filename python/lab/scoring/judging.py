# SPDX-License-Identifier: MIT
"""Rules by which a diagnosis counts as right; they are written only here.

| in the machine | verdict | outcome |
|---|---|---|
| one or two effects | `effects`, exactly these | right |
| | `effects`, the first is one of them, the set is another | incomplete |
| | `effects`, the first is none of them | wrong name |
| | `ambiguous`, one of the sets is exactly these | right |
| | `ambiguous`, none of them is | set without the truth |
| | `outside_catalogue` | rejected |
| | `no_gap` or `insufficient_data`, all listed under `cannot_judge` | abstained |
| | `no_gap`, `parameters`, `insufficient_data` | missed |
| none, or wrong values only | `no_gap`, `parameters` respectively | right |
| none | `parameters`, no value of the rig file differs: only what no data sheet gives | right |
| | the other of these two, or `insufficient_data` | other verdict |
| | `effects`, `ambiguous`, `outside_catalogue` | false alarm |
| an effect outside of the catalogue | `outside_catalogue` | right |
| | `effects`, the one that is nearly it (`NEAR`) | right |
| | `effects`, anything else | wrong name |
| | `ambiguous`, the most probable set is not nearly it | set without the truth |
| | anything else | missed |
| a linkage, perhaps with effects of the catalogue | `outside_catalogue` | right |
| | `effects`, `ambiguous`: of the catalogue's, of its load (`PARTS`), nothing else | incomplete |
| | `effects`, anything else | wrong name |
| | `ambiguous`, the most probable set has anything else | set without the truth |
| | anything else | missed |
| an effect that the diagnosis had to do without | `outside_catalogue`, `ambiguous` | right |
| | `effects` | wrong name |
| | anything else | missed |
| anything | the diagnosis raised an error | failed |

All laws of friction count as the same effect, so another law is right, too, where the true one was
left out of the catalogue. Unequal overlaps are a dead band and a null bias. So is a dead band whose
ends differ: beside it a null bias is true if it is that of the middle of both ends, within a factor
of NULL_WITHIN, and is not required. A spring contains a
constant force: a diagnosis that names a spring where the truth is a force is right; one that names
a force where the truth is a spring is not.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

from ehsid.harness.catalogue.families import friction_laws, spelled_out
from ehsid.harness.diagnosis.schema import Estimate

from ..blind.making import Answer, Kind
from .findings import FAILED, Findings

SENSORS = ("pressures", "position only")  # what was measured
Outcome = Literal[
    "right",
    "incomplete",
    "wrong name",
    "set without the truth",
    "rejected",
    "abstained",
    "missed",
    "other verdict",
    "false alarm",
    "failed",
]
KINDS: tuple[Kind, ...] = get_args(Kind)
KNOWN = ("one", "two")  # kinds with effects of the catalogue
HEALTHY = {"none": "no_gap", "params": "parameters"}
STRUCTURAL = ("effects", "ambiguous", "outside_catalogue")
# Causes of the generator that the catalogue has in another form. Either answer is right: its name,
# or that the catalogue does not have it.
NEAR = {
    "position_dependent_friction": "position_friction",
    "second_load_mass": "flexible_load",
    "valve_stiction": "spool_stiction",
    "warming_oil": "flow_gain_drift",
    "heating_oil": "flow_gain_drift",
    "dissolving_air": "entrained_air",
    "bowed_scale": "sensor_nonlinearity",
}
# Effects of the catalogue that are a part of what it does not have: the weight of a boom is a load.
PARTS = {"linkage": ("load_force", "load_spring")}
# Limits of the calibrated rig's gap over its noise floor; below the first, no name is required.
GAP_SIZES = (3.0, 10.0)
NULL_BIAS, NULL_WITHIN = "valve_null_bias", 1.5
GAP_NAMES = ("below 3 x floor", "3 to 10 x floor", "above 10 x floor", "gap not known")


@dataclass(frozen=True)
class Judgement:
    """Judgement of one diagnosis; None where a question does not arise in this case."""

    outcome: Outcome
    """Outcome by the table above."""
    subsystem_first: bool | None = None
    """Whether the subsystem with the largest share in `where` is that of a true effect, in the
    catalogue or not."""
    effect_first: bool | None = None
    """Whether the first effect named is a true one, whatever the verdict."""
    exact: bool | None = None
    """Whether the effects named are exactly the true ones, whatever the verdict."""
    in_set: bool | None = None
    """Whether one of the sets returned is the truth; without sets, the effects named are the set.
    """
    set_size: int | None = None
    """Number of sets returned; None where nothing was named."""
    wrong_name: bool | None = None
    """Whether the verdict is `effects` and the first effect is not a true one."""
    false_effect: bool | None = None
    """Whether an effect was named in a machine without effects."""
    false_alarm: bool | None = None
    """Whether the verdict for a machine without effects is that it has one, named or not."""
    recognised: bool | None = None
    """Whether the verdict for an effect outside or left out of the catalogue says so."""
    rejected: bool | None = None
    """Whether the verdict for an effect in the catalogue says that it is outside."""
    abstained: bool | None = None
    """Whether the true effects were not named, but listed as those that cannot be judged."""
    law: bool | None = None
    """Whether all laws that were found are in the machine; None where none was found, or the answer
    tells none."""
    beside: bool | None = None
    """Whether exactly the effects of the catalogue were named that are beside such laws."""

    @property
    def right(self) -> bool:
        """Whether the diagnosis as a whole is right."""
        return self.outcome == "right"


@dataclass(frozen=True)
class Transfer:
    """Gaps and shrinkage on the transfer record."""

    from_nominal: Estimate
    of_explainable: Estimate | None
    """Realised shrinkage; the second is None where no gap lies above the noise floor or no effect
    was named."""
    nominal: float
    augmented: float
    """Gaps of the rig as configured and of the augmented rig on the transfer record, nrmse."""


@dataclass(frozen=True)
class Edited:
    """The found rig on a record after the effects of its machine were changed; gaps are nrmse."""

    case: str
    edit: str
    """Name of the case, and "removed" or "halved": what became of the effects of the machine, and
    of those that were named."""
    own: float
    """Gap of the found rig on the held-out record of its diagnosis, before the change."""
    found: float
    edited: float
    """Gaps on the new record, of the found rig and of the edited one."""
    left: Estimate | None
    """Share of the named sizes that the new record shows to be left; None where it shows none."""

    @property
    def over_own(self) -> float:
        """Gap of the edited rig over its own before the change."""
        return self.edited / self.own


@dataclass(frozen=True)
class ScoredCase:
    """A finished case; `transfer` is None without a third record or without compared outputs."""

    name: str
    answer: Answer
    findings: Findings
    judgement: Judgement
    transfer: Transfer | None = None
    edits: tuple[Edited, ...] = ()

    @property
    def names_right(self) -> bool:
        """Whether exactly the true effects were named, whatever the verdict."""
        return bool(self.judgement.exact)

    @property
    def gap_size(self) -> str:
        """Size of the gap over its noise floor in words, one of `GAP_NAMES`."""
        if self.findings.gap is None:
            return GAP_NAMES[-1]
        return GAP_NAMES[sum(self.findings.gap >= size for size in GAP_SIZES)]

    @property
    def name_required(self) -> bool:
        """Whether the gap is large enough to require a name; True where the gap is not known."""
        return self.findings.gap is None or self.findings.gap >= GAP_SIZES[0]

    @property
    def left_out(self) -> bool:
        """Whether the diagnosis had to leave out a true effect."""
        return left_out(self.answer, self.findings)

    @property
    def measured(self) -> str:
        """What was measured, one of `SENSORS`."""
        return SENSORS[0] if "pressure" in self.answer.sensors else SENSORS[1]

    @property
    def known(self) -> bool:
        """Whether the machine has effects of the catalogue and no others."""
        return self.answer.kind in KNOWN


def group_by(
    cases: Sequence[ScoredCase], key: Callable[[ScoredCase], str | None]
) -> dict[str, list[ScoredCase]]:
    """Groups the cases by the key in alphabetic order; cases whose key is None are left out."""
    groups: dict[str, list[ScoredCase]] = {}
    for case in cases:
        name = key(case)
        if name is not None:
            groups.setdefault(name, []).append(case)
    return dict(sorted(groups.items()))


def is_true(named: str, effects: Collection[str]) -> bool:
    """Whether the name stands for one of the true effects."""
    true = spelled_out([*effects])
    return all(any(_stands_for(name, each) for each in true) for name in spelled_out([named]))


def is_exactly(named: Collection[str], effects: Collection[str]) -> bool:
    """Whether the names stand for all of the true effects and for nothing else."""
    named, effects = spelled_out([*named]), spelled_out([*effects])
    return (
        len(named) == len(effects)
        and all(any(_stands_for(name, effect) for name in named) for effect in effects)
        and all(is_true(name, effects) for name in named)
    )


def _stands_for(named: str, true: str) -> bool:
    if named in friction_laws():
        return true in friction_laws()
    return named == true or (named, true) == ("load_spring", "load_force")


def left_out(answer: Answer, findings: Findings) -> bool:
    """Whether a true effect was excluded from the catalogue of the diagnosis."""
    return bool(set(answer.effects) & set(findings.settings.get("effects_excluded", ())))


def judge(answer: Answer, findings: Findings) -> Judgement:
    """Compares the diagnosis with the truth."""
    named = [effect.id for effect in findings.named]
    verdict = findings.verdict
    if answer.kind in HEALTHY:
        return Judgement(
            _of_healthy(answer.kind, verdict, findings.moved),
            false_effect=bool(named),
            false_alarm=verdict in STRUCTURAL,
        )
    truth = (*answer.effects, *_null_by_ends(answer, findings))
    first = bool(named) and answer.kind in KNOWN and is_true(named[0], truth)
    near = not first and bool(named) and named == [NEAR.get(effect) for effect in truth]
    largest = max(findings.subsystem, key=lambda name: findings.subsystem[name], default=None)

    def structural(outcome: Outcome, **answers: Any) -> Judgement:
        return Judgement(
            outcome,
            subsystem_first=largest in answer.subsystem,
            wrong_name=verdict == "effects" and not (first or near),
            **answers,
        )

    excluded = left_out(answer, findings)
    if answer.laws and not excluded:
        parts = [part for effect in truth for part in PARTS.get(effect, ())]
        others = [name for name in named if not is_true(name, [*truth, *parts])]
        known = [effect for effect in truth if effect not in PARTS]
        return Judgement(
            _beside_laws(verdict, bool(others)),
            subsystem_first=largest in answer.subsystem,
            wrong_name=verdict == "effects" and bool(others),
            recognised=verdict == "outside_catalogue",
            law=set(findings.laws) <= set(answer.laws) if findings.laws else None,
            beside=not others and all(is_true(effect, named) for effect in known),
        )
    if excluded or answer.kind not in KNOWN:
        right = near or (excluded and (verdict == "ambiguous" or first))
        recognised = verdict == "outside_catalogue" or (verdict == "effects" and near)
        return structural(_of_unknown(verdict, right), recognised=recognised)
    exact = is_exactly(named, truth)
    in_set = any(is_exactly(group, truth) for group in (findings.sets or [named]))
    silent = verdict in ("no_gap", "insufficient_data")
    abstained = silent and all(effect in findings.cannot_judge for effect in truth)
    return structural(
        _of_known(verdict, first, exact, in_set, abstained),
        effect_first=first,
        exact=exact,
        in_set=in_set,
        set_size=(len(findings.sets) or 1) if named else None,
        rejected=verdict == "outside_catalogue",
        abstained=abstained,
    )


def _null_by_ends(answer: Answer, findings: Findings) -> tuple[str, ...]:
    """The null bias, where it is named and is that of a dead band whose ends differ."""
    sizes = {each.id: each.sizes for each in findings.named}.get(NULL_BIAS, {})
    if "offset" not in sizes or not answer.null_bias or NULL_BIAS in answer.effects:
        return ()
    share = sizes["offset"].value / answer.null_bias
    return (NULL_BIAS,) if 1.0 / NULL_WITHIN <= share <= NULL_WITHIN else ()


def _of_healthy(kind: str, verdict: str, moved: bool) -> Outcome:
    if verdict == FAILED:
        return "failed"
    if verdict in STRUCTURAL:
        return "false alarm"
    blameless = verdict == "parameters" and not moved
    return "right" if blameless or verdict == HEALTHY[kind] else "other verdict"


def _of_unknown(verdict: str, right: bool) -> Outcome:
    """Outcome where the effect is not in the catalogue; `right`: effects or a set are right."""
    match verdict:
        case "outside_catalogue":
            return "right"
        case "effects":
            return "right" if right else "wrong name"
        case "ambiguous":
            return "right" if right else "set without the truth"
        case "failed":
            return "failed"
    return "missed"


def _beside_laws(verdict: str, others: bool) -> Outcome:
    """Outcome where laws are missing; `others`: something is named that is not in the machine."""
    if others or verdict not in ("effects", "ambiguous"):
        return _of_unknown(verdict, right=False)
    return "incomplete"


def _of_known(verdict: str, first: bool, exact: bool, in_set: bool, abstained: bool) -> Outcome:
    match verdict:
        case "effects":
            return "right" if exact else "incomplete" if first else "wrong name"
        case "ambiguous":
            return "right" if in_set else "set without the truth"
        case "outside_catalogue":
            return "rejected"
        case "failed":
            return "failed"
    return "abstained" if abstained else "missed"
