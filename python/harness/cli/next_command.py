# SPDX-License-Identifier: MIT
"""The command that usually follows, with the names that the user gave, to be copied."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..catalogue.channels import COMMAND, POSITION
from .console import Console, print_points

if TYPE_CHECKING:
    from ..models.identification import ArxOrders

# Of the estimator that is compiled: see the options --na, --nb and --nk.
MOST_ORDER, MOST_DELAY = 6, 20


@dataclass(frozen=True)
class Given:
    """What the user gave of a record: its file, the two columns, --map and --dt."""

    record: Path
    input_name: str
    output_name: str
    maps: Sequence[str] = ()
    sampling_time: float | None = None

    def words(self) -> list[str]:
        """Returns the file and the options that have no default value."""
        words = [os.fspath(self.record)]
        if self.input_name != COMMAND:
            words += ["--input", self.input_name]
        if self.output_name != POSITION:
            words += ["--output", self.output_name]
        for one in self.maps:
            words += ["--map", one]
        if self.sampling_time is not None:
            words += ["--dt", f"{self.sampling_time:.12g}"]
        return words


def estimate_line(given: Given, orders: ArxOrders) -> str:
    """Returns `ehsid estimate` with these orders; "" where the estimator does not take them."""
    if max(orders.na, orders.nb) > MOST_ORDER or orders.nk > MOST_DELAY:
        return ""
    return shlex.join(["ehsid", "estimate", *given.words(), *order_words(orders)])


def export_line(given: Given, orders: ArxOrders, settings: Sequence[str]) -> str:
    """Returns `ehsid export` with these orders and these options of the forgetting."""
    words = [*given.words(), *order_words(orders), *settings]
    return shlex.join(["ehsid", "export", *words, "--out", "servo_configuration.hpp"])


def print_next(line: str, console: Console) -> None:
    """Prints the command that usually follows on a line of its own; nothing without one."""
    if line:
        console.print("\nNext:")
        console.print(line, soft_wrap=True)


def print_tries(tries: Sequence[str], console: Console) -> None:
    """Prints what to try as a list; nothing where there is nothing to try."""
    if tries:
        console.print("\nWhat to try:")
    print_points(tries, console)


def order_words(orders: ArxOrders) -> list[str]:
    """Returns the orders as options."""
    offset = [] if orders.offset else ["--no-offset"]
    return ["--na", f"{orders.na}", "--nb", f"{orders.nb}", "--nk", f"{orders.nk}", *offset]
