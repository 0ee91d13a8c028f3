# SPDX-License-Identifier: MIT
"""`ehsid export --growth`: from a quiet record and a rig to the monitor on the target."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from typer.testing import CliRunner

import ehsid
from ehsid.harness.cli import cli
from ehsid.harness.firmware import growth, growth_header
from ehsid.harness.firmware.growth_observer import Observer
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.simulation.closed_loop import simulate_closed_loop
from ehsid.harness.signals.simulation.controller import suggested_controller

ROOT = Path(__file__).parents[3]
BENCH = ROOT / "examples" / "rigs" / "bench.toml"
DT_S = 0.004
FLAGS = ["-std=c++17", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
PROGRAM = """
#include "port.hpp"
#include "made.hpp"
static servo::GrowthMonitor monitor;
int main() {
  port::start();
  const bool same = servo::growth_self_test(monitor);
  port::write(same ? "PASS" : "FAIL", 4);
  return same ? 0 : 1;
}
"""


def at_work(overlap: float, samples: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Command and position of the bench in a loop, with its noise and a dead band."""
    rig = read_rig(BENCH)
    rng = np.random.default_rng(seed)
    targets = np.repeat(rng.uniform(0.08, 0.22, samples // 200 + 1), 200)[:samples]
    reference = np.convolve(np.pad(targets, (100, 0), mode="edge"), np.ones(100) / 100.0)[
        100 : 100 + samples
    ]
    noise = np.zeros((samples, 6))
    noise[:, 0] = 1e-5 * rng.normal(size=samples)
    values = {"effects.valve_dead_band.overlap": overlap}
    loop = suggested_controller(rig, 3.0)
    run = simulate_closed_loop(rig, reference, loop, dt_s=DT_S, values=values, noise=noise)
    record = run.run.record
    return record.column("command_v"), record.column("position_m")


class Made(NamedTuple):
    path: Path
    said: str
    tables: growth.GrowthTables


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """The header, from a shorter record and shorter simulations than it takes otherwise."""
    path = tmp_path_factory.mktemp("growth") / "made.hpp"
    record = path.with_name("quiet.csv")
    rows = np.column_stack(at_work(0.0, 12_000, 1))
    np.savetxt(record, rows, "%.9g", ",", header="u,y", comments="")
    words = ["export", str(record), "--input", "u", "--output", "y", "--dt", f"{DT_S}"]
    words += ["--growth", str(BENCH), "--setting", "hours=100", "--out", str(path)]
    made: list[growth.GrowthTables] = []

    def kept(*given: Any) -> growth.GrowthTables:
        made.append(growth.growth_tables(*given))
        return made[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(growth, "LEAST_BLOCKS", 20)
        patch.setattr(growth, "MOST_SIMULATED", 6000)
        patch.setattr(growth, "LEAST_IN_CELL", 10)
        patch.setattr(growth_header, "growth_tables", kept)
        ended = CliRunner().invoke(cli, words)
    assert ended.exit_code == 0, ended.stderr
    return Made(path, ended.stdout, made[0])


def compiled(compiler: str, path: Path, *more: str | Path) -> Path:
    source = path.with_name("main.cpp")
    source.write_text(PROGRAM, encoding="utf-8")
    to = path.with_name(f"{compiler}.elf")
    port = ROOT / "examples" / "firmware"
    folders = [f"-I{path.parent}", f"-I{ROOT / 'cpp' / 'include'}", f"-I{port}"]
    words = [compiler, *FLAGS, "-DEHSID_WITHOUT_EIGEN", *folders, source, *more, "-o", to]
    subprocess.run(words, check=True)
    return to


@pytest.mark.slow
def test_the_header_has_the_bits_of_python_on_the_host(made: Made) -> None:
    path, said, _ = made
    assert "valve_dead_band.overlap" in said
    host = ROOT / "examples" / "firmware" / "port" / "host" / "board.cpp"
    done = subprocess.run([compiled("c++", path, host)], capture_output=True, check=False)
    assert done.stdout == b"PASS"
    # The check can fail: the last digit of a signature is another.
    text = path.read_text(encoding="utf-8")
    at = text.index("p", text.index("{{  // mean"))
    digit = "1" if text[at - 1] != "1" else "2"
    changed = path.with_name("changed") / "made.hpp"
    changed.parent.mkdir()
    changed.write_text(text[: at - 1] + digit + text[at:], encoding="utf-8")
    done = subprocess.run([compiled("c++", changed, host)], capture_output=True, check=False)
    assert done.stdout == b"FAIL"


@pytest.mark.slow
def test_the_header_has_the_bits_of_python_on_the_target(made: Made) -> None:
    if not (shutil.which("arm-none-eabi-g++") and shutil.which("qemu-system-arm")):
        pytest.skip("no compiler and emulator of a Cortex-M4F")
    port = ROOT / "examples" / "firmware" / "port" / "mps2"
    core = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard"]
    core += ["-fno-exceptions", "-fno-rtti", "-fno-threadsafe-statics", "-fno-math-errno"]
    core += ["-nostartfiles", "-nodefaultlibs", "-T", str(port / "mps2.ld")]
    sources = [port / "start_up.cpp", port / "board.cpp"]
    libraries = ["-lc", "-lgcc", "-lm"]
    image = compiled("arm-none-eabi-g++", made.path, *core, *sources, *libraries)
    machine = ["-machine", "mps2-an386", "-display", "none", "-monitor", "none"]
    machine += ["-serial", "stdio", "-semihosting-config", "enable=on,target=native"]
    words = ["qemu-system-arm", *machine, "-kernel", image]
    done = subprocess.run(
        words, capture_output=True, check=False, timeout=60, stdin=subprocess.DEVNULL
    )
    assert done.stdout == b"PASS"


def test_the_observer_is_that_of_the_monitor() -> None:
    """Two ways to its innovations: as filters in double, and step by step in float32."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.normal(size=100), 20)
    observer = Observer.of(np.array([0.03, 90.0, 0.6, 1e9]), 2, DT_S)
    y = 0.15 + np.cumsum(3e-2 * DT_S * u) + 1e-5 * rng.normal(size=u.size)
    y -= y[0] - 0.15
    empty = np.zeros((40, 1))
    monitor = ehsid.GrowthMonitor(
        servo=observer.numbers(DT_S),
        correction=observer.correction,
        delay=observer.delay,
        settle=0,
        block=100,
        command_edges=np.arange(7.0),
        acceleration_edges=np.arange(4.0),
        mean=empty[:, 0],
        weight=empty[:, 0],
        other=np.zeros((40, 2)),
        signature=empty,
        effect=[0],
        tests=[(0, 1.0, 0.0)],
        prior=1.0,
        limit=1.0,
    )
    kept = slice(observer.settle * 3, None)
    innovations = monitor.run(u, y).innovation[kept]
    # A position of 0.3 m has steps of 3e-8 m in float32.
    assert innovations == pytest.approx(observer.innovations(u, y)[kept], abs=2e-7)
    assert innovations.std() > 1e-5


def test_what_cannot_be_made_is_refused_with_a_remedy(tmp_path: Path) -> None:
    rows = np.column_stack(at_work(0.0, 2000, 1))
    record = tmp_path / "quiet.csv"
    np.savetxt(record, rows, "%.9g", ",", header="u,y", comments="")
    words = ["export", str(record), "--input", "u", "--output", "y", "--dt", f"{DT_S}"]
    axis = str(BENCH.with_name("axis.toml"))
    for more, said in (
        (["--growth", axis], 'expected a rig with plant = "ehs"'),
        (["--growth", str(BENCH)], "record longer"),
        (["--growth", str(BENCH), "--setting", "hours=0"], "expected a finite number above 0"),
        (["--growth", str(BENCH), "--servo"], "--servo is of an estimator"),
        (["--growth", str(BENCH), "--setting", "delay=2"], "delay"),
    ):
        ended = CliRunner().invoke(cli, [*words, *more])
        assert ended.exit_code != 0
        assert said in ended.stderr, ended.stderr


@pytest.mark.slow
def test_a_dead_band_that_grows_is_named(made: Made) -> None:
    monitor = made.tables.monitor()
    monitor.run(*at_work(0.0, 12_000, 2))
    assert monitor.first == -1
    monitor.run(*at_work(0.04, 12_000, 3))
    assert made.tables.effects[monitor.named].name == "valve_dead_band.overlap"
