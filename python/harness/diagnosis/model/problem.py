# SPDX-License-Identifier: MIT
"""Cost of a set of values on a set of records, with its gradient and Gauss-Newton Hessian.

    J(x) = sum_outputs J_output + sum_parameters ((x - centre) / sigma)^2 / 2

The first sum is the negative log-likelihood of the errors, see `likelihood`. The second sum is the
prior of the parameters. The errors of the fit are the coefficients of `spectrum`: a linear
transform of the errors, so that exact sensitivities pass through it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import numpy.typing as npt

import ehsid

from ...base.numbers import FloatArray
from ...base.parallel import run_threads, worker_count
from ...catalogue.parameters import plant_parameters
from ...rigs import Rig
from ...rigs.simulator_section import own_name
from ...signals.simulation.run import OUTPUTS
from ..deciding import INDEPENDENT, LEAST_TOLERANCE, TOLERANCE
from .comparison import Compared
from .differences import SimulatorEngine, differences
from .linear import Linear
from .parameters import Law, Parameter, block_basis
from .spectrum import BANDS, OutputLikelihood, Spectrum
from .unlogged import BETWEEN, Whitening, sent_twice, whitened

# Only the shape of a position inside a window counts: a free run drifts.
CENTRED = "position_m"


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
    white
        see `OutputLikelihood`.
    swinging
        whether the records show mainly a limit cycle.
    laws
        tables whose values the fit determines, too; their parameters follow the others in x.
    engine
        runs of the simulator of the rig, where that is not ours.
    unknown
        further power that is tolerated, by output, shape (BANDS,): see `between_samples`.
    unlogged
        whitening of the errors of each record for commands that nobody logged, or none.
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
        white: bool = False,
        swinging: bool = False,
        laws: Sequence[Law] = (),
        engine: SimulatorEngine | None = None,
        unknown: Mapping[str, FloatArray] | None = None,
        unlogged: Sequence[Whitening] = (),
    ) -> None:
        if not records or not outputs:
            raise ValueError("there is no record or no output to compare")
        own = [name for name in rig.values if own_name(name) is not None]
        names = [*plant_parameters(), *own]
        named = tuple(parameters)
        of_laws = [parameter for law in laws for parameter in law.parameters()]
        unfitted = {law.name: law.table(np.zeros(law.knots.size)) for law in laws}
        self.rig = replace(rig, tables={**rig.tables, **unfitted}) if laws else rig
        self.laws = tuple(laws)
        self.records = tuple(records)
        self.parameters = (*named, *of_laws)
        self.outputs = tuple(outputs)
        self.floors = dict(floors)
        self.substeps = substeps
        self.white = white
        self.swinging = swinging
        self._indices = [names.index(parameter.name) for parameter in named]
        self._basis = block_basis(self.laws)
        self._columns = [OUTPUTS.index(name) for name in self.outputs]
        self._engine = engine
        self._unknown = {} if unknown is None else unknown
        self._unlogged = tuple(unlogged)
        of_simulator = np.array([rig.values[name] for name in own])
        self._base = np.hstack(
            [self.rig.plant_values(fixed), self.rig.table_values(), of_simulator]
        )
        self.spectrum = Spectrum(self.records)
        self._centre = np.array([parameter.centre for parameter in self.parameters])
        self._weight = np.array([parameter.sigma**-2 for parameter in self.parameters])
        self.low = np.array([parameter.low for parameter in self.parameters])
        self.high = np.array([parameter.high for parameter in self.parameters])

    def explaining(
        self, simulated: Sequence[Mapping[str, FloatArray]], x: FloatArray, left: FloatArray
    ) -> Problem:
        """The same problem with simulated outputs in place of the measured ones, about x.

        Priors are centred at x, and powers `left` of errors, shape (outputs, BANDS), are tolerated
        besides: what would stay at x in any case. simulated: outputs of each record, by name.
        """
        other = copy(self)
        other.records = tuple(
            replace(record, outputs={name: outputs[name] for name in self.outputs})
            for record, outputs in zip(self.records, simulated, strict=True)
        )
        other._centre = x
        likelihoods = {
            name: replace(self.likelihoods[name], tolerated=self.likelihoods[name].tolerated + more)
            for name, more in zip(self.outputs, left, strict=True)
        }
        other.__dict__["likelihoods"] = likelihoods
        return other

    def with_evidence(self, independent: float) -> Problem:
        """The same problem whose errors count as so many independent ones, all outputs together."""
        likelihoods = self.likelihoods
        share = independent / sum(float(each.counts.sum()) for each in likelihoods.values())
        other = copy(self)
        other.__dict__["likelihoods"] = {
            name: replace(each, counts=share * each.counts) for name, each in likelihoods.items()
        }
        return other

    def information(self) -> FloatArray:
        """Information of the priors: sigma^-2 of each parameter, shape (n,)."""
        return self._weight

    @cached_property
    def likelihoods(self) -> Mapping[str, OutputLikelihood]:
        """Likelihood of the errors of each output."""
        independent = np.minimum(INDEPENDENT * self.spectrum.windows, self.spectrum.sizes)
        likelihoods = {}
        for name in self.outputs:
            motion = self._powers(name, [record.outputs for record in self.records])
            rounding = self._powers(name, [record.rounding for record in self.records])
            gain = self.spectrum.noise_gain(differences=name == CENTRED)
            white = self.floors[name] ** 2 * gain
            noise = np.maximum(white, rounding)
            of_motion = self._tolerance(name) ** 2 * motion
            unknown = self._unknown.get(name)
            likelihoods[name] = OutputLikelihood(
                self.spectrum,
                independent,
                noise
                + of_motion
                + self._least(name, motion)
                + (np.zeros(BANDS) if unknown is None else unknown),
                self.white,
                of_motion if unknown is None else unknown,
            )
        return likelihoods

    def _powers(self, name: str, signals: Sequence[Mapping[str, FloatArray]]) -> FloatArray:
        """Power in each band of a signal of that output, given for each record, shape (BANDS,)."""
        inside = [
            record.inside(of_record[name])
            for record, of_record in zip(self.records, signals, strict=True)
        ]
        return self.spectrum.powers(self.spectrum.transform(inside, differences=name == CENTRED))

    def _tolerance(self, name: str) -> FloatArray:
        """Share of the motion in each band to which no simulator is exact, shape (BANDS,).

        The phase of a limit cycle is lost with time: after k / 2 periods, a relative error e of its
        frequency is an error of pi k e of its amplitude. Nothing else swings through a window.
        """
        if not self.swinging:
            return np.full(BANDS, TOLERANCE if self._engine is None else self._engine.share(name))
        first = np.array([(1 << number) >> 1 for number in range(BANDS)], dtype=np.float64)
        return np.asarray(TOLERANCE * (1.0 + np.pi * first))

    def _least(self, name: str, motion: FloatArray) -> float:
        """Power that is tolerated in every octave, also where the record has no motion.

        motion: power of the measured output in each band, shape (BANDS,). The mean level of an
        output is no motion, unless it is that of differences.
        """
        sizes = self.spectrum.sizes.copy()
        if name != CENTRED:
            sizes[0] = 0.0
        return float(LEAST_TOLERANCE**2 * (motion @ sizes) / max(sizes.sum(), 1.0))

    def window_gradients(self, x: FloatArray) -> tuple[Step, FloatArray]:
        """Step at x, and the gradient of the first sum of J for each window, shape (W, n)."""
        linear = self.linear(x)
        window = self.spectrum.window_of_rows()
        by_window = np.zeros((self.spectrum.windows, x.size))
        for name in self.outputs:
            e = linear.errors[name]
            weights = self.spectrum.spread(self.likelihoods[name].weights(e))
            rows = linear.slopes[name] * (weights * e)[:, np.newaxis]
            for column in range(x.size):
                by_window[:, column] += np.bincount(window, rows[:, column])
        return self.form(x, linear), by_window

    def window_squares(self, errors: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
        """Sums of squared errors by window and output, (W, outputs), and sample counts, (W,)."""
        window_numbers = self._window_numbers()
        squares = [np.bincount(window_numbers, errors[name] ** 2) for name in self.outputs]
        return np.stack(squares, axis=1), np.bincount(window_numbers).astype(np.float64)

    def window_powers(self, coefficients: Mapping[str, FloatArray]) -> FloatArray:
        """Sums of squared coefficients by window, output and band, shape (W, outputs, BANDS)."""
        return np.stack(
            [self.spectrum.by_window(coefficients[name] ** 2) for name in self.outputs], axis=1
        )

    def _window_numbers(self) -> npt.NDArray[np.int64]:
        """Number of the window of each sample of `errors`, counted through all records."""
        numbers, first = [], 0
        for record in self.records:
            _, number_in_record = np.unique(record.window[record.used], return_inverse=True)
            numbers.append(number_in_record.astype(np.int64) + first)
            first += int(number_in_record.max()) + 1
        return np.concatenate(numbers)

    def centres(self) -> FloatArray:
        """Means of the priors, shape (n,)."""
        return self._centre

    def centre(self) -> FloatArray:
        """Centres of the priors, clipped to the bounds, shape (n,)."""
        return np.asarray(np.clip(self._centre, self.low, self.high), dtype=np.float64)

    def plant_values(self, x: FloatArray) -> FloatArray:
        """All values of the plant at x, shape (P + T,).

        First those of `plant_parameters`, then those of the tables of the rig.
        """
        values = self._base.copy()
        named = len(self._indices)
        for index, parameter, x_value in zip(
            self._indices, self.parameters[:named], x[:named], strict=True
        ):
            values[index] = parameter.value(float(x_value))
        if self.laws:  # of our plant, which has no values of another simulator
            values[values.size - self._basis.shape[0] :] = self._basis @ x[named:]
        return values

    def simulate(self, x: FloatArray) -> list[dict[str, FloatArray]]:
        """Simulated outputs at x for each record, by name, shape (N,) each."""
        return [outputs for outputs, _ in self._runs(x, ())]

    def errors(self, x: FloatArray) -> dict[str, FloatArray]:
        """Errors, simulated minus measured, inside the windows of all records, by output.

        The mean of each window is subtracted from the errors of the position.
        """
        return self.errors_of(self.simulate(x))

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
        return record.centre(error) if name == CENTRED else error

    def coefficients(self, x: FloatArray) -> dict[str, FloatArray]:
        """Coefficients of the errors at x by output, shape (R,); see `spectrum`."""
        return self.coefficients_of(self.simulate(x))

    def coefficients_of(
        self, simulated: Sequence[Mapping[str, FloatArray]]
    ) -> dict[str, FloatArray]:
        """Coefficients as `coefficients` gives them, from the result of `simulate`."""
        return self.transformed(
            {
                name: [
                    record.inside(outputs[name]) - record.inside(record.outputs[name])
                    for record, outputs in zip(self.records, simulated, strict=True)
                ]
                for name in self.outputs
            }
        )

    def transformed(self, inside: Mapping[str, Sequence[FloatArray]]) -> dict[str, FloatArray]:
        """Coefficients by output, shape (R, ...), of what the outputs are inside the windows.

        inside: by output the rows of each record, as `Compared.inside` gives them.
        """
        coefficients = {
            name: self.spectrum.transform(of_records, differences=name == CENTRED)
            for name, of_records in inside.items()
        }
        if not self._unlogged:
            return coefficients
        return whitened(self.spectrum, self._unlogged, coefficients)

    def cost(self, x: FloatArray) -> float:
        """Cost J(x), nats; infinite if the simulation diverges."""
        return self.cost_of(x, self.coefficients(x))

    def cost_of(self, x: FloatArray, coefficients: Mapping[str, FloatArray]) -> float:
        """Cost J(x), nats, from the coefficients of the errors at x."""
        return self.fit_cost(coefficients) + self.prior_cost(x)

    def fit_cost(self, coefficients: Mapping[str, FloatArray]) -> float:
        """First sum of J, the negative log-likelihood of the errors, nats."""
        return sum(self.likelihoods[name].cost(coefficients[name]) for name in self.outputs)

    def prior_cost(self, x: FloatArray) -> float:
        """Second sum of J, the negative logarithm of the priors, nats."""
        return float(0.5 * np.sum(self._weight * (x - self._centre) ** 2))

    def linear(self, x: FloatArray, first: Linear | None = None) -> Linear:
        """Returns the coefficients at x with exact sensitivities, except those in `first`.

        first: sensitivities of the first m parameters at a point near x, shape (R, m) by output,
        m <= n.
        """
        if first is None:
            return Linear(self.spectrum, *self._sensitivities(x, range(x.size)))
        # The sensitivities of a simulation that diverges overflow. No step is taken then.
        with np.errstate(over="ignore", invalid="ignore"):
            return first.joined(*self._sensitivities(x, range(first.size, x.size)))

    def form(self, x: FloatArray, linear: Linear) -> Step:
        """Cost, gradient and Gauss-Newton Hessian at x, from the errors and their derivatives."""
        gradient = self._weight * (x - self._centre)
        hessian = np.diag(self._weight)
        for name in self.outputs:
            # The sensitivities of a simulation that diverges overflow. No step is taken then.
            with np.errstate(over="ignore", invalid="ignore"):
                weights = self.likelihoods[name].weights(linear.errors[name])
                by_x, gram = linear.products(name, weights)
                gradient = gradient + by_x
                hessian = hessian + gram
        return Step(self.fit_cost(linear.errors) + self.prior_cost(x), gradient, hessian)

    def step(self, x: FloatArray) -> Step:
        """Cost, gradient and Gauss-Newton Hessian at x, with exact sensitivities."""
        return self.form(x, self.linear(x))

    def responses(
        self, x: FloatArray, disturbances: Sequence[Sequence[tuple[str, FloatArray]]]
    ) -> dict[str, FloatArray]:
        """Derivatives of the coefficients at x by the sizes of disturbances, by output, (R, D).

        disturbances: for each record D pairs of an equation and a signal, as
        `ehsid.simulate_plant` takes them.
        """
        values = self.plant_values(x)[np.newaxis]
        runs = run_threads(
            [
                partial(self._run, number, values, (), signals)
                for number, signals in enumerate(disturbances)
            ]
        )
        return self._slopes([partials for _, partials in runs])

    def _slopes(self, partials: Sequence[Mapping[str, FloatArray]]) -> dict[str, FloatArray]:
        """Derivatives of the coefficients by output, from those of the samples of each record."""
        return self.transformed(
            {
                name: [
                    record.inside(of_record[name])
                    for record, of_record in zip(self.records, partials, strict=True)
                ]
                for name in self.outputs
            }
        )

    def _sensitivities(
        self, x: FloatArray, varied: Sequence[int]
    ) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
        """Coefficients by output, (R,), and their derivatives by the varied x, shape (R, V)."""
        if self._engine is not None:
            return differences(x, varied, self.parameters, self.rig, self.coefficients)
        named = len(self._indices)
        own = [index for index in varied if index < named]
        of_laws = [index - named for index in varied if index >= named]
        tables = range(self._base.size - self._basis.shape[0], self._base.size)
        runs = self._runs(x, [*(self._indices[i] for i in own), *(tables if of_laws else ())])
        scale = np.array([self.parameters[index].slope(float(x[index])) for index in own])
        # The sensitivities of a simulation that diverges overflow. No step is taken then.
        with np.errstate(over="ignore", invalid="ignore"):
            slopes = self._slopes([partials for _, partials in runs])
            for name, by_values in slopes.items():
                by_parameters = scale * by_values[:, : len(own)]
                if of_laws:
                    by_laws = by_values[:, len(own) :] @ self._basis[:, of_laws]
                    by_parameters = np.hstack([by_parameters, by_laws])
                slopes[name] = by_parameters
        return self.coefficients_of([outputs for outputs, _ in runs]), slopes

    def _runs(
        self, x: FloatArray, places: Sequence[int]
    ) -> list[tuple[dict[str, FloatArray], dict[str, FloatArray]]]:
        """Outputs by name, shape (N,), and their derivatives by values of the plant, (N, V).

        places: of these values in `plant_values`.
        """
        values = self.plant_values(x)[np.newaxis]
        return run_threads(
            [partial(self._run, number, values, places) for number in range(len(self.records))]
        )

    def _run(
        self,
        number: int,
        values: FloatArray,
        indices: Sequence[int],
        disturbances: Sequence[tuple[str, FloatArray]] = (),
    ) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
        record = self.records[number]
        if self._engine is not None:
            return self._engine.outputs(record, values[0]), {}
        command, aligned, parts = record.record.column("command_v"), record.aligned, 1
        if self._unlogged:
            values = values.copy()
            values[:, list(plant_parameters()).index(BETWEEN)] = 0.0
            command, aligned = sent_twice(command, self._unlogged[number].between, aligned)
            middle = np.arange(command.size) / 2
            disturbances = [
                (equation, np.interp(middle, np.arange(signal.size), signal))
                for equation, signal in disturbances
            ]
            parts = 2
        outputs, partials = ehsid.simulate_plant(
            self.rig.plant,
            values,
            command,
            dt_s=record.dt_s / parts,
            substeps=-(-self.substeps // parts),
            varied=indices,
            watched=self._columns,
            aligned=aligned,
            # The parts of a run with many sensitivities can run side by side.
            threads=max(worker_count(), 0),
            tables=self.rig.table_shapes(),
            disturbances=disturbances,
        )
        places = list(enumerate(zip(self.outputs, self._columns, strict=True)))
        return (
            {name: outputs[0, ::parts, column] for _, (name, column) in places},
            {name: partials[0, ::parts, :, place] for place, (name, _) in places},
        )
