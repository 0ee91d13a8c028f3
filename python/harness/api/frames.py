# SPDX-License-Identifier: MIT
"""Columns into frames of polars and pandas, and out of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl


class Frame(Protocol):
    """What a DataFrame of polars has in common with one of pandas."""

    @property
    def columns(self) -> Iterable[Any]:
        """Names of the columns."""

    def __getitem__(self, name: Any, /) -> Any: ...


Columns = Mapping[str, npt.ArrayLike] | Frame
"""Columns in memory: arrays by name, or a frame."""


def columns_of(source: Columns) -> dict[str, npt.ArrayLike]:
    """Returns the columns of a mapping or of a frame; a named index of pandas is one of them.

    Raises
    ------
    ValueError
        the source is neither of them, or two of its columns have the same name.
    """
    if isinstance(source, Mapping):
        return dict(source)
    if hasattr(source, "collect") or not hasattr(source, "columns"):
        raise ValueError(
            f"a {type(source).__name__} is no record: expected a path, a mapping of arrays by "
            "column name, or a DataFrame of polars or pandas (of a LazyFrame, collect() it first)"
        )
    names = [str(name) for name in source.columns]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise ValueError(
            f"the frame has two columns '{twice[0]}': expected one of each name; rename one"
        )
    index = getattr(source, "index", None)
    first = getattr(index, "name", None)
    indexed = {str(first): np.asarray(index)} if first is not None and first not in names else {}
    return indexed | {str(name): source[name].to_numpy() for name in source.columns}


class Tabular(ABC):
    """A result with columns of equal length."""

    @abstractmethod
    def _columns(self) -> Mapping[str, npt.ArrayLike]:
        """Returns the columns by name."""

    def to_polars(self) -> pl.DataFrame:
        """Returns the columns as a DataFrame of polars."""
        import polars as pl

        return pl.DataFrame(dict(self._columns()))

    def to_pandas(self) -> pd.DataFrame:
        """Returns the columns as a DataFrame of pandas.

        Raises
        ------
        ModuleNotFoundError
            pandas is not installed.
        """
        return pandas_frame(self._columns())


def pandas_frame(columns: Mapping[str, npt.ArrayLike]) -> pd.DataFrame:
    """Returns columns as a DataFrame of pandas.

    Raises
    ------
    ModuleNotFoundError
        pandas is not installed.
    """
    try:
        import pandas as pd
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            "to_pandas() needs the package pandas, which is not installed: install it with "
            "pip install pandas, or take to_polars()",
            name=error.name,
        ) from None
    return pd.DataFrame(dict(columns))


def time_column(dt_s: float | None, index: npt.NDArray[Any]) -> dict[str, npt.NDArray[Any]]:
    """Returns the column of time in seconds of samples, or of their numbers without dt_s."""
    return {"sample": index} if dt_s is None else {"time_s": index * dt_s}
