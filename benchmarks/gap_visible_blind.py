# SPDX-License-Identifier: MIT
"""Are effects named that the records can show? python benchmarks/gap_visible_blind.py CHECK...

CHECK is the folder of an `ehsid gap-check` that is finished. Each machine with known effects is
fitted without one of them, and our simulator tells what this effect, of its true size, would leave
beside that fit (`ehsid.harness.diagnosis.search.visible`). This gives the evidence for the effect,
as a ratio to the evidence that a name needs. Where the ratio is at least one, the records can show
the effect. It is compared with what the diagnosis named, which did not know the effect. An effect
that is named beside a cause outside of the catalogue does not count as found. Steps of a position
sensor are left out: the record shows them without a fit.
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from ehsid.harness.base.parallel import run_tasks, single_threaded_algebra
from ehsid.harness.diagnosis.data.gate import usable_part
from ehsid.harness.diagnosis.model.case import make_case
from ehsid.harness.diagnosis.model.parameters import effect_parameters
from ehsid.harness.diagnosis.model.scale import effect_starts
from ehsid.harness.diagnosis.search.candidates import calibrate, refine
from ehsid.harness.diagnosis.search.search import restrict
from ehsid.harness.diagnosis.search.visible import beyond, ground_of
from ehsid.lab.blind.making import ANSWERS, RESULTS, read_answers
from ehsid.lab.blind.running import read_case
from ehsid.lab.pages.check_words import figure_text
from ehsid.lab.scoring.figures import share
from ehsid.lab.scoring.findings import read_findings
from ehsid.lab.scoring.judging import ScoredCase, is_true, judge

# Groups of the table: ends of the evidence over what a name needs.
ENDS = (0.0, 0.5, 1.0, 2.0, np.inf)


@dataclass(frozen=True)
class Shown:
    """What records can show of an effect, and what its diagnosis named."""

    case: ScoredCase
    effect: str
    evidence: float
    """Evidence for the effect over that which a name needs."""

    @property
    def found(self) -> bool:
        """Whether one of the sets of an answer from the catalogue has the effect."""
        findings = self.case.findings
        sets = findings.sets or (tuple(one.id for one in findings.named),)
        told = findings.verdict in ("effects", "ambiguous")
        return told and any(is_true(name, [self.effect]) for names in sets for name in names)


def shown_by(check: Path, name: str) -> list[Shown]:
    """Returns what the records of a machine can show of each of its effects."""
    answer, found = read_answers(check / ANSWERS)[name], read_findings(check / RESULTS / name)
    job = read_case(check, name)
    truth = tuple(one for one in answer.effects if effect_starts(one, job.rig))
    if found is None or not truth:
        return []
    scored = ScoredCase(name, answer, found, judge(answer, found))
    fitted, held_out = (
        [usable_part(record, job.rig)[0] for record in part] for part in (job.fitted, job.held_out)
    )
    with single_threaded_algebra():
        case = make_case(job.rig, fitted, held_out)
        sizes = [
            place
            for effect in truth
            for _, place in effect_parameters(effect, answer.effects[effect], job.rig.plant)
        ]
        whole = refine(case, truth, np.concatenate([calibrate(case).x, sizes]))
        case = case.with_unlogged_commands(truth, whole.x)
        rows = []
        for effect in truth:
            others = tuple(one for one in truth if one != effect)
            ground = ground_of(case, refine(case, others, restrict(case, whole, others)))
            evidence = 1.0 + beyond(ground, effect, answer.effects[effect])
            rows.append(Shown(scored, effect, evidence))
    return rows


def main() -> None:
    """Prints each effect, and how many of each group were found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checks", nargs="+", type=Path)
    tasks = [
        partial(shown_by, check, name)
        for check in parser.parse_args().checks
        for name, answer in read_answers(check / ANSWERS).items()
        if answer.kind in ("one", "two")
    ]
    rows = [row for rows in run_tasks(tasks) for row in rows]
    print("| machine | grade | effect | evidence over what a name needs | outcome |")
    print("|---|---|---|---|---|")
    for row in sorted(rows, key=lambda row: row.evidence):
        outcome = row.case.judgement.outcome if row.found else "not named"
        cells = (row.case.name, row.case.answer.grade, row.effect, f"{row.evidence:.2g}", outcome)
        print(f"| {' | '.join(cells)} |")
    print("\n| evidence over what a name needs | in the answer (90 % interval; effects) |")
    print("|---|---|")
    for low, high in itertools.pairwise(ENDS):
        found = [row.found for row in rows if low <= row.evidence < high]
        print(f"| {low:g} to {high:g} | {figure_text(share('', found))} |")


if __name__ == "__main__":
    main()
