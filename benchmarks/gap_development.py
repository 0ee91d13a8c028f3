# SPDX-License-Identifier: MIT
"""Diagnosis of records whose cause is known: python benchmarks/gap_development.py FOLDER

FOLDER holds answers.json and one folder a record with rig.toml, train.csv and validate.csv. Each
is diagnosed by itself with train.csv to fit and validate.csv held out; the answers are looked up
afterwards. Right is, without allowance: the same effects (all laws of friction taken for one);
"no_gap" where there is nothing, "parameters" where values alone differ, "outside_catalogue" where
the cause is not in the catalogue. Sizes are compared by the parameter of the effect.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import resource
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from joblib.externals.loky import get_reusable_executor

from ehsid.harness.catalogue.families import effect_families
from ehsid.harness.diagnosis import Diagnosis, diagnose
from ehsid.harness.records import read_record
from ehsid.harness.rigs import read_rig

VERDICTS = {"none": "no_gap", "params": "parameters", "open": "outside_catalogue"}
HEAD = (
    "record",
    "sensors",
    "truth",
    "verdict",
    "found (90 % interval)",
    "error of size",
    "gap: given / calibrated / with effects / floor",
    "shrinkage of the explainable gap",
    "s",
    "MB",
    "right",
)


@dataclass(frozen=True)
class Row:
    """A line of the table; `error` is the largest of the sizes that can be compared, or None."""

    cells: tuple[str, ...]
    right: bool
    error: float | None
    seconds: float
    megabytes: float


def diagnosed(folder: Path) -> tuple[Diagnosis, float]:
    """The diagnosis of a record and its peak memory with that of its workers, MB."""
    rig = read_rig(folder / "rig.toml")
    records = [
        read_record(folder / f"{name}.csv", layout=rig.columns) for name in ("train", "validate")
    ]
    found = diagnose(records[:1], rig, validate=records[1:])
    # Children count once they have ended.
    get_reusable_executor().shutdown(wait=True)
    # Peak of this process and of the largest child, kB on Linux.
    peaks = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return found, sum(peak.ru_maxrss for peak in peaks) / 1024.0


def is_right(found: Diagnosis, answer: dict[str, Any]) -> bool:
    """Strict: a set that holds the truth among others is not the truth."""
    if answer["kind"] in VERDICTS:
        return found.verdict == VERDICTS[answer["kind"]]
    named = effect_families([effect.id for effect in found.effects])
    return found.verdict == "effects" and named == effect_families(list(answer["effects"]))


def errors(found: Diagnosis, answer: dict[str, Any]) -> list[float]:
    """Relative errors of the sizes of effects that were found and are there."""
    sizes = {
        (effect.id, name): estimate.value
        for effect in found.effects
        for name, estimate in effect.parameters.items()
    }
    return [
        abs(sizes[effect, name] - true) / abs(true)
        for effect, parameters in answer["effects"].items()
        for name, true in parameters.items()
        if (effect, name) in sizes
    ]


def truth_of(answer: dict[str, Any]) -> str:
    """Effects with sizes, or the kind of the record."""
    words = {"none": "no gap", "params": "values of the rig"}
    if answer["kind"] in words:
        return words[answer["kind"]]
    return "<br>".join(
        f"{effect}: " + ", ".join(f"{name} {value:.4g}" for name, value in parameters.items())
        for effect, parameters in answer["effects"].items()
    ) + (" (not in the catalogue)" if answer["kind"] == "open" else "")


def found_of(found: Diagnosis) -> str:
    """Effects with sizes and intervals."""
    lines = [
        f"{effect.id}: "
        + ", ".join(
            f"{name} {size.value:.4g} ({size.low:.4g} to {size.high:.4g})"
            for name, size in effect.parameters.items()
        )
        for effect in found.effects
    ]
    others = ["or " + " + ".join(effects) for effects in found.ambiguity_set[1:]]
    return "<br>".join([*lines, *others]) or "-"


def row(folder: Path, answer: dict[str, Any]) -> Row:
    """Diagnose and compare."""
    found, megabytes = diagnosed(folder)
    right = is_right(found, answer)
    off = errors(found, answer)
    far = found.how_far
    gap = shrinkage = "-"
    if far is not None:
        steps = (far.nominal, far.calibrated, far.augmented, far.noise_floor[1])
        gap = " / ".join(f"{100.0 * step:.3g} %" for step in steps)
        if far.of_explainable is not None and found.effects:
            share = far.of_explainable
            shrinkage = f"{share.value:.3f} ({share.low:.3f} to {share.high:.3f})"
    cells = (
        folder.name,
        answer["sensors"],
        truth_of(answer),
        found.verdict,
        found_of(found),
        f"{100.0 * max(off):.2g} %" if off else "-",
        gap,
        shrinkage,
        f"{found.seconds:.0f}",
        f"{megabytes:.0f}",
        "yes" if right else "no",
    )
    return Row(cells, right, max(off, default=None), found.seconds, megabytes)


def table(rows: list[Row]) -> str:
    """Markdown with a summary."""
    lines = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
    lines += ["| " + " | ".join(one.cells) + " |" for one in rows]
    return "\n".join(
        [
            "# Records whose cause is known",
            "",
            f"The diagnosis was right for {sum(one.right for one in rows)} of {len(rows)} records "
            "whose cause is known. A record took at most "
            f"{max(one.seconds for one in rows):.0f} s and "
            f"{max(one.megabytes for one in rows):.0f} MB on {os.cpu_count()} cores.",
            "",
            "- **Sensors**: y is the position, pa and pb are the chamber pressures, and ps is the "
            "supply pressure.",
            "- **Error of size** is the largest error of the parameters of the effects that are "
            "in the machine.",
            "- **Gap** is the gap of the rig file as it was given, of the calibrated rig, and of "
            "the rig with the found effects, followed by the noise floor.",
            "- **MB** is the peak memory of the process and of its largest worker.",
            "",
            "`benchmarks/gap_development.py` writes this page.",
            "",
            *lines,
            "",
        ]
    )


def main() -> None:
    """Print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", nargs="*", help="names of records; all by default")
    default = Path(__file__).parents[1] / "docs" / "gap" / "development.md"
    parser.add_argument("--out", type=Path, default=default)
    told = parser.parse_args()
    answers = json.loads((told.folder / "answers.json").read_text())
    rows = []
    # A process for each record: peak memory is that of one diagnosis, and its workers are its own.
    start = multiprocessing.get_context("spawn")
    for name in told.only or sorted(answers):
        with ProcessPoolExecutor(1, mp_context=start) as pool:
            rows.append(pool.submit(row, told.folder / name, answers[name]).result())
        print(" | ".join(rows[-1].cells), flush=True)
    told.out.parent.mkdir(parents=True, exist_ok=True)
    partial = told.out.with_suffix(".part")
    partial.write_text(table(rows))
    partial.replace(told.out)


if __name__ == "__main__":
    main()
