# SPDX-License-Identifier: MIT
"""What the page draws of a recursive estimation: its figures, and its paths as pyramids."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np

import ehsid
from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.base.encoding import from_json, json_text
from ehsid.harness.base.files import write_text
from ehsid.harness.catalogue.channels import TIME
from ehsid.harness.models.estimation import EstimationResult
from ehsid.harness.models.estimation.advice import Advice
from ehsid.harness.models.estimation.result import NORMAL_95
from ehsid.harness.models.estimation.words import advice_words
from ehsid.harness.models.identification import IoData
from ehsid.harness.records import Record
from ehsid.harness.show.model_blocks import EstimateTold, estimate_told

from .downsampling import Pyramid, make_pyramid, opened, store
from .model_look import look_folder, times_of
from .session import Session

FILE = "estimated.json"
INPUT, OUTPUT, FACTOR, INNOVATION = "input", "output", "factor", "innovation"
START = 0.1  # share of a record whose coefficients may leave the plot: they vary most there
INSIDE = (0.02, 0.98)  # quantiles of the other coefficients that the plot holds
WIDEST = 1.5  # of a band, in ranges of the coefficients
MOST_RESETS = 200  # that are marked


class Estimated(msgspec.Struct, frozen=True):
    """Figures of a recursive estimation.

    Attributes
    ----------
    record, input_name, output_name
        what it was made of.
    made_from
        digest of that and of the choices, see `Session.made_from`.
    names, ranges
        coefficients, and of each the lowest and highest value that the plot holds.
    rmse
        root mean square of the innovation in the unit of the output.
    n_samples, converged
        see `Estimate`.
    reset_samples
        samples of the record at which a change was found.
    told
        what is told of it.
    tries
        what may make the estimate converge.
    """

    record: str
    input_name: str
    output_name: str
    made_from: str
    names: list[str]
    ranges: list[tuple[float, float]]
    rmse: float
    n_samples: int
    converged: bool
    reset_samples: list[int]
    told: EstimateTold
    tries: list[str] = []


@dataclass(frozen=True, eq=False)
class EstimateLook:
    """Figures, and signals over the whole record by their keys; see `low` and `high`."""

    figures: Estimated
    time_s: FloatArray
    signals: dict[str, Pyramid]


def low(name: str) -> str:
    """Returns the key of the lower end of the 95 % band of a coefficient."""
    return f"{name}_low"


def high(name: str) -> str:
    """Returns the key of the upper end of the 95 % band of a coefficient."""
    return f"{name}_high"


def look_of(
    session: Session, record: Record, result: EstimationResult, data: IoData
) -> EstimateLook:
    """Returns what the page draws of an estimation of a record."""
    index = data.index

    def whole(values: FloatArray) -> Pyramid:
        spread = np.full(data.y.size, np.nan)
        spread[index] = np.where(np.isfinite(values), values, np.nan)
        return make_pyramid(spread)

    signals = {
        INPUT: whole(data.u[index]),
        OUTPUT: whole(data.y[index]),
        FACTOR: whole(result.forgetting_factor),
        INNOVATION: whole(result.innovation),
    }
    for i, name in enumerate(result.orders.names):
        path, half = result.theta_path[:, i], NORMAL_95 * result.deviation_path[:, i]
        signals[name] = whole(path)
        signals[low(name)], signals[high(name)] = whole(path - half), whole(path + half)
    figures = _figures(session, record.name, result, data)
    return EstimateLook(figures, times_of(record), signals)


def write_look(session: Session, look: EstimateLook) -> None:
    """Keeps what the page draws of an estimation."""
    folder = look_folder(session) / "estimate"
    folder.mkdir(parents=True, exist_ok=True)
    np.save(folder / f"{TIME}.npy", look.time_s)
    for key, pyramid in look.signals.items():
        store(pyramid, folder, key)
    write_text(folder / FILE, json_text(look.figures))


def write_tries(session: Session, figures: Estimated, advice: Advice) -> None:
    """Keeps what to try with the estimate: to find it takes longer than to estimate."""
    told = msgspec.structs.replace(figures, tries=advice_words(advice))
    write_text(look_folder(session) / "estimate" / FILE, json_text(told))


def read_look(session: Session) -> EstimateLook | None:
    """Returns what was kept last; None without one."""
    folder = look_folder(session) / "estimate"
    try:
        figures = from_json((folder / FILE).read_bytes(), Estimated)
        bands = [key for name in figures.names for key in (name, low(name), high(name))]
        keys = [INPUT, OUTPUT, FACTOR, INNOVATION, *bands]
        signals = {key: opened(folder, key) for key in keys}
        return EstimateLook(figures, np.load(folder / f"{TIME}.npy", mmap_mode="r"), signals)
    except (OSError, ValueError):  # msgspec's errors are ValueErrors
        return None


def _figures(session: Session, record: str, result: EstimationResult, data: IoData) -> Estimated:
    settled = result.theta_path[int(START * result.theta_path.shape[0]) :]
    lows, highs = np.nanquantile(settled, INSIDE, axis=0)
    # The band of the end is in the plot too, unless it is so wide that the paths would be lines.
    half = np.nan_to_num(NORMAL_95 * result.standard_deviation, posinf=0.0)
    room = WIDEST * (np.max(highs) - np.min(lows))
    lows = np.minimum(lows, result.theta - np.minimum(half, room))
    highs = np.maximum(highs, result.theta + np.minimum(half, room))
    resets = data.index[result.status == int(ehsid.Status.reset)]
    return Estimated(
        record=record,
        input_name=data.input_name,
        output_name=data.output_name,
        made_from=session.made_from("estimate"),
        names=list(result.orders.names),
        ranges=list(zip(lows.tolist(), highs.tolist(), strict=True)),
        rmse=result.rmse,
        n_samples=result.n_samples,
        converged=result.converged,
        reset_samples=resets[:MOST_RESETS].tolist(),
        told=estimate_told(result, data.input_name, data.output_name, usual=True),
    )
