# SPDX-License-Identifier: MIT
"""Structure of an ARX model: orders and delay."""

from __future__ import annotations

from dataclasses import dataclass

from .errors import IdentificationError


@dataclass(frozen=True)
class ArxOrders:
    """Structure of A(q^-1) y(k) = q^-nk B(q^-1) u(k) + e(k), Ghazali et al. 2011, Eq. (7).

    Attributes
    ----------
    na
        number of output coefficients a1..a_na, at least 1.
    nb
        number of input coefficients b1..b_nb, at least 1.
    nk
        delay in samples, at least 0; b1 multiplies u(k - nk).
    offset
        whether the model has a constant term.
    """

    na: int
    nb: int
    nk: int = 1
    offset: bool = False

    def __post_init__(self) -> None:
        if self.na < 1 or self.nb < 1 or self.nk < 0:
            raise IdentificationError(
                f"na = {self.na}, nb = {self.nb}, nk = {self.nk}: na and nb must be at least 1 "
                "and nk at least 0"
            )

    @property
    def n_parameters(self) -> int:
        """Number of parameters, the length of theta."""
        return self.na + self.nb + int(self.offset)

    @property
    def n_history(self) -> int:
        """Number of samples before k that the regressor of sample k needs."""
        return max(self.na, self.nk + self.nb - 1)

    @property
    def names(self) -> tuple[str, ...]:
        """Parameter names in the order of theta: a1.., b1.., offset."""
        return (
            *(f"a{i}" for i in range(1, self.na + 1)),
            *(f"b{i}" for i in range(1, self.nb + 1)),
            *(("offset",) if self.offset else ()),
        )

    def __str__(self) -> str:
        equal = f"na = nb = {self.na}"
        orders = equal if self.na == self.nb else f"na = {self.na}, nb = {self.nb}"
        return f"{orders}, nk = {self.nk}" + (", offset" if self.offset else "")
