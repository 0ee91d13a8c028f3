# SPDX-License-Identifier: MIT
"""The case of a diagnosis: a rig, training records and held-out records."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from scipy.signal import welch

import ehsid

from ...base.numbers import FloatArray
from ...catalogue.channels import CHAMBER_PRESSURES
from ...catalogue.parameters import effects as catalogue
from ...records import Record
from ...rigs import Rig
from ..data.floor import NoiseFloor, machine_floor
from ..options import Effort
from ..schema import WINDOW_S
from . import between_samples
from .comparison import Blocks, Compared, compare, varying_outputs
from .differences import SimulatorEngine
from .fit import SUBSTEPS
from .parameters import Law, Parameter, calibration_parameters, effect_parameters
from .problem import Problem
from .scale import effect_starts
from .spectrum import BANDS
from .unlogged import BETWEEN, LONGEST, Whitening
from .unsteadiness import unsteady_friction_power

# A record is a limit cycle where more than the share MOSTLY_SWINGS of the power of its pressure
# (without pressures: of its speed) lies above SWING_HZ, which commands do not reach. It is compared
# in windows of a few periods.
SWING_HZ = 25.0
MOSTLY_SWINGS = 0.7
WINDOW_SWINGING_S = 0.1
# With fewer samples in a window, nothing is left after its mean is subtracted.
LEAST_WINDOW_SAMPLES = 10


@dataclass(frozen=True, eq=False)
class Case:
    """All inputs of a fit; they are the same for all candidates."""

    rig: Rig
    """The rig as configured in the rig file."""
    training: tuple[Record, ...]
    held_out: tuple[Record, ...]
    """Records to fit and held-out records; all of them have the compared outputs."""
    outputs: tuple[str, ...]
    """Names of the compared outputs: those that vary by more than noise in every record."""
    left_out: tuple[str, ...]
    """Names of the outputs that all records have but that are not compared."""
    floors: Mapping[str, NoiseFloor]
    """Noise floor by output: the largest over the training records."""
    substeps: int = SUBSTEPS
    """Integration steps per sample."""
    blocks: bool = False
    """True if training and held-out data are different blocks of the same records."""
    window_s: float = WINDOW_S
    all_states: bool = False
    """Length of the windows in s, and which states are reset in each window, as in `compare`."""
    held: Mapping[str, float] = field(default_factory=dict)
    """Values of parameters of effects that are not fitted, by full name."""
    effort: Effort = "full"
    """How many fits the search makes."""
    engine: SimulatorEngine | None = None
    """Runs of the simulator of the rig; None where that is ours."""
    unknown: Mapping[bool, Mapping[str, FloatArray]] = field(default_factory=dict)
    """Further power that is tolerated, by output, of the fitted (False) and the held-out data."""
    unlogged: Mapping[Record, Whitening] = field(default_factory=dict)
    """Whitening of the errors for commands that nobody logged, by record; empty without them."""
    prepared: dict[tuple[Record, float, bool, Blocks], Compared] = field(default_factory=dict)
    """Results of `compare` so far, which the fits of all candidates share."""

    @property
    def commands_are_missing(self) -> bool:
        """Whether commands of the controller count that nobody logged."""
        return bool(self.unlogged) or any(self.unknown.values())

    @property
    def records(self) -> tuple[Record, ...]:
        """All records, each of them once."""
        return self.training if self.blocks else (*self.training, *self.held_out)

    @property
    def pressures(self) -> bool:
        """Whether the pressure of at least one chamber is compared."""
        return any(name in CHAMBER_PRESSURES for name in self.outputs)

    def parameters(self, effects: Sequence[str] = ()) -> tuple[Parameter, ...]:
        """Parameters of the calibration, then those of the effects in the given order."""
        parameters = list(calibration_parameters(self.rig, pressures=self.pressures))
        for effect in effects:
            # The effect replaces its nuisances. They are held but keep their places in x.
            nuisances = (catalogue()[effect].nuisance or "").split()
            parameters = [p.held() if p.name in nuisances else p for p in parameters]
            start = effect_starts(effect, self.rig)[0]
            parameters += [
                parameter for parameter, _ in effect_parameters(effect, start, self.rig.plant)
            ]
        return tuple(
            replace(p, centre=p.place(self.held[p.name])).held() if p.name in self.held else p
            for p in parameters
        )

    def problem(
        self,
        effects: Sequence[str] = (),
        *,
        window_s: float | None = None,
        held_out: bool = False,
        all_states: bool | None = None,
        white: bool = False,
        laws: Sequence[Law] = (),
    ) -> Problem:
        """Returns the cost of calibration and effects; by default in the windows of the case."""
        window_s = self.window_s if window_s is None else window_s
        all_states = self.all_states if all_states is None else all_states
        records = self.held_out if held_out else self.training
        blocks: Blocks = ("held out" if held_out else "fit") if self.blocks else "all"
        compared = [self._compared(record, window_s, all_states, blocks) for record in records]
        as_usual = window_s == self.window_s and all_states == self.all_states
        whitening = [self.unlogged[record] for record in records] if self.unlogged else []
        return Problem(
            self.rig,
            compared,
            self.parameters(effects),
            outputs=self.outputs,
            floors={name: floor.value for name, floor in self.floors.items()},
            substeps=self.substeps,
            white=white,
            swinging=self.all_states,
            laws=laws,
            engine=self.engine,
            unknown=self.unknown.get(held_out) if window_s == self.window_s else None,
            unlogged=[one.of(each) for one, each in zip(whitening, compared, strict=True)]
            if whitening and as_usual
            else (),
        )

    def together(self) -> Case:
        """The case with all data fitted, and none held out."""
        nothing = np.zeros(BANDS)
        # A mean power of single commands, which is the same in both parts but for chance.
        fitted, held_out = (self.unknown.get(part, {}) for part in (False, True))
        unknown = {
            name: 0.5 * (fitted.get(name, nothing) + held_out.get(name, nothing))
            for name in {*fitted, *held_out}
        }
        return replace(
            self,
            training=self.records,
            held_out=(),
            blocks=False,
            unknown={False: unknown},
        )

    def as_logged(self) -> Case:
        """The case as if the controller had sent what was logged, and nothing else."""
        held = {name: x for name, x in self.held.items() if name != BETWEEN}
        return replace(self, unlogged={}, unknown={}, held=held)

    def with_unlogged_commands(
        self,
        effects: Sequence[str],
        x: FloatArray,
        move: float | None = None,
        held: Collection[Record] | None = None,
    ) -> Case:
        """The case with what the records do not tell of the command between their samples.

        The errors are whitened for it, about this fit, and what that leaves is tolerated. Where a
        window has more than `LONGEST` samples, all that such commands do is tolerated.

        Parameters
        ----------
        effects, x
            the set that leaves least, and its fit.
        move
            of the mean course, 0 to 1; None: as the fit tells, and the same case where it is none.
        held
            records in which the command is held; None: as in this case.
        """
        if self.engine is not None:
            return self
        if move is None:
            move = between_samples.mean_move_of(self.parameters(effects), x)
        if move is None:
            return self
        as_logged = self.as_logged()
        if held is None:
            held = [record for record, each in self.unlogged.items() if not each.moves]
        power = partial(between_samples.unknown_command_power, move=move, held=held)
        tolerating = self if self.unlogged else as_logged._tolerating(power, effects, x)
        if not tolerating.commands_are_missing:
            return self  # the log is fast enough
        whole = replace(as_logged, training=self.records, blocks=False).problem(effects)
        if max(record.full_windows[1] for record in whole.records) > LONGEST:
            return tolerating
        whitenings = between_samples.whitenings(whole, x, move, held)
        return replace(
            as_logged,
            unlogged=dict(zip(self.records, whitenings, strict=True)),
            held={**as_logged.held, BETWEEN: move},
        )._tolerating(power, effects, x)

    def with_unsteady_friction(self, effects: Sequence[str], x: FloatArray) -> Case:
        """The case with what no simulator tells of a rod with friction tolerated.

        effects, x: the set whose friction it is, and its fit.
        """
        return self._tolerating(unsteady_friction_power, effects, x)

    def _tolerating(
        self,
        power: Callable[[Problem, FloatArray], Mapping[str, FloatArray]],
        effects: Sequence[str],
        x: FloatArray,
    ) -> Case:
        if self.engine is not None:
            return self
        unknown, nothing = {}, np.zeros(BANDS)
        for held_out in (False, True):
            further = power(self.problem(effects, held_out=held_out), x)
            before = self.unknown.get(held_out, {})
            unknown[held_out] = {
                name: before.get(name, nothing) + further.get(name, nothing)
                for name in {*before, *further}
            }
        return replace(self, unknown=unknown)

    def _compared(
        self, record: Record, window_s: float, all_states: bool, blocks: Blocks
    ) -> Compared:
        key = record, window_s, all_states, blocks
        if key not in self.prepared:
            self.prepared[key] = compare(
                record,
                window_s=window_s,
                all_states=all_states,
                blocks=blocks,
                caught=None if self.engine is None else self.engine.first_catch_s,
            )
        return self.prepared[key]


def make_case(
    rig: Rig,
    training: Sequence[Record],
    held_out: Sequence[Record] = (),
    engine: SimulatorEngine | None = None,
    effort: Effort = "full",
) -> Case:
    """Selects the compared outputs, their noise floors, the integration steps and the windows.

    If there are no held-out records, blocks of the training records are held out instead. engine:
    runs of the simulator of the rig, where that is not ours. effort: see `DiagnosisOptions`.

    Raises
    ------
    ValueError
        there is no training record, a record cannot be compared, or no common output varies by
        more than its noise.
    """
    blocks = not held_out
    records = [*training, *held_out]
    if not training:
        raise ValueError("the diagnosis needs a record")
    compared = [compare(record) for record in records]
    common = [
        name
        for name in compared[0].outputs
        if all(name in record.outputs for record in compared)
        and (engine is None or name in engine.runs.section.outputs)
    ]
    floors = {name: machine_floor(training, name, rig) for name in common}
    values = {name: floor.value for name, floor in floors.items()}
    varying = [set(varying_outputs(record, values)) for record in compared]
    outputs = tuple(name for name in common if all(name in names for names in varying))
    if not outputs:
        raise ValueError("no output moves by more than its noise: there is nothing to compare")
    left_out = tuple(name for name in common if name not in outputs)
    compared_floors = {name: floors[name] for name in outputs}
    dt_s = max(record.dt_s for record in compared)
    substeps, windows = 1, (WINDOW_S, False)
    if engine is None:
        substeps = max(SUBSTEPS, ehsid.plant_substeps(rig.plant, rig.plant_values(), dt_s))
        windows = _windows(records)
    return Case(
        rig,
        tuple(training),
        tuple(training if blocks else held_out),
        outputs,
        left_out,
        compared_floors,
        substeps,
        blocks,
        *windows,
        effort=effort,
        engine=engine,
    )


def _windows(records: Sequence[Record]) -> tuple[float, bool]:
    """Length of the windows in s, and whether each window starts from all measured states.

    The windows are short if all records show mainly a limit cycle. Half a second then holds so many
    periods that a slightly stiffer servo loses the phase, which hides all other errors.
    """
    if min(map(_swings, records)) > MOSTLY_SWINGS:
        return WINDOW_SWINGING_S, True
    return max(
        WINDOW_S, LEAST_WINDOW_SAMPLES * max(record.dt_s or 0.0 for record in records)
    ), False


def _swings(record: Record) -> float:
    """Share of the signal power above SWING_HZ, that is, above the frequencies of commands.

    The signal is the pressure in chamber A if it is measured, else the speed.
    """
    if "pressure_a_pa" in record.columns:
        signal = record.column("pressure_a_pa")
    else:
        signal = np.diff(record.column("position_m"))
    assert record.dt_s is not None
    length = min(signal.size, round(1.0 / record.dt_s))
    frequency, power = welch(signal, 1.0 / record.dt_s, nperseg=length)
    # White noise also has power in the upper band. It must not count as a limit cycle.
    power = np.maximum(power - 2.0 * np.median(power), 0.0)
    total = float(power.sum())
    return float(power[frequency > SWING_HZ].sum()) / total if total > 0.0 else 0.0
