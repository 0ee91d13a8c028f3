# SPDX-License-Identifier: MIT
"""Our figures beside those of the literature: python benchmarks/gap_literature.py ROW FOLDER

ROW is `valve`, `faults`, `names`, `leak` or `competition`; docs/gap/literature.md says with which
published figure it is compared. The rigs of the publications are not known to us in full: all rows
are on one small laboratory cylinder. Its records are made by the independent generator
(`ehsid.lab.reality`), which shares nothing with the simulator, or where a row says so by the
simulator itself. FOLDER keeps each finished machine, so that an interrupted run goes on where it
stopped. `competition` needs the folder of a finished `ehsid gap-check`. `picture` makes the picture
of the page from the folder of the others, with --out FILE.
"""

from __future__ import annotations

import argparse
import json
import math
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from gap_efficiency import bounds
from gap_visible import is_seen, kept
from matplotlib.figure import Figure

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.base.parallel import single_threaded_algebra
from ehsid.harness.catalogue.families import effect_families
from ehsid.harness.catalogue.spellings import effect_values, sizes_of
from ehsid.harness.commissioning.drive import edge_area
from ehsid.harness.diagnosis import diagnose
from ehsid.harness.diagnosis.model.case import make_case
from ehsid.harness.diagnosis.model.parameters import effect_parameters
from ehsid.harness.diagnosis.model.scale import effect_starts
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.diagnosis.schema import read_diagnosis_file
from ehsid.harness.diagnosis.search.candidates import calibrate, refine
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs.rig import Rig
from ehsid.harness.rigs.rig_file import parse_rig
from ehsid.harness.signals.simulation import simulate
from ehsid.lab.reality import case as reality
from ehsid.lab.reality import machine as equations
from ehsid.lab.reality.effects import CATALOGUE
from ehsid.lab.reality.excitation import draw_task
from ehsid.lab.reality.noise import draw_noise, usual_logger
from ehsid.lab.reality.nominal_rig import NominalRig, draw_true_values, rig_text
from ehsid.lab.reality.truth import Truth
from ehsid.lab.reality.variants import build, draw_structure

SECONDS, DT_S, SEED = 15.0, 1e-3, 45_000_000  # no check of `ehsid gap-check` has this seed
LITRES_MIN = 1.0 / 60e3  # m^3/s
# What is assumed where the publication, as far as it was at hand, does not tell it.
VALUES = {
    "cylinder.bore_m": 0.040,
    "cylinder.rod_m": 0.025,
    "cylinder.stroke_m": 0.300,
    "cylinder.dead_volume_a_m3": 6e-5,
    "cylinder.dead_volume_b_m3": 6e-5,
    "load.mass_kg": 60.0,
    "load.viscous_friction_n_s_m": 2500.0,
    "valve.rated_flow_m3_s": 10.0 * LITRES_MIN,
    "valve.rated_pressure_drop_pa": 3.5e6,
    "valve.rated_command_v": 10.0,
    "supply.pressure_pa": 7e6,
    "supply.tank_pressure_pa": 2e5,
    "fluid.bulk_modulus_pa": 1e9,
}
SUPPLY_PA = VALUES["supply.pressure_pa"]
Effects = Mapping[str, Mapping[str, float]]


def nominal() -> NominalRig:
    """The laboratory cylinder as its rig file tells it."""
    v = VALUES
    area_a = math.pi / 4.0 * v["cylinder.bore_m"] ** 2
    area_b = area_a - math.pi / 4.0 * v["cylinder.rod_m"] ** 2
    middle = 0.5 * (SUPPLY_PA - v["supply.tank_pressure_pa"])
    flow = v["valve.rated_flow_m3_s"] * math.sqrt(middle / v["valve.rated_pressure_drop_pa"])
    damping = v["load.viscous_friction_n_s_m"] / v["load.mass_kg"]
    speed = flow / (0.5 * (area_a + area_b))
    return NominalRig("ehs", v, speed, SUPPLY_PA * area_a, damping, v["cylinder.stroke_m"])


def rig() -> Rig:
    """The rig file of the laboratory cylinder."""
    return parse_rig(rig_text(nominal(), "laboratory"))


def machine_of(seed: int, effects: Effects) -> Truth:
    """A machine of the generator, with values drawn from the uncertainties of the rig file."""
    rng = np.random.default_rng([SEED, seed, 1])
    structure = draw_structure(rng, nominal(), 0.0)
    truth = build(nominal(), draw_true_values(rng, nominal(), "within"), structure)
    for effect, sizes in effects.items():
        truth = CATALOGUE[effect].put(truth, sizes, structure["bristle_m"])
    return truth


