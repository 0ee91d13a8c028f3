# SPDX-License-Identifier: MIT
"""Machines with an FMU as their simulator: python benchmarks/user_simulators.py OUT [COUNT] [SEED]

The machines, their causes and their records are those of `ehsid gap-check`, which another program
simulates than any of ours. The simulator of each is the bench of the tests, an FMU with Runge-Kutta
steps of 0.1 ms and without seals, compiled anew with the sizes of the machine as its rig file tells
them. Two in five have only a command and a position. Needs gcc and the extras `fmu` and `lab`.

    python benchmarks/user_simulators.py OUT
    python benchmarks/gap_development.py OUT

OUT has answers.json and a folder for each machine.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np

from ehsid.harness.rigs import Rig, read_rig
from ehsid.lab.blind.making import Settings, make_check

FMUS = Path(__file__).resolve().parents[1] / "tests/python/data/user_simulator"
GRADES = ("plain", "hard", "confusable")
WITHOUT_PORTS = 0.4
# Of a valve whose lag no data sheet tells: bandwidth, Hz, and standard deviation of its logarithm.
HIDDEN_VALVE = (200.0, 0.4)
# Parameters of the FMU that may be wrong, and the values of our rig that they are.
TUNABLE = {
    "mass": "load.mass_kg",
    "viscous_friction": "load.viscous_friction_n_s_m",
    "bulk_modulus": "fluid.bulk_modulus_pa",
    "rated_flow": "valve.rated_flow_m3_s",
}


def main(out: Path, count: int, seed: int) -> None:
    """Makes the machines and their simulators."""
    rng = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        check = Path(folder) / "check"
        make_check(check, Settings(seed=seed, count=count, grades=GRADES))
        answers = json.loads((check / "answers.json").read_text(encoding="utf-8"))
        kept = {}
        for name, answer in answers.items():
            case = check / "cases" / name
            rig = read_rig(case / "rig.toml")
            ports = bool(rng.random() >= WITHOUT_PORTS)
            if rig.plant != "ehs":
                continue
            made = out / name
            made.mkdir(parents=True, exist_ok=True)
            build(made / "model.fmu", rig, "bench" if ports else "bench_portless")
            (made / "rig.toml").write_text(rig_text(rig, ports), encoding="utf-8")
            for record in ("train.csv", "validate.csv"):
                shutil.copy(case / record, made / record)
            kept[name] = answer | {"ports": ports}
    (out / "answers.json").write_text(json.dumps(kept, indent=1), encoding="utf-8")
    print(
        f"{len(kept)} machines in {out}, {sum(each['ports'] for each in kept.values())} with ports"
    )


def areas(rig: Rig) -> tuple[float, float]:
    """Areas of the piston on both sides, m^2."""
    cap = 0.25 * math.pi * rig.values["cylinder.bore_m"] ** 2
    return cap, cap - 0.25 * math.pi * rig.values["cylinder.rod_m"] ** 2


def valve(rig: Rig) -> tuple[float, float, float]:
    """Bandwidth, Hz, damping, and standard deviation of the logarithm of the bandwidth."""
    name = "effects.valve_lag.bandwidth_hz"
    if name in rig.values:
        return rig.values[name], rig.values["effects.valve_lag.damping"], rig.sigma(name)
    return HIDDEN_VALVE[0], 0.9, HIDDEN_VALVE[1]


def build(path: Path, rig: Rig, of: str) -> None:
    """Compiles an FMU of the tests with the values of a rig."""
    v, (cap, annulus), (bandwidth, damping, _) = rig.values, areas(rig), valve(rig)
    numbers = (
        *(v[name] for name in TUNABLE.values()),
        *(v["supply.tank_pressure_pa"], bandwidth, damping, cap, annulus, v["cylinder.stroke_m"]),
        *(v["cylinder.dead_volume_a_m3"], v["cylinder.dead_volume_b_m3"]),
        *(v["valve.rated_command_v"], 0.5 * v["cylinder.stroke_m"], 0.0, 0.0),
        v["supply.pressure_pa"],
    )
    with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(FMUS / f"{of}.fmu") as old:
        old.extractall(folder)
        sources = Path(folder) / "sources"
        config = (sources / "config.h").read_text(encoding="utf-8")
        listed = ", ".join(repr(float(number)) for number in numbers)
        config = re.sub(r"PARAMETERS \{.*\}", f"PARAMETERS {{ {listed} }}", config)
        drop = float(v["valve.rated_pressure_drop_pa"])
        config = re.sub(r"RATED_DROP_PA .*", f"RATED_DROP_PA {drop!r}", config)
        (sources / "config.h").write_text(config, encoding="utf-8")
        flags = ["-O2", "-std=c99", "-fPIC", "-shared", "-fvisibility=hidden"]
        binary = Path(folder) / "binaries" / "linux64" / f"{of}.so"
        subprocess.run(["gcc", *flags, "-o", binary, sources / "plant.c", "-lm"], check=True)
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as new:
            for name in old.namelist():
                new.write(Path(folder) / name, name)


def rig_text(rig: Rig, ports: bool) -> str:
    """The rig file of a machine with the FMU beside it."""
    v, (cap, _), (bandwidth, _, sigma) = rig.values, areas(rig), valve(rig)
    drop = v["valve.rated_pressure_drop_pa"]
    flow = v["valve.rated_flow_m3_s"] * math.sqrt(0.5 * v["supply.pressure_pa"] / drop)
    lines = [
        f'name = "{rig.name}"',
        'plant = "simulator"',
        f"valve.rated_command_v = {v['valve.rated_command_v']}",
        f"cylinder.stroke_m = {v['cylinder.stroke_m']}",
        f"supply.pressure_pa = {v['supply.pressure_pa']}",
        f"supply.tank_pressure_pa = {v['supply.tank_pressure_pa']}",
        *(f"sensors.{name} = {value}" for name, value in rig.sensors.items()),
        "[simulator]",
        'fmu = "model.fmu"',
        f"scales = {{ force_n = {cap * v['supply.pressure_pa']:.4g}, flow_m3_s = {flow:.4g} }}",
        'inputs.command_v = "u"',
        'outputs.position_m = "y"',
        'start.position_m = "position_start"',
    ]
    if ports:
        lines += [
            'outputs.velocity_m_s = "v"',
            'outputs.pressure_a_pa = "p_a"',
            'outputs.pressure_b_pa = "p_b"',
            'outputs.supply_flow_m3_s = "q_supply"',
            'ports = { force_n = "force", supply_pressure_pa = "p_supply", flow_a_m3_s = "q_a", '
            'flow_b_m3_s = "q_b" }',
        ]
    values = {name: (v[of], rig.sigma(of)) for name, of in TUNABLE.items()}
    values["valve.frequency"] = bandwidth, sigma
    if not ports:
        values["supply_pressure"] = v["supply.pressure_pa"], rig.sigma("supply.pressure_pa")
    for name, (value, deviation) in values.items():
        lines += [
            f'[simulator.parameters."{name}"]',
            f"value = {value}",
            f"sigma = {deviation}",
            "log = true",
        ]
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    main(
        Path(sys.argv[1]),
        int(sys.argv[2]) if len(sys.argv) > 2 else 60,
        int(sys.argv[3]) if len(sys.argv) > 3 else 70001,
    )
