# SPDX-License-Identifier: MIT
"""docs/budgets.md out of the figures of target_budget.py."""

from __future__ import annotations

from typing import Any

import ehsid

Row = dict[str, Any]
NAMES = {
    "as_printed": "textbook, `P -= K*phi'*P`",
    "grouped": "textbook, `P -= K*(phi'*P)`",
}
TEXTBOOK = tuple(NAMES)
NAMES |= {info.id: f"`{info.policy.__name__}`" for info in ehsid.policies()}
POLICIES = tuple(info.id for info in ehsid.policies())

# Whole estimator only: its recursion needs the samples of a servo.
METHODS = {
    "small": "`SmallArxEstimator`, `Constant`",
    "riv": "`InstrumentalArxEstimator`, `Exponential`",
}

SERVO = {
    "servo": "`ServoEstimator`",
    "servo_start": "`ServoEstimator`, while its twelve starts compete",
    "growth": "`GrowthMonitor`, 22 signatures",
}

M4F, M7 = "Cortex-M4F", "Cortex-M7"

DIVISION_CYCLES = 14
CLOCK_MHZ = {M4F: 168, M7: 480}  # of a usual part: STM32F407, STM32H743

HEAD = """# What an update costs on the target

This page tells how much time, flash, RAM and stack the estimator takes on a Cortex-M. With it you
can check, before you have a board, whether the estimator fits into your controller.

{times}
[Goals](#goals) compares each policy with the textbook form, and
[The whole estimator](#the-whole-estimator) has the instructions of a whole `step`.

`nice python benchmarks/target_budget.py` writes this page. It needs arm-none-eabi-g++,
qemu-system-arm and Eigen. This page was made with {tools}.

## What is measured

**The target** is QEMU's mps2-an386 (Cortex-M4F) with float32, `-ffp-contract=off`, no exceptions,
no RTTI and `NDEBUG`. Every form is compiled with the same flags, in its own translation unit.

**Instructions** are counted with `-icount` and SysTick, with interrupts masked, and with barriers
before and after the call. As a check, the script first counts a sequence of 1000 known
instructions, and the result must be 1000.

**Cycles** are instructions, and {more} more for each division and square root: a Cortex-M4F takes
{division} cycles for VDIV and VSQRT (ARM 100166_0001, Table 7-1). The script counts how often
the program comes to one of them. Flash wait states of a real part, loads that wait, and branches
add to this.
A Cortex-M7 does some pairs of instructions in one cycle. Its time in the table uses the same rule.
No board was measured.

**n** is the number of parameters of `Rls<float, n, Policy>::update(phi, y)`. All its guards are
active, and the figures are over 400 samples that carry information.

**The textbook form** is Eqs. (12)-(14) with a dense Eigen matrix of static size and without any
check. C++ evaluates `K*phi'*P` from left to right, which is a product of two matrices. In the
bracketed form, `K*(phi'*P)`, the cost is only n^2.
"""

REASONS = """
- **-O2 unrolls** the loops of an update (`EHSID_UNROLL`). This makes the update fast but needs more
  flash. With -Os the loops are kept. Use -Os if flash is scarce or n is large.
- **Small n**: the textbook form has no guards. At -O2 it therefore takes fewer instructions up to
  n = 4, and in its bracketed form up to n = 6.
- **Stack**: the largest part of it is the new state, which must be complete before it replaces the
  old state. The stack grows with n^2 / 2. At -O2 it is below 256 bytes up to n = 6 with `Constant`,
  `Exponential`, `ErrorDriven` and `FRatio`. At -Os it is below 256 bytes only up to n = 3, and with
  `Exponential` up to n = 2.
"""


def find(rows: list[Row], form: str, parameters: int, level: str, target: str = M4F) -> Row:
    """The one row."""
    wanted = (target, form, parameters, level)
    return next(r for r in rows if (r["target"], r["form"], r["parameters"], r["level"]) == wanted)


def table(head: list[str], body: list[list[str]]) -> str:
    """Markdown, first column left, others right."""
    lines = [head, ["---"] + ["---:"] * (len(head) - 1), *body]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def deepest(row: Row) -> int:
    """Stack as it counts: painted (library functions, too) or for any input."""
    return max(int(row["stack"]), int(row["stack_static"]))


def cycles(row: Row) -> float:
    """Of a Cortex-M4F, without what its memory adds."""
    return float(row["instructions"]) + (DIVISION_CYCLES - 1) * float(row["divisions"])


def times(rows: list[Row]) -> str:
    """Time of a whole step at usual clocks."""
    body = []
    for form, name in ({policy: NAMES[policy] for policy in POLICIES} | METHODS | SERVO).items():
        line = [name]
        for level in ("2", "s"):
            each = {target: find(rows, f"whole_{form}", 6, level, target) for target in CLOCK_MHZ}
            line.append(f"{cycles(each[M4F]):.0f}")
            line += [f"{cycles(each[target]) / mhz:.1f}" for target, mhz in CLOCK_MHZ.items()]
        body.append(line)
    clocks = [f"{target} at {mhz} MHz, us" for target, mhz in CLOCK_MHZ.items()]
    return (
        "One `step` takes so long, where the memory adds nothing (see [below](#what-is-measured)). "
        "The first rows are `ArxEstimator<float, 3, 3, 1, Policy>`. At a sampling time of 1 ms, 10 "
        "us are 1 % of the time.\n\n"
        + table(["", "cycles -O2", *clocks, "cycles -Os", *clocks], body)
    )


