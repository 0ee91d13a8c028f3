# SPDX-License-Identifier: MIT
"""What an update costs on a Cortex-M: nice python benchmarks/target_budget.py

Builds every form of benchmarks/target/forms.cpp, runs each on the emulator and writes
docs/budgets.md: Cortex-M4F for 2 to 10 parameters, Cortex-M7 for 6. Needs the installed package,
arm-none-eabi-g++, qemu-system-arm and Eigen; takes some minutes. `--json` prints the figures, too.

Instructions: QEMU with -icount shift=5 gives each instruction 32 ns, SysTick counts 40 ns, so a
tick is 1.25 instructions. A form of 1000 known instructions checks this before anything is written.

Divisions: QEMU logs each execution of an address at which objdump finds VDIV or VSQRT, of which a
Cortex-M4F takes 14 cycles (ARM 100166_0001, Table 7-1). The program runs with 400 and with 200
samples, each twice; the difference is that of 400 updates. One that is skipped by its condition
counts, too.
"""

from __future__ import annotations

import importlib.metadata
import json
import re
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

from target_tables import METHODS, NAMES, POLICIES, SERVO, document

ROOT = Path(__file__).parents[1]
PROGRAM = ROOT / "benchmarks" / "target"
PORT = ROOT / "examples" / "firmware" / "port" / "mps2"
COUNTS = range(2, 11)
LEVELS = ("2", "s")
WHOLE = tuple(f"whole_{form}" for form in (*POLICIES, *METHODS, *SERVO))
INSTRUCTIONS_PER_TICK = 40.0 / 32.0
SAMPLES = (400, 200)
FLAGS = [
    *("-mthumb", "-mfloat-abi=hard", "-std=c++17"),
    *("-DNDEBUG", "-fno-exceptions", "-fno-rtti", "-fno-threadsafe-statics", "-fno-math-errno"),
    *("-ffp-contract=off", "-ffunction-sections", "-fdata-sections"),
]


@dataclass(frozen=True)
class Target:
    """A processor, and the machine of the emulator that has it."""

    name: str
    machine: str
    flags: tuple[str, ...]


M4F = Target("Cortex-M4F", "mps2-an386", ("-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16"))
M7 = Target("Cortex-M7", "mps2-an500", ("-mcpu=cortex-m7", "-mfpu=fpv5-sp-d16"))


@dataclass
class Figures:
    """One form: instructions and bytes."""

    target: str
    form: str
    parameters: int
    level: str
    instructions: float  # mean of an update
    instructions_most: float
    divisions: float  # and square roots, mean of an update
    flash: int
    ram: int
    stack: int  # painted
    stack_static: int  # -fstack-usage along the deepest calls


def run(command: list[str | Path]) -> str:
    """Standard output of a command that must not fail."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    if done.returncode != 0:
        sys.exit(f"target_budget: failed ({done.returncode}): {command[0]}\n{done.stderr}")
    return done.stdout


def eigen() -> Path:
    """Folder of Eigen's headers: the system's or the wheel's, as in cmake/LocateEigen.cmake."""
    system = Path("/usr/include/eigen3")
    if system.exists():
        return system
    for file in importlib.metadata.files("cmeel-eigen") or []:
        if file.name == "Eigen3Config.cmake":
            return Path(str(file.locate())).resolve().parents[3] / "include" / "eigen3"
    sys.exit("target_budget: Eigen was not found; install libeigen3-dev or pip install cmeel-eigen")


def compile_source(
    source: Path,
    to: Path,
    parameters: int,
    level: str,
    form: str,
    target: Target,
    samples: int = SAMPLES[0],
) -> Path:
    """An object, and its call graph with stack beside it (.ci)."""
    includes = [ROOT / "cpp" / "include", ROOT / "examples" / "firmware", ROOT / "tests/firmware"]
    arguments = [*target.flags, *(f"-I{folder}" for folder in includes)]
    build: list[str | Path] = [
        "-fcallgraph-info=su",
        f"-O{level}",
        f"-DEHSID_N={parameters}",
        f"-DEHSID_FORM={form}",
        f"-DEHSID_SAMPLES={samples}",
        "-c",
        source,
        "-o",
        to,
    ]
    run(["arm-none-eabi-g++", *FLAGS, *arguments, "-isystem", eigen(), *build])
    return to


def link(objects: list[Path], to: Path, target: Target) -> Path:
    """The image."""
    options: list[str | Path] = [
        "-nostartfiles",
        "-nodefaultlibs",
        "-T",
        PORT / "mps2.ld",
        "-Wl,--gc-sections",
    ]
    libraries: list[str | Path] = ["-lc", "-lgcc", "-lm", "-o", to]
    run(["arm-none-eabi-g++", *FLAGS, *target.flags, *objects, *options, *libraries])
    return to


def emulate(image: Path, target: Target, *more: str | Path) -> dict[str, int]:
    """What the program prints."""
    machine = ["-machine", target.machine, "-icount", "shift=5", "-display", "none"]
    line: list[str | Path] = ["-monitor", "none", "-serial", "stdio", "-kernel", image]
    text = run(
        [
            "qemu-system-arm",
            *machine,
            "-semihosting-config",
            "enable=on,target=native",
            *line,
            *more,
        ]
    )
    return {name: int(value) for name, value in re.findall(r"(\w+) (\d+)", text)}


