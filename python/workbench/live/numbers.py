# SPDX-License-Identifier: MIT
"""The numbers of a run, its events and its results as HTML.

States and counts of a run in words.

What is drawn of the newest samples: never more points than pixels, and no peak is lost.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.base.encoding import read_json
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.show.page import Heading, Table

from .. import look
from ..jobs import State
from .watching import COLUMNS, RunStatus

STATUS = {
    "ok": "The estimator follows.",
    "filling": "The estimator collects its first samples.",
    "no_information": "The signals excite too little: the estimate stays as it is.",
    "disabled": "The estimator is switched off.",
    "reset": "The plant has changed: the estimator begins to learn again.",
    "invalid_input": "A measurement is not a number: this sample is left out.",
    "out_of_range": "A signal is larger than plausible: this sample is left out.",
    "numerical_limit": "The covariance is at its numerical limit: the estimate stays as it is.",
    "invalid_argument": "The estimator refuses its settings.",
}


def status_words(status: int) -> str:
    """Returns the status of the estimator as a sentence."""
    return STATUS[ehsid.Status(status).name]


DRAWN = ("position_m", "reference_m", "command_v", "forgetting_factor")
SERVO = ("velocity_gain", "omega_n", "xi")
RATE_S = 2.0  # on the wall clock, over which the rate is counted
LEAST_SPAN = 1e-9


@dataclass(frozen=True, eq=False)
class Drawn:
    """Points to draw of m blocks of samples."""

    time_s: FloatArray
    signals: dict[str, FloatArray]
    """For each block its minimum and its maximum, shape (2 m,): times, and values by name. Where
    the samples are few, each is a block of its own, and a point: shape (m,)."""
    at_s: FloatArray
    values: FloatArray
    low: FloatArray
    high: FloatArray
    """Ends of the blocks, shape (m,), and for K, omega_n, xi and each of n parameters the newest
    value in the block and the bounds of its interval in it; shape (3 + n, m). NaN where it is not
    known yet."""


def drawn(rows: FloatArray, columns: int) -> Drawn:
    """Returns the points of samples, shape (samples, columns of the ring), for pixel columns."""
    n = (rows.shape[1] - len(COLUMNS)) // 2
    count = len(rows)
    if count == 0:
        empty = np.zeros(0)
        none = np.zeros((len(SERVO) + n, 0))
        return Drawn(empty, dict.fromkeys(DRAWN, empty), empty, none, none, none)
    few = count <= 2 * columns
    blocks = count if few else columns
    starts = np.unique(np.linspace(0, count, blocks, endpoint=False).astype(np.int64))
    ends = np.append(starts[1:], count) - 1
    time_s = rows[:, 0]
    servo = [COLUMNS.index(name) for name in SERVO]
    half = [COLUMNS.index(f"{name}_half") for name in SERVO]
    values = np.hstack([rows[:, servo], rows[:, len(COLUMNS) : len(COLUMNS) + n]])
    deviation = np.hstack([rows[:, half], rows[:, len(COLUMNS) + n :]])
    middle = 0.5 * (time_s[starts] + time_s[ends])
    signals = {name: rows[:, COLUMNS.index(name)] for name in DRAWN}
    return Drawn(
        time_s if few else np.stack([time_s[starts], middle], axis=1).ravel(),
        signals if few else {name: _extremes(one, starts) for name, one in signals.items()},
        time_s[ends],
        values[ends].T.copy(),
        np.fmin.reduceat(values - deviation, starts, axis=0).T.copy(),
        np.fmax.reduceat(values + deviation, starts, axis=0).T.copy(),
    )


def _extremes(values: FloatArray, starts: npt.NDArray[np.int64]) -> FloatArray:
    low, high = np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)
    return np.stack([low, high], axis=1).ravel()


def span(values: FloatArray) -> tuple[float, float]:
    """Returns the range of an axis for the course of an estimate, shape (m,).

    After a vague start or a reset the first values are orders of magnitude too large, and an
    interval may be very wide: only the values of the newer half decide.
    """
    newer = values[values.size // 2 :]
    known = newer[np.isfinite(newer)]
    if known.size == 0:
        return -1.0, 1.0
    bottom, top = (float(one) for one in np.quantile(known, [0.02, 0.98]))
    margin = 0.3 * (top - bottom) + 0.1 * max(abs(top), abs(bottom)) + LEAST_SPAN
    return bottom - margin, top + margin


def rate(rows: FloatArray) -> float:
    """Returns the samples per second over the last moments; 0 where there are too few."""
    wall_s = rows[:, COLUMNS.index("wall_s")]
    recent = wall_s[wall_s >= wall_s[-1] - RATE_S] if wall_s.size else wall_s
    return float((recent.size - 1) / (recent[-1] - recent[0])) if recent.size > 2 else 0.0


RESULT_FILES = {
    "hil.html": "report, to be sent and read without ehsid",
    "record.csv": "the record",
    "estimates.csv": "the estimates, sample by sample",
    "hil.json": "all numbers",
}
UNFINISHED_RUN = (
    "This run did not come to its end. Samples that it had taken are in the folder hil of the run: "
)


class _Run(msgspec.Struct):
    """What the page itself reads of a run in hil.json."""

    samples: int
    samples_that_differ: int


class _Result(msgspec.Struct):
    equal_to_host: bool
    runs: list[_Run]


def tidy(text: str) -> str:
    """Returns a message of the commands without the dashes of their options."""
    return re.sub(r"(?<![\w-])--(?=[a-z])", "", text)


def state_words(state: State, status: RunStatus) -> str:
    """Returns what a run does as HTML."""
    if state is State.cancelled:
        return '<p role="status">The run was stopped before its first sample.</p>'
    if state in (State.done, State.running):
        board = f" Target: {look.plain(status.board)}, ehsid {look.plain(status.firmware)}."
        words = look.plain(status.phase) + (board if status.board else "")
        return f'<p role="status">{words}</p>'
    return ""


def numbers_html(rows: FloatArray, status: RunStatus, *, running: bool) -> str:
    """Returns the state of a run and its counts; `rows` are samples as the ring has them."""
    last = dict(zip(COLUMNS, rows[-1, : len(COLUMNS)], strict=True))
    done = round(last["time_s"] / status.dt_s) + 1
    share = 100.0 * done / max(1, status.samples)
    speed = f"{rate(rows):.0f} samples/s" if running else "ended"
    sentence = status_words(int(last["status"]))
    settled = (
        "It has converged: every parameter is known well, and the residuals are white."
        if last["converged"]
        else "It has not converged yet."
    )
    limited = " The command is at its limit." if last["limited"] else ""
    agrees = (
        ""
        if last["agrees"]
        else '<p class="bad">The parameters of the target are not those of this host on the same '
        "samples. The bands are those of this host; build the firmware with -ffp-contract=off and "
        "the version of this ehsid.</p>"
    )
    cells = (
        ("time", f"{last['time_s']:.2f} s of {status.samples * status.dt_s:.6g} s"),
        ("rate", speed),
        ("position", f"{1e3 * last['position_m']:.2f} mm"),
        ("command", f"{last['command_v']:.3f} V"),
        ("lambda", f"{last['forgetting_factor']:.4f}"),
        ("fit", f"{last['fit_percent']:.1f} %"),
        ("changes of the plant", f"{last['changes']:.0f}"),
    )
    line = (
        ("frames sent", f"{last['sent']:.0f}"),
        ("lost, asked again", f"{last['asked_again']:.0f}"),
        ("damaged, seen here", f"{last['bad_here']:.0f}"),
        ("damaged, seen by the target", f"{last['bad_there']:.0f}"),
        ("late", f"{last['late']:.0f}"),
        ("valve closed by the watchdog", f"{last['resumed']:.0f}"),
        ("resets of the target", f"{last['restarts']:.0f}"),
    )
    counts = f"<h2>Line</h2>{_cells(line)}" if last["sent"] else ""
    return (
        f'<div class="bar"><i style="width:{min(100.0, share):.1f}%"></i></div>'
        f"<p>{sentence} {settled}{limited}</p>{agrees}{_cells(cells)}{counts}"
    )


def _cells(cells: tuple[tuple[str, str], ...]) -> str:
    boxes = "".join(
        '<div style="flex:1 1 7.5rem;border-left:3px solid var(--line);padding:0 .6rem">'
        f'<div class="soft small">{name}</div><div style="font-variant-numeric:tabular-nums">'
        f"<b>{value}</b></div></div>"
        for name, value in cells
    )
    return f'<div style="display:flex;flex-wrap:wrap;gap:.6rem;margin:.4rem 0">{boxes}</div>'


def events_html(status: RunStatus) -> str:
    """Returns what has happened during a run, the newest in front."""
    if not status.events:
        return ""
    rows = [(f"{time_s:.2f} s", words) for time_s, words in reversed(status.events)]
    return look.told(Heading("Events"), Table("", ("time", "what"), rows))


def ended_html(folder: Path, status: RunStatus) -> str:
    """Returns the results of a run that has ended; "" where there is nothing."""
    out = folder / "hil"
    result = read_json(out / "hil.json", _Result)
    if result is None:
        left = sorted(out.glob("unfinished_*"))
        if not left:
            return ""
        return f'<p class="soft">{UNFINISHED_RUN}<code>{look.plain(left[-1])}</code></p>'
    samples = sum(run.samples for run in result.runs)
    other = sum(run.samples_that_differ for run in result.runs)
    verdict = (
        f"{samples} samples. The estimates of the target are bit for bit those of this host."
        if result.equal_to_host
        else f"{samples} samples. At {other} of them the estimates of the target are not those of "
        "this host; the report says more."
    )
    address = f"/live-result/{folder.name}"
    snapshots = dict.fromkeys(status.snapshots, "a snapshot of the estimate")
    links = look.files(f"{address}/hil", RESULT_FILES)
    links += look.files(f"{address}/snapshots", snapshots)
    where = f'<p class="soft small">The files are in <code>{look.plain(out)}</code>.</p>'
    return f'<p class="verdict">{verdict}</p>{links}{where}'
