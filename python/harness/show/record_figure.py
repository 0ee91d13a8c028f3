# SPDX-License-Identifier: MIT
"""Draws the columns of a record over time, and a held-out record beside its simulations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ..base.error_words import printable
from ..base.numbers import FloatArray
from ..catalogue.channels import CHANNELS, Channel, shown_channel
from ..diagnosis.edits import EditRun
from ..diagnosis.result import HeldOutRun
from ..diagnosis.schema import HowFar
from ..records import Record
from .gap_plots import SIMULATED, curves_of
from .gap_words import SIMULATIONS, first_upper
from .page import Picture
from .plotting import DASHES, ROLES, stacked, styled
from .units import percent

# Columns that are no channels, as far as a page has room for their panels.
MOST_COLUMNS = 8
# The roles of the twins of an edit test.
OF_EDITS = {"found": "augmented", "edited": "nominal", "left": "calibrated"}
# Windows of the picture that a diagnosis begins with.
SHOWN_WINDOWS = 4
# More samples than a line of this width can show.
MOST_SAMPLES = 4000


@styled
def record_figure(record: Record) -> Figure:
    """Draws the channels of a record over time, those of one quantity together.

    A record without any channel has its first columns drawn, under their own names.
    """
    channels = [channel for channel in CHANNELS.values() if channel.name in record.columns]
    if not channels:
        names = list(record.columns)[:MOST_COLUMNS]
        channels = [Channel(name, name, "", printable(name), "its unit") for name in names]
    # Channels with the same unit of SI share a panel, such as the pressures.
    panels = [list(group) for _, group in groupby(channels, key=lambda channel: channel.unit)]
    figure, axes = stacked(
        1.6 * len(panels) + 0.6,
        [1.0] * len(panels),
        xlabel="sample" if record.time_s is None else "time in s",
    )
    time = range(len(record)) if record.time_s is None else record.time_s
    for axis, panel in zip(axes, panels, strict=True):
        for channel in panel:
            column = channel.factor * record.column(channel.name)
            axis.plot(time, column, linewidth=1.0, label=channel.name)
        words = "pressure" if len(panel) > 1 else panel[0].words
        axis.set_ylabel(f"{words} in {panel[0].shown_unit}", parse_math=False)
        if len(panel) > 1:
            axis.legend(ncols=len(panel), loc="upper right")
    axes[0].set_title(printable(record.name), parse_math=False)
    return figure


@styled
def run_figure(run: HeldOutRun | EditRun, simulations: Mapping[str, str] = SIMULATIONS) -> Figure:
    """Draws for each output measured and simulated values, and below them the errors.

    simulations: labels of at most three simulations, by their fields of the run. The fields of an
    edit test have the colours of the roles that they play: as found, prescribed, and fitted.
    """
    count = len(run.measured)
    figure, panels = stacked(3.2 * count + 0.6, [2.0, 1.0] * count, xlabel="time in s")
    colours = ROLES["light"]
    for upper, lower, name in zip(panels[::2], panels[1::2], run.measured, strict=True):
        words, scale, unit = shown_channel(name)
        curves = curves_of(run, name, tuple(simulations), scale=scale, most=MOST_SAMPLES)
        measured = curves["measured"]
        upper.plot(curves["time"], measured, color=colours["measured"], linewidth=3.0, alpha=0.35)
        upper.lines[0].set_label("measured")
        for kind, label in simulations.items():
            role = OF_EDITS.get(kind, kind)
            line: dict[str, Any] = {"color": colours[role], "linestyle": DASHES[role]}
            upper.plot(curves["time"], curves[kind], label=label, linewidth=1.2, **line)
            lower.plot(curves["time"], curves[f"{kind}_error"], linewidth=1.2, **line)
        upper.set_ylabel(f"{words} in {unit}")
        lower.set_ylabel(f"error in\n{unit}")
    # Above the curves, of which each may be at any place.
    panels[0].legend(ncols=4, loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False)
    title = f"{printable(run.record)}; error: simulated minus measured"
    panels[0].set_title(title, parse_math=False, pad=24.0)
    return figure


def gap_picture(
    runs: Sequence[HeldOutRun], gap: HowFar | None, simulations: Mapping[str, str]
) -> list[Picture]:
    """Returns the picture that a diagnosis begins with; none where nothing was simulated.

    Of the output whose gap shrinks most it shows the `SHOWN_WINDOWS` windows in which the first
    simulation is worse than the last one by the largest sum of squares.

    Parameters
    ----------
    runs
        held-out records.
    gap
        the gaps that the caption tells.
    simulations
        labels of one to three simulations, by their fields of a run: from before to after.
    """
    if gap is None or not runs:
        return []
    gaps = {name: dict(zip(SIMULATED, each, strict=True)) for name, each in gap.per_output.items()}
    first, *after = (next(iter(simulations)), *list(simulations)[1:][-1:])
    shrinks = {
        name: each[first] - sum(each[kind] for kind in after)
        for name, each in gaps.items()
        if any(name in run.measured for run in runs)
    }
    name = max(shrinks, key=lambda one: np.nan_to_num(shrinks[one], nan=-np.inf))
    shown = max(
        (_stretch(run, name, first, after) for run in runs if name in run.measured),
        key=lambda one: one[0],
    )[1]
    words = first_upper(shown_channel(name)[0])
    own = " before and ".join(percent(gaps[name][kind]) for kind in (first, *after))
    told = f"{own} after" if after else own
    if len(gaps) > 1:
        whole = " and ".join(percent(getattr(gap, kind)) for kind in (first, *after))
        told += f", and that of all outputs {whole}"
    seconds = shown.time_s[-1] - shown.time_s[0]
    return [
        Picture(
            run_figure(shown, simulations),
            f"{words} in held-out data, over the {seconds:.2g} s in which the gap shows most. On "
            f"all held-out data its gap is {told}. In each window the simulation "
            "starts from what was measured, and then follows the logged command alone.",
            f"{words} measured and simulated over time, and the errors of the simulations",
        )
    ]


def _stretch(
    run: HeldOutRun, name: str, first: str, after: Sequence[str]
) -> tuple[float, HeldOutRun]:
    """Returns by how much `after` is better in the best windows, and these of one output."""
    begins = np.flatnonzero((np.diff(run.window, prepend=-1) != 0) & (run.window >= 0))
    error = [getattr(run, kind)[name] - run.measured[name] for kind in (first, *after)]
    better = np.nan_to_num(error[0]) ** 2 - sum(np.nan_to_num(one) ** 2 for one in error[1:])
    total = np.concatenate(([0.0], np.cumsum(np.where(run.window >= 0, better, 0.0))))
    starts_s = run.time_s[begins]
    # By their times: where data were held out in parts, neighbours may be far apart.
    length_s = SHOWN_WINDOWS * float(np.median(np.diff(starts_s))) if begins.size > 1 else np.inf
    ends = np.searchsorted(run.time_s, starts_s + length_s - 0.5 * np.median(np.diff(run.time_s)))
    best = int(np.argmax(total[ends] - total[begins]))
    part = slice(begins[best], ends[best])

    def cut(signals: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        return {name: signals[name][part]}

    shown = (cut(getattr(run, kind)) for kind in ("measured", *SIMULATED))
    return float(total[ends[best]] - total[begins[best]]), HeldOutRun(
        run.record, run.time_s[part], run.window[part], run.command_v[part], *shown
    )
