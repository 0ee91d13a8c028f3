# SPDX-License-Identifier: MIT
"""The twin of a machine, as a diagnosis found it, with a share of a named effect left.

Nothing is fitted: all other values stay as they were found. A share s of the size of an effect
makes c s^power of a parameter c, with the power by which the outputs depend on it; of a lag with
half of its size the bandwidth is twice as high.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import ehsid

from ...base.numbers import FloatArray
from ...catalogue.parameters import effects as catalogue
from ...catalogue.spellings import effect_values, sizes_of
from ...records import Record
from ...records.errors import nearest_name
from ...rigs import Rig, read_rig
from ..data.floor import machine_floor
from ..deciding import EVIDENCE
from ..model.comparison import compare, varying_outputs
from ..model.differences import SimulatorEngine
from ..model.parameters import Parameter
from ..model.problem import Problem
from ..schema import WINDOW_S, DiagnosisFile, read_diagnosis_file
from ..search.candidates import DECISION_SUBSTEPS
from ..search.gap_reduction import WindowSums, window_sums

Shares = Mapping[str, float]
# The largest share that is looked at: an effect may also have grown.
MOST_SHARE = 2.0


@dataclass(frozen=True)
class Twin:
    """A machine as a diagnosis found it; at least one effect is named."""

    origin: str
    """What it was read from."""
    rig: Rig
    """With the values and effects that were found."""
    file: DiagnosisFile

    def __post_init__(self) -> None:
        if not self.named:
            raise ValueError(
                f"{self.origin}: the verdict is {self.file.verdict}, and no effect is named: "
                "expected a diagnosis that names what can be taken away; diagnose the record after "
                "the change as well, and compare the two"
            )

    @property
    def named(self) -> tuple[str, ...]:
        """Ids of the named effects, the most probable first."""
        return tuple(effect.id for effect in self.file.which.effects)

    @property
    def own_gap(self) -> float:
        """Gap that the twin left on the held-out record of its diagnosis, nrmse."""
        return self.file.how_far.augmented

    def sizes(self, shares: Shares) -> dict[str, float]:
        """Returns the parameters of all named effects by full name, with these shares left."""
        values: dict[str, float] = {}
        for effect in self.named:
            sizes = sizes_of(effect, self.rig.values)
            values |= effect_values(effect, _sized(effect, sizes, shares.get(effect, 1.0)))
        return values

    def relative_error(self, effects: Sequence[str]) -> float:
        """Half of the largest 90 % interval of the found sizes, as a share of them."""
        largest = 0.0
        for one in self.file.which.effects:
            for parameter in catalogue()[one.id].parameters:
                size = one.parameters.get(parameter.name)
                if one.id in effects and size is not None and parameter.power and size.value:
                    whole = (size.value - parameter.neutral) * parameter.power
                    half = 0.5 * abs((size.high - size.low) / whole) if whole else 0.0
                    largest = max(largest, half if math.isfinite(half) else 0.0)
        return largest


def _sized(effect: str, sizes: Mapping[str, float], share: float) -> dict[str, float]:
    """Sizes of an effect of which a share is left; without any of it they are 0, which is off."""
    made = {}
    for parameter in catalogue()[effect].parameters:
        size = sizes[parameter.name]
        if share > 0.0 and share != 1.0:
            size = parameter.neutral + (size - parameter.neutral) * share**parameter.power
        if share == 0.0 or (parameter.power < 0.0 and size > parameter.maximum):
            return dict.fromkeys(sizes, 0.0)
        made[parameter.name] = min(max(size, parameter.minimum), parameter.maximum)
    return made


def read_twin(folder: Path) -> Twin:
    """Reads the folder of a diagnosis.

    Raises
    ------
    ValueError
        a file cannot be read, or the diagnosis names nothing.
    OSError
        a file cannot be read.
    """
    path = folder / "diagnosis.json"
    if not path.is_file():
        raise ValueError(
            f"{folder}: has no diagnosis.json: expected the folder of `ehsid gap --out`; name it, "
            "and then the records after the change"
        )
    return Twin(str(folder), read_rig(folder / "rig.augmented.toml"), read_diagnosis_file(path))


def parse_edits(texts: Sequence[str], twin: Twin) -> tuple[dict[str, float], ...]:
    """Returns the edits that a user asks for, each as the shares that are left by effect.

    Parameters
    ----------
    texts
        ID or ID=SHARE, all of one edit; without any, each named effect is removed alone, and then
        all of them together.

    Raises
    ------
    ValueError
        an effect is not among the named ones, or a share is no number from 0 to 2.
    """
    if not texts:
        alone = tuple({effect: 0.0} for effect in twin.named)
        return (*alone, dict.fromkeys(twin.named, 0.0)) if len(alone) > 1 else alone
    edit = {}
    for text in texts:
        effect, _, share = text.partition("=")
        if effect not in twin.named:
            near = nearest_name(effect, twin.named)
            hint = f"; did you mean '{near}'?" if near else ""
            raise ValueError(
                f"--effect '{effect}': {twin.origin} does not name it: expected one of "
                f"{', '.join(twin.named)}{hint}"
            )
        try:
            edit[effect] = float(share or 0.0)
        except ValueError:
            edit[effect] = math.nan
        if not 0.0 <= edit[effect] <= MOST_SHARE:
            raise ValueError(
                f"--effect '{text}': expected the share of the size that is left, 0, removed, to "
                f"{MOST_SHARE:g}; write {effect}=0.5 for half of it"
            )
    return (edit,)


@dataclass(frozen=True, eq=False)
class Simulated:
    """What a twin leaves on the new records."""

    outputs: Sequence[Mapping[str, FloatArray]]
    """For each record the simulated outputs by name, shape (N,)."""
    sums: WindowSums
    nats: float
    """Evidence against it, up to a constant: EVIDENCE times the mean of ln(errors / tolerated), as
    the decision of a diagnosis counts it."""

    @property
    def per_output(self) -> dict[str, float]:
        """Gap by output, nrmse as the contract has it."""
        return {
            name: math.sqrt(float(error.sum() / self.sums.spread[name].sum()))
            for name, error in self.sums.error.items()
        }

    @property
    def gap(self) -> float:
        """Mean gap of the outputs."""
        return float(np.mean(list(self.per_output.values())))


class Comparison:
    """New records of a machine beside its twin.

    Parameters
    ----------
    twin
        as found.
    records
        after the change, each one stretch with a sampling time.
    engine
        runs of the simulator of the rig, where that is not ours.

    Raises
    ------
    ValueError
        a record cannot be compared, or no compared output of the diagnosis moves by more than its
        noise in all records.
    """

    def __init__(
        self, twin: Twin, records: Sequence[Record], engine: SimulatorEngine | None = None
    ) -> None:
        settings = twin.file.provenance.settings
        all_states = settings.get("reset") == "estimate"
        self.twin = twin
        self.compared = [
            compare(
                record,
                window_s=float(settings.get("window_s", WINDOW_S)),
                all_states=all_states,
                caught=None if engine is None else engine.first_catch_s,
            )
            for record in records
        ]
        wanted = [
            name
            for name in settings.get("outputs", ())
            if all(name in one.outputs for one in self.compared)
        ]
        floors = {name: machine_floor(records, name, twin.rig).value for name in wanted}
        moving = [varying_outputs(one, floors) for one in self.compared]
        self.outputs = tuple(name for name in wanted if all(name in names for names in moving))
        if not self.outputs:
            raise ValueError(
                f"{records[0].source or records[0].name}: nothing to compare: expected a record "
                f"with one of {', '.join(settings.get('outputs', ()))} that moves by more than its "
                "noise; record it with an excitation"
            )
        self.floors = {name: floors[name] for name in self.outputs}
        self._values = twin.sizes({})
        removed = np.array(list(twin.sizes(dict.fromkeys(twin.named, 0.0)).values()))
        parameters = [
            Parameter(name, False, value, math.inf, -math.inf, math.inf)
            for name, value in self._values.items()
        ]

        def problem(substeps: int) -> Problem:
            return Problem(
                twin.rig,
                self.compared,
                parameters,
                outputs=self.outputs,
                floors=self.floors,
                substeps=substeps,
                swinging=all_states,
                engine=engine,
            )

        # An edited twin may swing faster than it did as found.
        substeps = 1 if engine is not None else DECISION_SUBSTEPS
        if engine is None:
            first, dt_s = problem(substeps), max(one.dt_s for one in self.compared)
            for x in (first.centres(), removed):
                values = first.plant_values(x)[: twin.rig.plant_values().size]
                substeps = max(substeps, ehsid.plant_substeps(twin.rig.plant, values, dt_s))
        self._problem = problem(substeps)
        self._count = sum(one.counts.sum() for one in self._problem.likelihoods.values())

    def simulate(self, shares: Shares) -> Simulated:
        """Simulates the twin on the records, with these shares of the named effects left."""
        x = np.array(list(self.twin.sizes(shares).values()))
        outputs = self._problem.simulate(x)
        cost = self._problem.fit_cost(self._problem.coefficients_of(outputs))
        sums = window_sums(self.compared, outputs, self.outputs)
        return Simulated(outputs, sums, EVIDENCE * cost / float(self._count))

    def floor(self, reached: Simulated) -> float:
        """Noise floor of the records as nrmse, mean of the outputs."""
        samples = reached.sums.count.sum()
        return float(
            np.mean(
                [
                    floor * math.sqrt(samples / reached.sums.spread[name].sum())
                    for name, floor in self.floors.items()
                ]
            )
        )