def record_of(truth: Truth, seed: int, exact: Mapping[str, float] | None = None) -> Record:
    """A noisy record of a machine under position control.

    exact: values by full name of a machine that is our simulator itself; it gets the same command.
    """
    rng = np.random.default_rng([SEED, seed, 2])
    samples = round((SECONDS + reality.BEFORE_S) / DT_S)
    task = draw_task(rng, nominal(), "multisine", samples, DT_S, False, None)
    noise = draw_noise(rng, nominal(), samples, usual_logger(nominal(), DT_S, False))
    none = reality.faults({}, rng, samples, DT_S)
    quantised = truth._replace(sensor_step_m=noise.position_step_m)
    made = reality._record(quantised, nominal(), task, noise, none, "pressures", DT_S)
    if exact is not None:
        names = ("position_m", "pressure_a_pa", "pressure_b_pa")
        errors = {"position_m": noise.position_m, **noise.pressures_pa}
        run = simulate(rig(), made["command_v"], dt_s=DT_S, values=dict(exact), substeps=16).record
        last = {name: errors[name][-len(run) :] for name in names}
        made = {**made, **{name: run.column(name) + last[name] for name in names}}
    return make_record(made)


def fitted(record: Record, effects: tuple[str, ...]) -> Mapping[str, float]:
    """Values by full name of the rig with these effects, fitted from usual sizes."""
    case = make_case(rig(), [record])
    starts = [
        x
        for effect in effects
        for _, x in effect_parameters(effect, effect_starts(effect, rig())[0], "ehs")
    ]
    return refine(case, effects, np.array([*calibrate(case).x, *starts])).values


# --- The characteristic of a valve ---------------------------------------------------------------

VALVE = {
    "valve_dead_band": {"overlap": 0.04},
    "valve_flow_saturation": {"limit": 0.7},
    "valve_null_bias": {"offset": 0.02},
}
COMMANDS = np.linspace(-1.0, 1.0, 401)


def true_curve(truth: Truth) -> FloatArray:
    """Flow at the rated drop through the mean of the two edges of a direction, m^3/s, signed."""
    opening = np.array([equations.opening(u, truth) for u in COMMANDS])
    flow = truth.flow_gain * VALUES["valve.rated_pressure_drop_pa"] ** truth.flow_exponent
    edges = {
        name: getattr(truth, f"gain_{name}")
        * np.array(
            [
                equations.edge(sign * o - getattr(truth, f"overlap_{name}"), truth.round_width)
                for o in opening
            ]
        )
        for name, sign in (("pa", 1.0), ("bt", 1.0), ("at", -1.0), ("pb", -1.0))
    }
    mean = 0.5 * (edges["pa"] + edges["bt"] - edges["at"] - edges["pb"])
    return np.asarray(flow * mean)


def our_curve(values: Mapping[str, float]) -> FloatArray:
    """The same of our simulator with these values by full name; see docs/simulator.md."""
    v = {**VALUES, **values}
    x = COMMANDS + v.get("effects.valve_null_bias.offset", 0.0)
    limit = v.get("effects.valve_flow_saturation.limit", 0.0)
    x = limit * np.tanh(x / limit) if limit > 0.0 else x
    lap = v.get("effects.valve_dead_band.overlap", 0.0) + v.get("nuisance.edge_overlap", 0.0)
    sides = v.get("nuisance.edge_overlap_sides", 0.0)
    tank = v.get("nuisance.edge_overlap_tank", 0.0)
    d, g, k = (v.get(f"nuisance.edge_gain_{w}", 0.0) for w in ("direction", "sides", "tank"))
    w, i, r = (v.get(f"nuisance.edge_rounding_{w}", 0.0) for w in ("direction", "sides", "tank"))
    rounding, closing = (v.get(f"nuisance.edge_{name}", 0.0) for name in ("rounding", "closing"))

    def area(s: FloatArray, wider: float) -> FloatArray:
        return edge_area(s, rounding * math.exp(wider), closing)

    out = (1 + d + g - k) * area(x - lap - sides + tank, w + i - r)
    out = out + (1 + d - g + k) * area(x - lap + sides - tank, w - i + r)
    back = (1 - d + g + k) * area(-x - lap - sides - tank, -w + i + r)
    back = back + (1 - d - g - k) * area(-x - lap + sides + tank, -w - i - r)
    return np.asarray(0.5 * v["valve.rated_flow_m3_s"] * (out - back))


