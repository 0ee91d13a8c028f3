# SPDX-License-Identifier: MIT
"""Estimates a model recursively, with the code that runs in the controller."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

import ehsid

from ..base.files import result_folder
from ..base.numbers import FloatArray
from ..catalogue.parameters import POLICIES
from ..models import estimation
from ..models.estimation import EstimationResult
from ..models.estimation.advice import Advice, advice_words, advise, state_words
from ..models.estimation.recursion import START_VARIANCE, Recursion
from ..models.estimation.servo import ServoPath
from ..models.identification import ArxOrders
from ..records.errors import nearest_name
from ..show.model_blocks import estimate_told
from ..show.model_file_names import ESTIMATION_FILES
from ..show.page import Items, Told
from .record import Source
from .simulate import Arrays, Signals, about, signals_of
from .tables import Shown, Tabular, time_column
from .wording import in_python

if TYPE_CHECKING:
    import control
    from matplotlib.figure import Figure


class Estimation(Shown, Tabular):
    """A recursive estimation over a record; its frame has the paths, sample by sample.

    Attributes
    ----------
    result
        `ehsid.harness.models.estimation.EstimationResult`.
    signals
        input and output that it was made of.
    """

    def __init__(self, result: EstimationResult, signals: Signals, recursion: Recursion) -> None:
        self.result = result
        self.signals = signals
        self._recursion = recursion

    @cached_property
    def _advice(self) -> Advice:
        """What to try, which takes some runs of the estimator: only once it is asked for."""
        return advise(self.signals.data, self._recursion, self.result)

    @property
    def parameters(self) -> dict[str, float]:
        """Parameters at the end of the record by name: a1 .., b1 .., offset."""
        return dict(zip(self.orders.names, self.theta.tolist(), strict=True))

    @property
    def orders(self) -> ArxOrders:
        """Structure of the model, with `na`, `nb`, `nk` and `names` of the parameters."""
        return self.result.orders

    @property
    def theta(self) -> FloatArray:
        """Parameters at the end of the record in the order of `orders.names`, shape (p,)."""
        return self.result.theta

    @property
    def standard_deviations(self) -> FloatArray:
        """Standard deviations of `theta`, shape (p,)."""
        return self.result.standard_deviation

    @property
    def servo(self) -> ServoPath | None:
        """K, omega_n and xi over the record, each with its interval and whether it is trusted.

        None where na or nb is not 3, or the sampling time is not known.
        """
        return self.result.servo

    @property
    def converged(self) -> bool:
        """Whether the estimate has settled, and its residuals show no sign that they are not white.

        Only then the intervals of the parameters hold.
        """
        return self.result.converged

    @property
    def settled(self) -> bool:
        """Whether each parameter is determined to 5 %, computed as if the residuals were white."""
        return self.result.settled

    def to_control(self) -> control.TransferFunction:
        """Returns the final model as a discrete-time system of python-control.

        Its dt is the sampling time in seconds, or True without one. The constant term is left out.
        """
        from ..models.identification.loop import arx_system

        return arx_system(self.result.orders, self.result.theta, self.signals.data.dt_s)

    def plot(self) -> Figure:
        """Returns a figure: K, the parameters with 95 % bands, lambda and the innovation."""
        from ..show.model_figures import estimation_figure

        figure = estimation_figure(self.result, self.signals.data.dt_s)
        label = f"innovation of\n{self.signals.output_label}"
        figure.axes[-1].set_ylabel(label, parse_math=False)
        return figure

    def save(self, folder: str | os.PathLike[str]) -> Path:
        """Writes what `ehsid estimate --out` writes, and returns the folder.

        Raises
        ------
        ValueError
            the folder cannot be written to, or has files of these names that ehsid did not write.
        """
        from ..show.model_figures import write_estimation

        out, signals = Path(folder), self.signals
        with (
            in_python(),
            result_folder(out, "estimate", ESTIMATION_FILES, signals.inputs) as new,
        ):
            write_estimation(new, self.result, signals.data.dt_s, signals.origin, self._advice)
        return out

    def _columns(self) -> Mapping[str, npt.NDArray[Any]]:
        result, data = self.result, self.signals.data
        paths: dict[str, npt.NDArray[Any]] = {}
        for value in result.servo or ():
            paths[value.name] = value.path
            paths[f"{value.name}_half90"] = value.half_path
            paths[f"{value.name}_trusted"] = value.trusted_path
        for i, name in enumerate(result.orders.names):
            paths[name] = result.theta_path[:, i]
            paths[f"{name}_deviation"] = result.deviation_path[:, i]
        paths["innovation"] = result.innovation
        paths["forgetting_factor"] = result.forgetting_factor
        paths["status"] = result.status
        time = time_column(data.dt_s, data.index)
        signals = {
            f"{name} (signal)" if name in {**paths, **time} else name: values[data.index]
            for name, values in ((data.input_name, data.u), (data.output_name, data.y))
        }
        return {**time, **signals, **paths}

    def _line(self) -> str:
        result = self.result
        servo = "" if result.servo is None else f"{result.servo}; "
        values = ", ".join(f"{name} {value:.5g}" for name, value in self.parameters.items())
        return (
            f"{self.signals.name}, {servo}{result.orders}, {result.method}; {values}; one-step fit "
            f"{result.one_step_fit_percent:.2f} %, {state_words(result)}"
        )

    def _blocks(self) -> Sequence[Told]:
        data = self.signals.data
        told = estimate_told(self.result, data.input_name, data.output_name)
        return [*told.blocks(), Items(advice_words(self._advice, python=True))]


def estimate(
    record: Source | Arrays | npt.ArrayLike,
    *arrays: npt.ArrayLike | None,
    input: str = "command_v",
    output: str = "position_m",
    na: int = 3,
    nb: int = 3,
    nk: int = 1,
    offset: bool = True,
    forgetting: str | float | ehsid.Forgetting = "exponential",
    method: str = "rls",
    reset: bool = True,
    guards: ehsid.RlsOptions | None = None,
    start_variance: float = START_VARIANCE,
) -> Estimation:
    """Estimates a servo and its ARX model sample by sample, with the code that the firmware runs.

    With na = nb = 3 the record is also read as a servo: `found.servo` has K, omega_n and xi, each
    with its 90 % interval and whether it can be trusted.

    Parameters
    ----------
    record, arrays
        as for `identify`.
    input, output
        names of the columns.
    na, nb, nk
        structure of the model: na and nb from 1 to 6, nk in samples up to 20.
    offset
        whether the model has a constant term: the mean command of a record is not the command at
        which a servo stands still.
    forgetting
        name of a policy with its defaults, such as "exponential" or "f-ratio"; a policy with
        settings, such as ehsid.Exponential(lambda0=0.99); or a number, the constant forgetting
        factor.
    method
        "rls", or for noise of the position sensor "riv"
        (docs/which_estimator.md).
    reset
        whether lambda and P are reset when the RMSE shows a change of the plant.
    guards
        guards against wind-up; None takes the defaults, ehsid.RlsOptions.textbook() has none.
    start_variance
        P_ii at the start and after a reset, above 0, in units of sigma^2 of the scaled signals.

    Raises
    ------
    ValueError
        the record lacks a column, a signal is constant, the record is too short, or a setting is
        out of range.

    Examples
    --------
    >>> import ehsid
    >>> log = "examples/data/hydraulic_crane.csv"
    >>> found = ehsid.estimate(log, input="valve_opening", output="oil_pressure", na=2, nb=2)
    >>> list(found.parameters)
    ['a1', 'a2', 'b1', 'b2', 'offset']
    """
    with in_python():
        signals = signals_of(record, input, output, arrays)
        policy = _policy(forgetting)
        with about(signals):
            recursion = Recursion(
                ArxOrders(na, nb, nk, offset=offset),
                policy,
                reset=reset,
                guards=guards,
                start_variance=start_variance,
                method=method,
            )
            result = estimation.estimate(signals.data, **vars(recursion))
    return Estimation(result, signals, recursion)


def _policy(forgetting: str | float | ehsid.Forgetting) -> ehsid.Forgetting:
    """Returns the policy of this name with its defaults; a policy stays as it is.

    A number is the constant factor, which must be in (0, 1].
    """
    if isinstance(forgetting, int | float) and not isinstance(forgetting, bool):
        if 0.0 < forgetting <= 1.0:
            return ehsid.Constant(float(forgetting))
        raise ValueError(
            f"forgetting={forgetting!r}: expected a constant factor above 0, 1 at most, or one of "
            f"{', '.join(POLICIES)}"
        )
    policies = tuple(info.policy for info in POLICIES.values())
    if not isinstance(forgetting, str) and isinstance(forgetting, policies):
        return forgetting
    name = str(forgetting).replace("_", "-")
    if name not in POLICIES:
        near = nearest_name(name, POLICIES)
        hint = f"; did you mean '{near}'?" if near else ""
        raise ValueError(f"forgetting={forgetting!r}: expected one of {', '.join(POLICIES)}{hint}")
    return POLICIES[name].policy()
