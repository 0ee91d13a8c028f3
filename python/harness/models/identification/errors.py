# SPDX-License-Identifier: MIT
"""Exceptions of the identification, one type for each cause that a caller may handle."""

from __future__ import annotations


class IdentificationError(ValueError):
    """The identification cannot be carried out with these data or settings."""


class TooFewSamplesError(IdentificationError):
    """The record, or one part of it, is too short for the requested orders."""


class UnexcitedError(IdentificationError):
    """The regression matrix is rank-deficient: the data do not determine all parameters.

    Attributes
    ----------
    parameters
        names of the parameters that the data do not determine.
    why
        reason: what the data lack.
    """

    def __init__(self, parameters: tuple[str, ...], why: str) -> None:
        self.parameters = parameters
        self.why = why
        super().__init__(f"the data do not determine {', '.join(parameters)}: {why}")
