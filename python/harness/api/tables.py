# SPDX-License-Identifier: MIT
"""Columns into frames of polars and pandas, and out of them.

How results show themselves: in a line, in a notebook, and at length.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from ..base.error_words import printable
from ..show import rendering
from ..show.page import Table, Told
from .wording import in_python_words

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
    """Returns the columns of a mapping or of a frame.

    An index of pandas with a name or with dates is a column, too.

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
    columns: dict[str, npt.ArrayLike] = {
        str(name): _values(source[name]) for name in source.columns
    }
    index = getattr(source, "index", None)
    named, dated = getattr(index, "name", None), getattr(index, "dtype", None)
    if named is None and getattr(dated, "kind", "") in ("m", "M"):
        named = "time"
    return columns if named is None else {str(named): _values(index)} | columns


def _values(series: Any) -> npt.NDArray[Any]:
    """Returns the values of a column; moments with a time zone, which numpy lacks, in UTC."""
    if getattr(series.dtype, "tz", None) is not None:
        return np.asarray(series, dtype="datetime64[ns]")
    return np.asarray(series.to_numpy())


class Tabular(ABC):
    """A result with columns of equal length."""

    @abstractmethod
    def _columns(self) -> Mapping[str, npt.ArrayLike]:
        """Returns the columns by name."""

    def to_polars(self) -> pl.DataFrame:
        """Returns the columns as a DataFrame of polars.

        Raises
        ------
        ModuleNotFoundError
            polars is not installed.
        """
        frame: pl.DataFrame = self._frame("polars", "pandas")
        return frame

    def to_pandas(self) -> pd.DataFrame:
        """Returns the columns as a DataFrame of pandas.

        Raises
        ------
        ModuleNotFoundError
            pandas is not installed.
        """
        frame: pd.DataFrame = self._frame("pandas", "polars")
        return frame

    def _frame(self, package: str, other: str) -> Any:
        try:
            frames = import_module(package)
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(
                f"to_{package}() needs the package {package}, which is not installed: install it "
                f"with pip install {package}, or take to_{other}()",
                name=error.name,
            ) from None
        return frames.DataFrame(dict(self._columns()))


def time_column(dt_s: float | None, index: npt.NDArray[Any]) -> dict[str, npt.NDArray[Any]]:
    """Returns the column of time in seconds of samples, or of their numbers without dt_s."""
    return {"sample": index} if dt_s is None else {"time_s": index * dt_s}


class Shown(ABC):
    """A result with a line and blocks; what they hold comes from the harness."""

    @abstractmethod
    def _line(self) -> str:
        """Returns the main figures with their units, for one line."""

    @abstractmethod
    def _blocks(self) -> Sequence[Told]:
        """Returns tables and sentences; a notebook shows the first table."""

    def __repr__(self) -> str:
        # A name may have a line end; this is one line whatever it has. The spaces between numbers
        # and units, which keep them together on a page, are plain ones here.
        line = printable(self._line()).replace("\n", "\\n").replace("\N{NO-BREAK SPACE}", " ")
        return f"<ehsid.{type(self).__name__}: {line}>"

    def _repr_html_(self) -> str:
        """Returns the line and the first table for a notebook, in the colours of its page."""
        name = type(self).__name__
        line = escape(printable(self._line()))
        tables = [block for block in self._blocks() if isinstance(block, Table)]
        first = "".join(map(rendering.notebook, tables[:1]))
        return f"<div><p><strong>{name}</strong> {line}</p>{first}</div>"

    def summary(self) -> str:
        """Returns the result at length as plain text: the tables, and then the sentences."""
        blocks = sorted(self._blocks(), key=lambda block: not isinstance(block, Table))
        return in_python_words(rendering.text(blocks))
