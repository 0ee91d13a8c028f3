# SPDX-License-Identifier: MIT
"""What the page draws of models and of an estimate; kept in files, and the signals as pyramids.

The numbers are those of `identification` and `estimation`; here they are only brought together.
The newest model is whole, and those before it are kept so far that they can be drawn with it: each
simulates the record of the newest one.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.base.encoding import from_json, json_text, read_json
from ehsid.harness.base.files import write_text
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.catalogue.channels import TIME
from ehsid.harness.models.estimation import EstimationResult
from ehsid.harness.models.estimation.advice import Advice, advice_words
from ehsid.harness.models.estimation.recursion import NORMAL_95
from ehsid.harness.models.identification import (
    ArxModel,
    ArxOrders,
    IdentificationError,
    IdentificationResult,
    IoData,
    Prediction,
    fit_percent,
    simulate,
)
from ehsid.harness.models.identification.candidates import simulation_cell
from ehsid.harness.models.identification.dynamics import Dynamics, dynamics
from ehsid.harness.records import Record
from ehsid.harness.show.model_blocks import (
    EstimateTold,
    ModelTold,
    estimate_told,
    model_line,
    model_told,
)
from ehsid.harness.show.model_figures import Bode, Lags, lags, model_bode

from .downsampling import Pyramid, make_pyramid, opened, store
from .session import Session

FILE = "identified.json"
MEASURED, SIMULATED, RESIDUAL, ERROR = "measured", "simulated", "residual", "error"
MOST_MODELS = 4  # that are kept, the newest one among them
ESTIMATE_FILE = "estimated.json"
INPUT, OUTPUT, FACTOR, INNOVATION = "input", "output", "factor", "innovation"
START = 0.1  # share of a record whose coefficients may leave the plot: they vary most there
INSIDE = (0.02, 0.98)  # quantiles of the other coefficients that the plot holds
WIDEST = 1.5  # of a band, in ranges of the coefficients
MOST_RESETS = 200  # that are marked


class Identified(msgspec.Struct, frozen=True):
    """An identified model, as the page shows it."""

    number: int
    """By which it is known as long as it is kept."""
    record: str
    input_name: str
    output_name: str
    dt_s: float | None
    """What it was made of."""
    orders: ArxOrders
    theta: list[float]
    fit: str
    """The model, and the fit of its simulation on the half of its record that it was not fitted to,
    in per cent, or that it diverges."""
    line: str
    told: ModelTold
    """Which model was chosen, and what is told of it."""
    dynamics: Dynamics
    """Its poles and zeros."""
    whiteness: Lags
    independence: Lags
    bode: Bode
    """What is drawn of it."""
    here: str = ""
    """As `fit`, on the record of the newest model; "" where it cannot simulate that one."""

    def same_signals(self, other: Identified) -> bool:
        """Whether both have the same input, output and sampling time."""
        names = (self.input_name, self.output_name) == (other.input_name, other.output_name)
        return names and self.same_time(other)

    def same_time(self, other: Identified) -> bool:
        """Whether both have the same sampling time, but for the jitter of clocks."""
        return bool(np.isclose(self.dt_s or 0.0, other.dt_s or 0.0, rtol=1e-3, atol=0.0))


def key_of(signal: str, place: int) -> str:
    """Returns the key of a signal of the model at a place among `read_looks`; 0 is the newest."""
    return f"{signal}_{place}" if place else signal


def look_folder(session: Session) -> Path:
    """Returns the folder of what the page draws of models; no record can have its name."""
    return session.folder / "looks" / "_model"


def write_look(
    session: Session, record: Record, result: IdentificationResult, data: IoData
) -> None:
    """Writes what the page draws of an identification of a record, and of the models before it.

    A model of the same structure, record and signals as an earlier one takes its place.
    """
    folder = look_folder(session)
    folder.mkdir(parents=True, exist_ok=True)
    free, ahead = result.simulated, result.one_step
    first, last = int(free.index[0]), int(free.index[-1]) + 1  # only the half that is judged by
    np.save(folder / f"{TIME}.npy", times_of(record)[first:last])

    def keep(key: str, index: npt.NDArray[np.int64], values: FloatArray) -> None:
        whole = np.full(last - first, np.nan)
        inside = (index >= first) & np.isfinite(values)
        whole[index[inside] - first] = values[inside]
        store(make_pyramid(whole), folder, key)

    keep(MEASURED, free.index, free.measured)
    keep(RESIDUAL, ahead.index, ahead.residual)
    earlier = read_looks(session)
    chosen = result.chosen
    newest = Identified(
        number=1 + max((one.number for one in earlier), default=0),
        record=record.name,
        input_name=data.input_name,
        output_name=data.output_name,
        dt_s=result.dt_s,
        orders=chosen.orders,
        theta=chosen.model.theta.tolist(),
        fit=simulation_cell(chosen.simulation_fit_percent),
        line=model_line(result),
        told=model_told(result, data.input_name, data.output_name, usual=True),
        dynamics=dynamics(chosen.model, result.dt_s),
        whiteness=lags(result.whiteness),
        independence=lags(result.independence),
        bode=model_bode(result, data),
    )
    others = []
    for one in earlier:
        if one.same_signals(newest) and (one.record, one.orders) == (record.name, chosen.orders):
            newest = msgspec.structs.replace(newest, number=one.number)
        else:
            others.append(one)
    models = []
    for place, one in enumerate([newest, *others[: MOST_MODELS - 1]]):
        run = free if place == 0 else _run(one, newest, data, result)
        here = ""
        if run is not None:
            keep(key_of(SIMULATED, place), run.index, run.predicted)
            keep(key_of(ERROR, place), run.index, run.residual)
            here = simulation_cell(fit_percent(run.measured, run.predicted))
        models.append(msgspec.structs.replace(one, here=here))
    write_text(folder / FILE, json_text(models))


def _run(
    one: Identified, newest: Identified, data: IoData, result: IdentificationResult
) -> Prediction | None:
    """Simulates the half of the data that the newest model is judged by; None if it cannot."""
    if not one.same_signals(newest):
        return None
    theta = np.array(one.theta)
    unknown = np.full((theta.size, theta.size), np.nan)  # a simulation needs the parameters only
    model = ArxModel(one.orders, theta, unknown, np.nan, np.nan, 0)
    try:
        return simulate(model, data.split(result.n_estimation / data.n_samples)[1])
    except IdentificationError:  # the half is shorter than the history that the model needs
        return None


def times_of(record: Record) -> FloatArray:
    """Returns the times of all samples of a record in s."""
    if record.time_s is not None:
        return record.time_s
    return (record.dt_s or 1.0) * np.arange(len(record), dtype=np.float64)


def read_looks(session: Session) -> list[Identified]:
    """Returns what the page draws of the models that are kept, the newest one in front."""
    return read_json(look_folder(session) / FILE, list[Identified]) or []


class Estimated(msgspec.Struct, frozen=True):
    """Figures of a recursive estimation."""

    record: str
    input_name: str
    output_name: str
    """What it was made of."""
    made_from: str
    """Digest of that and of the choices, see `Session.made_from`."""
    names: list[str]
    ranges: list[tuple[float, float]]
    """Coefficients, and of each the lowest and highest value that the plot holds."""
    rmse: float
    """Root mean square of the innovation in the unit of the output."""
    n_samples: int
    converged: bool
    """See `Estimate`."""
    reset_samples: list[int]
    """Samples of the record at which a change was found."""
    told: EstimateTold
    """What is told of it."""
    tries: list[str] = []
    """What may make the estimate converge."""


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


def write_estimate_look(session: Session, look: EstimateLook) -> None:
    """Keeps what the page draws of an estimation."""
    folder = look_folder(session) / "estimate"
    folder.mkdir(parents=True, exist_ok=True)
    np.save(folder / f"{TIME}.npy", look.time_s)
    for key, pyramid in look.signals.items():
        store(pyramid, folder, key)
    write_text(folder / ESTIMATE_FILE, json_text(look.figures))


def write_tries(session: Session, figures: Estimated, advice: Advice) -> None:
    """Keeps what to try with the estimate: to find it takes longer than to estimate."""
    told = msgspec.structs.replace(figures, tries=advice_words(advice))
    write_text(look_folder(session) / "estimate" / ESTIMATE_FILE, json_text(told))


def read_estimate_look(session: Session) -> EstimateLook | None:
    """Returns what was kept last; None without one."""
    folder = look_folder(session) / "estimate"
    try:
        figures = from_json((folder / ESTIMATE_FILE).read_bytes(), Estimated)
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
