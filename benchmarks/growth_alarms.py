# SPDX-License-Identifier: MIT
"""False alarms of the GrowthMonitor on quiet machines, and what it names when an effect grows.

    python benchmarks/growth_alarms.py quiet      # 1e8 samples, and 2e7 each of three others
    python benchmarks/growth_alarms.py detection  # five effects, five sizes, four seeds
    python benchmarks/growth_alarms.py other      # the same at other work than that of the record
    python benchmarks/growth_alarms.py picture    # docs/growth/monitor.png

The machine is the bench with some wear, in a loop at 500 Hz (growth/machine.cpp, needs c++ and
Eigen). Its tables are made of a quiet record of 400 s, as `ehsid export --growth` makes them. The
constants of the monitor were set with other seeds.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from target_budget import eigen

import ehsid
from ehsid.harness.firmware.growth import GrowthTables, growth_tables
from ehsid.harness.firmware.growth_header import render_growth_header
from ehsid.harness.models.identification import IoData
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.simulation.controller import suggested_controller
from ehsid.harness.signals.simulation.run import REFINEMENT, prepare

ROOT = Path(__file__).parents[1]
DT_S = 0.002
NAMES = [parameter.name for parameter in ehsid.plant_parameters()]
WEAR = {
    "effects.coulomb_friction.force_n": 200.0,
    "effects.internal_leakage.coefficient_m3_s_pa": 2e-12,
    "effects.valve_dead_band.overlap": 0.005,
}
# What 100 % is: the largest force, and the rated flow at the pressure of the supply.
WHOLE = {"coulomb_friction": 37_400.0, "internal_leakage": 5.28e-11}
SHARES = (0.005, 0.01, 0.02, 0.04, 0.08)
BENCH = read_rig(ROOT / "examples" / "rigs" / "bench.toml")
RIG = replace(BENCH, values={**BENCH.values, **WEAR})


class Machine:
    """The program, for tables of its own quiet record."""

    def __init__(self, folder: Path, seed: int = 101, correlation: float = 0.0) -> None:
        self.folder, self.correlation = folder, correlation
        recorder = self.compiled("recorder")
        out = self.said(recorder, 200_000, seed, [(-1, 0.0)])
        self.u, self.y = np.frombuffer(out, np.float32).reshape(-1, 2).astype(np.float64).T
        data = IoData(self.u, self.y, (slice(0, self.u.size),), DT_S, "command_v", "position_m")
        self.tables: GrowthTables = growth_tables(RIG, data)
        header = folder / "tables.hpp"
        header.write_text(render_growth_header(self.tables), encoding="utf-8")
        self.watcher = self.compiled("watcher", f'-DEHSID_TABLES="{header}"')
        self.recorder = recorder

    def compiled(self, name: str, *more: str) -> Path:
        """Compiles machine.cpp."""
        to = self.folder / name
        source = ROOT / "benchmarks" / "growth" / "machine.cpp"
        includes = [f"-I{ROOT / 'cpp' / 'include'}", "-isystem", eigen()]
        flags = ["-std=c++17", "-O2", "-ffp-contract=off", *more, *includes]
        subprocess.run(["c++", *flags, source, "-o", to], check=True)
        return to

    def said(
        self,
        program: Path,
        samples: int,
        seed: int,
        cases: list[tuple[int, float]],
        *,
        oil: float = 0.0,
        slow: int = 0,
    ) -> bytes:
        """Runs it; see the head of machine.cpp."""
        start = prepare(RIG, dt_s=DT_S, position0_m=0.15)
        loop = suggested_controller(RIG, 3.0)
        viscous = NAMES.index("load.viscous_friction_n_s_m")
        # A quarter of the steps of a single run, as a fit takes them.
        substeps = start.substeps // REFINEMENT
        numbers: list[float] = [seed, samples, DT_S, substeps, 1e-5, self.correlation]
        numbers += [oil, viscous, slow, loop.gain_v_m, loop.feed_forward_v_s_m, loop.limit_v]
        numbers += [len(start.plant_values), *start.plant_values.tolist(), len(cases)]
        numbers += [number for case in cases for number in case]
        text = " ".join(str(number) for number in numbers)
        return subprocess.run(
            [program], input=text.encode(), capture_output=True, check=True
        ).stdout


def quiet() -> Iterator[str]:
    """False alarms against those that the limits allow."""
    cases: tuple[tuple[str, int, float, float, int], ...] = (
        ("white noise of the sensor", 100_000_000, 0.0, 0.0, 0),
        ("noise with a correlation of 0.9 from sample to sample", 20_000_000, 0.9, 0.0, 0),
        ("oil: viscous friction ±30 %, flow ±3 %", 20_000_000, 0.0, 0.3, 0),
        ("slow, short moves, unlike the record", 20_000_000, 0.0, 0.0, 1),
    )
    yield "quiet machine | samples | allowed, alarms at three limits | alarms at one a year"
    for words, samples, correlation, oil, slow in cases:
        with tempfile.TemporaryDirectory() as folder:
            machine = Machine(Path(folder), correlation=correlation)
            out = machine.said(machine.watcher, samples, 301, [(-1, 0.0)], oil=oil, slow=slow)
            row = out.split()
            tests = len(machine.tables.effects)
            alarms = np.array(row[: 3 * tests], dtype=int).reshape(3, tests)
            allowed = samples / machine.tables.block / np.array([2e2, 2e3, 2e4])
            told = ", ".join(
                f"{a:g}: {n}" for a, n in zip(allowed, alarms.sum(axis=1), strict=True)
            )
            at_a_year = row[3 * tests].decode()  # the test of the first alarm, or -1
            yield f"{words} | {samples:.0e} | {told} ({alarms.tolist()}) | {at_a_year}"


def detection(slow: int = 0, seeds: int = 4) -> Iterator[str]:
    """What is named, and when, for each effect and size."""
    with tempfile.TemporaryDirectory() as folder:
        machine = Machine(Path(folder))
        effects = machine.tables.effects
        units = [f"{effect.name} {effect.sizes[0]:.3g}" for effect in effects]
        yield "units: " + ", ".join(units)
        for i, effect in enumerate(effects):
            for share in SHARES:
                whole = WHOLE.get(effect.name.split(".")[0], 1.0)
                size = share * whole * np.sign(effect.sizes[0])
                case = [(NAMES.index(f"effects.{effect.name}"), float(size))]
                found = []
                for seed in range(401, 401 + seeds):
                    out = machine.said(machine.watcher, 450_000, seed, case, slow=slow)
                    found.append([float(n) for n in out.split()[-6:]])
                first, noticed, named, at, told, _ = np.array(found).T
                seen, known = first >= 0, named >= 0
                right = named == i
                others = [effects[int(n)].name for n in named[known & ~right]]
                told_size = np.median(told[right]) * effect.sizes[0] / size if right.any() else 0.0
                yield (
                    f"{effect.name} {size:+.3g} ({share:.1%}): noticed {seen.sum()} of {seeds} "
                    f"after {np.median(noticed[seen]) * DT_S if seen.any() else np.nan:.0f} s, "
                    f"named right {right.sum()} "
                    f"after {np.median(at[right]) * DT_S if right.any() else np.nan:.0f} s, "
                    f"wrong {others}, size as told / true {told_size:.2f}"
                )


def other() -> Iterator[str]:
    """Detection at slow, short moves."""
    yield from detection(slow=1)


def picture() -> Iterator[str]:
    """Five minutes of the quiet machine, and then the leakage is larger by 2 %."""
    import matplotlib.pyplot as plt

    with tempfile.TemporaryDirectory() as folder:
        machine = Machine(Path(folder))
        tables = machine.tables
        monitor = tables.monitor()
        grown = (NAMES.index("effects.internal_leakage.coefficient_m3_s_pa"), 0.02 * 5.28e-11)
        statistic, named = [], -1.0
        for part, case in enumerate(((-1, 0.0), grown)):
            out = machine.said(machine.recorder, 150_000, 501, [case])
            u, y = np.frombuffer(out, np.float32).reshape(-1, 2).T
            monitor.step(np.nan, np.nan)
            for begin in range(0, u.size, tables.block):
                chunk = slice(begin, begin + tables.block)
                statistic.append(monitor.run(u[chunk], y[chunk]).statistic[-1])
                if named < 0.0 and monitor.named >= 0:
                    named = (part * u.size + begin + tables.block) * DT_S
                    name = tables.effects[monitor.named].name
        time = np.arange(1, len(statistic) + 1) * tables.block * DT_S
        figure, axes = plt.subplots(figsize=(8.0, 3.6), layout="constrained")
        for effect, course in zip(tables.effects, np.transpose(statistic), strict=True):
            words = effect.name.split(".")[0].replace("_", " ")
            sign = {True: " +", False: " -"}[effect.sizes[0] > 0] if "null" in words else ""
            axes.plot(time, course, label=f"{words}{sign}")
        axes.axhline(tables.limit, color="black", linestyle="--", linewidth=1.0)
        axes.axvline(300.0, color="grey", linewidth=1.0)
        axes.axvline(named, color="grey", linestyle=":")
        axes.set_ylim(-1.0, 4.0 * tables.limit)
        axes.annotate("limit: one false alarm a year", (2.0, tables.limit + 1.0))
        axes.annotate("leakage + 2 %", (302.0, 65.0))
        axes.annotate(f"named: {name.split('.')[0].replace('_', ' ')}", (named + 2.0, 28.0))
        axes.set_xlabel("time in s")
        axes.set_ylabel("S of the test")
        axes.legend(loc="upper left", frameon=False)
        path = ROOT / "docs" / "growth" / "monitor.png"
        path.parent.mkdir(exist_ok=True)
        figure.savefig(path, dpi=110)
        yield f"{path.relative_to(ROOT)}: named {name} at {named:.0f} s"


def main() -> None:
    """Prints one of the tables, or makes the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    runs = {"quiet": quiet, "detection": detection, "other": other, "picture": picture}
    parser.add_argument("which", choices=list(runs))
    for line in runs[parser.parse_args().which]():
        print(line)
        sys.stdout.flush()


if __name__ == "__main__":
    main()
