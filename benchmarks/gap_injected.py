# SPDX-License-Identifier: MIT
"""Logs with a known effect put in, diagnosed: python benchmarks/gap_injected.py

Without arguments EMPS, a real axis; others by --log RECORD RIG, again for more. Every effect that
can be put into the log, in two sizes, one at a time. A real machine has a gap of its own, so what
counts is the change against the untouched log: the effects named beside those of the untouched log
must be those put in, sizes as put in, values of the rig where they were. What the untouched log
had and the other has not is shown as lost.
"""

from __future__ import annotations

import argparse
import math
import os
import time
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from ehsid.harness.catalogue.families import effect_families
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.diagnosis import Diagnosis, diagnose
from ehsid.harness.diagnosis.schema import Estimate
from ehsid.harness.records import Record, read_record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.signals.injection import Answer, InjectError, inject, injectable

ROOT = Path(__file__).parents[1]
EMPS = ROOT / "tests" / "python" / "data" / "emps"
HEAD = (
    "put in",
    "verdict",
    "named beside the untouched log's",
    "size found (90 % interval)",
    "error of size",
    "values that moved",
    "named right",
    "in the set",
)

Sizes = Mapping[str, float]


@dataclass(frozen=True)
class Row:
    """A line of the table; error is relative, None where nothing was to be found or was."""

    cells: tuple[str, ...]
    right: bool
    in_set: bool
    error: float | None
    inside: bool | None


def sizes_of(effect: str, record: Record, rig: Rig) -> list[dict[str, float]]:
    """A small and a large size that an ordinary fault has, for this machine."""
    # Positions are known to about a thousandth of the travel.
    position = record.column("position_m")
    travel_m = float(position.max() - position.min())
    size_m = float(f"{travel_m:.1g}") * 1e-3
    # Of the largest force in the log.
    gain = rig.values.get("axis.force_per_volt", 0.0)
    force_n = float(f"{gain * abs(record.column('command_v')).max():.1g}")
    choices: dict[str, list[dict[str, float]]] = {
        "load_force": [{"force_n": 0.04 * force_n}, {"force_n": -0.12 * force_n}],
        "gain": [{"factor": 1.05}, {"factor": 0.9}],
        "valve_dead_band": [{"overlap": 0.02}, {"overlap": 0.05}],
        "valve_dead_band_sides": [
            {"overlap_a": 0.02, "overlap_b": 0.05},
            {"overlap_a": 0.06, "overlap_b": 0.01},
        ],
        "valve_null_bias": [{"offset": 0.015}, {"offset": -0.04}],
        "valve_lag": [
            {"bandwidth_hz": 50.0, "damping": 0.8},
            {"bandwidth_hz": 20.0, "damping": 0.6},
        ],
        "valve_hysteresis": [{"half_width": 0.01}, {"half_width": 0.03}],
        "transport_delay": [{"delay_s": 0.003}, {"delay_s": 0.008}],
        "position_bias": [{"offset_m": 5.0 * size_m}, {"offset_m": -20.0 * size_m}],
        "sensor_backlash": [{"half_width_m": 0.5 * size_m}, {"half_width_m": 1.5 * size_m}],
        "sensor_nonlinearity": [
            {"amplitude_m": size_m, "period_m": 0.5 * travel_m},
            {"amplitude_m": 4.0 * size_m, "period_m": travel_m},
        ],
        "sensor_lag": [{"time_constant_s": 0.003}, {"time_constant_s": 0.008}],
        "position_delay": [{"delay_s": 0.004}, {"delay_s": 0.01}],
        "position_sensor_delay": [{"delay_s": 0.003}, {"delay_s": 0.008}],
        "pressure_sensor_gain": [
            {"gain_a": 1.04, "gain_b": 1.0},
            {"gain_a": 1.0, "gain_b": 0.9},
        ],
        "pressure_sensor_offset": [
            {"offset_a_pa": 3e5, "offset_b_pa": 0.0},
            {"offset_a_pa": 0.0, "offset_b_pa": -1e6},
        ],
        "pressure_sensor_lag": [{"time_constant_s": 0.004}, {"time_constant_s": 0.012}],
        "sensor_quantisation": [{"step_m": 0.25 * size_m}, {"step_m": size_m}],
    }
    return choices[effect]