def valve(folder: Path, seed: int) -> dict[str, Any]:
    """RMSE of the curve, share of its largest value, on both kinds of machine."""
    sizes = {k: v for name, one in VALVE.items() for k, v in effect_values(name, one).items()}
    true = draw_true_values(np.random.default_rng([SEED, seed, 3]), nominal(), "within")
    machine = machine_of(seed, VALVE)
    found: dict[str, Any] = {"command": list(COMMANDS)}
    for kind, exact, curve in (
        ("generator", None, true_curve(machine)),
        ("exact", {**true, **sizes}, our_curve({**true, **sizes})),
    ):
        ours = our_curve(fitted(record_of(machine, seed, exact), tuple(VALVE)))
        found[kind] = float(np.sqrt(np.mean((ours - curve) ** 2)) / np.abs(curve).max())
        found[f"{kind}_curves"] = [list(60e3 * curve), list(60e3 * ours)]
    return found


# --- Friction and two leaks at once --------------------------------------------------------------


def three(seed: int) -> Effects:
    """Friction of 2 to 8 % of the largest force, and leaks of 0.3 to 1.5 l/min at the supply."""
    rng = np.random.default_rng([SEED, seed, 4])
    leaks = rng.uniform(0.3, 1.5, 3) * LITRES_MIN / SUPPLY_PA
    return {
        "coulomb_friction": {"force_n": float(rng.uniform(0.02, 0.08)) * nominal().force_n},
        "internal_leakage": {"coefficient_m3_s_pa": float(leaks[0])},
        "external_leakage": {
            "coefficient_a_m3_s_pa": float(leaks[1]),
            "coefficient_b_m3_s_pa": float(leaks[2]),
        },
    }


def faults(folder: Path, seed: int) -> dict[str, Any]:
    """Relative errors of the four sizes, with the names given."""
    effects = three(seed)
    record = record_of(machine_of(seed, effects), seed)
    values = fitted(record, tuple(effects))
    errors = {
        f"{effect}.{name}": sizes_of(effect, values)[name] / size - 1.0
        for effect, sizes in effects.items()
        for name, size in sizes.items()
    }
    return {"errors": errors}


def names(folder: Path, seed: int) -> dict[str, Any]:
    """What is answered on the same machines without the names."""
    return answered(seed, three(seed))


def answered(seed: int, effects: Effects) -> dict[str, Any]:
    """Verdict and sets of a diagnosis, and the internal leakage that could have been seen."""
    record = record_of(machine_of(seed, effects), seed)
    found = diagnose([record], rig(), options=DiagnosisOptions((), "screened"))
    size = next((one.size for one in found.could_be_seen if one.id == "internal_leakage"), None)
    sets = [list(each) for each in found.ambiguity_set]
    return {"verdict": found.verdict, "sets": sets, "size": size}


# --- The smallest leak ---------------------------------------------------------------------------

LEAKS = (0.0, 0.0042, 0.05, 0.1, 0.2, 0.6)  # l/min at the supply pressure


def leak(folder: Path, seed: int) -> dict[str, Any]:
    """For each leak what is answered, the size that could have been seen, and the bound."""
    rows = {}
    for litres in LEAKS:
        coefficient = litres * LITRES_MIN / SUPPLY_PA
        effects = {"internal_leakage": {"coefficient_m3_s_pa": coefficient}} if litres else {}
        made = partial(answered, seed, effects)
        rows[f"{litres:g}"] = kept(folder / f"leak-{seed}-{litres:g}.json", made)
    # The deviation of the leak if the simulator were exact: by the noise alone, and with what the
    # likelihood tolerates besides.
    case = make_case(rig(), [record_of(machine_of(seed, {}), seed)])
    problem = case.problem(("internal_leakage",))
    place = len(case.parameters())
    size = 0.1 * LITRES_MIN / SUPPLY_PA
    own = problem.parameters[place]
    x = np.array([*(p.centre for p in case.parameters()), own.place(size)])
    unit = own.slope(float(x[place])) * SUPPLY_PA / LITRES_MIN
    return {"rows": rows} | {
        name: float(deviation[place]) * unit
        for name, deviation in zip(("noise", "tolerant"), bounds(problem, x), strict=True)
    }


# --- Detected, false, named ----------------------------------------------------------------------


def competition(folder: Path) -> dict[str, list[float]]:
    """The figures of a competition of all machines of a finished `ehsid gap-check`.

    Detected and false: whether the answer has a cause, on machines with and without one. Named: the
    probability of the true effects, or of a cause outside where no catalogue has them.
    """
    answers = json.loads((folder / "answers.json").read_text())
    found: dict[str, list[float]] = {"detected": [], "false": [], "named": []}
    for name, answer in answers.items():
        file = read_diagnosis_file(folder / "results" / name / "diagnosis.json")
        row = {"verdict": file.verdict}
        if answer["kind"] in ("none", "params"):
            found["false"].append(is_seen(row))
            continue
        found["detected"].append(is_seen(row))
        true = effect_families(tuple(answer["effects"]))
        known = [
            each.probability or 0.0
            for each in file.which.candidates
            if effect_families(each.effects) == true
        ]
        outside = answer["kind"] == "open" or not known
        found["named"].append((file.which.outside_probability or 0.0) if outside else sum(known))
    return found


