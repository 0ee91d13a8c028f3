# SPDX-License-Identifier: MIT
"""What the caller of `read_record` asks for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..catalogue.channels import CHANNELS, TIME
from .layout import Layout, layout_of, names_in_file
from .origin import Hints


@dataclass(frozen=True)
class Wish:
    """The parameters of `read_record`; `required` is never None here."""

    columns: Sequence[str] | None
    required: tuple[str, ...]
    layout: Layout
    hints: Hints

    def is_met_by(self, file_names: Sequence[str], path: Path) -> bool:
        """Whether a file has all required columns, and the mapped ones, under the names asked for.

        Raises
        ------
        RecordError
            two columns of the file would get the same name.
        """
        layout = layout_of(file_names, self.layout)
        names = names_in_file(file_names, layout, path)
        requested = self.requested(names)
        needed = (*self.required, *(name for name in layout if name in requested))
        if any(self._log_has_unit(names, layout, name) for name in layout):
            return False
        return all(
            names.get(name) == (layout[name].name if name in layout else name) for name in needed
        )

    def _log_has_unit(self, names: Mapping[str, str], layout: Layout, channel: str) -> bool:
        """Whether a column without a unit in the layout has one in its name, not the schema's."""
        if layout[channel].unit is not None or channel not in self.requested(names):
            return False
        from .logs.names import unit_in_name, unknown_unit

        name = layout[channel].name
        unit = unit_in_name(name, channel) or unknown_unit(name, channel)
        return unit is not None and unit != CHANNELS[channel].unit

    def requested(self, names: Mapping[str, str]) -> set[str]:
        """Returns the columns to read of a file with the columns `names`."""
        if self.columns is None:
            return {*names, *self.layout}
        return {*self.columns, *self.required, TIME}

    @property
    def time_name(self) -> str:
        """Name of the column of time in the file, as the layout has it."""
        return self.layout[TIME].name if TIME in self.layout else TIME