def effects_of(found: Diagnosis) -> dict[tuple[str, str], Estimate]:
    """Sizes of the effects named, by id and parameter."""
    return {
        (effect.id, name): size
        for effect in found.effects
        for name, size in effect.parameters.items()
    }


def is_right(named: Collection[str], own: Collection[str], put_in: Collection[str]) -> bool:
    """What was put in is there, and nothing else that the untouched log does not have.

    As in the scores of blind records, unequal overlaps are a dead band and a null bias, and all
    laws of friction count as one.
    """
    wanted, there, before = (effect_families(tuple(one)) for one in (put_in, named, own))
    return wanted <= there and there - before == wanted - before


def moved_values(found: Diagnosis, untouched: Diagnosis, answer: Answer) -> list[str]:
    """Values of the rig, and sizes of the untouched log's own effects, that are elsewhere.

    Elsewhere: beyond both half intervals of 90 %, added as independent ones, and by 1 %.
    """
    before = {
        name: one.found
        for name, one in untouched.calibration.items()
        if ParameterKey(name).is_rig_value
    }
    after = {
        name: one.found
        for name, one in found.calibration.items()
        if ParameterKey(name).is_rig_value
    }
    own, now = effects_of(untouched), effects_of(found)
    before |= {f"{e}.{p}": size for (e, p), size in own.items() if e not in answer.effects}
    after |= {f"{e}.{p}": size for (e, p), size in now.items()}
    # Only forces over the gain are seen of an axis: with the gain that was put in all of them move.
    scale = 1.0
    if found.rig.plant == "axis":
        for name, factor in answer.parameters.items():
            scale = factor * untouched.calibration[name].found.value
            scale /= found.calibration[name].found.value
    moved = []
    for name in sorted(before.keys() & after.keys() - answer.parameters.keys()):
        old, new = before[name], after[name]
        change = scale * new.value - old.value
        allowed = 0.5 * math.hypot(old.high - old.low, scale * (new.high - new.low))
        if abs(change) > max(allowed, 0.01 * abs(old.value)):
            moved.append(f"{name} {100.0 * change / abs(old.value):+.2g} %")
    return moved


def sizes_found(
    found: Diagnosis, untouched: Diagnosis, answer: Answer
) -> tuple[list[str], list[float], list[bool]]:
    """In words, relative errors, whether the interval holds what was put in."""
    own, now = effects_of(untouched), effects_of(found)
    words, errors, inside = [], [], []
    for effect, sizes in answer.effects.items():
        for name, true in sizes.items():
            if (effect, name) not in now:
                continue
            size = now[effect, name]
            # What the machine had of it before counts as it was found there.
            zero = own[effect, name].value if (effect, name) in own else 0.0
            words.append(
                f"{name} {size.value - zero:.4g} ({size.low - zero:.4g} to {size.high - zero:.4g})"
            )
            errors.append(abs(size.value - zero - true) / abs(true))
            inside.append(size.low - zero <= true <= size.high - zero)
    for name, factor in answer.parameters.items():
        # Forces are seen as accelerations only: gain and mass of an axis go together.
        ratios = [
            one.calibration[name].found.value
            / (one.calibration["axis.mass_kg"].found.value if one.rig.plant == "axis" else 1.0)
            for one in (found, untouched)
        ]
        per = " over mass" if found.rig.plant == "axis" else ""
        words.append(f"{name}{per} x {ratios[0] / ratios[1]:.4g}")
        errors.append(abs(ratios[0] / ratios[1] / factor - 1.0))
    return words, errors, inside


def row(found: Diagnosis, untouched: Diagnosis, answer: Answer) -> Row:
    """Compare."""
    own = {effect.id for effect in untouched.effects}
    named = {effect.id for effect in found.effects}
    right = is_right(named, own, answer.effects)
    in_set = right or any(is_right(one, own, answer.effects) for one in found.ambiguity_set)
    words, errors, inside = sizes_found(found, untouched, answer)
    new = [*sorted(named - own), *(f"lost: {effect}" for effect in sorted(own - named))]
    others = ["or " + " + ".join(effects) for effects in found.ambiguity_set[1:]]
    put_in = "; ".join(
        f"{effect} " + ", ".join(f"{name} {value:.4g}" for name, value in sizes.items())
        for effect, sizes in answer.put_in.items()
    )
    cells = (
        put_in + (" (not exact)" if answer.not_exact else ""),
        found.verdict,
        "<br>".join([", ".join(new) or "-", *others]),
        "<br>".join(words) or "-",
        f"{100.0 * max(errors):.2g} %" if errors else "-",
        "<br>".join(moved_values(found, untouched, answer)) or "-",
        "yes" if right else "no",
        "yes" if in_set else "no",
    )
    return Row(cells, right, in_set, max(errors, default=None), all(inside) if inside else None)


