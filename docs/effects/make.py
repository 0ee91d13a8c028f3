# SPDX-License-Identifier: MIT
"""Makes the gallery of effects: python docs/effects/make.py

Every effect at its typical size on the same rig and commands, with and without, and how well each
agrees with the separate solution of the tests. It writes docs/effects/*.png, docs/effects.md and
docs/effects/agreement.md.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.progress import track

import ehsid
from ehsid.harness.records import Record
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.excitation import random_steps, triangle
from ehsid.harness.signals.simulation import simulate

HERE = Path(__file__).parent
sys.path.append(str(HERE.parents[1] / "tests" / "python"))
import plant_reference  # noqa: E402
import plant_runs  # noqa: E402

RIG = read_rig(HERE.parents[1] / "examples" / "rigs" / "bench.toml").with_values(
    {"effects.valve_lag.bandwidth_hz": 0.0, "effects.valve_lag.damping": 0.0}
)
DT_S = 1e-3
# A slow triangle through null, then steps: what most effects show in.
COMMAND = np.concatenate(
    [
        triangle(1000, DT_S, amplitude=0.8, period_s=1.0),
        random_steps(1000, amplitude=6.0, hold=(100, 250), rng=np.random.default_rng(4)),
    ]
)


def machine_of(effect: ehsid.EffectInfo) -> Mapping[str, float]:
    """What the machine has on which the effect shows, where that is not the bench."""
    return plant_runs.SHOWN_ON.get(effect.id, {})


def run(values: Mapping[str, float]) -> Record:
    """The record of the bench with these values."""
    return simulate(RIG, COMMAND, dt_s=DT_S, values=values).record


def picture(effect: ehsid.EffectInfo, without: Record, with_effect: Record) -> Figure:
    """Position, load pressure, and what changes."""
    figure = Figure(figsize=(9, 4.6), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    assert without.time_s is not None
    for record, label, style in ((without, "without", "0.55"), (with_effect, "with", "C0")):
        axes[0].plot(record.time_s, 1e3 * record.column("position_m"), color=style, label=label)
        load = record.column("pressure_a_pa") - record.column("pressure_b_pa")
        axes[1].plot(record.time_s, 1e-5 * load, color=style, linewidth=1.0)
    change = with_effect.column("position_m") - without.column("position_m")
    axes[2].plot(without.time_s, 1e3 * change, color="C3")
    for axis, label in zip(
        axes, ("position in mm", "p_a - p_b in bar", "difference in mm"), strict=True
    ):
        axis.set_ylabel(label, fontsize="small")
        axis.margins(x=0.0)
        axis.grid(True, alpha=0.3)
    axes[0].legend(fontsize="small", loc="upper left")
    axes[0].set_title(effect.id)
    axes[2].set_xlabel("time in s")
    return figure


def section(effect: ehsid.EffectInfo) -> str:
    """The effect in words, and its picture."""
    rows = "\n".join(
        f"| `{p.name}` | {p.unit} | {p.minimum:g} .. {p.maximum:g} | {p.typical:g} | {p.meaning} |"
        for p in effect.parameters
    )
    simpler = (
        ""
        if effect.contains is None
        else f"\n- **Contains:** [`{effect.contains}`](#{effect.contains})."
    )
    machine = "".join(
        f"\n- **Changed for the picture:** {name} = {value:g}."
        for name, value in machine_of(effect).items()
    )
    return f"""## {effect.id}

Subsystem: {effect.subsystem}. Equation: `{effect.equation}` ({effect.source}).

- **Shown by:** {effect.excitation}.
- **Sensors:** {effect.sensors}.{machine}{simpler}
- **Too small to be named:** {effect.least_size}.

| parameter | unit | plausible range | here | meaning |
|---|---|---|---|---|
{rows}

![{effect.id}: position and load pressure with and without](effects/{effect.id}.png)
"""


SUBSTEPS = (8, 16, 32, 64)
COMPARED = ("position_m", "velocity_m_s", "pressure_a_pa", "pressure_b_pa")


def agreement(effect: ehsid.EffectInfo | None) -> str:
    """A row: largest error of any output, as a share of its range, for halved steps."""
    values = plant_reference.typical() if effect is None else plant_runs.with_effect(effect)
    command = plant_runs.steps(0, 100, 10, 6.0)
    expected = plant_runs.reference(values, command)
    errors = [
        plant_runs.worst_error(plant_runs.simulate(values, command, n), expected, COMPARED)
        for n in SUBSTEPS
    ]
    cells = " | ".join(f"{error:.1e}" for error in errors)
    name = "none" if effect is None else f"[{effect.id}](../effects.md#{effect.id})"
    return f"| {name} | {cells} | {errors[-2] / errors[-1]:.1f} |"


def main() -> None:
    """Write pictures and pages."""
    bench = run({})
    parts = []
    rows = [agreement(None)]
    for effect in track(ehsid.effects(), description="simulating"):
        machine = machine_of(effect)
        sizes = {f"effects.{effect.id}.{p.name}": p.typical for p in effect.parameters}
        without = run(machine) if machine else bench
        picture(effect, without, run({**machine, **sizes})).savefig(
            HERE / f"{effect.id}.png", dpi=70
        )
        parts.append(section(effect))
        rows.append(agreement(effect))
    head = """# The catalogue of effects

This page has a section for each effect that the simulator knows and that the diagnosis can name.
Use it to see what an effect does to a machine, which excitation and which sensors show it, and how
large it may be.

- **Pictures.** Grey is the machine without the effect, and blue is the machine with it. Red is the
  difference in position. The machine is the bench of `examples/rigs` without its valve lag. The
  command is a slow triangle of 0.8 V through null, then steps of up to 6 V.
- **Tables.** The column *here* has the size in the picture, which is a typical one.
- **Too small to be named** says why the diagnosis does not name the effect if it is smaller.
- **Contains** names a simpler effect that this one includes.

`ehsid effects --json` prints the texts of this page. [Each effect agrees with a separate
solution](effects/agreement.md) has the checks. `python docs/effects/make.py` makes both pages.
"""
    (HERE.parent / "effects.md").write_text("\n".join([head, *parts]), encoding="utf-8")
    compared = """# Each effect agrees with a separate solution

The table shows how exactly the simulator solves its equations with each effect of
[the catalogue](../effects.md). The same equations are written separately in Python
(`tests/python/plant_reference.py`) and solved by scipy's LSODA at a relative tolerance of 1e-9. The
machine is the typical servo, and the command has steps of up to 6 V.

- **8 to 64** is the number of integration steps in a sample of 2 ms. The cells have the largest
  error of position, velocity and both pressures, as a share of the range of the output.
- **rate** is the factor by which the last halving of the step reduces the error. It is four for a
  method of second order.

The rate can differ from four where friction has kinks at its reversals, and where the play or the
quantisation of the sensor changes single readings. The two solutions agree there, too.

`python docs/effects/make.py` makes this page.

| effect | 8 | 16 | 32 | 64 | rate |
|---|---|---|---|---|---|
"""
    (HERE / "agreement.md").write_text(compared + "\n".join([*rows, ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
