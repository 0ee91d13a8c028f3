# SPDX-License-Identifier: MIT
"""Cost of a set of values on a set of records, with its gradient and Gauss-Newton Hessian.

    J(x) = sum_outputs (n / 2) ln(mse + floor^2) + sum_parameters ((x - centre) / sigma)^2 / 2

The first sum is the negative log-likelihood of normal errors whose standard deviation is unknown
for each output, so that no output needs a weight by hand. The second sum is the prior of the
parameters. n is the number of independent errors, not of samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.arrays import FloatArray
from ehsid.harness.catalogue.parameters import plant_parameters
from ehsid.harness.gap.model.comparison import Compared
from ehsid.harness.gap.model.linear import Linear
from ehsid.harness.gap.model.parameters import Parameter
from ehsid.harness.gap.thresholds import INDEPENDENT_HZ
from ehsid.harness.parallel import run_threads, worker_count
from ehsid.harness.rigs import Rig
from ehsid.harness.simulation.outputs import OUTPUTS


@dataclass(frozen=True, eq=False)
class Step:
    """Cost at a point, nats, with its gradient, shape (n,), and Gauss-Newton Hessian, (n, n)."""

    cost: float
    gradient: FloatArray
    hessian: FloatArray


class Problem:
    """The cost function of a fit: a rig, records, and the parameters that a fit may change.

    Parameters
    ----------
    rig
        the rig as configured in the rig file.
    records
        at least one record; all of them have the compared outputs.
    parameters
        parameters in the order of x.
    outputs
        names of the compared outputs.
    floors
        noise floor by output, in the unit of the output, > 0.
    substeps
        integration steps per sample.
    fixed
        values by full name that replace those of the rig where no parameter does.
    """

    def __init__(
        self,
        rig: Rig,
        records: Sequence[Compared],
        parameters: Sequence[Parameter],
        *,
        outputs: Sequence[str],
        floors: Mapping[str, float],
        substeps: int = 2,
        fixed: Mapping[str, float] | None = None,
    ) -> None:
        if not records or not outputs:
            raise ValueError("there is no record or no output to compare")
        names = list(plant_parameters())
        self.rig = rig
        self.records = tuple(records)
        self.parameters = tuple(parameters)
        self.outputs = tuple(outputs)
        self.floors = dict(floors)
        self.substeps = substeps
        self._indices = [names.index(parameter.name) for parameter in parameters]
        self._columns = [OUTPUTS.index(name) for name in self.outputs]
        self._columns = [OUTPUTS.index(name) for name in self.outputs]
        self._base = rig.plant_values(fixed)
        self._independent = INDEPENDENT_HZ * sum(record.seconds for record in records)
        self._centre = np.array([parameter.centre for parameter in parameters])
        self._weight = np.array([parameter.sigma**-2 for parameter in parameters])
        self.low = np.array([parameter.low for parameter in parameters])
        self.high = np.array([parameter.high for parameter in parameters])

    def information(self) -> FloatArray:
        """Information of the priors: sigma^-2 of each parameter, shape (n,)."""
        return self._weight

    def window_gradients(self, x: FloatArray) -> tuple[Step, FloatArray]:
        """Step at x, and the gradient of the first sum of J for each window, shape (W, n)."""
        linear = self.linear(x)
        numbers = self._window_numbers()
        begins = np.flatnonzero(np.diff(numbers, prepend=-1))
        by_window = np.zeros((begins.size, x.size))
        for name in self.outputs:
            e = linear.errors[name]
            weight = self._independent / e.size / (np.mean(e**2) + self.floors[name] ** 2)
            rows = linear.slopes[name] * (weight * e)[:, np.newaxis]
            by_window += np.add.reduceat(rows, begins, axis=0)
        return self.form(x, linear), by_window

    def window_squares(self, errors: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Sums of squared errors by window and output, (W, outputs), and sample counts, (W,)."""
        window_numbers = self._window_numbers()
        squares = [np.bincount(window_numbers, errors[name] ** 2) for name in self.outputs]
        return np.stack(squares, axis=1), np.bincount(window_numbers).astype(np.float64)

    def _window_numbers(self) -> npt.NDArray[np.int64]:
        """Number of the window of each sample of `errors`, counted through all records."""
        numbers, first = [], 0
        for record in self.records:
            _, number_in_record = np.unique(record.window[record.used], return_inverse=True)
            numbers.append(number_in_record.astype(np.int64) + first)
            first += int(number_in_record.max()) + 1
        return np.concatenate(numbers)

    def centre(self) -> FloatArray:
        """Centres of the priors, clipped to the bounds, shape (n,)."""
        return np.asarray(np.clip(self._centre, self.low, self.high), dtype=np.float64)

    def plant_values(self, x: FloatArray) -> FloatArray:
        """All P values of the plant at x, in the order of `plant_parameters`, shape (P,)."""
        values = self._base.copy()
        for index, parameter, x_value in zip(self._indices, self.parameters, x, strict=True):
            values[index] = parameter.value(float(x_value))
        return values

    def simulate(self, x: FloatArray) -> list[dict[str, FloatArray]]:
        """Simulated outputs at x for each record, by name, shape (N,) each."""
        return [outputs for outputs, _ in self._runs(x, ())]

    def errors(self, x: FloatArray) -> dict[str, FloatArray]:
        """Errors, simulated minus measured, inside the windows of all records, by output.

        The mean of each window is subtracted from the errors of the position.
        """
        errors, _ = self._errors(x)
        return errors

    def errors_of(self, simulated: Sequence[Mapping[str, FloatArray]]) -> dict[str, FloatArray]:
        """Errors as `errors` gives them, from the result of `simulate`."""
        errors: dict[str, list[FloatArray]] = {name: [] for name in self.outputs}
        for record, outputs in zip(self.records, simulated, strict=True):
            for name in self.outputs:
                errors[name].append(self._error(record, outputs, name))
        return {name: np.concatenate(parts) for name, parts in errors.items()}

    def _error(self, record: Compared, outputs: Mapping[str, FloatArray], name: str) -> FloatArray:
        """Error of an output inside the windows of a record; that of the position is centred."""
        error = record.inside(outputs[name]) - record.inside(record.outputs[name])
        return record.centre(error) if name == "position_m" else error

    def cost(self, x: FloatArray) -> float:
        """Cost J(x), nats; infinite if the simulation diverges."""
        return self.cost_of(x, self.errors(x))

    def cost_of(self, x: FloatArray, errors: Mapping[str, FloatArray]) -> float:
        """Cost J(x), nats, from the errors at x."""
        return self.fit_cost(errors) + self.prior_cost(x)

    def fit_cost(self, errors: Mapping[str, FloatArray]) -> float:
        """First sum of J, the negative log-likelihood of the errors, nats."""
        total = 0.0
        for name in self.outputs:
            mse = float(np.mean(errors[name] ** 2))
            if not np.isfinite(mse):
                return np.inf
            total += 0.5 * self._independent * np.log(mse + self.floors[name] ** 2)
        return total

    def prior_cost(self, x: FloatArray) -> float:
        """Second sum of J, the negative logarithm of the priors, nats."""
        return float(0.5 * np.sum(self._weight * (x - self._centre) ** 2))

    def linear(self, x: FloatArray, first: Linear | None = None) -> Linear:
        """Returns the errors at x with exact sensitivities, except those that `first` provides.

        first: sensitivities of the first m parameters at a point near x, shape (N, m) by output,
        m <= n.
        """
        if first is None:
            return Linear(*self._errors(x, range(x.size)))
        # The sensitivities of a simulation that diverges overflow. No step is taken then.
        with np.errstate(over="ignore", invalid="ignore"):
            return first.joined(*self._errors(x, range(first.size, x.size)))

    def form(self, x: FloatArray, linear: Linear) -> Step:
        """Cost, gradient and Gauss-Newton Hessian at x, from the errors and their derivatives."""
        gradient = self._weight * (x - self._centre)
        hessian = np.diag(self._weight)
        for name in self.outputs:
            e = linear.errors[name]
            # d/dx (n / 2) ln(mse + floor^2) = n / (N (mse + floor^2)) J' e
            weight = self._independent / e.size / (np.mean(e**2) + self.floors[name] ** 2)
            # The sensitivities of a simulation that diverges overflow. No step is taken then.
            with np.errstate(over="ignore", invalid="ignore"):
                by_x, gram = linear.products(name)
                gradient = gradient + weight * by_x
                hessian = hessian + weight * gram
        return Step(self.fit_cost(linear.errors) + self.prior_cost(x), gradient, hessian)

    def step(self, x: FloatArray) -> Step:
        """Cost, gradient and Gauss-Newton Hessian at x, with exact sensitivities."""
        return self.form(x, self.linear(x))

    def _errors(
        self, x: FloatArray, varied: Sequence[int] = ()
    ) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
        """Errors by output, shape (N,), and their derivatives by the varied x, shape (N, V)."""
        runs = self._runs(x, varied)
        errors = self.errors_of([outputs for outputs, _ in runs])
        if not varied:
            return errors, {}
        scale = [self.parameters[index].slope(float(x[index])) for index in varied]
        size = sum(record.size for record in self.records)
        slopes = {name: np.empty((size, len(varied))) for name in self.outputs}
        first = 0
        for record, (_, partials) in zip(self.records, runs, strict=True):
            rows = slice(first, first + record.size)
            first += record.size
            # The sensitivities of a simulation that diverges overflow. No step is taken then.
            with np.errstate(over="ignore", invalid="ignore"):
                for name in self.outputs:
                    part = slopes[name][rows]
                    np.multiply(record.inside(partials[name]), scale, out=part)
                    if name == "position_m":
                        record.centre(part)
        return errors, slopes

    def _runs(
        self, x: FloatArray, varied: Sequence[int]
    ) -> list[tuple[dict[str, FloatArray], dict[str, FloatArray]]]:
        """Outputs by name, shape (N,), and their derivatives by the plant's values, (N, V)."""
        values = self.plant_values(x)[np.newaxis]
        indices = [self._indices[index] for index in varied]
        return run_threads([partial(self._run, record, values, indices) for record in self.records])

    def _run(
        self, record: Compared, values: FloatArray, indices: Sequence[int]
    ) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
        outputs, partials = ehsid.simulate_plant(
            self.rig.plant,
            values,
            record.record.column("command_v"),
            dt_s=record.dt_s,
            substeps=self.substeps,
            varied=indices,
            watched=self._columns,
            aligned=record.aligned,
            # The parts of a run with many sensitivities can run side by side.
            threads=max(worker_count(), 0),
        )
        places = list(enumerate(zip(self.outputs, self._columns, strict=True)))
        return (
            {name: outputs[0, :, column] for _, (name, column) in places},
            {name: partials[0, :, :, place] for place, (name, _) in places},
        )
