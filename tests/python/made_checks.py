# SPDX-License-Identifier: MIT
"""Answers drawn as the generator draws them, and diagnoses made by hand: perfect, random, fair."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ehsid.lab.reality.effects import CATALOGUE, EXCLUSIVE_PAIRS
from ehsid.lab.reality.nominal_rig import draw_nominal_rig
from ehsid.lab.reality.unnamed import OUTSIDE

Plain = dict[str, Any]
Diagnoser = Callable[[Plain, np.random.Generator], Plain]
VERDICTS = {"none": "no_gap", "params": "parameters", "open": "outside_catalogue"}
SENSORS = ("position", "pressures", "pressures+supply")
EXCITATIONS = ("multisine", "steps", "triangle", "prbs")


def made_answers(count: int, seed: int = 1) -> dict[str, Plain]:
    """Answers of the form of `reality.make_case`, without any machine behind them."""
    rng = np.random.default_rng(seed)
    answers = {}
    for _ in range(count):
        kind = str(
            rng.choice(["one", "two", "none", "params", "open"], p=[0.5, 0.15, 0.1, 0.1, 0.15])
        )
        pool = OUTSIDE if kind == "open" else CATALOGUE
        number = {"one": 1, "two": 2, "open": 1}.get(kind, 0)
        names = [str(name) for name in rng.permutation(list(pool))[:number]]
        if frozenset(names) in EXCLUSIVE_PAIRS:
            names[1] = "transport_delay"
        told = draw_nominal_rig(rng, "ehs")
        answers[f"{int(rng.integers(2**32)):08x}"] = {
            "kind": kind,
            "plant": "ehs",
            "grade": str(rng.choice(["plain", "hard", "confusable"])),
            "effects": {name: dict(pool[name].draw(rng, told)) for name in names},
            "subsystem": [pool[name].subsystem for name in names],
            "excitation": [str(one) for one in rng.choice(EXCITATIONS, 2)],
            "sensors": str(rng.choice(SENSORS)),
            "true": {"load.mass_kg": 100.0, "fluid.bulk_modulus_pa": 1e9},
            "largest_command": [0.5, 0.6],
        }
    return answers


def diagnosis(
    verdict: str,
    effects: Mapping[str, Mapping[str, float]] | None = None,
    *,
    subsystem: str | None = None,
    sets: list[list[str]] | None = None,
    cannot_judge: tuple[str, ...] = (),
    probability: float = 0.97,
    gap: float = 8.0,
    candidates: list[Plain] | None = None,
    calibration: Plain | None = None,
    shrinkage: float | None = None,
) -> Plain:
    """A diagnosis file with these findings."""
    named = dict(effects or {})
    return {
        "schema_version": 1,
        "verdict": verdict,
        "where": {
            "subsystem": {subsystem: 0.9, "other": 0.1} if subsystem else {},
            "regimes": [],
            "frequency": [],
            "time": [],
        },
        "which": {
            "effects": [
                {
                    "id": name,
                    "probability": probability,
                    "parameters": {
                        one: {"value": size, "ci90": sorted([0.97 * size, 1.03 * size])}
                        for one, size in sizes.items()
                    },
                    "share_of_shrinkage": 1.0 / len(named),
                }
                for name, sizes in named.items()
            ],
            "ambiguity_set": sets if sets is not None else [list(named)] if named else [],
            "candidates": candidates or [],
            "cannot_judge": [{"id": name, "why": "not visited"} for name in cannot_judge],
            "next_experiment": None,
        },
        "how_far": {
            "nominal": 0.02 * gap,
            "calibrated": 0.01 * gap,
            "augmented": 0.011,
            "noise_floor": [0.009, 0.011],
            "shrinkage_of_explainable": _share(shrinkage),
            "shrinkage_from_nominal": _share(0.9),
            "per_output": {},
        },
        "calibration": calibration or {},
        "provenance": {
            "ehsid_version": "0",
            "records": [],
            "seconds": 12.0,
            "settings": {"window_s": 0.5, "reset": "carry", "outputs": ["position_m"]},
        },
    }


def _share(value: float | None) -> Plain:
    if value is None:
        return {"value": None, "ci90": [None, None]}
    return {"value": value, "ci90": [value - 0.02, value + 0.02]}


def candidate(effects: list[str], fitted: float, held_out: float, free: int) -> Plain:
    """An entry of `which.candidates` with the costs that the baselines want."""
    return {
        "effects": effects,
        "score": 0.0,
        "held_out_shrinkage": 0.0,
        "fitted_cost": fitted,
        "held_out_cost": held_out,
        "free": free,
    }


def perfect(answer: Plain, _: np.random.Generator) -> Plain:
    """The truth, exactly."""
    kind, effects = answer["kind"], answer["effects"]
    known = kind in ("one", "two")
    return diagnosis(
        VERDICTS.get(kind, "effects"),
        effects if known else {},
        subsystem=answer["subsystem"][0] if effects else None,
        shrinkage=0.99 if known else None,
    )


def at_random(_: Plain, rng: np.random.Generator) -> Plain:
    """One effect of the catalogue, whatever the record."""
    name = str(rng.choice(list(CATALOGUE)))
    return diagnosis(
        "effects", {name: {}}, subsystem=CATALOGUE[name].subsystem, probability=float(rng.random())
    )


def fair(answer: Plain, rng: np.random.Generator) -> Plain:
    """Right in most cases, sure of itself where it is, and now and then not at all."""
    kind, truth = answer["kind"], answer["effects"]
    gap = float(np.exp(rng.uniform(0.3, 4.0)))
    blamed = str(rng.choice(list(CATALOGUE)))
    luck = rng.random()
    sets: list[list[str]] | None = None
    verdict, named = VERDICTS.get(kind, "effects"), dict(truth) if kind in ("one", "two") else {}
    if luck > 0.97:
        verdict, named = "effects", {blamed: {}}
    elif luck > 0.92:
        verdict, named = "outside_catalogue", {}
    elif luck > 0.85 and named:
        verdict, sets = (
            "ambiguous",
            [[blamed], list(named)] if luck > 0.9 else [list(named), [blamed]],
        )
        named = {sets[0][0]: truth.get(sets[0][0], {})}
    off = float(rng.normal(0.0, 0.015))
    sizes = {n: {p: v * (1.0 + off) for p, v in one.items()} for n, one in named.items()}
    subsystem = CATALOGUE[next(iter(named))].subsystem if named else None
    if verdict == "outside_catalogue" and answer["subsystem"]:
        subsystem = answer["subsystem"][0]
    fits = [
        candidate([], 100.0, 120.0, 10),
        candidate([blamed], 60.0, 60.0 + 8.0 * rng.random(), 11),
    ]
    if kind in ("one", "two") and rng.random() > 0.1:
        fits.append(candidate(list(truth), 30.0, 55.0, 12))
    return diagnosis(
        verdict,
        sizes,
        subsystem=subsystem,
        sets=sets,
        probability=float(np.clip(rng.normal(0.93 if luck < 0.85 else 0.6, 0.05), 0.3, 0.97)),
        gap=gap,
        candidates=fits,
        calibration={
            "load.mass_kg": {
                "rig": 100.0,
                "found": 100.0 + float(rng.normal()),
                "ci90": [98.4, 101.6],
            }
        },
        shrinkage=float(rng.uniform(0.8, 1.0)) if named else None,
    )


def write_check(out: Path, answers: Mapping[str, Plain], how: Diagnoser, seed: int = 0) -> Path:
    """Answers and results as a check leaves them."""
    rng = np.random.default_rng(seed)
    out.mkdir(parents=True, exist_ok=True)
    (out / "answers.json").write_text(json.dumps(answers))
    for name, answer in answers.items():
        folder = out / "results" / name
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "diagnosis.json").write_text(json.dumps(how(answer, rng)))
    return out