def goals(rows: list[Row]) -> str:
    """Goals at n = 6, each against what was measured."""

    def count(form: str, level: str) -> float:
        return cycles(find(rows, form, 6, level))

    body = []
    for form in POLICIES:
        line = [NAMES[form]]
        for level, share in (("2", 1.0), ("s", 0.6)):
            for textbook in TEXTBOOK:
                ratio = count(form, level) / count(textbook, level)
                line.append(f"{ratio:.3f} {'met' if ratio < share else '**not met**'}")
        for level, most in (("2", 224), ("s", 256)):
            stack = deepest(find(rows, form, 6, level))
            line.append(f"{stack} {'met' if stack <= most else '**not met**'}")
        body.append(line)
    head = ["n = 6", "-O2, left to right", "-O2, bracketed", "-Os, left to right"]
    head += ["-Os, bracketed", "stack -O2", "stack -Os"]
    return (
        "## Goals\n\nThe number of cycles relative to the textbook form must be below 1 at -O2 and "
        "below 0.6 at -Os. The stack, painted and static, must be at most 224 bytes at -O2 and 256 "
        "at -Os.\n\n"
        + table(head, body)
        + REASONS
        + "\nNo image contains a heap, exceptions, the unwinder, static constructors or software "
        "double arithmetic. The script checks each image with `tests/firmware/check_image.cmake`.\n"
    )


def instructions(rows: list[Row], level: str) -> str:
    """Mean by form and n."""
    counts = sorted({int(r["parameters"]) for r in rows if r["target"] == M4F})
    body = [
        [NAMES[form], *(f"{find(rows, form, n, level)['instructions']:.0f}" for n in counts)]
        for form in NAMES
    ]
    return f"## Instructions an update, -O{level}\n\n" + table(
        ["n", *(str(n) for n in counts)], body
    )


def memory(rows: list[Row], level: str) -> str:
    """Flash, RAM and stack by form and n."""
    counts = sorted({int(r["parameters"]) for r in rows if r["target"] == M4F})

    def cell(form: str, n: int) -> str:
        r = find(rows, form, n, level)
        return f"{r['flash']} / {r['ram']} / {r['stack']} ({r['stack_static']})"

    return f"## Flash / RAM / stack, bytes, -O{level}\n\n" + table(
        ["n", *(str(n) for n in counts)],
        [[NAMES[form], *(cell(form, n) for n in counts)] for form in NAMES],
    )


def whole(rows: list[Row]) -> str:
    """The estimator as a controller calls it."""
    body = []
    for form, name in ({policy: NAMES[policy] for policy in POLICIES} | METHODS | SERVO).items():
        for level in ("2", "s"):
            r = find(rows, f"whole_{form}", 6, level)
            body.append(
                [
                    f"{name} -O{level}",
                    f"{r['instructions']:.0f}",
                    f"{r['instructions_most']:.0f}",
                    f"{r['divisions']:.0f}",
                    *(str(r[key]) for key in ("flash", "ram", "stack", "stack_static")),
                ]
            )
    return (
        "## The whole estimator\n\n`ArxEstimator<float, 3, 3, 1, Policy>::step(command, "
        "position)` includes scaling, regressor, recursion, reset and convergence. "
        "`SmallArxEstimator` has none of the optional parts ([estimator.md](estimator.md#parts)). "
        '"Instructions" is the mean of 400 samples, and "most" is the largest. With `FRatio`, the '
        "largest is the sample at which it sums up a window. The estimators below it are for noise "
        "that biases least squares ([which_estimator.md](which_estimator.md)). `ServoEstimator` is "
        "no ARX model; of its RAM 2.9 kB are those of its starts.\n\n"
        + table(
            ["n = 6", "instructions", "most", "divisions", "flash", "RAM", "stack", "(static)"],
            body,
        )
    )


def other_processor(rows: list[Row]) -> str:
    """The same on the M7, n = 6."""
    body = []
    for form in NAMES:
        two, small = (find(rows, form, 6, level, M7) for level in ("2", "s"))
        body.append([NAMES[form]])
        for row in (two, small):
            body[-1] += [f"{row['instructions']:.0f}", str(row["flash"]), str(deepest(row))]
    head = ["n = 6", "-O2", "flash", "stack", "-Os", "flash", "stack"]
    return (
        "## Cortex-M7\n\nThe target is QEMU's mps2-an500 with a single-precision unit. The table "
        "gives instructions and bytes.\n\n" + table(head, body)
    )


def document(rows: list[Row], tools: str) -> str:
    """The page."""
    note = (
        "- **Flash** is the size of the image minus that of an empty image. It includes the call "
        "that sets up\n  the form.\n"
        "- **RAM** is the storage of the form and its static data.\n"
        "- **Stack** is measured by painting. The value in brackets is static: the sum of "
        "`-fstack-usage`\n  along the deepest chain of calls, for any input, without library "
        "functions.\n"
    )
    return "\n".join(
        [
            HEAD.format(
                tools=tools,
                times=times(rows),
                more=DIVISION_CYCLES - 1,
                division=DIVISION_CYCLES,
            ),
            goals(rows),
            instructions(rows, "2"),
            instructions(rows, "s"),
            memory(rows, "2"),
            note,
            memory(rows, "s"),
            whole(rows),
            other_processor(rows),
        ]
    )
