# SPDX-License-Identifier: MIT
"""Could the missed effects have been identified? python benchmarks/gap_distinguishable.py FOLDER

FOLDER is that of a finished `ehsid gap-check`. Every effect of the catalogue in a case that was not
answered right is fitted from its true size, beside the values of the rig and all nuisances, those
among them that the record cannot tell from an effect. Its size over the deviation of the fit
(sandwich of exact sensitivities, `ehsid.harness.diagnosis.search.intervals`) says how far it stands
out: below 3 no diagnosis could be sure of it on this record.
"""

from __future__ import annotations

import argparse
import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ehsid.harness.base.parallel import run_tasks
from ehsid.harness.diagnosis.model.case import make_case
from ehsid.harness.diagnosis.model.parameters import effect_parameters
from ehsid.harness.diagnosis.model.scale import effect_starts
from ehsid.harness.diagnosis.search.candidates import calibrate, refine
from ehsid.harness.diagnosis.search.intervals import candidate_deviations
from ehsid.harness.records import read_record
from ehsid.harness.rigs import read_rig

HEAD = ("case", "grade, sensors", "effect", "true size", "deviations from zero", "reading")
SURE = 3.0


def rows(folder: Path, name: str, answer: dict[str, Any]) -> list[tuple[str, ...]]:
    """A line for each effect of a case."""
    rig = read_rig(folder / "cases" / name / "rig.toml")
    train, validate = (
        read_record(folder / "cases" / name / f"{part}.csv") for part in ("train", "validate")
    )
    case = make_case(rig, [train], [validate])
    # The record shows an effect without start values, such as quantisation, without a fit.
    fitted = {
        effect: sizes for effect, sizes in answer["effects"].items() if effect_starts(effect, rig)
    }
    sizes = [x for id_, own in fitted.items() for _, x in effect_parameters(id_, own, rig.plant)]
    candidate = refine(case, tuple(fitted), np.concatenate([calibrate(case).x, sizes]))
    scatter, _ = candidate_deviations(case, candidate)
    parameters = case.parameters(candidate.effects)
    lines = []
    for effect, parts in fitted.items():
        first = next(iter(parts))
        place = [one.name for one in parameters].index(f"effects.{effect}.{first}")
        deviation = float(scatter[place])
        # A logarithm's deviation is relative: nothing is one such size away.
        size = 1.0 if parameters[place].logarithmic else abs(float(candidate.x[place]))
        away = size / deviation if deviation > 0.0 else float("nan")
        reading = "at a bound: not seen" if deviation == 0.0 else "clearly visible"
        if away < SURE:
            reading = "cannot be distinguished from zero"
        where = f"{answer['grade']}, {answer['sensors']}"
        size_text = f"{first} {parts[first]:.3g}"
        lines.append((name, where, effect, size_text, f"{away:.2g}", reading))
    return lines


def main() -> None:
    """Print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    default = Path(__file__).parents[1] / "docs" / "check" / "distinguishable.md"
    parser.add_argument("--out", type=Path, default=default)
    told = parser.parse_args()
    answers = json.loads((told.folder / "answers.json").read_text())
    wrong = json.loads((told.folder / "score.json").read_text())["wrong"]
    names = [one["name"] for one in wrong if answers[one["name"]]["kind"] in ("one", "two")]
    tasks = [partial(rows, told.folder, name, answers[name]) for name in names]
    found = run_tasks(tasks, lambda share: print(f"{100.0 * share:.0f} %", flush=True))
    lines = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
    lines += ["| " + " | ".join(line) + " |" for case in found for line in case]
    text = "\n".join(
        [
            "# Could the missed effects have been identified?",
            "",
            "The table shows which of the effects that a diagnosis did not find could have been "
            "found in the record. Each effect of the cases that were not answered right was fitted "
            "together with the values of the rig and all nuisances, starting at its true size. The "
            "column *deviations from zero* is the fitted size over its standard deviation. Below "
            f"{SURE:g} deviations, no diagnosis could identify the effect with confidence from "
            "this record.",
            "",
            "`benchmarks/gap_distinguishable.py` writes this page.",
            "",
            *lines,
            "",
        ]
    )
    partial_file = told.out.with_suffix(".part")
    partial_file.write_text(text)
    partial_file.replace(told.out)
    print(text)


if __name__ == "__main__":
    main()
