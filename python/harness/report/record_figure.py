# SPDX-License-Identifier: MIT
"""Draws the columns of a record over time."""

from __future__ import annotations

from matplotlib.figure import Figure

from ehsid.harness.records import Record
from ehsid.harness.report.plotting import stacked, styled

# Columns that share a panel, with the factor from SI and the label of the panel.
PANELS = (
    (("command_v",), 1.0, "command in V"),
    (("position_m",), 1e3, "position in mm"),
    (("velocity_m_s",), 1.0, "velocity in m/s"),
    (("pressure_a_pa", "pressure_b_pa", "supply_pressure_pa"), 1e-5, "pressure in bar"),
    (("spool",), 1.0, "spool, fraction"),
)


@styled
def record_figure(record: Record) -> Figure:
    """Draws command, position, velocity, pressures and spool over time, as far as they exist."""
    panels = [
        (known, scale, label)
        for names, scale, label in PANELS
        if (known := [name for name in names if name in record.columns])
    ]
    figure, axes = stacked(
        1.6 * len(panels) + 0.6,
        [1.0] * len(panels),
        xlabel="sample" if record.time_s is None else "time in s",
    )
    time = range(len(record)) if record.time_s is None else record.time_s
    for axis, (names, scale, label) in zip(axes, panels, strict=True):
        for name in names:
            axis.plot(time, scale * record.column(name), linewidth=1.0, label=name)
        axis.set_ylabel(label)
        if len(names) > 1:
            axis.legend(ncols=len(names), loc="upper right")
    axes[0].set_title(record.name)
    return figure
