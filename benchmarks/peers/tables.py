# SPDX-License-Identifier: MIT
"""Tables of a comparison; every number comes from the results."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from results import BASE, PYTHON, SHOWN_N, Answer, Errors, Hold, Name, Results, Times

from ehsid.harness.show.page import Table

# Wanted ratios to the bare UD recursion in float at n = 6, of gcc and of clang.
GOALS = {
    "Rls, Constant, no parts": (1.05, None),
    "Rls, Constant": (1.15, 1.4),
    "Rls, FRatio": (1.25, 1.4),
    "ArxEstimator::step, FRatio": (1.7, None),
}
# The same measured earlier at -O2, gcc 12 and clang 14, on another machine, before the P_ii of an
# update were handed to the monitor.
EARLIER_MACHINE = "Intel Xeon"
EARLIER: dict[str, tuple[float, float | None]] = {
    "Rls, Constant, no parts": (1.04, 1.63),
    "Rls, Constant": (1.38, 1.95),
    "Rls, FRatio": (1.47, 1.87),
    "ArxEstimator::step, FRatio": (2.4, None),
}
NOT_INSTALLED = "not installed"


def shown(name: Name) -> str:
    """A row with its precision."""
    return f"{name.text} ({name.scalar})"


def of(results: Results, level: str, n: int, scalar: str | None = None) -> list[Times]:
    """Times at a level and size, in the order of measurement."""
    return [
        one
        for one in results.times
        if one.level == level and one.n == n and scalar in (None, one.name.scalar)
    ]


def levels(results: Results) -> list[str]:
    """Optimisation levels that were measured."""
    return sorted({one.level for one in results.times if one.level})


def sizes(results: Results) -> list[int]:
    """Numbers of parameters that were measured."""
    return sorted({one.n for one in results.times})


def ratio_text(times: Times) -> str:
    """Median and quartiles of a ratio."""
    low, middle, high = times.ratios()
    return f"{middle:.2f} ({low:.2f} to {high:.2f})"


def number(value: float) -> str:
    """Nanoseconds with at most three digits where they are few."""
    return f"{value:.1f}" if value < 100.0 else f"{value:,.0f}"


def small(value: float) -> str:
    """An error."""
    return "no number" if not np.isfinite(value) else f"{value:.1e}"


def missing_rows(results: Results, names: Sequence[str], columns: int) -> list[list[str]]:
    """Rows of what is not installed."""
    return [
        [name, f"{NOT_INSTALLED}: {how}", *[""] * (columns - 2)]
        for name, how in results.missing.items()
        if name in names
    ]


def time_table(results: Results) -> Table:
    """C and C++ at one size, all levels."""
    columns = ["recursion", "precision"]
    for level in levels(results):
        columns += [f"ns, -O{level}", f"ratio, -O{level}"]
    rows: list[list[str]] = []
    for one in of(results, levels(results)[0], SHOWN_N):
        row = [one.name.text, one.name.scalar]
        for level in levels(results):
            same = next(two for two in of(results, level, SHOWN_N) if two.name == one.name)
            row += [number(same.least), ratio_text(same)]
        rows.append(row)
    caption = (
        f"C and C++ with n = {SHOWN_N}: the shortest time of an update, and the ratio. The ratio "
        "is to the bare UD recursion of the same precision in the same pass, with median and "
        "quartiles."
    )
    return Table(
        caption, columns, [*rows, *missing_rows(results, cpp_names(results), len(columns))]
    )


def cpp_names(results: Results) -> list[str]:
    """Rows that are missing among those in C and C++."""
    return [name for name, how in results.missing.items() if how.startswith("apt-get")]


def python_names(results: Results) -> list[str]:
    """Rows that are missing among those in Python."""
    return [name for name in results.missing if name not in cpp_names(results)]


def size_table(results: Results) -> Table:
    """Median ratios over all sizes."""
    level = levels(results)[0]
    rows: list[list[str]] = []
    for one in of(results, level, sizes(results)[0]):
        same = [
            two for n in sizes(results) for two in of(results, level, n) if two.name == one.name
        ]
        rows.append([shown(one.name), *(f"{two.ratios()[1]:.2f}" for two in same)])
    base = {scalar: bases(results, level, scalar) for scalar in ("float", "double")}
    for scalar, times in base.items():
        rows.append([f"{BASE} ({scalar}), ns", *map(number, times)])
    columns = ["recursion", *(f"n = {n}" for n in sizes(results))]
    return Table(f"The same for all n at -O{level}: medians of the ratio.", columns, rows)


def bases(results: Results, level: str, scalar: str) -> list[float]:
    """Shortest times of the bare UD recursion, for each size."""
    return [
        one.least
        for n in sizes(results)
        for one in of(results, level, n, scalar)
        if one.name.text == BASE
    ]


def python_table(results: Results) -> Table:
    """Called from Python."""
    few = [n for n in sizes(results) if n in (2, SHOWN_N, 12)]
    columns = ["called from Python", *(f"ns, n = {n}" for n in few), f"ratio, n = {SHOWN_N}"]
    base = dict(zip(sizes(results), bases(results, levels(results)[0], "double"), strict=True))
    rows: list[list[str]] = []
    for name in dict.fromkeys(one.name for one in results.times if one.name.language == PYTHON):
        times = {one.n: one for one in results.times if one.name == name}
        ratio = times[SHOWN_N].least / base[SHOWN_N]
        rows.append([name.text, *(number(times[n].least) for n in few), f"{ratio:,.0f}"])
    rows += missing_rows(results, python_names(results), len(columns))
    rows.append(["python-control", results.control, *[""] * (len(columns) - 2)])
    caption = (
        "Called from Python, double: shortest time of an update, and its ratio to the shortest "
        "time of the bare UD recursion in C."
    )
    return Table(caption, columns, rows)


def goal_table(results: Results) -> Table:
    """What is wanted of our own."""
    first = levels(results)[0]
    columns = [
        *(f"in float, n = {SHOWN_N}", "wanted"),
        *(f"reached, -O{level}" for level in levels(results)),
        f"{EARLIER_MACHINE}, -O{first}",
        "wanted of clang",
        *(f"{compiler}, -O{first}" for compiler in results.others),
        f"{EARLIER_MACHINE}, clang",
    ]
    rows = []
    for name, (wanted, of_clang) in GOALS.items():
        reached = [
            reached_words(of(results, level, SHOWN_N, "float"), name, wanted)
            for level in levels(results)
        ]
        others = [
            reached_words([one for one in times if one.name.scalar == "float"], name, of_clang)
            for times in results.others.values()
        ]
        gcc, clang = EARLIER[name]
        rows.append(
            [
                *(name, f"{wanted:.2f}", *reached, against(gcc, wanted)),
                *("–" if of_clang is None else f"{of_clang:.2f}", *others),
                "–" if clang is None else against(clang, of_clang),
            ]
        )
    return Table(
        "Ratio to the bare UD recursion of the same compiler, median. The columns of "
        f"{EARLIER_MACHINE} are an earlier run on another machine.",
        columns,
        rows,
    )


def reached_words(times: Sequence[Times], name: str, wanted: float | None) -> str:
    """The median ratio of a recursion, and whether it is what is wanted."""
    one = next(two for two in times if two.name.text == name)
    return against(float(one.ratios()[1]), wanted)


def against(ratio: float, wanted: float | None) -> str:
    """A ratio, and whether it is what is wanted."""
    if wanted is None:
        return f"{ratio:.2f}"
    return f"{ratio:.2f}: {'met' if round(ratio, 2) <= wanted else 'not met'}"


def verdict(answer: Answer) -> str:
    """What a deviation means."""
    if answer.own:
        return "has a weighting of its own"
    return "the same" if answer.right else "beyond the tolerance"


def share_words(answer: Answer) -> str:
    """The share of the tolerance, where it means something."""
    return "–" if answer.own else small(answer.share)


def answer_table(results: Results) -> Table:
    """Deviations from batch least squares."""
    rows = [
        [shown(one.name), one.name.language, small(one.deviation), share_words(one), verdict(one)]
        for one in results.answers
    ]
    return Table(
        "Largest deviation from batch least squares over all n, relative to the largest "
        "parameter, and the share of the tolerance that it takes.",
        ["recursion", "from", "deviation", "share of the tolerance", "answer"],
        rows,
    )


def error_table(errors: Sequence[Errors]) -> Table:
    """Errors in float at the end, and the largest of the last half."""
    cases = list(dict.fromkeys((one.times_faster, one.factor) for one in errors))
    rows = []
    for name in dict.fromkeys(one.name for one in errors):
        row = [name.text]
        for case in cases:
            one = next(
                two for two in errors if two.name == name and (two.times_faster, two.factor) == case
            )
            row.append(small(late_error(one)))
        rows.append(row)
    columns = ["recursion in float", *(case_words(*case) for case in cases)]
    return Table(
        "Error in float against batch least squares in double on the same samples, relative to the "
        "largest parameter. The table has the largest error of the second half of the run.",
        columns,
        rows,
    )


def late_error(errors: Errors) -> float:
    """The largest error in the second half of the samples."""
    return float(np.max(errors.errors[2.0 * errors.samples >= errors.samples[-1]]))


def case_words(times_faster: int, factor: float) -> str:
    """A case of the runs in float."""
    rate = "as published" if times_faster == 1 else f"sampled {times_faster} times as fast"
    return f"{rate}, lambda {factor:g}"


def count_words(values: Sequence[int | None], held: int) -> str:
    """The median over the seeds and the least, or that it did not happen."""
    seen = sorted(held if value is None else value for value in values)
    if all(value is None for value in values):
        return f"not in {held:,}"
    middle = seen[len(seen) // 2]
    return f"{middle:,}" if seen[0] == middle else f"{middle:,} (least {seen[0]:,})"


def hold_table(holds: Sequence[Hold]) -> Table:
    """How long each recursion survives."""
    rows = [
        [
            shown(one.name),
            count_words(one.moved, one.held),
            count_words(one.not_finite, one.held),
        ]
        for one in holds
    ]
    return Table(
        "Samples of a held input until a parameter has moved by 1 % of the largest one, and "
        "until a parameter is no number.",
        ["recursion", "moved by 1 %", "no number"],
        rows,
    )
