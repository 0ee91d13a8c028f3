# SPDX-License-Identifier: MIT
"""ServoEstimator on servos that no constant has seen.

Run: python benchmarks/servo_estimator.py [OUT.json]

Servos of `servo_machines.py` with the seeds FIRST to LAST, six runs of each, float32. Beside it
least squares, the same with the integrator known, and instrumental variables with it: signals
scaled by their standard deviation, theta read by identify_servo, which is trusted where
`converged`. Every run is judged at 120 times, the seconds on a grid of 20 ms. Prints the table of
docs/which_estimator.md and writes its figures. Needs the extra `lab`.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
from servo_machines import Run, runs_of

import ehsid
from ehsid.harness.base.parallel import run_unordered

FIRST, LAST = 17000, 17500
TIMES, LAST_TIMES = 120, 5
FROM_S = 2.0  # trust is judged from here on
METHODS = ("servo", "rls", "rls, integrator known", "riv")
GRID_S, GRID_TIMES = 0.02, 500  # on which seconds are judged
FloatArray = npt.NDArray[np.float64]
Found = tuple[FloatArray, FloatArray, npt.NDArray[np.bool_], int]


def of_a_servo(run: Run, at: npt.NDArray[np.intp]) -> Found:
    """Returns values and half widths, shape (3, n), what is trusted, and the number of resets."""
    estimator = ehsid.ServoEstimator(run.dt_s)
    told = estimator.run(run.command, run.position)
    series = (told.gain, told.omega_n, told.xi)
    values = np.array([one.value[at] for one in series], dtype=np.float64)
    widths = np.array([one.half_width[at] for one in series], dtype=np.float64)
    return values, widths, np.array([one.trusted[at] for one in series]), estimator.resets


def read(run: Run, at: npt.NDArray[np.intp], method: str) -> Found:
    """Returns the same of a recursion for Eq. (8), read as a servo."""
    scaling = ehsid.Scaling(
        command_scale=float(run.command.std()),
        position_scale=float(run.position.std()),
        command_offset=float(run.command.mean()),
        position_offset=float(run.position.mean()),
    )
    known = method != "rls"
    how = {"forgetting": ehsid.Exponential(0.995, 0.98), "method": "riv"}
    estimator = ehsid.ArxEstimator(
        2 if known else 3, 3, 1, offset=True, scaling=scaling, integrator=known,
        **(how if method == "riv" else {}),
    )  # fmt: skip
    size = 5 if known else 6
    values, widths = np.full((3, at.size), np.nan), np.full((3, at.size), np.nan)
    trusted, resets, begin = np.zeros((3, at.size), dtype=bool), 0, 0
    for k, end in enumerate(at + 1):
        part = estimator.run(run.command[begin:end], run.position[begin:end])
        resets += int(np.sum(part.status == ehsid.Status.reset))
        begin = int(end)
        servo = ehsid.identify_servo(
            estimator.theta_hat[:size], estimator.covariance[:size, :size], run.dt_s
        )
        values[:, k] = servo.gain, servo.omega_n, servo.xi
        widths[:, k] = 1.645 * np.array([servo.gain_std, servo.omega_n_std, servo.xi_std])
        trusted[:, k] = estimator.converged and np.isfinite(servo.gain)
    return values, widths, trusted, resets


def times_to(right: npt.NDArray[np.bool_]) -> tuple[int, int]:
    """Returns where it is right first, and where it stays so for 0.5 s; the size where never."""
    needed = round(0.5 / GRID_S)
    in_a_row = np.convolve(right, np.ones(needed), "valid") >= needed
    found = [np.flatnonzero(one) for one in (right, in_a_row)]
    first, stays = (int(one[0]) if one.size else right.size for one in found)
    return first, stays


def judged(run: Run, method: str) -> dict[str, float | str | bool]:
    """Returns what one method made of one run."""
    count = run.command.size
    at = np.unique(np.linspace(0, count - 1, TIMES + 1).astype(np.intp)[1:])
    found = of_a_servo(run, at) if method == "servo" else read(run, at, method)
    values, widths, trusted, resets = found
    true = run.true_at(at)
    with np.errstate(invalid="ignore"):
        gain, omega_n = values[0] / true[0] - 1.0, values[1] / true[1] - 1.0
        xi = values[2] - true[2]
        end = [float(np.median(np.abs(one[-LAST_TIMES:]))) for one in (gain, omega_n, xi)]
        holds = np.abs(values[:, -1] - true[:, -1]) <= widths[:, -1]
    time_s = at * run.dt_s
    late = time_s > FROM_S
    begin = run.truth[-1][0]
    fine = begin + (GRID_S * np.arange(1, GRID_TIMES + 1) / run.dt_s).astype(np.intp)
    fine = np.unique(fine[fine < count])
    seconds = of_a_servo(run, fine) if method == "servo" else read(run, fine, method)
    first, stays = times_to(np.abs(seconds[0][0] / run.true_at(fine)[0] - 1.0) < 0.05)
    return {
        "method": method,
        "linear": run.linear,
        "sine": run.command_kind == "loop_sine",
        "run": run.kind,
        "gain_5": end[0] < 0.05,
        "gain_10": end[0] < 0.10,
        "omega_n_10": end[1] < 0.10,
        "xi_01": end[2] < 0.1,
        "false_trust": float(np.mean(trusted[0] & ~(np.abs(gain) <= 0.10) & late)),
        "false_distrust": float(np.mean(~trusted[0] & (np.abs(gain) < 0.05) & late)),
        "gain_holds": bool(holds[0]),
        "omega_n_holds": bool(holds[1]),
        "xi_holds": bool(holds[2]),
        "resets": resets,
        "first_s": float((fine[first] - begin) * run.dt_s) if first < fine.size else np.inf,
        "stays_s": float((fine[stays] - begin) * run.dt_s) if stays < fine.size else np.inf,
    }


def of_seed(seed: int) -> list[dict[str, float | str | bool]]:
    """Returns what each method made of the runs of one servo."""
    return [judged(run, method) for run in runs_of(seed) for method in METHODS]


def row(rows: list[dict[str, float | str | bool]], method: str) -> dict[str, float]:
    """Returns the figures of one method in per cent and seconds."""

    def share(name: str, linear: bool, runs: Iterable[str] = (), sine: bool = True) -> float:
        chosen = [
            float(one[name])
            for one in rows
            if one["method"] == method and one["linear"] == linear
            if (one["run"] in runs if runs else True) and (sine or not one["sine"])
        ]
        return 100.0 * float(np.mean(chosen))

    same = ("none", "hold", "delay", "glitch", "null")

    def seconds(name: str, run: str) -> float:
        linear = [one for one in rows if one["method"] == method and one["linear"]]
        return float(np.median([float(one[name]) for one in linear if one["run"] == run]))

    begins = [
        [
            100.0 * (float(one["resets"]) > 0)
            for one in rows
            if one["method"] == method and one["linear"] == linear and one["run"] in same
        ]
        for linear in (True, False)
    ]
    return {
        "K within 5 %, linear, at the end": share("gain_5", True, same),
        "... without the single sine": share("gain_5", True, same, sine=False),
        "... after K + 50 %, omega_n - 20 %": share("gain_5", True, ("change",)),
        "K within 10 %, nonlinear": share("gain_10", False),
        "omega_n within 10 %, linear, no single sine": share("omega_n_10", True, sine=False),
        "xi within 0.1, linear, no single sine": share("xi_01", True, sine=False),
        "seconds until K is within 5 % at the start, linear, median": seconds("first_s", "none"),
        "... after the change": seconds("first_s", "change"),
        "seconds until it stays so for 0.5 s, at the start": seconds("stays_s", "none"),
        "... after the change, stays": seconds("stays_s", "change"),
        "K trusted and more than 10 % off, linear": share("false_trust", True, same),
        "... with the change": share("false_trust", True, ("change",)),
        "... nonlinear and trusted": share("false_trust", False),
        "K within 5 % and not trusted, linear": share("false_distrust", True, same),
        "... nonlinear and not trusted": share("false_distrust", False),
        "90 % intervals of K hold, linear": share("gain_holds", True),
        "... of omega_n": share("omega_n_holds", True),
        "... of xi": share("xi_holds", True),
        "... of K, nonlinear": share("gain_holds", False),
        "... of omega_n, nonlinear": share("omega_n_holds", False),
        "... of xi, nonlinear": share("xi_holds", False),
        "begins anew without a change, linear, runs": float(np.mean(begins[0])),
        "... nonlinear, runs": float(np.mean(begins[1])),
    }


def main() -> None:
    """Runs all servos and prints the table."""
    seeds = list(range(FIRST, LAST))
    rows: list[dict[str, float | str | bool]] = []
    for number, found in enumerate(
        run_unordered(partial(of_seed, seed) for seed in seeds), start=1
    ):
        rows += found
        if number % 25 == 0:
            print(f"{number} of {len(seeds)} servos", file=sys.stderr, flush=True)
    table = {method: row(rows, method) for method in METHODS}
    runs = len(rows) // len(METHODS)
    print(f"| seeds {FIRST} to {LAST - 1}, {runs} runs | {' | '.join(METHODS)} |")
    print("|---|" + "---|" * len(METHODS))
    for name in table[METHODS[0]]:
        print(f"| {name} | " + " | ".join(f"{table[one][name]:.3g}" for one in METHODS) + " |")
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
