# SPDX-License-Identifier: MIT
"""A law without a name as part of a fit: a table whose values have a smoothness prior.

The values at the knots are a Gaussian process over the variable with the Matérn covariance of order
5/2 (C. Rasmussen, C. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, eq. 4.17),

    k(r) = s^2 (1 + a + a^2 / 3) exp(-a),   a = sqrt(5) r / l,

with the size s that such a term may have on this machine and the length l. The distance r is
counted in knots, so that a law can bend most where they are close. With the Cholesky factor L of
the covariance the values are L z, and the parameters z are independent with variance one: a prior
as any other parameter has. Between knots the term is linear, as in a rig file.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...base.arrays import FloatArray
from ...rigs.table_law import TableLaw
from .parameters import Parameter

# Length l of the prior, in knots: a law bends a few times at most.
LENGTH = 3.0
# Share of s^2 that keeps the covariance of close knots regular; no law is known to a thousandth.
NUGGET = 1e-6


@dataclass(frozen=True, eq=False)
class Law:
    """Table of K values that a fit determines.

    Attributes
    ----------
    adds_to, of
        equation and variable, as `TableLaw` has them.
    knots
        shape (K,), rising.
    size
        standard deviation s of the values by the prior, in the unit of the equation.
    suffix
        end of the name, where the rig has a table of the same name already.
    """

    adds_to: str
    of: str
    knots: FloatArray
    size: float
    suffix: str = ""

    @property
    def name(self) -> str:
        """Name of its table in a rig file."""
        return f"{self.adds_to}_of_{self.of}{self.suffix}"

    @cached_property
    def basis(self) -> FloatArray:
        """Cholesky factor L of the covariance of the prior, shape (K, K): the values are L z."""
        place = np.arange(self.knots.size)
        a = math.sqrt(5.0) * np.abs(place[:, np.newaxis] - place) / LENGTH
        covariance = self.size**2 * (
            (1.0 + a + a * a / 3.0) * np.exp(-a) + NUGGET * np.eye(self.knots.size)
        )
        return np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)

    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters z."""
        return tuple(
            Parameter(f"{self.name}[{k}]", False, 0.0, 1.0, -math.inf, math.inf)
            for k in range(self.knots.size)
        )

    def table(self, z: FloatArray) -> TableLaw:
        """The table of a rig file with the values of the parameters z, shape (K,)."""
        values = self.basis @ z
        return TableLaw(self.adds_to, self.of, tuple(self.knots.tolist()), tuple(values.tolist()))


def block_basis(laws: Sequence[Law]) -> FloatArray:
    """Factors of all laws in one matrix, shape (T, T): their values are its product with all z."""
    count = sum(law.knots.size for law in laws)
    basis, first = np.zeros((count, count)), 0
    for law in laws:
        end = first + law.knots.size
        basis[first:end, first:end] = law.basis
        first = end
    return basis