def told_of(found: Diagnosis) -> str:
    """The untouched log in a line."""
    sizes = "; ".join(
        f"{effect} {name} {size.value:.4g} ({size.low:.4g} to {size.high:.4g})"
        for (effect, name), size in effects_of(found).items()
    )
    return f"Untouched: `{found.verdict}`; {sizes or 'no effect'}."


def study(path: Path, rig: Rig, only: list[str] | None) -> list[str]:
    """All effects in two sizes; the section of the table in Markdown."""
    record = read_record(path, required=("time_s", "command_v", "position_m"), layout=rig.columns)
    there = [effect for effect in injectable(rig.plant) if effect not in rig.effects()]
    asked = [
        (effect, sizes)
        for effect in there
        if not only or effect in only
        for sizes in sizes_of(effect, record, rig)
    ]
    began = time.monotonic()
    untouched = diagnose([record], rig)
    print(f"{rig.name}: {told_of(untouched)}", flush=True)
    rows, refused, notes = [], [], []
    for done, (effect, sizes) in enumerate(asked, start=1):
        try:
            injected = inject(record, rig, {effect: sizes})
        except InjectError as error:
            refused.append(f"{effect}: {error}")
            continue
        rows.append(row(diagnose([injected.record], rig), untouched, injected.answer))
        notes += [note for note in injected.answer.not_exact if note not in notes]
        left = (time.monotonic() - began) / (done + 1) * (len(asked) - done)
        print(f"{done}/{len(asked)}, {left:.0f} s left: " + " | ".join(rows[-1].cells), flush=True)
    errors = sorted(one.error for one in rows if one.error is not None and one.right)
    inside = [one.inside for one in rows if one.inside is not None and one.right]
    summary = (
        f"{sum(one.right for one in rows)} of {len(rows)} named right, "
        f"{sum(one.in_set for one in rows)} in the set"
    )
    if errors:
        summary += (
            f"; of those named right the error of size is {100.0 * errors[len(errors) // 2]:.2g} % "
            f"(median), {100.0 * errors[-1]:.2g} % at most, and {sum(inside)} of {len(inside)} "
            "intervals hold what was put in"
        )
    return [
        f"## {rig.name}: {path.name}",
        "",
        f"{len(record)} samples at {record.dt_s:g} s, plant `{rig.plant}`. {told_of(untouched)}",
        "",
        "| " + " | ".join(HEAD) + " |",
        "|" + "---|" * len(HEAD),
        *("| " + " | ".join(one.cells) + " |" for one in rows),
        "",
        summary + ".",
        *([""] if refused or notes else []),
        *(f"- Refused: {one}." for one in refused),
        *(f"- Not exact: {one}." for one in notes),
        "",
    ]


def main() -> None:
    """Print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--log", nargs=2, action="append", metavar=("RECORD", "RIG"), type=Path)
    parser.add_argument("--only", nargs="*", help="ids of effects; all by default")
    default = ROOT / "docs" / "gap" / "injected.md"
    parser.add_argument("--out", type=Path, default=default)
    told = parser.parse_args()
    began = time.monotonic()
    sections = []
    for record, rig in told.log or [(EMPS / "emps.csv", EMPS / "emps.rig.toml")]:
        sections += study(record, read_rig(rig), told.only)
    lines = [
        "# Logs with a known effect put in",
        "",
        "Written by `benchmarks/gap_injected.py`; what the columns mean is in "
        "[inject.md](../inject.md). Values have moved where they left both intervals and 1 %.",
        "",
        *sections,
        f"{time.monotonic() - began:.0f} s on {os.cpu_count()} cores.",
        "",
    ]
    told.out.parent.mkdir(parents=True, exist_ok=True)
    partial = told.out.with_suffix(".part")
    partial.write_text("\n".join(lines), encoding="utf-8")
    partial.replace(told.out)


if __name__ == "__main__":
    main()
