# SPDX-License-Identifier: MIT
"""Sizes of an effect from the factors of its trials in the residuals of equations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ehsid import EffectInfo
from ehsid.harness.arrays import FloatArray


def scaled(
    effect: EffectInfo, columns: Sequence[Mapping[str, float]], factors: FloatArray
) -> dict[str, float]:
    """Returns the sizes of an effect at the factors of its columns.

    A residual is proportional to c if a parameter is proportional to c^power. Parameters with the
    power one are summed over the columns. A parameter of the form of a law (power zero) keeps its
    value.

    Parameters
    ----------
    effect
        the effect.
    columns
        sizes of each column, by the effect's own names.
    factors
        factor of each column, shape (columns,).
    """
    power = {parameter.name: parameter.power for parameter in effect.parameters}
    sizes: dict[str, float] = {}
    for column, factor in zip(columns, factors.tolist(), strict=True):
        for name, size in column.items():
            if power[name] == 0.0:
                sizes[name] = size
            elif power[name] == 1.0:
                sizes[name] = sizes.get(name, 0.0) + factor * size
            else:
                sizes[name] = size * factor ** power[name] if factor > 0.0 else -1.0
    return sizes
