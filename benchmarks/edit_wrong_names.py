# SPDX-License-Identifier: MIT
"""The edit test on wrong names: python benchmarks/edit_wrong_names.py CHECK...

CHECK is the folder of an `ehsid gap-check`, finished or not. A diagnosis names a wrong effect too
rarely to say what the edit test makes of it. So each machine with effects is searched once more
without its own effects, and without all laws that contain one of them or act like it. The best set
that is left is taken as the name, whatever a decision would say of it. The rigs that the check
named rightly are the comparison.
"""

from __future__ import annotations

import argparse
from collections.abc import Collection
from functools import partial
from pathlib import Path

from msgspec.structs import replace

from ehsid.harness.base.parallel import run_tasks
from ehsid.harness.catalogue.families import friction_laws
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.catalogue.spellings import sizes_of
from ehsid.harness.diagnosis.data.gate import usable_part
from ehsid.harness.diagnosis.edits import Twin
from ehsid.harness.diagnosis.model.case import make_case
from ehsid.harness.diagnosis.schema import (
    NO_INTERVAL,
    NOT_COMPARED,
    NOWHERE,
    DiagnosisFile,
    Effect,
    Provenance,
    Value,
    Which,
)
from ehsid.harness.diagnosis.search.gap_reduction import mean_gap
from ehsid.harness.diagnosis.search.search import search
from ehsid.lab.blind.making import ANSWERS, EDITED, RESULTS, read_answers
from ehsid.lab.blind.running import read_case
from ehsid.lab.pages.check_words import figure_text
from ehsid.lab.scoring.edits import EDITS, edits_of, edits_of_twin, figures_of
from ehsid.lab.scoring.findings import read_findings
from ehsid.lab.scoring.judging import Edited, ScoredCase, judge

Edits = tuple[Edited, ...]


def alike(truth: Collection[str]) -> tuple[str, ...]:
    """The true effects, and those that contain one, are contained in one, or act alike."""
    names = set(truth)
    if names & set(friction_laws()):
        names |= set(friction_laws())
    for name, info in effects().items():
        if {info.contains, info.together_with} & set(truth):
            names.add(name)
        if name in truth and info.contains is not None:
            names.add(info.contains)
    return tuple(sorted(names))


def wrong_twin(check: Path, name: str, truth: Collection[str]) -> Twin | None:
    """The rig with the best set that has none of the true effects; None where there is no set."""
    job = read_case(check, name)
    fitted, held_out = (
        [usable_part(record, job.rig)[0] for record in part] for part in (job.fitted, job.held_out)
    )
    case = make_case(job.rig, fitted, held_out, effort="list")
    sets = [one for one in search(case, alike(truth)).refined if one.effects]
    if not sets:
        return None
    best = min(sets, key=lambda one: one.held_out_cost)
    named = tuple(
        Effect(
            effect,
            0.5,
            {one: Value(x, NO_INTERVAL) for one, x in sizes_of(effect, best.values).items()},
            1.0,
        )
        for effect in best.effects
    )
    settings = {
        "window_s": case.window_s,
        "reset": "estimate" if case.all_states else "carry",
        "outputs": list(case.outputs),
    }
    file = DiagnosisFile(
        1,
        "effects",
        NOWHERE,
        Which(named, (best.effects,), (), (), None),
        replace(NOT_COMPARED, augmented=mean_gap(best.sums)),
        {},
        Provenance("", (), settings, 0.0),
    )
    return Twin(name, job.rig.with_values(best.values), file)


def both(check: Path, name: str) -> tuple[tuple[Edits, Edits], str]:
    """Edits of a case by its right names and by the best wrong ones, and a line of the table."""
    answer, found = read_answers(check / ANSWERS)[name], read_findings(check / RESULTS / name)
    folder = check / EDITED / name
    right: Edits = ()
    if found is not None and ScoredCase(name, answer, found, judge(answer, found)).names_right:
        right = edits_of(check, name, found)
    twin = wrong_twin(check, name, answer.effects)
    wrong = () if twin is None else edits_of_twin(twin, folder)
    folds = [
        ", ".join(f"{one.found / one.edited:.2g}" for one in each) or "-" for each in (right, wrong)
    ]
    cells = (" + ".join(answer.effects), folds[0], " + ".join(twin.named if twin else ()), folds[1])
    return (right, wrong), f"| {' | '.join(cells)} |"


def main() -> None:
    """Prints each machine, and then the figures of both edits."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checks", nargs="+", type=Path)
    tasks = [
        partial(both, check, folder.name)
        for check in parser.parse_args().checks
        for folder in sorted((check / EDITED).iterdir())
    ]
    rows = run_tasks(tasks)
    print("| in the machine | unedited over edited | wrong name | unedited over edited |")
    print("|---|---|---|---|")
    for _, line in rows:
        print(line)
    for edit, left in EDITS.items():
        right, wrong = (
            [one for groups, _ in rows for one in groups[number] if one.edit == edit]
            for number in (0, 1)
        )
        print(f"\n| effects {edit} | value (90 % interval; machines) |\n|---|---|")
        for figure in figures_of(right, wrong, left):
            print(f"| {figure.words} | {figure_text(figure)} |")


if __name__ == "__main__":
    main()
