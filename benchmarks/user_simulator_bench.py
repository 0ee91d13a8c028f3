# SPDX-License-Identifier: MIT
"""Machines whose FMU has their structure: python benchmarks/user_simulator_bench.py OUT [SEED]

Unlike those of `user_simulators.py` these machines are what their FMU describes, but for what every
servo has: edges that are round and differ, friction of the seals of 0.2 % of the largest force, an
oil that stiffens with pressure, noise of the sensors. Their values differ from those of the rig
file by its uncertainty. Each cause of the catalogue comes once with all ports and, where it can be
carried without, once with a simulator that has only its command; causes inside, sound machines and
machines with other values only follow. Needs gcc and the extras `fmu` and `lab`.

    python benchmarks/user_simulator_bench.py OUT
    python benchmarks/gap_development.py OUT
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
from user_simulators import TUNABLE, build, rig_text

from ehsid.harness.rigs import read_rig
from ehsid.lab.reality import case as blind
from ehsid.lab.reality import nominal_rig, variants
from ehsid.lab.reality.batch import record_text
from ehsid.lab.reality.effects import ADDED_EFFECTS, CATALOGUE
from ehsid.lab.reality.excitation import EXCITATIONS, draw_task
from ehsid.lab.reality.noise import draw_noise, usual_logger

BANDWIDTH = nominal_rig.LAG[0]
# Standard deviations of the logarithms of the values that may be wrong, as the rig file tells them.
SIGMA = {
    "load.mass_kg": 0.1,
    "load.viscous_friction_n_s_m": 0.3,
    "fluid.bulk_modulus_pa": 0.3,
    "valve.rated_flow_m3_s": 0.05,
    BANDWIDTH: 0.2,
}
SEALS = 0.002  # of the largest force
SECONDS = 15.0
ANYWHERE = (
    "valve_dead_band valve_dead_band_sides valve_hysteresis valve_null_bias valve_flow_saturation "
    "flow_gain_drift"
)
BEHIND = "transport_delay sensor_lag sensor_quantisation sensor_backlash sensor_nonlinearity"
THROUGH_PORTS = (
    "internal_leakage external_leakage supply_droop relief_valve coulomb_friction "
    "coulomb_friction_sides stribeck_friction position_friction load_spring load_force"
)
INSIDE = (
    "internal_leakage external_leakage supply_droop coulomb_friction stribeck_friction load_spring "
    "load_force entrained_air flexible_load"
)
# Kind, effect, and whether the simulator has ports.
PLAN: list[tuple[str, str, bool]] = [
    *(("one", effect, True) for effect in f"{ANYWHERE} {THROUGH_PORTS} {BEHIND}".split()),
    *(("one", effect, False) for effect in f"{ANYWHERE} {BEHIND} {INSIDE}".split()),
    ("one", "entrained_air", True),
    ("one", "flexible_load", True),
    *(("none", "", ports) for ports in (True, False, True)),
    *(("params", "", ports) for ports in (True, False, True, False)),
]


def main(out: Path, seed: int) -> None:
    """Makes the machines and their simulators."""
    answers = {}
    for number, plan in enumerate(PLAN):
        name, answer = machine(out, np.random.default_rng((seed, number)), number, *plan)
        answers[name] = answer
    (out / "answers.json").write_text(json.dumps(answers, indent=1), encoding="utf-8")
    print(f"{len(answers)} machines in {out}")


def true_values(rng: np.random.Generator, told: dict[str, float], kind: str) -> dict[str, float]:
    """Values of the machine: as told, within the uncertainty, or one or two 2 to 3 sigma away."""
    if kind == "none":
        return told
    away = {name: float(np.clip(rng.standard_normal(), -2.0, 2.0)) for name in SIGMA}
    if kind == "params":
        for name in rng.permutation(list(SIGMA))[: int(rng.integers(1, 3))]:
            away[str(name)] = float(rng.choice([-1, 1]) * rng.uniform(2, 3))
    return told | {name: told[name] * math.exp(SIGMA[name] * away[name]) for name in SIGMA}


def machine(
    out: Path, rng: np.random.Generator, number: int, kind: str, effect: str, ports: bool
) -> tuple[str, dict[str, Any]]:
    """Writes one machine, and returns its name and answer."""
    rig = nominal_rig.draw_nominal_rig(rng, "ehs")
    while BANDWIDTH not in rig.values:
        rig = nominal_rig.draw_nominal_rig(rng, "ehs")
    true = true_values(rng, dict(rig.values), kind)
    structure = variants.draw_structure(rng, rig, 0.0)
    structure |= {"spool_slew_1_s": 1e4, "seal_n": SEALS * rig.force_n}
    truth = variants.build(rig, true, structure)
    sizes = {}
    if effect:
        law = (dict(CATALOGUE) | dict(ADDED_EFFECTS))[effect]
        sizes = {effect: law.draw(rng, rig)}
        truth = law.put(truth, sizes[effect], structure["bristle_m"])
    dt_s = float(rng.choice([0.001, 0.002]))
    logger = usual_logger(rig, dt_s, False)
    kinds = [str(each) for each in rng.permutation(list(EXCITATIONS))[:2]]
    is_small = bool(rng.random() < 0.2)
    samples = round((SECONDS + blind.BEFORE_S) / dt_s)
    records = []
    for each in kinds:
        small = is_small and each == "multisine"
        task = draw_task(rng, rig, each, samples, dt_s, small, None)  # type: ignore[arg-type]
        noise = draw_noise(rng, rig, samples, logger)
        faults = blind.faults(sizes, rng, samples, dt_s)
        step = sizes.get("sensor_quantisation", {}).get("step_m", 0.0)
        measured = truth._replace(sensor_step_m=max(noise.position_step_m, step))
        sensors: blind.Sensors = "pressures" if ports else "position"
        records.append(blind._record(measured, rig, task, noise, faults, sensors, dt_s))
    name = f"m{number:02d}-{int(rng.integers(2**24)):06x}"
    folder = out / name
    folder.mkdir(parents=True)
    rig_file = folder / "rig.toml"
    rig_file.write_text(nominal_rig.rig_text(rig, name), encoding="utf-8")
    described = read_rig(rig_file)
    build(folder / "model.fmu", described, "bench" if ports else "bench_portless")
    rig_file.write_text(with_uncertainty(rig_text(described, ports), rig.values), encoding="utf-8")
    for file, record in zip(("train", "validate"), records, strict=True):
        (folder / f"{file}.csv").write_text(record_text(record), encoding="utf-8")
    return name, {"kind": kind, "effects": sizes, "ports": ports, "true": true}


def with_uncertainty(text: str, told: Any) -> str:
    """The rig file with the values of this benchmark and their uncertainty."""
    values = TUNABLE | {"valve.frequency": BANDWIDTH}
    lines = [
        f'[simulator.parameters."{name}"]\nvalue = {told[of]}\nsigma = {SIGMA[of]}\nlog = true'
        for name, of in values.items()
    ]
    return "\n".join([text.split("[simulator.parameters.")[0] + lines[0], *lines[1:], ""])


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 91001)
