# SPDX-License-Identifier: MIT
"""What can go wrong in an identification, as types a caller can tell apart."""

from __future__ import annotations


class IdentificationError(ValueError):
    """Data or settings with which the identification cannot be carried out."""


class TooFewSamplesError(IdentificationError):
    """The record, or a half of it, is too short for the orders asked for."""


class UnexcitedError(IdentificationError):
    """The regression matrix is rank-deficient: the data do not determine all parameters.

    Attributes
    ----------
    parameters
        names of the parameters that the data do not determine.
    why
        what the data lack.
    """

    def __init__(self, parameters: tuple[str, ...], why: str) -> None:
        self.parameters = parameters
        self.why = why
        super().__init__(f"the data do not determine {', '.join(parameters)}: {why}")
