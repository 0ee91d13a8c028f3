# SPDX-License-Identifier: MIT
"""The files of an offline identification and of a recursive estimation."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from ..base.encoding import to_plain
from ..base.files import write_text
from ..models.estimation import EstimationResult
from ..models.estimation.advice import Advice
from ..models.identification import (
    IdentificationResult,
    IoData,
    power_band,
)
from ..models.identification.loop import analyse_loop
from ..models.identification.systems import to_control
from ..records import Origin
from ..records.origin import with_reading
from .loop_blocks import limit_words
from .model_curves import model_bode
from .model_figures import bode_figure, estimation_figure, identification_figure
from .model_file_names import IDENTIFICATION_FILES
from .plotting import write_figure


def write_identification(
    folder: Path,
    result: IdentificationResult,
    data: IoData,
    origin: Origin | None,
) -> str:
    """Writes the files of an identification.

    Parameters
    ----------
    folder
        to write into.
    result, data
        the identification, and what it was made of.
    origin
        how the log became a record; None for a record.

    Returns
    -------
    The limit of stability of the chosen model under proportional control, in words.
    """
    plain = with_reading(result.to_dict(), origin)
    _write(folder, "identify", plain, identification_figure(result))
    model, dt_s = result.chosen.model, data.dt_s
    loop, band = analyse_loop(to_control(model, dt_s)), power_band(data)
    figure = bode_figure(model_bode(result, data), dt_s, loop)
    write_figure(folder / IDENTIFICATION_FILES[2], figure)
    return limit_words(loop, dt_s, band)


def write_estimation(
    folder: Path,
    result: EstimationResult,
    dt_s: float | None,
    origin: Origin | None,
    advice: Advice,
) -> None:
    """Writes the files of a recursive estimation; `advice` is what to try, the others as above."""
    plain = {**with_reading(result.to_dict(), origin), "advice": to_plain(advice)}
    _write(folder, "estimate", plain, estimation_figure(result, dt_s))


def _write(folder: Path, stem: str, results: dict[str, Any], figure: Figure) -> None:
    text = json.dumps(results, indent=2, allow_nan=False) + "\n"
    write_text(folder / f"{stem}.json", text)
    write_figure(folder / f"{stem}.png", figure)
