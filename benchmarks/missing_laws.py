# SPDX-License-Identifier: MIT
"""Are missing laws found? python benchmarks/missing_laws.py FOLDER

Makes machines of the blind generator, each with one law that no catalogue names (eight families,
see `lab/reality/unnamed.py`), diagnoses them without telling the law, and compares:
equation, variable, curve, and how much of the explainable gap goes away on held-out data. The
generator and the simulator share no code.

FOLDER keeps each finished machine, so that an interrupted run goes on where it stopped. With
--pictures DIR the gallery and the table go to DIR/missing_laws.png and DIR/missing_laws.md.
"""

from __future__ import annotations

import argparse
import functools
import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from matplotlib.figure import Figure

from ehsid.harness.base.files import write_text
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.base.parallel import run_tasks
from ehsid.harness.diagnosis import diagnose
from ehsid.harness.diagnosis.result import Diagnosis
from ehsid.harness.records import read_record
from ehsid.harness.rigs import read_rig
from ehsid.harness.rigs.rig import OF_TERM, OF_VARIABLE, TERM_WORDS, VARIABLE_WORDS
from ehsid.lab.reality.batch import write_case
from ehsid.lab.reality.case import BEFORE_S, Kind, RealityCase, Sensors, make_case
from ehsid.lab.reality.truth import Truth
from ehsid.lab.reality.unnamed import UNNAMED
from ehsid.lab.scoring.figures import wilson

SEED = 22_000_000  # no check of `ehsid gap-check` has it
GRADES = ("plain", "hard")
SENSORS: tuple[Sensors, ...] = ("pressures", "pressures", "position")
SECONDS, DT_S = 15.0, 1e-3
# Equations that say the same where the flow over the spool is meant: an opening, or a flow.
SAME = frozenset({("spool", "spool"), ("flow_a", "spool"), ("flow_b", "spool")})
GALLERY = 10
Part = Callable[[FloatArray, Mapping[str, float], Truth], FloatArray]
# Terms of effects that stay beside a law: the law is then what remains. By effect: the equation,
# the variables of the laws of which it is a part, and the term.
PARTS: Mapping[str, tuple[str, tuple[str, ...], Part]] = {
    "coulomb_friction": (
        "force",
        ("velocity_m_s",),
        lambda v, sizes, _: sizes["force_n"] * np.sign(v),
    ),
    "load_force": ("force", tuple(OF_VARIABLE), lambda x, sizes, _: sizes["force_n"] + 0.0 * x),
    "load_spring": (
        "force",
        ("position_m",),
        lambda y, sizes, t: (
            sizes["stiffness_n_m"] * (y - 0.5 * t.stroke_m) + sizes["force_at_mid_stroke_n"]
        ),
    ),
    "valve_null_bias": ("spool", tuple(OF_VARIABLE), lambda x, sizes, _: sizes["offset"] + 0.0 * x),
    "transport_delay": (
        "delay",
        tuple(OF_VARIABLE),
        lambda x, sizes, _: sizes["delay_s"] + 0.0 * x,
    ),
    "external_leakage": (
        "flow_a",
        ("pressure_a_pa",),
        lambda p, sizes, t: -sizes["coefficient_a_m3_s_pa"] * (p - t.tank_pa),
    ),
}


