# SPDX-License-Identifier: MIT
"""Draws the columns of a record over time."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ehsid.harness.records import Record

# Columns that share a panel, with the factor from SI and the label of the panel.
PANELS = (
    (("command_v",), 1.0, "command in V"),
    (("position_m",), 1e3, "position in mm"),
    (("velocity_m_s",), 1.0, "velocity in m/s"),
    (("pressure_a_pa", "pressure_b_pa", "supply_pressure_pa"), 1e-5, "pressure in bar"),
    (("spool",), 1.0, "spool, fraction"),
)


def record_figure(record: Record) -> Figure:
    """Draws command, position, velocity, pressures and spool over time, as far as they exist."""
    panels = [
        ([name for name in names if name in record.columns], scale, label)
        for names, scale, label in PANELS
    ]
    panels = [panel for panel in panels if panel[0]]
    figure = Figure(figsize=(9, 1.6 * len(panels) + 0.6), layout="constrained")
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    time = np.arange(len(record)) if record.time_s is None else record.time_s
    for axis, (names, scale, label) in zip(axes, panels, strict=True):
        for name in names:
            axis.plot(time, scale * record.column(name), linewidth=1.0, label=name)
        axis.set_ylabel(label)
        axis.margins(x=0.0)
        axis.grid(True, alpha=0.3)
        if len(names) > 1:
            axis.legend(fontsize="small", ncols=len(names), loc="upper right")
    axes[-1].set_xlabel("sample" if record.time_s is None else "time in s")
    axes[0].set_title(record.name)
    return figure
