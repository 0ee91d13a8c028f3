# SPDX-License-Identifier: MIT
"""Runs an exported C99 estimator on emulated cores: python tests/firmware/cores/run.py FILE.c

For each core whose compiler and emulator are there: whether the self-test has the bits of the host,
the mean number of instructions of a step over 1,000 steps of a servo under a random command, and
the bytes of code. QEMU counts instructions, not cycles: each core takes at least one cycle for one.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

HERE = Path(__file__).parent
ARM, RISCV = "arm-none-eabi-", "riscv64-unknown-elf-"
LEVELS = ("-O2", "-Os")


@dataclass(frozen=True)
class Core:
    """A core, how to compile for it, and the board of QEMU that has it."""

    name: str
    tools: str
    flags: str
    emulator: str
    clock_mhz: float
    """Usual clock of parts with this core, for the least time of a step."""


def _arm(flags: str, code: int, ram: int, tenths: int) -> str:
    memory = f"-Wl,--defsym=CODE={code},--defsym=RAM={ram} -DTENTHS={tenths}"
    return f"-mthumb {flags} {memory} -T {HERE / 'arm.ld'} arm.c -lc -lgcc"


CORES = (
    Core("Cortex-M0+", ARM, _arm("-mcpu=cortex-m0plus", 0, 0x20000000, 625), "arm -M microbit", 48),
    Core(
        "Cortex-M4F",
        ARM,
        _arm("-mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16", 0, 0x20000000, 400),
        "arm -M mps2-an386",
        168,
    ),
    Core(
        "Cortex-M33",
        ARM,
        _arm("-mcpu=cortex-m33 -mfloat-abi=hard -mfpu=fpv5-sp-d16", 0x10000000, 0x38000000, 500),
        "arm -M mps2-an505",
        160,
    ),
    Core(
        "RV32IMAFC",
        RISCV,
        f"-march=rv32imafc -mabi=ilp32f -misa-spec=2.2 -T {HERE / 'riscv.ld'} riscv.c",
        "riscv32 -M virt -bios none",
        100,
    ),
    Core(
        "RV32IMC",
        RISCV,
        f"-march=rv32imc -mabi=ilp32 -misa-spec=2.2 -T {HERE / 'riscv.ld'} riscv.c",
        "riscv32 -M virt -bios none",
        100,
    ),
)


@dataclass(frozen=True)
class Cost:
    """Of the estimator on a core at a level of optimisation."""

    core: str
    level: str
    same_bits: bool
    instructions: int
    code_bytes: int
    least_us: float
    """Time of a step at one cycle an instruction and the usual clock."""


def is_there(core: Core) -> bool:
    """Whether compiler and emulator of the core are installed."""
    emulator = f"qemu-system-{core.emulator.split()[0]}"
    return all(shutil.which(tool) for tool in (f"{core.tools}gcc", emulator))


def cost(core: Core, source: Path, level: str) -> Cost:
    """Compiles and runs the estimator of `source`, whose header lies beside it."""
    common = "-std=gnu99 -ffp-contract=off -fno-math-errno -fno-builtin-printf -nostartfiles"
    specs = "--specs=picolibc.specs" if core.tools == RISCV else ""
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder) / "image.elf"
        command = f"{core.tools}gcc {common} {specs} {level} -I {source.parent} -o {image} main.c"
        subprocess.run(
            [*command.split(), str(source), *core.flags.split(), "-lm", "-lgcc"],
            cwd=HERE,
            check=True,
            capture_output=True,
        )
        run = f"qemu-system-{core.emulator} -nographic -icount shift=0"
        made = subprocess.run(
            [*run.split(), "-semihosting-config", "enable=on,target=native", "-kernel", str(image)],
            capture_output=True,
            timeout=60,
            check=False,
        )
        size = subprocess.run(
            [f"{core.tools}size", str(image)], capture_output=True, text=True, check=True
        )
    said = (made.stdout + made.stderr).decode(errors="replace").strip()
    instructions = int(said) if made.returncode == 0 and said.isdigit() else 0
    return Cost(
        core.name,
        level,
        made.returncode == 0,
        instructions,
        int(size.stdout.splitlines()[1].split()[0]),
        round(instructions / core.clock_mhz, 1),
    )


def main(source: Path, as_json: bool) -> None:
    """Prints a table, or JSON."""
    costs = [
        cost(core, source.resolve(), level) for core in CORES if is_there(core) for level in LEVELS
    ]
    if as_json:
        print(json.dumps([asdict(each) for each in costs]))
        return
    for each in costs:
        bits = "same bits" if each.same_bits else "OTHER BITS"
        print(
            f"{each.core:<11} {each.level}  {bits}  {each.instructions:>6} instructions  "
            f"{each.code_bytes:>6} B  at least {each.least_us:g} us"
        )


if __name__ == "__main__":
    files = [Path(word) for word in sys.argv[1:] if word != "--json"]
    if len(files) != 1 or not files[0].is_file():
        sys.exit("expected one file: a servo_estimator.c of ehsid export --c-source")
    main(files[0], "--json" in sys.argv)
