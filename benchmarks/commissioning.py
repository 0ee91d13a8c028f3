# SPDX-License-Identifier: MIT
"""What `ehsid apply` gives: machines before and after, python benchmarks/commissioning.py OUT 50

Each machine is the bench with other dimensions and with one to three hidden effects. The rig file
tells the values with their uncertainty and none of the effects. Two noisy records are diagnosed
with the effort "screened", half a minute to two minutes each; a diagnosis that is in OUT is not
made again. `ehsid apply` takes the diagnosis, and nothing else knows the truth but the simulated
machine.

Before: P with velocity feed-forward by the rig file as it was told. After: the same pole, with the
tables. Between them, "directions" has the speed of each direction by the rig file, and no effect.
The same reference, noise and start. Errors are rms in mm, `_volts` the rms of the steps of the
command from sample to sample.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.base.parallel import single_threaded_algebra
from ehsid.harness.commissioning import design
from ehsid.harness.diagnosis import diagnose
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig, read_rig, write_rig
from ehsid.harness.show.gap_page import write_diagnosis
from ehsid.harness.signals.excitation import multisine, triangle
from ehsid.harness.signals.simulation import (
    ClosedLoopRun,
    draw_noise,
    inside_stroke,
    simulate,
    simulate_closed_loop,
    suggested_controller,
)
from ehsid.harness.signals.simulation.run import OUTPUTS, prepare

BENCH = Path(__file__).parents[1] / "examples" / "rigs" / "bench.toml"
SEED, DT_S, SAMPLES = 20261126, 1e-3, 8000
POSITION, VELOCITY = OUTPUTS.index("position_m"), OUTPUTS.index("velocity_m_s")
# Of what the rig file tells, relative 1-sigma, in which the machine differs from it.
TOLD = {
    "valve.rated_flow_m3_s": 0.05,
    "fluid.bulk_modulus_pa": 0.15,
    "load.mass_kg": 0.03,
    "load.viscous_friction_n_s_m": 0.3,
    "supply.pressure_pa": 0.01,
}
# Sizes of the effects: lowest and highest, of either sign where that is told.
SIZES: dict[str, dict[str, tuple[float, float]]] = {
    "valve_dead_band": {"overlap": (0.01, 0.06)},
    "valve_dead_band_sides": {"overlap_a": (0.03, 0.06), "overlap_b": (0.005, 0.02)},
    "valve_null_bias": {"offset": (0.01, 0.03)},
    "valve_flow_saturation": {"limit": (0.4, 0.9)},
    "valve_hysteresis": {"half_width": (0.006, 0.02)},
    "coulomb_friction": {"force_n": (300.0, 1200.0)},
    "stribeck_friction": {
        "coulomb_n": (200.0, 600.0),
        "static_n": (700.0, 1200.0),
        "stribeck_velocity_m_s": (0.01, 0.03),
    },
    "internal_leakage": {"coefficient_m3_s_pa": (2e-12, 8e-12)},
    "load_force": {"force_n": (500.0, 2000.0)},
}
SIGNED = ("offset", "load_force.force_n")
TOGETHER = (
    {"valve_dead_band", "valve_dead_band_sides"},
    {"valve_null_bias", "valve_dead_band_sides"},
    {"coulomb_friction", "stribeck_friction"},
)


def drawn(number: int) -> tuple[Rig, Rig]:
    """Draws the rig file of a machine, and the machine itself with its effects."""
    rng = np.random.default_rng([SEED, number])
    bench = read_rig(BENCH)
    scale = float(np.exp(rng.uniform(-0.3, 0.3)))
    sizes = {
        "cylinder.bore_m": 0.063 * scale,
        "cylinder.rod_m": 0.063 * scale * rng.uniform(0.4, 0.7),
        "cylinder.dead_volume_a_m3": 2.5e-4 * scale**2,
        "cylinder.dead_volume_b_m3": 2.5e-4 * scale**2,
        "load.mass_kg": 120.0 * scale**2 * np.exp(rng.uniform(-0.4, 0.7)),
        "valve.rated_flow_m3_s": 6.33e-4 * scale**2 * np.exp(rng.uniform(-0.4, 0.4)),
        "effects.valve_lag.bandwidth_hz": rng.uniform(50.0, 110.0),
    }
    told = bench.with_values(sizes)
    truth = {key: told.values[key] * np.exp(s * rng.standard_normal()) for key, s in TOLD.items()}
    chosen: set[str] = set()
    for effect in rng.permutation(list(SIZES))[: 1 + int(rng.integers(3))]:
        if not any({str(effect), other} in TOGETHER for other in chosen):
            chosen.add(str(effect))
    for effect in sorted(chosen):
        for name, (low, high) in SIZES[effect].items():
            sign = rng.choice([-1.0, 1.0]) if f"{effect}.{name}".endswith(SIGNED) else 1.0
            truth[f"effects.{effect}.{name}"] = sign * rng.uniform(low, high)
    rig = Rig(f"m{number:02d}", told.plant, told.values, TOLD, told.sensors)
    return rig, rig.with_values(truth)


def records_of(machine: Rig, rig: Rig, number: int) -> list[Record]:
    """Takes two noisy records of a machine: a multisine, and slow triangles in a loop."""
    rng = np.random.default_rng([SEED, number, 1])
    n = 8000
    volts = multisine(n, DT_S, band_hz=(0.5, 15.0), peak=7.0, rng=rng)
    volts = inside_stroke(rig, volts, DT_S)
    noise = draw_noise(rig, n, rng)
    fast = simulate(machine, volts, dt_s=DT_S, noise=noise, name="multisine")
    slow = simulate_closed_loop(
        machine,
        0.15 + triangle(n, DT_S, amplitude=0.02, period_s=2.0),
        suggested_controller(rig),
        dt_s=DT_S,
        noise=draw_noise(rig, n, rng),
        name="triangles",
    )
    return [fast.record, slow.run.record]


def diagnosed(number: int, out: Path) -> Path:
    """Returns the folder of the diagnosis of a machine; makes it where there is none."""
    folder = out / f"m{number:02d}"
    if not (folder / "diagnosis.json").exists():
        rig, machine = drawn(number)
        folder.mkdir(parents=True, exist_ok=True)
        write_rig(rig, folder / "rig.toml")
        records = records_of(machine, rig, number)
        with single_threaded_algebra():
            found = diagnose(records, rig, options=DiagnosisOptions(effort="screened"))
        write_diagnosis(folder, found, records, "rig.toml")
    return folder


def reference(rig: Rig) -> FloatArray:
    """Returns a position that stops and reverses, at most a third of the speed, m."""
    t = np.arange(SAMPLES) * DT_S
    swing = 0.02 * np.sin(2.0 * np.pi * 0.5 * t) ** 3 + 0.01 * np.sin(2.0 * np.pi * 1.3 * t)
    swing[t > 6.0] = swing[t <= 6.0][-1]  # and stands
    return np.asarray(0.5 * rig.values["cylinder.stroke_m"] + swing)


def loops(number: int, folder: Path) -> dict[str, ClosedLoopRun]:
    """Returns the loop of a machine before, with the directions alone, and after.

    Raises
    ------
    ValueError
        `ehsid apply` refuses tables or gains.
    """
    rig, machine = drawn(number)
    made = design([folder])
    after = made.controller()
    assert made.gains is not None
    by_file = design([folder / "rig.toml"])  # no effects: the speeds by direction alone
    controllers = {
        "before": suggested_controller(rig, made.gains.pole / (2.0 * np.pi)),
        "directions": replace(by_file, gains=made.gains).controller(),
        "after": after,
    }
    runs = {}
    for name, controller in controllers.items():
        noise = draw_noise(rig, SAMPLES, np.random.default_rng([SEED, number, 2]))
        runs[name] = simulate_closed_loop(
            machine, reference(rig), controller, dt_s=DT_S, noise=noise
        )
    return runs


def error_mm(run: ClosedLoopRun) -> FloatArray:
    """Returns reference minus measured position, mm."""
    return np.asarray(1e3 * (run.reference_m - run.run.record.column("position_m")))


def placed_mm(number: int, folder: Path) -> float:
    """Returns the error of the pole placement, rms in mm; NaN where it is refused.

    Velocity and acceleration are without noise, the position has that of its sensor.
    """
    rig, machine = drawn(number)
    made = design([folder])
    gains = made.placed
    if gains is None or made.servo is None:
        return float("nan")
    # With a pole of 1 and no error it turns a velocity into a command.
    tables = replace(made.controller(), gain_v_m=1.0, feed_forward_v_s_m=1.0)
    wanted = reference(rig)
    speed = np.append(np.diff(wanted), 0.0) / DT_S
    plant = prepare(machine, dt_s=DT_S, position0_m=float(wanted[0])).plant(quantised=False)
    noise = draw_noise(rig, SAMPLES, np.random.default_rng([SEED, number, 2]))[:, POSITION]
    error, before = np.empty(SAMPLES), 0.0
    for k in range(SAMPLES):
        now = plant.read()
        position, velocity = float(now[POSITION]), float(now[VELOCITY])
        error[k] = wanted[k] - position - noise[k]
        volts = gains.position * error[k] + gains.feed_forward * speed[k]
        volts -= gains.velocity * velocity + gains.acceleration * (velocity - before) / DT_S
        before = velocity
        plant.advance(tables.step(0.0, 0.0, 0.0, made.servo.gain.value * volts, DT_S)[0])
    return float(1e3 * np.sqrt(np.mean(error[500:] ** 2)))


def compared(number: int, folder: Path) -> dict[str, object]:
    """Returns the tracking errors, rms in mm, before and after; or why there is no controller."""
    row: dict[str, object] = {"machine": number, "truth": list(drawn(number)[1].effects()[1:])}
    try:
        runs = loops(number, folder)
    except ValueError as error:
        return row | {"refused": str(error)}
    for name, run in runs.items():
        row[name] = float(np.sqrt(np.mean(error_mm(run)[500:] ** 2)))
        row[f"{name}_volts"] = float(np.std(np.diff(run.run.record.column("command_v"))))
    return row | {"placed": placed_mm(number, folder)}


if __name__ == "__main__":
    place = Path(sys.argv[1])
    rows = []
    for one in range(int(sys.argv[2]) if len(sys.argv) > 2 else 50):
        rows.append(compared(one, diagnosed(one, place)))
        print(json.dumps(rows[-1]), flush=True)
    told = [(row["before"], row["directions"], row["after"]) for row in rows if "after" in row]
    ratios = np.array([after / before for before, _, after in told])
    print(
        f"{len(rows)} machines, {len(rows) - len(told)} refused: better {np.sum(ratios < 1.0)}, "
        f"worse {np.sum(ratios > 1.0)}; error after over before: median {np.median(ratios):.2f}, "
        f"largest {ratios.max():.2f}; than the directions alone worse: "
        f"{sum(after > plain for _, plain, after in told)}"
    )