def judge(case: RealityCase, diagnosis: Diagnosis, name: str) -> dict[str, Any]:
    """What was found beside what is true, as plain data; the first law is judged."""
    true = UNNAMED[name]
    far = diagnosis.how_far
    result: dict[str, Any] = {
        "law": name,
        "sensors": case.answer["sensors"],
        "grade": case.answer["grade"],
        "seed": case.answer["seed"],
        "verdict": diagnosis.verdict,
        "effects": [effect.id for effect in diagnosis.effects],
        "shrinkage": far.of_explainable.value if far and far.of_explainable else None,
        "gap": far.calibrated / far.noise_floor[1] if far else None,
        "seconds": diagnosis.seconds,
        "offered": bool(diagnosis.missing_laws),
    }
    if not diagnosis.missing_laws:
        return result
    found = diagnosis.missing_laws[0]
    pairs = [(found.law.adds_to, found.law.of), *found.rivals]
    wanted = (true.adds_to, true.of)
    alike = SAME if wanted in SAME else {wanted}
    knots = np.array(found.law.knots)
    shift = BEFORE_S if found.law.of == "time_s" else 0.0
    finely = np.linspace(knots[0], knots[-1], 200)

    def expected(x: FloatArray) -> FloatArray:
        """The true law, less what named effects of the same equation and variable stand for."""
        curve = true.curve(x + shift, case.truth)
        for effect in diagnosis.effects:
            adds_to, variables, term = PARTS.get(effect.id, ("", (), None))
            if term is not None and adds_to == found.law.adds_to and found.law.of in variables:
                sizes = {key: value.value for key, value in effect.parameters.items()}
                curve = curve - term(x, sizes, case.truth)
        if found.law.adds_to == "sensor":
            # Windows begin at the measured position, so that a constant error does not show.
            own = true.curve(knots, case.truth) - np.array(found.law.values)
            curve = curve - float(np.sum(np.array(found.visited) * own))
        return np.asarray(curve, dtype=np.float64)

    curve = expected(knots)
    low, high = np.array(found.band).T
    inside = (low <= curve) & (curve <= high)
    same = pairs[0] in alike and pairs[0] == wanted
    return result | {
        "equation": found.law.adds_to == true.adds_to or pairs[0] in alike,
        "variable": pairs[0] in alike,
        "among_rivals": any(pair in alike for pair in pairs),
        "covered": float(np.array(found.visited)[inside].sum()) if same else None,
        "found": [found.law.adds_to, found.law.of],
        "looks_like": found.looks_like,
        "knots": knots.tolist(),
        "values": list(found.law.values),
        "band": [list(ends) for ends in found.band],
        "visited": list(found.visited),
        "true_knots": finely.tolist(),
        "true": expected(finely).tolist(),
    }


def run_one(folder: Path, index: int) -> dict[str, Any]:
    """Makes, diagnoses and judges one machine, or reads what an earlier run wrote."""

    def judged() -> dict[str, Any]:
        name, turn = list(UNNAMED)[index % len(UNNAMED)], index // len(UNNAMED)
        return judge(*diagnosed(folder, SEED + index, "open", name, turn), name)

    return kept(folder / f"{index:04d}.json", judged)


