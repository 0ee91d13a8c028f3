# SPDX-License-Identifier: MIT
"""The options that say where the tasks of a command run: in how many processes, or on a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated

import typer

from ..base.parallel import on_cluster
from ..base.parallel import workers as using

Workers = Annotated[int | None, typer.Option(min=1, help="processes; default: one for each core")]
Dask = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler: tcp://HOST:PORT")
]


@contextmanager
def on(cluster: str | None, workers: int | None) -> Iterator[None]:
    """Runs the tasks of its block on a Dask cluster, or in this number of processes.

    Raises
    ------
    ValueError
        both a cluster and a number of processes are given, or the cluster cannot be used.
    """
    if cluster is None:
        with using(workers):
            yield
        return
    if workers is not None:
        raise ValueError("--workers is of this machine: leave it away with --dask")
    with on_cluster(cluster):
        yield
