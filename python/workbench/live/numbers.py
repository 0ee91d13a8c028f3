# SPDX-License-Identifier: MIT
"""The numbers of a run, its events and its results as HTML."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec

from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.base.encoding import read_json
from ehsid.harness.show.page import Heading, Table

from .. import look
from ..jobs import State
from .told import COLUMNS, Told
from .windows import rate
from .words import status_words

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


def state_words(state: State, told: Told) -> str:
    """Returns what a run does as HTML."""
    if state is State.cancelled:
        return '<p role="status">The run was stopped before its first sample.</p>'
    if state in (State.done, State.running):
        board = f" Target: {look.plain(told.board)}, ehsid {look.plain(told.firmware)}."
        words = look.plain(told.phase) + (board if told.board else "")
        return f'<p role="status">{words}</p>'
    return ""


def numbers_html(rows: FloatArray, told: Told, *, running: bool) -> str:
    """Returns the state of a run and its counts; `rows` are samples as the ring has them."""
    last = dict(zip(COLUMNS, rows[-1, : len(COLUMNS)], strict=True))
    done = round(last["time_s"] / told.dt_s) + 1
    share = 100.0 * done / max(1, told.samples)
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
        ("time", f"{last['time_s']:.2f} s of {told.samples * told.dt_s:.6g} s"),
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
    return (
        f'<div class="bar"><i style="width:{min(100.0, share):.1f}%"></i></div>'
        f"<p>{sentence} {settled}{limited}</p>{agrees}{_cells(cells)}<h2>Line</h2>{_cells(line)}"
    )


def _cells(cells: tuple[tuple[str, str], ...]) -> str:
    boxes = "".join(
        '<div style="flex:1 1 7.5rem;border-left:3px solid var(--line);padding:0 .6rem">'
        f'<div class="soft small">{name}</div><div style="font-variant-numeric:tabular-nums">'
        f"<b>{value}</b></div></div>"
        for name, value in cells
    )
    return f'<div style="display:flex;flex-wrap:wrap;gap:.6rem;margin:.4rem 0">{boxes}</div>'


def events_html(told: Told) -> str:
    """Returns what has happened during a run, the newest in front."""
    if not told.events:
        return ""
    rows = [(f"{time_s:.2f} s", words) for time_s, words in reversed(told.events)]
    return look.told(Heading("Events"), Table("", ("time", "what"), rows))


def ended_html(folder: Path, told: Told) -> str:
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
    snapshots = dict.fromkeys(told.snapshots, "a snapshot of the estimate")
    links = look.files(f"{address}/hil", RESULT_FILES)
    links += look.files(f"{address}/snapshots", snapshots)
    where = f'<p class="soft small">The files are in <code>{look.plain(out)}</code>.</p>'
    return f'<p class="verdict">{verdict}</p>{links}{where}'