def kept(file: Path, make: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """What an earlier run wrote, or what is made now and written."""
    if file.exists():
        read: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        return read
    result = make()
    write_text(file, json.dumps(result))
    return result


def diagnosed(
    folder: Path, seed: int, kind: Kind, name: str, turn: int
) -> tuple[RealityCase, Diagnosis]:
    """Makes and diagnoses one machine with an effect; its grade and sensors change by turns."""
    case = make_case(
        seed,
        GRADES[turn % len(GRADES)],
        kind,
        [name],
        sensors=SENSORS[turn % len(SENSORS)],
        seconds=SECONDS,
        dt_s=DT_S,
    )
    place = folder / "records" / case.name
    write_case(case, place)
    rig = read_rig(place / "rig.toml")
    train, validate = (read_record(place / f"{part}.csv") for part in ("train", "validate"))
    return case, diagnose([train], rig, validate=[validate])


def share(values: Sequence[bool]) -> str:
    """Such as "12 of 14 = 86 % (60 to 96)"."""
    if not values:
        return "-"
    low, high = wilson(sum(values), len(values))
    return (
        f"{sum(values)} of {len(values)} = {100 * sum(values) / len(values):.0f} % "
        f"({100 * low:.0f} to {100 * high:.0f})"
    )


def _median(values: Sequence[float | None]) -> str:
    known = [value for value in values if value is not None]
    return f"{np.median(known):.2f}" if known else "-"


Rows = Sequence[Mapping[str, Any]]
FIGURES: Mapping[str, tuple[str, Callable[[Rows], str]]] = {
    "recognised as outside of the catalogue": (
        "",
        lambda rows: share([row["verdict"] == "outside_catalogue" for row in rows]),
    ),
    "a law is offered": ("", lambda rows: share([row["offered"] for row in rows])),
    "right equation, where offered": (
        "90 %; 75 % position only",
        lambda rows: share([row["equation"] for row in rows if row["offered"]]),
    ),
    "right equation and variable, where offered": (
        "80 %",
        lambda rows: share([row["variable"] for row in rows if row["offered"]]),
    ),
    "curve in its band over 80 % of what was visited": (
        "90 %",
        lambda rows: share(
            [row["covered"] >= 0.8 for row in rows if row.get("covered") is not None]
        ),
    ),
    "shrinkage of the explainable gap, median, where offered": (
        "0.8",
        lambda rows: _median([row["shrinkage"] for row in rows if row["offered"]]),
    ),
}


def table(rows: Rows) -> str:
    """The figures by sensors, and a line for each family, as Markdown."""
    seen = [row for row in rows if row["sensors"] != "position"]
    blind = [row for row in rows if row["sensors"] == "position"]
    lines = [
        "| figure | target | with pressures | position only |",
        "|---|---|---|---|",
        *(
            f"| {name} | {goal} | {figure(seen)} | {figure(blind)} |"
            for name, (goal, figure) in FIGURES.items()
        ),
        "",
        "| family | true law | recognised | offered | right equation and variable | in its band |",
        "|---|---|---|---|---|---|",
    ]
    for name, law in UNNAMED.items():
        own = [row for row in rows if row["law"] == name]
        covered = [row["covered"] >= 0.8 for row in own if row.get("covered") is not None]
        right = sum(row.get("variable", False) for row in own)
        lines.append(
            f"| {name} | {law.adds_to} over {law.of} | "
            f"{sum(row['verdict'] == 'outside_catalogue' for row in own)} of {len(own)} | "
            f"{sum(row['offered'] for row in own)} | {right} | "
            f"{sum(covered)} of {len(covered)} |"
        )
    return "\n".join(lines)


def gallery(rows: Rows) -> Figure:
    """The first laws that were offered, wrong ones included: found on true."""
    shown = [row for row in rows if row["offered"]][:GALLERY]
    figure = Figure(figsize=(14, 6.4), layout="constrained")
    for axes, row in zip(np.ravel(figure.subplots(2, GALLERY // 2)), shown, strict=False):
        adds_to, of = row["found"]
        (unit, scale), (x_unit, x_scale) = OF_TERM[adds_to], OF_VARIABLE[of]
        x = x_scale * np.array(row["knots"])
        low, high = scale * np.array(row["band"]).T
        axes.fill_between(x, low, high, color="#0072b2", alpha=0.2, lw=0, label="90 % band")
        axes.plot(x, scale * np.array(row["values"]), "o-", color="#0072b2", ms=3, label="found")
        if row["variable"]:
            axes.plot(
                x_scale * np.array(row["true_knots"]),
                scale * np.array(row["true"]),
                color="black",
                lw=1.0,
                label="true",
            )
        verdict = "" if row["variable"] else f"\nWRONG: it is {UNNAMED[row['law']].adds_to} over "
        verdict += "" if row["variable"] else UNNAMED[row["law"]].of
        axes.set_title(f"{row['law'].replace('_', ' ')}, {row['sensors']}{verdict}", fontsize=8)
        axes.set_xlabel(f"{VARIABLE_WORDS[of]} in {x_unit}", fontsize=8)
        axes.set_ylabel(f"{TERM_WORDS[adds_to]} in {unit}", fontsize=8)
        axes.tick_params(labelsize=7)
    figure.axes[0].legend(fontsize=7)
    return figure


def options(description: str | None) -> argparse.ArgumentParser:
    """Parser of the options that all such runs have."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="finished machines are kept here")
    parser.add_argument("--count", type=int, default=48, help="number of machines")
    return parser


def run_all(one: Callable[[Path, int], dict[str, Any]], folder: Path, count: int) -> Rows:
    """Runs so many machines, or reads them, and prints the progress."""
    folder.mkdir(parents=True, exist_ok=True)
    tasks = [functools.partial(one, folder, index) for index in range(count)]
    return run_tasks(tasks, lambda done: print(f"{100 * done:.0f} %", flush=True))


def main() -> None:
    """Runs the machines and prints the table."""
    parser = options(__doc__)
    parser.add_argument("--pictures", type=Path, help="folder of the gallery and the table")
    given = parser.parse_args()
    rows = run_all(run_one, given.folder, given.count)
    text = table(rows)
    print(text)
    if given.pictures is not None:
        given.pictures.mkdir(parents=True, exist_ok=True)
        gallery(rows).savefig(given.pictures / "missing_laws.png", dpi=110)
        write_text(given.pictures / "missing_laws.md", text + "\n")


if __name__ == "__main__":
    main()
