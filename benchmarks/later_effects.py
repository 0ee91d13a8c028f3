# SPDX-License-Identifier: MIT
"""Are the newer effects found? python benchmarks/later_effects.py FOLDER

Makes machines of the blind generator, each with one of the effects that came into the catalogue
later (see `lab/reality/effects.py`), diagnoses them without telling the effect, and compares.
The generator and the simulator share no code, no form of the equations and no integrator.

FOLDER keeps each finished machine, so that an interrupted run goes on where it stopped. With
--table FILE the table goes to FILE as Markdown.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from missing_laws import diagnosed, kept, options, run_all, share

from ehsid.harness.base.files import write_text
from ehsid.lab.reality.effects import ADDED_EFFECTS
from ehsid.lab.scoring.judging import GAP_SIZES, is_exactly

SEED = 23_000_000  # no check of `ehsid gap-check` has it


def run_one(folder: Path, index: int) -> dict[str, Any]:
    """Makes, diagnoses and judges one machine, or reads what an earlier run wrote."""

    def judged() -> dict[str, Any]:
        name, turn = list(ADDED_EFFECTS)[index % len(ADDED_EFFECTS)], index // len(ADDED_EFFECTS)
        case, diagnosis = diagnosed(folder, SEED + index, "one", name, turn)
        far = diagnosis.how_far
        return {
            "effect": name,
            "sizes": case.answer["effects"][name],
            "sensors": case.answer["sensors"],
            "grade": case.answer["grade"],
            "seed": case.answer["seed"],
            "verdict": diagnosis.verdict,
            "found": {
                effect.id: {key: value.value for key, value in effect.parameters.items()}
                for effect in diagnosis.effects
            },
            "sets": [list(each) for each in diagnosis.ambiguity_set],
            "gap": far.calibrated / far.noise_floor[1] if far else 0.0,
            "seconds": diagnosis.seconds,
        }

    return kept(folder / f"{index:04d}.json", judged)


def outcome(row: Mapping[str, Any]) -> str:
    """What the diagnosis said, beside the truth."""
    effect = row["effect"]
    if row["verdict"] == "effects":
        return "named" if is_exactly(list(row["found"]), [effect]) else "wrong name"
    if row["verdict"] == "ambiguous":
        inside = any(is_exactly(each, [effect]) for each in row["sets"])
        return "in the set" if inside else "set without it"
    return {"outside_catalogue": "outside"}.get(row["verdict"], "nothing")


def size_error(row: Mapping[str, Any]) -> float | None:
    """Relative error of the first size; None where the effect itself is not named."""
    sizes = row["found"].get(row["effect"])
    if sizes is None:
        return None
    name, true = next(iter(row["sizes"].items()))
    return abs(sizes[name] / true - 1.0)


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """The outcomes by sensors, and a line for each effect, as Markdown."""
    shown = [row for row in rows if row["gap"] >= GAP_SIZES[0]]
    lines = [
        f"Of {len(rows)} machines, {len(shown)} show a gap of at least {GAP_SIZES[0]:g} floors.",
        "",
        "| of these | with pressures | position only |",
        "|---|---|---|",
    ]
    for words, kinds in (
        ("named, or in the set", ("named", "in the set")),
        ("a wrong name", ("wrong name",)),
    ):
        figures = [
            share(
                [outcome(row) in kinds for row in shown if (row["sensors"] == "position") is blind]
            )
            for blind in (False, True)
        ]
        lines.append(f"| {words} | {' | '.join(figures)} |")
    lines += [
        "",
        "| effect | machines | with a gap | outcomes | error of the first size, median |",
        "|---|---|---|---|---|",
    ]
    for name in ADDED_EFFECTS:
        own = [row for row in rows if row["effect"] == name]
        large = [row for row in own if row["gap"] >= GAP_SIZES[0]]
        outcomes = [outcome(row) for row in large]
        told = ", ".join(f"{outcomes.count(each)} {each}" for each in dict.fromkeys(outcomes))
        errors = [error for error in map(size_error, large) if error is not None]
        error = f"{100.0 * float(np.median(errors)):.1f} %" if errors else "-"
        lines.append(f"| `{name}` | {len(own)} | {len(large)} | {told or '-'} | {error} |")
    return "\n".join(lines)


def main() -> None:
    """Runs the machines and prints the table."""
    parser = options(__doc__)
    parser.add_argument("--table", type=Path, help="file of the table")
    given = parser.parse_args()
    text = table(run_all(run_one, given.folder, given.count))
    print(text)
    if given.table is not None:
        write_text(given.table, text + "\n")


if __name__ == "__main__":
    main()
