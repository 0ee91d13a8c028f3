# SPDX-License-Identifier: MIT
"""The cost of a set of values on some records, with its Gauss-Newton form.

    J(x) = sum_outputs (n / 2) ln(mse + floor^2) + sum_parameters ((x - centre) / sigma)^2 / 2

that is the likelihood of normal errors of unknown deviation for each output, so that no output
needs a weight by hand, and the prior of the rig. n counts independent errors, not samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.model.comparison import Compared
from ehsid.harness.gap.model.parameters import Parameter
from ehsid.harness.gap.thresholds import INDEPENDENT_HZ
from ehsid.harness.rigs import Rig
from ehsid.harness.rigs.parameters import plant_parameters
from ehsid.harness.simulation.outputs import OUTPUTS


@dataclass(frozen=True, eq=False)
class Step:
    """Gradient and Gauss-Newton Hessian of the cost at a point, and the cost itself."""

    cost: float
    gradient: FloatArray
    hessian: FloatArray


@dataclass(frozen=True, eq=False)
class Linear:
    """Errors, shape (N,), and their derivatives, (N, n), by output."""

    errors: Mapping[str, FloatArray]
    slopes: Mapping[str, FloatArray]

    def moved(
        self, move: FloatArray, errors: Mapping[str, FloatArray], scale: FloatArray
    ) -> Linear:
        """After a move, the slopes changed as little as its errors allow.

        J + (e - e_0 - J dx) dx' D / (dx' D dx)   (C. G. Broyden, Math. Comput. 19, 1965), with
        D = diag(scale) so that units do not count. Changes the slopes in place; a move along values
        that nothing depends on says nothing of them.
        """
        length = float(move @ (scale * move))
        if length <= 0.0:
            return Linear(errors, self.slopes)
        along = scale * move / length
        for name, slopes in self.slopes.items():
            slopes += np.outer(errors[name] - self.errors[name] - slopes @ move, along)
        return Linear(errors, self.slopes)


class Problem:
    """Records, a rig, and the parameters that may move.

    Parameters
    ----------
    rig
        told values.
    records
        at least one, all with the compared outputs.
    parameters
        in the order of x.
    outputs
        that count.
    floors
        noise floor by output, > 0.
    substeps
        steps of integration a sample.
    fixed
        values in place of those of the rig that do not move.
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
        self._places = [names.index(parameter.name) for parameter in parameters]
        self._base = rig.plant_values(fixed)
        self._independent = INDEPENDENT_HZ * sum(record.seconds for record in records)
        self._centre = np.array([parameter.centre for parameter in parameters])
        self._weight = np.array([parameter.sigma**-2 for parameter in parameters])
        self.low = np.array([parameter.low for parameter in parameters])
        self.high = np.array([parameter.high for parameter in parameters])

    def information(self) -> FloatArray:
        """Of the priors: sigma^-2 of each parameter, shape (n,)."""
        return self._weight

    def window_gradients(self, x: FloatArray) -> tuple[Step, FloatArray]:
        """The step at x, and the gradient of the first sum by windows, shape (W, n)."""
        step = self.step(x)
        errors, jacobians = self._errors(x, range(x.size))
        numbers = self._window_numbers()
        by_window = np.zeros((int(numbers.max()) + 1, x.size))
        for name in self.outputs:
            e = errors[name]
            share = self._independent / e.size / (np.mean(e**2) + self.floors[name] ** 2)
            np.add.at(by_window, numbers, share * jacobians[name] * e[:, np.newaxis])
        return step, by_window

    def window_squares(self, errors: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Sums of squared errors by window and output, shape (W, outputs), and samples, (W,)."""
        joined = self._window_numbers()
        squares = [np.bincount(joined, errors[name] ** 2) for name in self.outputs]
        return np.stack(squares, axis=1), np.bincount(joined).astype(np.float64)

    def _window_numbers(self) -> npt.NDArray[np.int64]:
        """Of the samples of `errors`, counted through all records."""
        numbers, first = [], 0
        for record in self.records:
            _, inside = np.unique(record.window[record.used], return_inverse=True)
            numbers.append(inside.astype(np.int64) + first)
            first += int(inside.max()) + 1
        return np.concatenate(numbers)

    def centre(self) -> FloatArray:
        """Middle of the priors, inside the bounds."""
        return np.asarray(np.clip(self._centre, self.low, self.high), dtype=np.float64)

    def plant_values(self, x: FloatArray) -> FloatArray:
        """All values of the plant, shape (P,)."""
        values = self._base.copy()
        for place, parameter, at in zip(self._places, self.parameters, x, strict=True):
            values[place] = parameter.value(float(at))
        return values

    def simulate(self, x: FloatArray) -> list[dict[str, FloatArray]]:
        """Outputs of each record, shape (N,) by name."""
        return [outputs for outputs, _ in self._runs(x, ())]

    def errors(self, x: FloatArray) -> dict[str, FloatArray]:
        """Simulated minus measured inside the windows of all records; position less its means."""
        errors, _ = self._errors(x)
        return errors

    def cost(self, x: FloatArray) -> float:
        """J(x); infinite where the simulation is."""
        return self.cost_of(x, self.errors(x))

    def cost_of(self, x: FloatArray, errors: Mapping[str, FloatArray]) -> float:
        """J(x) from the errors at x."""
        return self.fit_cost(errors) + self.prior_cost(x)

    def fit_cost(self, errors: Mapping[str, FloatArray]) -> float:
        """The first sum."""
        total = 0.0
        for name in self.outputs:
            mse = float(np.mean(errors[name] ** 2))
            if not np.isfinite(mse):
                return np.inf
            total += 0.5 * self._independent * np.log(mse + self.floors[name] ** 2)
        return total

    def prior_cost(self, x: FloatArray) -> float:
        """The second sum."""
        return float(0.5 * np.sum(self._weight * (x - self._centre) ** 2))

    def linear(self, x: FloatArray, first: Linear | None = None) -> Linear:
        """Errors at x with exact sensitivities; those of the first parameters as told, if they are.

        first: at a point nearby, shape (N, m) by output, m <= n.
        """
        if first is None:
            return Linear(*self._errors(x, range(x.size)))
        told = first.slopes[self.outputs[0]].shape[1]
        errors, slopes = self._errors(x, range(told, x.size))
        joined = {n: np.concatenate([first.slopes[n], slopes[n]], axis=1) for n in self.outputs}
        return Linear(errors, joined)

    def form(self, x: FloatArray, linear: Linear) -> Step:
        """Cost, gradient and Gauss-Newton Hessian from errors and their derivatives at x."""
        gradient = self._weight * (x - self._centre)
        hessian = np.diag(self._weight)
        for name in self.outputs:
            e, j = linear.errors[name], linear.slopes[name]
            # d/dx (n / 2) ln(mse + floor^2) = n / (N (mse + floor^2)) J' e
            share = self._independent / e.size / (np.mean(e**2) + self.floors[name] ** 2)
            # Sensitivities of a simulation on its way to infinity overflow; no step is taken then.
            with np.errstate(over="ignore", invalid="ignore"):
                gradient = gradient + share * (j.T @ e)
                hessian = hessian + share * (j.T @ j)
        return Step(self.fit_cost(linear.errors) + self.prior_cost(x), gradient, hessian)

    def step(self, x: FloatArray) -> Step:
        """The form at x by exact sensitivities."""
        return self.form(x, self.linear(x))

    def _errors(
        self, x: FloatArray, varied: Sequence[int] = ()
    ) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
        errors: dict[str, list[FloatArray]] = {name: [] for name in self.outputs}
        jacobians: dict[str, list[FloatArray]] = {name: [] for name in self.outputs}
        for record, (outputs, slopes) in zip(self.records, self._runs(x, varied), strict=True):
            for name in self.outputs:
                error = outputs[name] - record.outputs[name]
                if name == "position_m":
                    errors[name].append(record.centred(error))
                    if varied:
                        jacobians[name].append(record.centred(slopes[name]))
                else:
                    errors[name].append(error[record.used])
                    if varied:
                        jacobians[name].append(slopes[name][record.used])
        joined = {name: np.concatenate(parts) for name, parts in errors.items()}
        if not varied:
            return joined, {}
        return joined, {name: np.concatenate(parts) for name, parts in jacobians.items()}

    def _runs(
        self, x: FloatArray, varied: Sequence[int]
    ) -> list[tuple[dict[str, FloatArray], dict[str, FloatArray]]]:
        values = self.plant_values(x)
        slopes = np.array(
            [self.parameters[place].slope(float(x[place])) for place in varied], dtype=np.float64
        )
        runs = []
        for record in self.records:
            outputs, partials = ehsid.simulate_plant(
                self.rig.plant,
                values[np.newaxis],
                record.record.column("command_v"),
                dt_s=record.dt_s,
                substeps=self.substeps,
                varied=[self._places[place] for place in varied],
                aligned=record.aligned,
                threads=1,
            )
            places = {name: OUTPUTS.index(name) for name in self.outputs}
            runs.append(
                (
                    {name: outputs[0, :, place] for name, place in places.items()},
                    {name: partials[0, :, :, place] * slopes for name, place in places.items()}
                    if varied
                    else {},
                )
            )
        return runs
