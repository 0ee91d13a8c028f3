# SPDX-License-Identifier: MIT
"""The description of a machine, as people handle it."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, SupportsFloat

from .. import rigs
from ..base.files import result_files, write_text
from ..rigs import parse_rig, read_rig, rig_text
from ..rigs.checks import unknown
from ..rigs.new import shown
from ..rigs.questions import QUESTIONS, Question, answered, read_answer, rig_file_text
from ..show.page import Table, Told
from .tables import Shown
from .wording import in_python


class Rig(Shown):
    """A machine for the simulator: values in SI units with their uncertainty.

    `Rig.read` reads a rig file, `Rig.new` makes a rig of what is on the name plates.

    Attributes
    ----------
    result
        the rig as the rooms of the harness have it, `ehsid.harness.rigs.Rig`.
    source
        file that it was read from; None for one made in memory.

    Examples
    --------
    >>> import ehsid
    >>> rig = ehsid.Rig.read("examples/rigs/bench.toml")
    >>> rig
    <ehsid.Rig: bench, plant ehs, 15 values, effects: valve_lag>
    >>> rig.with_values({"load.mass_kg": 150.0}).values["load.mass_kg"]
    150.0
    """

    def __init__(
        self, result: rigs.Rig, *, source: Path | None = None, text: str | None = None
    ) -> None:
        self.result = result
        self.source = source
        # What `save` writes: with the comments of `new`, which tell the origin of each value.
        self._text = rig_text(result) if text is None else text

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Rig:
        """Reads and checks a rig file.

        Raises
        ------
        ValueError
            the file has problems; the message lists all of them with key, value and what was
            expected.
        """
        return cls(read_rig(path), source=Path(path))

    @classmethod
    def new(
        cls,
        plant: Literal["ehs", "axis"] = "ehs",
        *,
        name: str = "rig",
        double_rod: bool = False,
        hoses: bool = False,
        drop_over: Literal["edge", "both"] = "edge",
        **answers: str | float,
    ) -> Rig:
        """Returns a rig of what is known; typical values fill the rest.

        Parameters
        ----------
        plant
            "ehs", valve and cylinder; or "axis", driven by the force of a motor.
        name
            of the machine.
        double_rod
            whether the rod is on both sides of the piston.
        hoses
            whether flexible hoses connect valve and cylinder.
        drop_over
            whether the rated drop was measured over one metering edge or over both.
        answers
            by the options of `ehsid rig new`, with underscores: texts with units, bore="63 mm",
            mass="120 kg +- 20 %"; or numbers in SI units, bore=0.063. The rated command in V, the
            oil as its ISO grade. For "ehs" bore, rod, stroke, supply and rated_flow are needed,
            for "axis" mass and force_gain.

        Raises
        ------
        ValueError
            an answer is unknown, missing, not to be read or a text without a unit, or the answers
            contradict each other.

        Examples
        --------
        >>> import ehsid
        >>> rig = ehsid.Rig.new(bore="63 mm", rod="35 mm", stroke="300 mm", supply="120 bar",
        ...                     rated_flow="38 l/min", name="press")
        >>> rig.values["cylinder.bore_m"]
        0.063
        """
        if plant not in QUESTIONS:
            raise ValueError(f"plant={plant!r}: expected one of {', '.join(QUESTIONS)}")
        if drop_over not in ("edge", "both"):
            raise ValueError(f"drop_over={drop_over!r}: expected 'edge' or 'both'")
        questions = {question.name.replace("-", "_"): question for question in QUESTIONS[plant]}
        known = list(questions)
        for given in answers:
            if given not in known:
                raise ValueError(
                    f"{unknown(given, known)}: a plant {plant!r} has {', '.join(known)}"
                )
        with in_python():
            entries = answered(
                plant,
                {
                    questions[given].name: _answer(plant, given, answer, questions[given])
                    for given, answer in answers.items()
                },
                double_rod=double_rod,
                hoses=hoses,
                drop_over_both=drop_over == "both",
            )
            text = rig_file_text(name, plant, entries)
        return cls(parse_rig(text, source=name), text=text)

    @property
    def name(self) -> str:
        """Name of the machine."""
        return self.result.name

    @property
    def plant(self) -> str:
        """Type of the plant: "ehs", "axis" or "linear", or "simulator", a program of yours."""
        return self.result.plant

    @property
    def values(self) -> Mapping[str, float]:
        """Values in SI units by full name, such as "load.mass_kg"."""
        return self.result.values

    def with_values(self, values: Mapping[str, float]) -> Rig:
        """Returns the rig with some values replaced or added, by full name, in SI units.

        Raises
        ------
        ValueError
            the plant does not have a name, a value is outside its range, or values contradict
            each other.
        """
        return Rig(self.result.with_values(values))

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the rig file and returns its path.

        Raises
        ------
        ValueError
            the file cannot be written, or there is one that ehsid did not write.
        """
        out = Path(path)
        with in_python(), result_files(out, "rig-new") as new:
            write_text(new / out.name, self._text)
        return out

    def _line(self) -> str:
        rig = self.result
        effects = ", ".join(rig.effects()) or "none"
        return f"{rig.name}, plant {rig.plant}, {len(rig.values)} values, effects: {effects}"

    def _blocks(self) -> Sequence[Told]:
        rig = self.result
        rows = [
            (name, f"{value:.6g}", shown(name, value), f"{100.0 * rig.sigma(name):.3g} %")
            for name, value in rig.values.items()
        ]
        values = Table("", ("value", "SI", "for people", "1-sigma"), rows)
        return [values, self._line(), "The value of each name is in SI; its ending has the unit."]


def _answer(plant: str, name: str, answer: object, question: Question) -> str:
    """Returns an answer as the command reads it: a number is in the unit of the rig file."""
    unit = {"command": "V", "grade": ""}.get(question.si, question.si)
    example = "'VG 46'" if question.si == "grade" else f"'50 {question.usual}'"
    expected = f"expected a text with its unit, such as {example}, or a number" + (
        f" in {unit}" if unit else ""
    )
    if isinstance(answer, str):
        if answer.strip() and read_answer(plant, question.name, answer).assumed:
            raise ValueError(f"{name}={answer!r}: {expected}; the unit is missing")
        return answer
    if isinstance(answer, bool) or not isinstance(answer, SupportsFloat):
        raise ValueError(f"{name}={answer!r}: {expected}")
    number = float(answer)
    if not math.isfinite(number):
        raise ValueError(f"{name}={answer!r}: {expected}, which is finite")
    return f"{number:.17g} {unit}".strip() if unit else f"{number:g}"


RigSource = str | os.PathLike[str] | Rig | rigs.Rig
"""What is taken for a rig: a path, or a rig."""


def rig_of(source: RigSource) -> Rig:
    """Returns a rig of whatever is taken for one.

    Raises
    ------
    ValueError
        the source is none; or as `Rig.read`.
    """
    if isinstance(source, Rig):
        return source
    if isinstance(source, rigs.Rig):
        return Rig(source)
    if isinstance(source, str | os.PathLike):
        return Rig.read(source)
    raise ValueError(f"a {type(source).__name__} is no rig: expected a path or an ehsid.Rig")
