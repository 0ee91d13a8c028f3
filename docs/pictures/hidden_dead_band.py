# SPDX-License-Identifier: MIT
"""Draws a hidden dead band before and after: python docs/pictures/hidden_dead_band.py FOLDER

FOLDER is that of benchmarks/commissioning.py; a diagnosis that is not there is made, in a minute.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ehsid.harness.show.plotting import BLUE, INK, VERMILION, stacked, styled, write_figure

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1] / "benchmarks"))

from commissioning import DT_S, diagnosed, error_mm, loops  # noqa: E402  the folder is known now

MACHINE = 24
SHOWN = slice(2000, 7500)


@styled
def figure(folder: Path) -> Figure:
    """Draws the positions about the reference, and the errors below them."""
    runs = loops(MACHINE, diagnosed(MACHINE, folder))
    made, (upper, lower) = stacked(4.6, [1.4, 1.0], xlabel="time in s")
    time = DT_S * np.arange(SHOWN.start, SHOWN.stop)
    upper.plot(time, 1e3 * runs["after"].reference_m[SHOWN], color=INK, label="reference")
    for name, colour in (("before", VERMILION), ("after", BLUE)):
        run, error = runs[name], error_mm(runs[name])[SHOWN]
        position = 1e3 * run.run.record.column("position_m")[SHOWN]
        upper.plot(time, position, color=colour, linewidth=1.0, label=name)
        rms = float(np.sqrt(np.mean(error**2)))
        lower.plot(time, error, color=colour, linewidth=0.9, label=f"{name}: {rms:.2f} mm rms")
    upper.set_ylabel("position in mm")
    lower.set_ylabel("error in mm")
    for axes in (upper, lower):
        axes.legend(loc="upper right", ncols=3)
    return made


if __name__ == "__main__":
    write_figure(HERE / "hidden_dead_band.png", figure(Path(sys.argv[1])))
