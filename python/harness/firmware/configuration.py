# SPDX-License-Identifier: MIT
"""All settings of a float32 estimator, the single source of the Python object and the header."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

import ehsid

from ..base.numbers import FloatArray
from ..models.identification import ArxOrders, IdentificationError


@dataclass(frozen=True, eq=False)
class Seed:
    """Initial estimate of an estimator with n parameters."""

    theta: FloatArray
    """Parameters, shape (n,), in the units of the signals about the offsets of the scaling."""
    u: FloatArray
    d: FloatArray
    """Factors of the covariance P = u diag(d) u' of the scaled parameters, in units of sigma^2; u
    has shape (n, n) and is unit upper triangular, d has shape (n,) and is > 0."""
    noise_variance: float
    """sigma^2 in squared units of the position, >= 0; 0 if it is unknown."""

    @classmethod
    def from_covariance(
        cls, theta: npt.ArrayLike, covariance: npt.ArrayLike, noise_variance: float
    ) -> Seed:
        """Factors a covariance P in double precision and returns the seed.

        In float32 it would not always be possible to distinguish P from a singular matrix.

        Parameters
        ----------
        theta
            parameters, shape (n,), in the units of the signals.
        covariance
            P, shape (n, n), of the scaled parameters in units of sigma^2; positive definite.
        noise_variance
            sigma^2 in squared units of the position.

        Raises
        ------
        IdentificationError
            P is not positive definite.
        """
        # In reversed order of rows and columns, P = L L' becomes P = R R' with R upper triangular.
        turned = np.asarray(covariance, dtype=np.float64)[::-1, ::-1]
        try:
            r = np.linalg.cholesky(turned)[::-1, ::-1]
        except np.linalg.LinAlgError as error:
            raise IdentificationError(
                "the covariance to start from is not positive definite: the record does not "
                "determine all parameters; excite more or take a lower order"
            ) from error
        size = np.diag(r)
        u = np.triu(r / size, 1) + np.eye(size.size)
        return cls(np.asarray(theta, dtype=np.float64), u, size**2, noise_variance)

    @property
    def variances(self) -> FloatArray:
        """Diagonal of P, shape (n,)."""
        return (self.u**2) @ self.d


@dataclass(frozen=True, eq=False)
class EstimatorConfiguration:
    """Complete configuration of a float32 estimator before its first sample.

    The numbers are double precision. They are rounded once to float32, both in the Python estimator
    and in the header.

    Attributes
    ----------
    scaling, forgetting, rls, convergence
        settings as `ehsid.ArxEstimator` takes them.
    """

    orders: ArxOrders
    """Structure of the ARX model; na, nb up to 6, nk up to 20."""
    scaling: ehsid.Scaling = field(default_factory=ehsid.Scaling)
    forgetting: ehsid.Forgetting = field(default_factory=ehsid.FRatio)
    rls: ehsid.RlsOptions = field(default_factory=ehsid.RlsOptions)
    reset: ehsid.RmseResetOptions | None = field(default_factory=ehsid.RmseResetOptions)
    """Settings of the reset; with None the estimator never resets."""
    convergence: ehsid.ConvergenceOptions = field(default_factory=ehsid.ConvergenceOptions)
    variance0: float = 1e6
    """Diagonal of the P that a reset restores, of the scaled parameters, in units of sigma^2."""
    input_limit: float = 1e4
    """Largest plausible absolute value of a scaled signal."""
    seed: Seed | None = None
    """Initial estimate; with None the estimator starts from zero and `variance0`."""

    def estimator(self) -> ehsid.ArxEstimator:
        """Returns a new float32 estimator with these settings, before its first sample.

        Raises
        ------
        ValueError
            the structure is outside the compiled range, or a number is outside its range in
            float32.
        """
        made = ehsid.ArxEstimator(
            self.orders.na,
            self.orders.nb,
            self.orders.nk,
            offset=self.orders.offset,
            forgetting=self.forgetting,
            scaling=self.scaling,
            rls=self.rls,
            reset=self.reset,
            convergence=self.convergence,
            variance0=[self.variance0] * self.orders.n_parameters,
            input_limit=self.input_limit,
            dtype="float32",
        )
        if self.seed is not None:
            made.seed(self.seed.theta, self.seed.u, self.seed.d, self.seed.noise_variance)
        return made