def divided(image: Path, target: Target) -> int:
    """Divisions and square roots of a whole run, but for those of the program that measures."""
    function, places = "", []
    for line in run(["arm-none-eabi-objdump", "-d", image]).splitlines():
        if begin := re.match(r"[0-9a-f]+ <(.+)>:", line):
            function = begin[1]
        if (found := re.match(r" +([0-9a-f]+):.*\tv(?:div|sqrt)", line)) and function != "main":
            places.append(f"0x{found[1]}+2")
    if not places:
        return 0
    log = image.with_suffix(".log")
    each = ("-singlestep", "-d", "exec,nochain", "-dfilter", ",".join(places), "-D", log)
    emulate(image, target, *each)
    with log.open() as lines:
        return sum(1 for _ in lines)


def sizes(image: Path) -> tuple[int, int]:
    """Flash and static RAM of an image, bytes."""
    text, data, bss = run(["arm-none-eabi-size", image]).splitlines()[1].split()[:3]
    return int(text) + int(data), int(data) + int(bss)


def deepest_stack(graph: Path, start: str) -> int:
    """Bytes along the deepest chain of calls; library functions count nothing."""
    text = graph.read_text()
    own = {
        title: int(size)
        for title, size in re.findall(r'node: \{ title: "([^"]+)" .*?(\d+) bytes \(static\)', text)
    }
    if " bytes (dynamic" in text:
        sys.exit("target_budget: a stack of variable size")
    calls: dict[str, set[str]] = {}
    for source, target in re.findall(r'sourcename: "([^"]+)" targetname: "([^"]+)"', text):
        calls.setdefault(source, set()).add(target)

    def depth(name: str) -> int:
        return own.get(name, 0) + max((depth(called) for called in calls.get(name, ())), default=0)

    return depth(start)


def measure(folder: Path, parameters: int, level: str, target: Target) -> list[Figures]:
    """All forms at one size and level."""

    def compiled(source: Path, form: str) -> Path:
        to = folder / f"{source.stem}_{form}.o"
        return compile_source(source, to, parameters, level, form, target)

    port = [compiled(PORT / name, "nothing") for name in ("start_up.cpp", "board.cpp")]
    program = {
        samples: compile_source(
            PROGRAM / "main.cpp",
            folder / f"main_{samples}.o",
            parameters,
            level,
            "nothing",
            target,
            samples,
        )
        for samples in SAMPLES
    }

    def image(form: str) -> Path:
        own = compiled(PROGRAM / "forms.cpp", form)
        return link([own, program[SAMPLES[0]], *port], folder / f"{form}.elf", target)

    def divisions(form: str, whole: Path) -> float:
        own = folder / f"forms_{form}.o"
        half = link([own, program[SAMPLES[1]], *port], folder / f"{form}_half.elf", target)
        updates = 2 * (SAMPLES[0] - SAMPLES[1])
        return (divided(whole, target) - divided(half, target)) / updates

    empty_image = image("nothing")
    empty = emulate(empty_image, target)
    known = emulate(image("ruler"), target)
    counted = INSTRUCTIONS_PER_TICK * (known["ticks"] - empty["ticks"]) / known["updates"]
    if abs(counted - 1000.0) > 2.0:
        sys.exit(f"target_budget: 1000 instructions were counted as {counted:.1f}")
    flash, ram = sizes(empty_image)
    call = empty["ticks"] / empty["updates"]
    all_figures = []
    for form in (*NAMES, *(WHOLE if parameters == 6 else ())):
        linked = image(form)
        check: list[str | Path] = ["-D", f"IMAGE={linked}", "-D", "NM=arm-none-eabi-nm"]
        run(["cmake", *check, "-P", ROOT / "tests" / "firmware" / "check_image.cmake"])
        made = emulate(linked, target)
        own_flash, own_ram = sizes(linked)
        all_figures.append(
            Figures(
                target.name,
                form,
                parameters,
                level,
                INSTRUCTIONS_PER_TICK * (made["ticks"] / made["updates"] - call),
                INSTRUCTIONS_PER_TICK * (made["most"] - call),
                divisions(form, linked),
                own_flash - flash,
                own_ram - ram + made["bytes"],
                made["stack"],
                deepest_stack(folder / f"forms_{form}.ci", "measured_update"),
            )
        )
    return all_figures


def main() -> None:
    """Measure and write."""
    figures: list[Figures] = []
    with tempfile.TemporaryDirectory() as folder:
        for target, counts in ((M4F, COUNTS), (M7, (6,))):
            for parameters in counts:
                for level in LEVELS:
                    print(
                        f"{target.name}, n = {parameters}, -O{level}", file=sys.stderr, flush=True
                    )
                    figures += measure(Path(folder), parameters, level, target)
    rows = [asdict(one) for one in figures]
    compiler = run(["arm-none-eabi-g++", "--version"]).splitlines()[0]
    emulator = run(["qemu-system-arm", "--version"]).splitlines()[0]
    (ROOT / "docs" / "budgets.md").write_text(document(rows, f"{compiler}; {emulator}"))
    if "--json" in sys.argv[1:]:
        print(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