# --- Tables and picture --------------------------------------------------------------------------

ROWS = {"valve": valve, "faults": faults, "names": names, "leak": leak}
LEAK = {"internal_leakage"}


def spread(values: Sequence[float], unit: str) -> str:
    """Such as "0.05 % (0.03 to 0.09; 8)": the median, and the lowest and highest of how many."""
    ends = (float(np.median(values)), min(values), max(values))
    middle, low, high = (f"{value:.2g}" for value in ends)
    return f"{middle} {unit} ({low} to {high}; {len(values)})"


def words(row: str, found: Sequence[Mapping[str, Any]]) -> list[str]:
    """The figures of a row, a line each."""
    if row == "valve":
        kinds = ("generator", "exact")
        return [f"{k}: RMSE {spread([100 * one[k] for one in found], '%')}" for k in kinds]
    if row == "faults":
        return [
            f"{name}: error {spread([100 * abs(one['errors'][name]) for one in found], '%')}, "
            f"mean {np.mean([100 * abs(one['errors'][name]) for one in found]):.2g} %"
            for name in found[0]["errors"]
        ]
    if row == "names":
        sets = Counter(" / ".join("+".join(sorted(s)) for s in one["sets"]) for one in found)
        return [f"{count} times: {name or 'nothing'}" for name, count in sets.items()]
    lines = []
    for litres in LEAKS:
        rows = [one["rows"][f"{litres:g}"] for one in found]
        lines.append(f"{litres:g} l/min: {seen_share(rows)}")
    sound = [one["rows"]["0"]["size"] for one in found]
    smallest = [size * SUPPLY_PA / LITRES_MIN for size in sound if size is not None]
    lines.append(f"size that could be seen: {spread(smallest, 'l/min')}")
    for name in ("noise", "tolerant"):
        lines.append(f"deviation by {name}: {spread([one[name] for one in found], 'l/min')}")
    return lines


def named(row: Mapping[str, Any]) -> bool:
    """Whether internal leakage is in every set of an answer."""
    return bool(row["sets"]) and all(set(one) >= LEAK for one in row["sets"])


def seen_share(rows: Sequence[Mapping[str, Any]]) -> str:
    """Such as "a cause in 5 of 6, the leak by its name in 5"."""
    return (
        f"a cause in {sum(map(is_seen, rows))} of {len(rows)}, "
        f"the leak by its name in {sum(map(named, rows))}"
    )


def picture(folder: Path, seeds: int) -> Figure:
    """Left the curve of a valve, right the share of leaks that are named, over their size."""
    read = {
        row: [json.loads((folder / f"{row}-{seed}.json").read_text()) for seed in range(seeds)]
        for row in ("valve", "leak")
    }
    figure = Figure(figsize=(9.6, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    first = read["valve"][0]
    true, ours = (np.array(one) for one in first["generator_curves"])
    left.plot(first["command"], true, color="black", lw=2.5, label="the machine")
    left.plot(first["command"], ours, color="#d55e00", lw=1.0, label="found")
    left.set_xlabel("command, share of the rated one")
    left.set_ylabel("flow at 35 bar in l/min")
    left.legend()
    shares = [
        np.mean([named(one["rows"][f"{litres:g}"]) for one in read["leak"]]) for litres in LEAKS[1:]
    ]
    right.semilogx(LEAKS[1:], 100 * np.array(shares), "o-", color="#0072b2", label="ours, named")
    right.axvline(0.6, color="black", ls="--", label="Mahulkar 2011, smallest")
    right.plot([0.0042], [85], "^", color="black", label="Thakur, detected")
    right.set_xlabel("internal leakage in l/min")
    right.set_ylabel("share of the machines in %")
    right.set_ylim(-5, 105)
    right.legend()
    return figure


def main() -> None:
    """Run what is missing, and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("row", choices=[*ROWS, "competition", "picture"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=6, help="number of machines")
    parser.add_argument("--out", type=Path, help="file of the picture")
    given = parser.parse_args()
    if given.row == "competition":
        for name, values in competition(given.folder).items():
            print(f"{name}: {100 * np.mean(values):.1f} % of {len(values)}")
        return
    if given.row == "picture":
        picture(given.folder, given.seeds).savefig(given.out, dpi=100)
        return
    given.folder.mkdir(parents=True, exist_ok=True)
    found = []
    with single_threaded_algebra():
        for seed in range(given.seeds):
            path = given.folder / f"{given.row}-{seed}.json"
            found.append(kept(path, partial(ROWS[given.row], given.folder, seed)))
            print(f"machine {seed + 1} of {given.seeds}", flush=True)
    print("\n".join(words(given.row, found)))


if __name__ == "__main__":
    main()
