# SPDX-License-Identifier: MIT
"""Identifies a model offline."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import numpy.typing as npt

from ..base.files import result_folder
from ..base.numbers import FloatArray
from ..models import identification
from ..models.identification import ArxModel, ArxOrders, IdentificationResult, IoData, Prediction
from ..models.identification.dynamics import Dynamics, dynamics
from ..models.identification.residuals import predict_one_step, simulate
from ..models.identification.selection import (
    DEFAULT_DELAYS,
    DEFAULT_ORDERS,
    MOST_DELAY,
    MOST_ORDER,
    parse_range,
)
from ..show.model_blocks import model_line, model_told
from ..show.model_file_names import IDENTIFICATION_FILES
from ..show.page import Told
from .record import Source
from .simulate import Arrays, Signals, about, signals_of
from .tables import Shown, Tabular, time_column
from .wording import in_python

if TYPE_CHECKING:
    import control
    from matplotlib.figure import Figure

T = TypeVar("T")


class Identification(Shown, Tabular):
    """A model that `identify` chose; its frame has the validation half, sample by sample.

    Attributes
    ----------
    result
        `ehsid.harness.models.identification.IdentificationResult`.
    signals
        input and output that it was made of.
    """

    def __init__(self, result: IdentificationResult, signals: Signals) -> None:
        self.result = result
        self.signals = signals

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters of the chosen model by name: a1 .., b1 .., offset."""
        return dict(zip(self.orders.names, self.theta.tolist(), strict=True))

    @property
    def orders(self) -> ArxOrders:
        """Structure of the chosen model, with `na`, `nb`, `nk` and `names` of the parameters."""
        return self.result.chosen.orders

    @property
    def theta(self) -> FloatArray:
        """Parameters of the chosen model in the order of `orders.names`, shape (p,)."""
        return self.result.chosen.model.theta

    @property
    def standard_deviations(self) -> FloatArray:
        """Standard deviations of `theta`, shape (p,)."""
        return self.result.chosen.model.standard_deviations

    @property
    def fit_percent(self) -> tuple[float, float]:
        """Fits on the validation half in per cent: one step ahead, and of the free run."""
        chosen = self.result.chosen
        return chosen.one_step_fit_percent, chosen.simulation_fit_percent

    @cached_property
    def dynamics(self) -> Dynamics:
        """Poles, zeros, gains, `lag_s`, and the servo that the model is, each with a deviation."""
        return dynamics(self.result.chosen.model, self.result.dt_s)

    def predict(self, u: npt.ArrayLike, y: npt.ArrayLike) -> FloatArray:
        """Returns the prediction of each output from the inputs and outputs before it, shape (n,).

        The first max(na, nb + nk - 1) entries are NaN: nothing is before them.

        Parameters
        ----------
        u, y
            input and measured output, shape (n,) each, in the units of the record.

        Raises
        ------
        ValueError
            the lengths differ, a value is not finite, or there are too few samples.
        """
        return self._placed(predict_one_step, u, y)

    def simulate(self, u: npt.ArrayLike, start: npt.ArrayLike | None = None) -> FloatArray:
        """Returns the output of the model alone, shape (n,).

        Parameters
        ----------
        u
            input, shape (n,), in the unit of the record.
        start
            the first outputs, shape (max(na, nb + nk - 1),); they are the first of the result.
            None begins at zero.

        Raises
        ------
        ValueError
            `start` has another length, a value is not finite, or there are too few samples.
        """
        history = self.orders.n_history
        first = np.zeros(history) if start is None else np.asarray(start, dtype=np.float64)
        if first.shape != (history,):
            raise ValueError(f"start has the shape {first.shape}: expected ({history},)")
        given = np.asarray(u, dtype=np.float64)
        y = np.zeros(given.size)
        y[:history] = first[: given.size]
        run = self._placed(simulate, given, y)
        run[:history] = first
        return run

    def _placed(
        self, made: Callable[[ArxModel, IoData], Prediction], u: npt.ArrayLike, y: npt.ArrayLike
    ) -> FloatArray:
        """Returns what a function of the room predicts at its places among all samples."""
        data = IoData.from_arrays(u, y, dt_s=self.result.dt_s)
        prediction = made(self.result.chosen.model, data)
        placed = np.full(data.n_samples, np.nan)
        placed[prediction.index] = prediction.predicted
        return placed

    def to_control(self) -> control.TransferFunction:
        """Returns the chosen model as a discrete-time system of python-control.

        Its dt is the sampling time in seconds, or True without one. The constant term is left out.
        """
        from ..models.identification.loop import to_control

        return to_control(self.result.chosen.model, self.result.dt_s)

    def plot(self) -> Figure:
        """Returns a figure: measured and simulated output, and both tests of the residuals."""
        from ..show.model_figures import identification_figure

        figure = identification_figure(self.result)
        figure.axes[0].set_ylabel(self.signals.output_label, parse_math=False)
        return figure

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Writes what `ehsid identify --out` writes, and returns the folder.

        Raises
        ------
        ValueError
            the folder cannot be written to, or has files of these names that ehsid did not write.
        """
        from ..show.model_figures import write_identification

        out, inputs = Path(folder), self.signals.inputs
        with in_python(), result_folder(out, "identify", IDENTIFICATION_FILES, inputs) as new:
            write_identification(new, self.result, self.signals.data, self.signals.origin)
        return out

    def _columns(self) -> Mapping[str, npt.NDArray[Any]]:
        one_step, simulated = self.result.one_step, self.result.simulated
        return {
            **time_column(self.result.dt_s, simulated.index),
            "measured": simulated.measured,
            "one_step": one_step.predicted,
            "simulated": simulated.predicted,
        }

    def _line(self) -> str:
        return f"{self.signals.name}, {model_line(self.result)}"

    def _blocks(self) -> Sequence[Told]:
        data, orders = self.signals.data, self.result.chosen.orders
        return [
            *model_told(self.result, data.input_name, data.output_name).blocks(),
            f"Next: ehsid.estimate(..., na={orders.na}, nb={orders.nb}, nk={orders.nk})",
        ]


def identify(
    record: Source | Arrays | npt.ArrayLike,
    *arrays: npt.ArrayLike | None,
    input: str = "command_v",
    output: str = "position_m",
    orders: int | str | Iterable[int | tuple[int, int]] = DEFAULT_ORDERS,
    delays: int | str | Iterable[int] = DEFAULT_DELAYS,
) -> Identification:
    """Chooses order and delay of an ARX model on one half of a record, judged on the other.

    The model is A(q^-1) y(k) = q^-nk B(q^-1) u(k) + e(k), Ghazali et al. 2011, Eq. (7);
    docs/identification.md has the rules of the choice.

    Parameters
    ----------
    record
        a record, a path, or columns in memory as `read` takes them.
    arrays
        behind a plain array in place of a record: identify(u, y, dt_s), with arrays of shape (n,)
        and the sampling time in seconds or None. One tuple (u, y, dt_s) is taken, too.
    input, output
        names of the columns.
    orders
        orders na = nb to try, or pairs (na, nb), each at least 1: a number, several, or a range as
        text, "2-5".
    delays
        delays nk to try, in samples, at least 0, in the same way.

    Raises
    ------
    ValueError
        the record lacks a column, is too short, or does not excite the plant; the message says how
        to mend it.

    Examples
    --------
    >>> import ehsid
    >>> log = "examples/data/hydraulic_crane.csv"
    >>> model = ehsid.identify(log, input="valve_opening", output="oil_pressure", orders=[2, 3])
    >>> model.orders.na, model.theta.size
    (2, 5)
    >>> model.to_control().dt
    True
    """
    with in_python():
        signals = signals_of(record, input, output, arrays)
        tried = _several(orders, "--orders", MOST_ORDER)
        delayed = _several(delays, "--delays", MOST_DELAY)
        with about(signals):
            result = identification.identify(signals.data, orders=tried, delays=delayed)
    return Identification(result, signals)


def _several(given: int | str | Iterable[T], option: str, most: int) -> Iterable[int | T]:
    """Returns what is to be tried; a number or a text as the command reads it."""
    return parse_range(str(given), option, most) if isinstance(given, int | str) else given
