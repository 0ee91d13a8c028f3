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
| | the other of these two, or `insufficient_data` | other verdict |
| | `effects`, `ambiguous`, `outside_catalogue` | false alarm |
| an effect outside of the catalogue | `outside_catalogue` | right |
| | `effects` | wrong name |
| | `ambiguous` | set without the truth |
| | anything else | missed |
| an effect that the diagnosis had to do without | `outside_catalogue`, `ambiguous` | right |
| | `effects` | wrong name |
| | anything else | missed |
| anything | the diagnosis raised an error | failed |

Both laws of friction count as the same effect, so the other law is right, too, where the true one
was left out of the catalogue. A spring contains a constant force: a diagnosis that names a spring
where the truth is a force is right; one that names a force where the truth is a spring is not.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from ehsid.harness.gap.inference.choice import FRICTION
from ehsid.harness.validation.scoring.reading import FAILED, Answer, Said

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
KNOWN = ("one", "two")  # kinds with effects of the catalogue
HEALTHY = {"none": "no_gap", "params": "parameters"}
STRUCTURAL = ("effects", "ambiguous", "outside_catalogue")


@dataclass(frozen=True)
class Judgement:
    """Judgement of one diagnosis; None where a question does not arise in this case.

    Attributes
    ----------
    outcome
        outcome by the table above.
    subsystem_first
        whether the subsystem with the largest share in `where` is that of a true effect, in the
        catalogue or not.
    effect_first
        whether the first effect named is a true one, whatever the verdict.
    exact
        whether the effects named are exactly the true ones, whatever the verdict.
    in_set
        whether one of the sets returned is the truth; without sets, the effects named are the set.
    set_size
        number of sets returned; None where nothing was named.
    wrong_name
        whether the verdict is `effects` and the first effect is not a true one.
    false_effect
        whether an effect was named in a machine without effects.
    false_alarm
        whether the verdict for a machine without effects is that it has one, named or not.
    recognised
        whether the verdict for an effect outside or left out of the catalogue says so.
    rejected
        whether the verdict for an effect in the catalogue says that it is outside.
    abstained
        whether the true effects were not named, but listed as those that cannot be judged.
    """

    outcome: Outcome
    subsystem_first: bool | None = None
    effect_first: bool | None = None
    exact: bool | None = None
    in_set: bool | None = None
    set_size: int | None = None
    wrong_name: bool | None = None
    false_effect: bool | None = None
    false_alarm: bool | None = None
    recognised: bool | None = None
    rejected: bool | None = None
    abstained: bool | None = None

    @property
    def right(self) -> bool:
        """Whether the diagnosis as a whole is right."""
        return self.outcome == "right"


def is_true(named: str, effects: Collection[str]) -> bool:
    """Whether the name stands for one of the true effects."""
    return any(_stands_for(named, one) for one in effects)


def is_exactly(named: Collection[str], effects: Collection[str]) -> bool:
    """Whether the names stand for all of the true effects and for nothing else."""
    return (
        len(named) == len(effects)
        and all(any(_stands_for(name, one) for name in named) for one in effects)
        and all(is_true(name, effects) for name in named)
    )


def _stands_for(named: str, true: str) -> bool:
    if named in FRICTION:
        return true in FRICTION
    return named == true or (named, true) == ("load_spring", "load_force")


def first_subsystem(said: Said) -> str | None:
    """Returns the subsystem with the largest share in `where`; None where there are no shares."""
    return max(said.subsystem, key=lambda name: said.subsystem[name], default=None)


def left_out(answer: Answer, said: Said) -> bool:
    """Whether a true effect was excluded from the catalogue of the diagnosis."""
    return bool(set(answer.effects) & set(said.settings.get("effects_excluded", ())))


def judge(answer: Answer, said: Said) -> Judgement:
    """Compares the diagnosis with the truth."""
    named = [one.id for one in said.named]
    if answer.kind in HEALTHY:
        return Judgement(
            _of_healthy(answer.kind, said.verdict),
            false_effect=bool(named),
            false_alarm=said.verdict in STRUCTURAL,
        )
    truth = tuple(answer.effects)
    first = bool(named) and answer.kind in KNOWN and is_true(named[0], truth)
    common = Judgement(
        "missed",
        subsystem_first=first_subsystem(said) in answer.subsystems,
        wrong_name=said.verdict == "effects" and not first,
    )
    if left_out(answer, said):
        recognised = said.verdict == "outside_catalogue"
        return _with(common, _of_left_out(said.verdict, first), recognised=recognised)
    if answer.kind not in KNOWN:
        recognised = said.verdict == "outside_catalogue"
        return _with(common, _of_open(said.verdict), recognised=recognised)
    exact = is_exactly(named, truth)
    in_set = any(is_exactly(one, truth) for one in (said.sets or [named]))
    return _with(
        common,
        _of_known(said, truth, first, exact, in_set),
        effect_first=first,
        exact=exact,
        in_set=in_set,
        set_size=(len(said.sets) or 1) if named else None,
        rejected=said.verdict == "outside_catalogue",
        abstained=_abstained(said, truth),
    )


def _with(judgement: Judgement, outcome: Outcome, **more: Any) -> Judgement:
    return replace(judgement, outcome=outcome, **more)


def _abstained(said: Said, truth: Sequence[str]) -> bool:
    silent = said.verdict in ("no_gap", "insufficient_data")
    return silent and all(one in said.cannot_judge for one in truth)


def _of_healthy(kind: str, verdict: str) -> Outcome:
    if verdict == FAILED:
        return "failed"
    if verdict in STRUCTURAL:
        return "false alarm"
    return "right" if verdict == HEALTHY[kind] else "other verdict"


def _of_left_out(verdict: str, first: bool) -> Outcome:
    if verdict == "ambiguous" or (verdict == "effects" and first):
        return "right"
    return _of_open(verdict)


def _of_open(verdict: str) -> Outcome:
    found: dict[str, Outcome] = {
        "outside_catalogue": "right",
        "effects": "wrong name",
        "ambiguous": "set without the truth",
        FAILED: "failed",
    }
    return found.get(verdict, "missed")


def _of_known(said: Said, truth: Sequence[str], first: bool, exact: bool, in_set: bool) -> Outcome:
    match said.verdict:
        case "effects":
            return "right" if exact else "incomplete" if first else "wrong name"
        case "ambiguous":
            return "right" if in_set else "set without the truth"
        case "outside_catalogue":
            return "rejected"
        case "failed":
            return "failed"
    return "abstained" if _abstained(said, truth) else "missed"
