# SPDX-License-Identifier: MIT
"""How often a hunt ends with the true cause, on machines that the diagnosis does not know.

    python benchmarks/hunt.py --seeds 60 --out build/hunt.jsonl

The independent generator makes machines with one effect, and of each a slow record of 5 s of its
position alone (grade `confusable`). Where the diagnosis of this record is ambiguous, `hunt` runs
experiments on the machine itself, stepped from outside, within three quarters of its speed and 1.2
times its supply pressure. The true position, speed and pressures are compared with these limits at
each sample. Finished seeds are kept: the same command goes on.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ehsid.harness.base.parallel import workers
from ehsid.harness.diagnosis import limits_of
from ehsid.harness.diagnosis.limits import Limits
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.hunt.hunting import DT_S, hunt
from ehsid.harness.records import make_record
from ehsid.harness.rigs import parse_rig
from ehsid.harness.signals.simulation import velocity_gain
from ehsid.lab.reality.case import make_case
from ehsid.lab.reality.noise import usual_logger
from ehsid.lab.reality.nominal_rig import draw_nominal_rig
from ehsid.lab.reality.stepping import SteppedReality

SEEDS_FROM = 460_000
# Effects that a slow record of the position alone does not tell apart.
ALIKE = ("transport_delay", "valve_lag", "sensor_lag")
BUDGET = 2


class Watched(SteppedReality):
    """The machine with the largest of what truly happened."""

    def __init__(self, *given: Any, **more: Any) -> None:
        self.low_m, self.high_m, self.speed_m_s, self.pressure_pa = np.inf, -np.inf, 0.0, 0.0
        super().__init__(*given, **more)

    def step(self, command_v: float) -> None:
        """Holds a command, and looks at what it does."""
        super().step(command_v)
        true = self.true_outputs
        self.low_m, self.high_m = (
            min(self.low_m, true["position_m"]),
            max(self.high_m, true["position_m"]),
        )
        self.speed_m_s = max(self.speed_m_s, abs(true["speed_m_s"]))
        chambers = true["pressure_a_pa"], true["pressure_b_pa"]
        self.pressure_pa = max(self.pressure_pa, *chambers)


def passed(machine: Watched, limits: Limits) -> list[str]:
    """Limits that the machine truly passed."""
    low, high = limits.position_m
    return [
        what
        for what, is_passed in (
            ("position", machine.low_m < low or machine.high_m > high),
            ("speed", machine.speed_m_s > limits.speed_m_s),
            ("pressure", machine.pressure_pa > limits.pressure_pa),
        )
        if is_passed
    ]


def one(seed: int) -> Mapping[str, Any]:
    """The hunt on the machine of a seed."""
    effect = ALIKE[seed % len(ALIKE)]
    case = make_case(seed, "confusable", "one", (effect,), sensors="position", seconds=5.0)
    rig = parse_rig(case.rig_toml)
    nominal = draw_nominal_rig(
        np.random.default_rng(np.random.SeedSequence(seed).spawn(11)[0]), "ehs"
    )
    margin = 0.05 * rig.values["cylinder.stroke_m"]
    usual = limits_of(rig)
    assert usual is not None
    limits = Limits(
        (margin, rig.values["cylinder.stroke_m"] - margin),
        usual.command_v,
        0.75 * velocity_gain(rig) * usual.command_v,
        1.2 * rig.values["supply.pressure_pa"],
    )
    machine = Watched(
        case.name,
        case.truth,
        nominal,
        usual_logger(nominal, DT_S, False),
        sensors="position",
        dt_s=DT_S,
        seconds=25.0 * (BUDGET + 1),
        seed=seed,
        position_m=0.5 * rig.values["cylinder.stroke_m"],
    )
    record = make_record(dict(case.train), name="train")
    hunted = hunt(
        machine, rig, [record], budget=BUDGET, options=DiagnosisOptions(limits=limits)
    ).told
    return {
        "seed": seed,
        "true": sorted(case.answer["effects"]),
        "ending": hunted.ending,
        "verdicts": [step.verdict for step in hunted.steps],
        "sets": [[sorted(cause.effects) for cause in step.causes] for step in hunted.steps],
        "experiments": [
            {
                "what": each.description,
                "nats": each.nats,
                "power": each.power,
                "stopped": each.stopped,
            }
            for each in hunted.experiments
        ],
        "passed": passed(machine, limits),
    }


def table(rows: list[Mapping[str, Any]]) -> str:
    """What came of the hunts whose first diagnosis was ambiguous."""
    hunted = [row for row in rows if row["verdicts"][0] == "ambiguous"]
    resolved = [row for row in hunted if row["ending"] == "cause"]
    right = [row for row in resolved if row["sets"][-1] == [row["true"]]]
    held = [row for row in hunted if row["true"] in row["sets"][0]]
    lines = [
        f"machines: {len(rows)}; first diagnosis: {dict(Counter(r['verdicts'][0] for r in rows))}",
        f"ambiguous: {len(hunted)}, with the true effect among the sets: {len(held)}",
        f"ended with one cause: {len(resolved)}, the true one: {len(right)}",
        f"endings: {dict(Counter(row['ending'] for row in hunted))}",
        f"experiments: {dict(Counter(len(row['experiments']) for row in hunted))}",
        f"limits passed: {[(row['seed'], row['passed']) for row in rows if row['passed']]}",
        f"ended by the guard: {sum(bool(e['stopped']) for r in rows for e in r['experiments'])}",
    ]
    return "\n".join(lines)


def main(
    seeds: Annotated[int, typer.Option(min=1, help="machines")] = 60,
    first: Annotated[int, typer.Option(min=0, help="first seed, above 460000")] = 0,
    out: Annotated[Path, typer.Option(help="rows, one a seed")] = Path("build/hunt.jsonl"),
) -> None:
    """Hunt on machines of the generator, and count.

    Example: python benchmarks/hunt.py --seeds 60
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    rows = [json.loads(line) for line in out.read_text().splitlines()] if out.is_file() else []
    done = {row["seed"] for row in rows}
    with out.open("a", encoding="utf-8") as file, workers(1):
        for seed in range(SEEDS_FROM + first, SEEDS_FROM + first + seeds):
            if seed not in done:
                rows.append(one(seed))
                file.write(json.dumps(rows[-1]) + "\n")
                file.flush()
                print(f"{seed}: {rows[-1]['ending']}, {rows[-1]['sets'][-1]}", flush=True)
    print(table(rows))


if __name__ == "__main__":
    typer.run(main)
