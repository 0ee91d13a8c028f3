# SPDX-License-Identifier: MIT
"""Is the size right from which on an effect is seen? python benchmarks/gap_visible.py FOLDER

Each setting is a rig, its sensors, a command and a sampling time. A machine is drawn from the
uncertainties of the rig, and a record without effects is diagnosed, which tells the size from which
on it would have shown each effect (`ehsid.harness.diagnosis.search.visible`). Then the machine gets
the effect, of two thirds and of three halves of this size, and each record is diagnosed. Where two
thirds are seen a smaller size follows, where three halves are not a larger one, else the size
itself. Seen is an effect where the answer has a cause, and named where the cause is the effect.

FOLDER keeps each finished diagnosis, so that an interrupted run goes on where it stopped. With
--table FILE the table goes to FILE as Markdown.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

import ehsid
from ehsid.harness.base.files import write_text
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.families import effect_families, spelled_out
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.catalogue.spellings import effect_values
from ehsid.harness.diagnosis import diagnose
from ehsid.harness.diagnosis.model.parameters import calibration_parameters
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.signals.excitation import multisine, triangle
from ehsid.harness.signals.simulation import draw_noise, simulate

RIGS = Path(__file__).parents[1] / "examples" / "rigs"
SECONDS, SUBSTEPS = 12.0, 16
STEP = 1.5
LADDER = 3
# Share of the uncertainty by which a machine differs from its rig file.
DRAWN = 0.7
# Of each part of the machine some, those that are asked for most first.
EFFECTS = (
    "internal_leakage",
    "transport_delay",
    "load_force",
    "supply_droop",
    "coulomb_friction",
    "valve_null_bias",
    "sensor_lag",
    "entrained_air",
    "valve_lag",
    "sensor_backlash",
)


def bench() -> Rig:
    """The bench of the examples; its valve is fast, and no lag of it is told."""
    rig = read_rig(RIGS / "bench.toml")
    values = {name: value for name, value in rig.values.items() if "valve_lag" not in name}
    noise = {"position_noise_m": 5e-6, "pressure_a_noise_pa": 1e4, "pressure_b_noise_pa": 1e4}
    return Rig("bench", "ehs", values, sensors=noise)


def press() -> Rig:
    """A larger machine, with sensors of an ordinary plant."""
    made = ehsid.Rig.new(
        bore="100 mm",
        rod="56 mm",
        stroke="500 mm",
        supply="200 bar",
        rated_flow="100 l/min",
        mass="600 kg",
    ).result
    noise = {"position_noise_m": 2e-5, "pressure_a_noise_pa": 3e4, "pressure_b_noise_pa": 3e4}
    return replace(made, name="press", sensors=noise)


def rich(samples: int, dt_s: float, rng: np.random.Generator) -> FloatArray:
    """Multisine past the oil spring, then a slow triangle."""
    half = samples // 2
    fast = multisine(half, dt_s, band_hz=(0.5, min(25.0, 0.4 / dt_s)), rms=2.0, rng=rng)
    return np.concatenate([fast, triangle(samples - half, dt_s, amplitude=0.8, period_s=1.0)])


def smooth(samples: int, dt_s: float, rng: np.random.Generator) -> FloatArray:
    """Slow motion to and fro, as in production."""
    return multisine(samples, dt_s, band_hz=(0.25, 1.5), rms=1.2, rng=rng)


@dataclass(frozen=True)
class Setting:
    """What is told apart in the table."""

    rig: Callable[[], Rig]
    pressures: bool
    command: Callable[[int, float, np.random.Generator], FloatArray]
    dt_s: float

    @property
    def words(self) -> str:
        """The setting as the table has it."""
        sensors = "pressures" if self.pressures else "position only"
        return f"{self.rig.__name__}, {sensors}, {self.command.__name__}, {1e3 * self.dt_s:g} ms"


SETTINGS = (
    Setting(bench, True, rich, 1e-3),
    Setting(bench, False, rich, 1e-3),
    Setting(press, True, smooth, 1e-3),
    Setting(press, False, rich, 2e-2),
)


def machine(rig: Rig, seed: int) -> dict[str, float]:
    """Values of a machine by full name, drawn from the uncertainties of its rig."""
    rng = np.random.default_rng([seed, 5])
    return {
        p.name: p.value(
            float(np.clip(p.centre + DRAWN * p.sigma * rng.standard_normal(), p.low, p.high))
        )
        for p in calibration_parameters(rig)
        if np.isfinite(p.sigma)
    }


def record_of(setting: Setting, seed: int, sizes: Mapping[str, float]) -> Record:
    """A record of the machine of a setting with these sizes, with the noise of its sensors."""
    rig, rng = setting.rig(), np.random.default_rng([seed, 6])
    samples = round(SECONDS / setting.dt_s)
    command = setting.command(samples, setting.dt_s, np.random.default_rng([seed, 7]))
    run = simulate(
        rig,
        command,
        dt_s=setting.dt_s,
        values={**machine(rig, seed), **sizes},
        substeps=max(SUBSTEPS, round(8000 * setting.dt_s)),
        noise=draw_noise(rig, samples, rng),
    ).record
    names = ["command_v", "position_m"]
    names += ["pressure_a_pa", "pressure_b_pa"] if setting.pressures else []
    return make_record({"time_s": run.time_s, **{name: run.column(name) for name in names}})


def diagnosed(setting: Setting, seed: int, sizes: Mapping[str, float], effort: Any) -> Any:
    """Diagnoses a record; the result as plain data."""
    found = diagnose(
        [record_of(setting, seed, sizes)], setting.rig(), options=DiagnosisOptions((), effort)
    )
    seen = [(one.id, one.size, one.limit, dict(one.sizes)) for one in found.could_be_seen]
    sets = [list(each) for each in found.ambiguity_set]
    return {"verdict": found.verdict, "sets": sets, "seen": seen, "seconds": found.seconds}


def is_seen(row: Mapping[str, Any]) -> bool:
    """Whether the answer has a cause, whatever its name."""
    return row["verdict"] in ("effects", "ambiguous", "outside_catalogue")


def is_named(effect: str, row: Mapping[str, Any]) -> bool:
    """Whether the answer has the effect, laws of friction as one, or two that act as it does."""
    able = {*effect_families((effect,)), *spelled_out((effect,))}
    return any(able & {*effect_families(names), *names} for names in row["sets"])


def scaled(effect: str, sizes: Mapping[str, float], factor: float) -> dict[str, float]:
    """Sizes of an effect that is larger by a factor, by full name."""
    power = {parameter.name: parameter.power for parameter in effects()[effect].parameters}
    return effect_values(effect, {name: v * factor ** power[name] for name, v in sizes.items()})


def kept(path: Path, made: Callable[[], Any]) -> Any:
    """Returns what an earlier run wrote, or makes and writes it."""
    if not path.exists():
        write_text(path, json.dumps(made()))
    return json.loads(path.read_text())


def run(folder: Path, number: int, seed: int, effort: Any, effect: str) -> dict[str, Any] | None:
    """All diagnoses of an effect in one setting; None where no size would have been seen."""
    setting = SETTINGS[number]
    name = f"{number}-{seed}"
    sound = kept(folder / f"{name}.json", lambda: diagnosed(setting, seed, {}, effort))
    told = {each: (limit, sizes) for each, _, limit, sizes in sound["seen"]}
    limit, sizes = told.get(effect, ("none", {}))
    if limit == "none":
        return None

    named: dict[int, bool] = {}

    def seen(power: int) -> bool:
        values = scaled(effect, sizes, STEP**power)
        path = folder / f"{name}-{effect}-{power}.json"
        row = kept(path, lambda: diagnosed(setting, seed, values, effort))
        named[power] = is_named(effect, row)
        return is_seen(row)

    decided = limit == "record"
    at = {power: seen(power) for power in ((-1, 1) if decided else (1,))}
    while decided and at[min(at)] and min(at) > -LADDER:
        power = min(at) - 1
        at[power] = seen(power)
    while not at[max(at)] and max(at) < LADDER:
        power = max(at) + 1
        at[power] = seen(power)
    if decided and at[1] and not at[-1]:
        at[0] = seen(0)
    print(setting.words, effect, limit, at, named, flush=True)
    return {
        "setting": setting.words,
        "effect": effect,
        "limit": limit,
        "seen": at,
        "named": named,
    }


def turn(row: Mapping[str, Any]) -> float:
    """Size from which on the effect is seen over the size that was told, from the ladder."""
    first = min((power for power, is_ in row["seen"].items() if is_), default=LADDER + 1)
    missed = [power for power, is_ in row["seen"].items() if not is_ and power < first]
    return float(STEP ** (0.5 * (first + max(missed, default=first - 1))))


def table(rows: list[dict[str, Any]]) -> str:
    """A line for each effect, a column for each setting, and the shares below."""
    settings = list(dict.fromkeys(row["setting"] for row in rows))
    cells = {
        (row["effect"], row["setting"]): f"{turn(row):.2g}"
        if row["limit"] == "record"
        else ("seen" if row["seen"][1] else "missed")
        for row in rows
    }
    decided = [row for row in rows if row["limit"] == "record"]
    inside = sum(1.0 / STEP <= turn(row) <= STEP for row in decided)
    lines = ["| effect | " + " | ".join(settings) + " |", "|---" * (len(settings) + 1) + "|"]
    for effect in dict.fromkeys(row["effect"] for row in rows):
        found = [cells.get((effect, setting), "-") for setting in settings]
        lines.append(f"| `{effect}` | " + " | ".join(found) + " |")
    above = [row["seen"][1] for row in rows]
    below = [row["seen"][-1] for row in decided]
    named = [row["named"][1] for row in rows if row["seen"][1]]
    ratios = [turn(row) for row in decided]
    return "\n".join(
        [
            *lines,
            "",
            f"- Seen at three halves of the size: {sum(above)} of {len(above)}; of these "
            f"{sum(named)} with the effect in the answer.",
            f"- Seen at two thirds of the size: {sum(below)} of {len(below)}.",
            f"- Ratio within a factor of {STEP:g}: {inside} of {len(decided)}; median "
            f"{np.median(ratios):.2g}.",
        ]
    )


def main() -> None:
    """Run what is missing, and print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--settings", type=int, nargs="*", default=range(len(SETTINGS)))
    parser.add_argument("--effects", nargs="*", default=EFFECTS)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--effort", default="list")
    parser.add_argument("--table", type=Path)
    told = parser.parse_args()
    told.folder.mkdir(parents=True, exist_ok=True)
    found = [
        run(told.folder, number, told.seed, told.effort, effect)
        for effect in told.effects
        for number in told.settings
    ]
    text = table([row for row in found if row is not None])
    print(text)
    if told.table is not None:
        write_text(told.table, text + "\n")


if __name__ == "__main__":
    main()
