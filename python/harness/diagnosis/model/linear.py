# SPDX-License-Identifier: MIT
"""Errors of a problem, linearised about a point, with updates of the slopes by Broyden's method.

C. G. Broyden, Math. Comput. 19, 1965. After k updates the slopes of an output are J = J_0 + R D'
with exact sensitivities J_0, shape (N, n), residuals R, (N, k), and directions D, (n, k). A fit
needs J'We and J'WJ only, with a weight W for each band of rows. Both follow from J_0'J_0 of each
band, which is computed once, and from products of J_0 with single vectors, so that J with its N n
numbers is not formed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...base.numbers import FloatArray
from .spectrum import BANDS, Spectrum


@dataclass(frozen=True, eq=False)
class _Updates:
    """Updates of the slopes of one output.

    R, D, and for each band J_0'R, shape (BANDS, n, k), and R'R, shape (BANDS, k, k).
    """

    residuals: FloatArray
    directions: FloatArray
    projected: FloatArray
    squares: FloatArray


class Linear:
    """Errors and their derivatives with respect to x, by output.

    Parameters
    ----------
    spectrum
        the bands of the N rows.
    errors
        errors by output, shape (N,).
    exact
        exact sensitivities by output, shape (N, n).
    """

    def __init__(
        self,
        spectrum: Spectrum,
        errors: Mapping[str, FloatArray],
        exact: Mapping[str, FloatArray],
    ) -> None:
        self._spectrum = spectrum
        self.errors = errors
        # The columns of J_0 in one array or in several: many fits start from the sensitivities of
        # the same point, and need not hold them once for each fit.
        self._exact: dict[str, tuple[FloatArray, ...]] = {
            name: (slopes,) for name, slopes in exact.items()
        }
        self._grams: dict[str, FloatArray] = {}
        self._updates: dict[str, _Updates] = {}

    @property
    def slopes(self) -> Mapping[str, FloatArray]:
        """Derivatives of the errors by output, shape (N, n)."""
        slopes = {}
        for name, parts in self._exact.items():
            slopes[name] = np.hstack(parts) if len(parts) > 1 else parts[0]
            if name in self._updates:
                updates = self._updates[name]
                slopes[name] = slopes[name] + updates.residuals @ updates.directions.T
        return slopes

    @property
    def size(self) -> int:
        """Number n of the parameters x."""
        return sum(part.shape[1] for part in next(iter(self._exact.values())))

    def gram(self, name: str) -> FloatArray:
        """Returns J_0'J_0 of the exact sensitivities of an output by band, (BANDS, n, n)."""
        if name not in self._grams:
            parts = self._exact[name]
            self._grams[name] = np.block([[self._product(a, b) for b in parts] for a in parts])
        return self._grams[name]

    def leading(self, count: int) -> Linear:
        """Returns the exact sensitivities of the first `count` parameters, with the same errors."""
        leading = Linear(self._spectrum, self.errors, {})
        for name, parts in self._exact.items():
            leading._exact[name] = (np.hstack(parts)[:, :count],)
            leading._grams[name] = self.gram(name)[:, :count, :count]
        return leading

    def joined(self, errors: Mapping[str, FloatArray], slopes: Mapping[str, FloatArray]) -> Linear:
        """Returns the exact sensitivities of this point with those of m further parameters.

        Parameters
        ----------
        errors
            errors at the new point by output, shape (N,).
        slopes
            exact sensitivities of the further parameters by output, shape (N, m).
        """
        joined = Linear(self._spectrum, errors, {})
        for name, further in slopes.items():
            joined._exact[name] = (*self._exact[name], further)
            cross = np.concatenate(
                [self._product(part, further) for part in self._exact[name]], axis=1
            )
            joined._grams[name] = np.block(
                [
                    [self.gram(name), cross],
                    [np.swapaxes(cross, 1, 2), self._product(further, further)],
                ]
            )
        return joined

    def at(self, errors: Mapping[str, FloatArray]) -> Linear:
        """Returns the same exact sensitivities with other errors."""
        other = Linear(self._spectrum, errors, {})
        other._exact, other._grams = self._exact, self._grams
        return other

    def after(self, step: FloatArray) -> dict[str, FloatArray]:
        """Returns the errors behind a step in x, shape (n,), by the exact sensitivities."""
        return {name: errors + self._times(name, step) for name, errors in self.errors.items()}

    def _product(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """Products a'b of the rows of each band, shape (BANDS, columns of a, columns of b)."""
        product = np.zeros((BANDS, a.shape[1], b.shape[1]))
        # The sensitivities of a simulation that diverges overflow. No step is taken then.
        with np.errstate(over="ignore", invalid="ignore"):
            for number, slices in enumerate(self._spectrum.bands):
                for rows in slices:
                    product[number] += a[rows].T @ b[rows]
        return product

    def _times(self, name: str, step: FloatArray) -> FloatArray:
        """Product of J_0 with a step, shape (n,)."""
        product = np.zeros(self._exact[name][0].shape[0])
        first = 0
        for part in self._exact[name]:
            product += part @ step[first : first + part.shape[1]]
            first += part.shape[1]
        return product

    def products(self, name: str, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Returns J'We, shape (n,), and J'WJ, shape (n, n), of an output.

        weights: weight of the squares in each band, shape (BANDS,).
        """
        error = self._spectrum.spread(weights) * self.errors[name]
        gradient = np.concatenate([part.T @ error for part in self._exact[name]])
        gram = np.tensordot(weights, self.gram(name), axes=1)
        if name in self._updates:
            updates = self._updates[name]
            mixed = np.tensordot(weights, updates.projected, axes=1) @ updates.directions.T
            squares = np.tensordot(weights, updates.squares, axes=1)
            gradient = gradient + updates.directions @ (updates.residuals.T @ error)
            gram = gram + mixed + mixed.T + updates.directions @ squares @ updates.directions.T
        return gradient, gram

    def updated(
        self, step: FloatArray, errors: Mapping[str, FloatArray], scale: FloatArray
    ) -> Linear:
        """Returns the errors after a step `step` in x, and the slopes with Broyden's update.

        J + (e - e_0 - J dx) dx' D / (dx' D dx), with D = diag(scale) so that the units of x have no
        influence. It is the smallest change of J that agrees with the new errors e. A step along
        parameters on which nothing depends changes no slopes.
        """
        after = Linear(self._spectrum, errors, {})
        after._exact, after._grams = self._exact, self._grams
        length = float(step @ (scale * step))
        if length <= 0.0:
            after._updates = self._updates
            return after
        direction = (scale * step / length)[:, np.newaxis]
        for name in self._exact:
            residual = errors[name] - self.errors[name] - self._times(name, step)
            before = self._updates.get(name)
            if before is not None:
                residual -= before.residuals @ (before.directions.T @ step)
            column = residual[:, np.newaxis]
            projected = np.concatenate(
                [self._product(part, column) for part in self._exact[name]], axis=1
            )
            if before is None:
                squares = self._product(column, column)
                after._updates[name] = _Updates(column, direction, projected, squares)
                continue
            residuals = np.hstack([before.residuals, column])
            after._updates[name] = _Updates(
                residuals,
                np.hstack([before.directions, direction]),
                np.concatenate([before.projected, projected], axis=2),
                self._product(residuals, residuals),
            )
        return after
