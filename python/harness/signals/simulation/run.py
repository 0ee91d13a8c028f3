# SPDX-License-Identifier: MIT
"""Runs the simulator once and returns a record with an estimate of the integration error.

Makes a command so small that the rod stays inside its stroke.

Takes the command of a record to drive a rig.

Outputs of a simulated plant as columns of a record, optionally with sensor noise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

import ehsid

from ...base.numbers import FloatArray, masked_count
from ...catalogue.channels import CHANNELS, COMMAND
from ...catalogue.parameters import PLANTS
from ...catalogue.spellings import ParameterKey
from ...records import Record, make_record
from ...records.checks import mend_of_gaps, pieces_in_words
from ...rigs import Rig
from ...rigs.checks import check_relations, check_values
from ..excitation import travel
from .controller import command_limit, velocity_gain

# Of the way to an end of the stroke: the speed differs between the directions.
USED = 0.7


def inside_stroke(rig: Rig, command_v: FloatArray, dt_s: float) -> FloatArray:
    """Returns the command less its mean, and so small that the rod stays inside, V, shape (N,).

    `excitation.fit_to_travel` refuses a command that is too large; this is for those who choose a
    size by eye.

    Parameters
    ----------
    rig
        the machine, which starts at mid-stroke; one without a stroke leaves the command as it is.
    command_v
        the command as wished, V, shape (N,).
    dt_s
        sampling time in seconds.
    """
    stroke = rig.values.get("cylinder.stroke_m")
    if stroke is None:
        return command_v
    centred = np.asarray(command_v - np.mean(command_v), dtype=np.float64)
    start = 0.5 * stroke
    low, high = travel(centred, dt_s, velocity_gain(rig), start)
    farthest = max(start - low, high - start)
    return centred * min(1.0, USED * start / max(farthest, 1e-12))


# A logged command may be beyond the rated one, where the valve is fully open. One that is so far
# beyond it is in another unit.
MOST_COMMAND = 10


def logged_command(record: Record, rig: Rig) -> tuple[FloatArray, float]:
    """Returns the command of a record, V, shape (N,), and its sampling time in seconds.

    Raises
    ------
    ValueError
        the record has no command, has gaps or no time, or its command is far beyond the rated one.
    """
    place = record.source or record.name
    command = record.column(COMMAND)
    if record.dt_s is None:
        raise ValueError(f"{place}: a command without time cannot drive a rig; give its time")
    if len(record.segments) > 1:
        raise ValueError(
            f"{place}: a command with gaps cannot drive a rig: {pieces_in_words(record)}; "
            f"{mend_of_gaps(record)}"
        )
    largest, limit = float(np.abs(command).max()), command_limit(rig)
    if largest > MOST_COMMAND * limit:
        raise ValueError(
            f"{place}, column '{COMMAND}': the command reaches {largest:.4g} V: expected at most "
            f"{MOST_COMMAND} times the rated command of {limit:g} V; is the column in V?"
        )
    return command, record.dt_s


# Columns of the output arrays of ehsid.simulate_plant and ehsid.Plant.
OUTPUTS = ehsid.plant_outputs()
OUTPUTS_OF = MappingProxyType(
    {plant: tuple(name for name in OUTPUTS if plant in CHANNELS[name].plants) for plant in PLANTS}
)

QUANTISATION = ParameterKey.of_effect("sensor_quantisation", "step_m")


def columns_of(plant: str, outputs: FloatArray) -> dict[str, FloatArray]:
    """Selects the outputs that the plant has, by name, from an array of shape (N, 6)."""
    return {name: outputs[:, OUTPUTS.index(name)] for name in OUTPUTS_OF[plant]}


def noise_sigma(rig: Rig, output: str) -> float:
    """Standard deviation of the noise of an output in the rig file, in its unit; 0 for none."""
    key = CHANNELS[output].noise
    return 0.0 if key is None else rig.sensors.get(key, 0.0)


def draw_noise(rig: Rig, samples: int, rng: np.random.Generator) -> FloatArray:
    """Draws white Gaussian noise of the rig's sensors, shape (samples, 6), in output units.

    The noise of an output is zero where the rig file gives no standard deviation.
    """
    sigma = np.array([noise_sigma(rig, name) for name in OUTPUTS])
    return np.asarray(rng.standard_normal((samples, len(OUTPUTS))) * sigma, dtype=np.float64)


def as_measured(clean: FloatArray, noise: FloatArray, values: Mapping[str, float]) -> FloatArray:
    """Adds noise to the outputs, then quantises the position, in the order of a real sensor.

    Parameters
    ----------
    clean
        outputs, shape (..., 6), of a plant whose own quantisation is off.
    noise
        noise in output units, of the same shape.
    values
        values of the rig by full name; the step of its `sensor_quantisation` is applied here.
    """
    measured = clean + noise
    step = values.get(QUANTISATION, 0.0)
    if step > 0.0:
        position = OUTPUTS.index("position_m")
        measured[..., position] = step * np.round(measured[..., position] / step)
    return measured


Progress = Callable[[float], None]

# Largest number of integration steps in a sample. At 1 kHz they resolve oscillations of 10 kHz,
# where a lumped model is not valid any more; a rig that needs more counts as too stiff.
MOST_SUBSTEPS = 1000

# A single run can afford more steps than a fit of thousands of runs. Four times as many steps leave
# a sixteenth of the error.
REFINEMENT = 4

# Samples between two reports of progress; without substeps they take a few hundredths of a second.
CHUNK = 200_000


class SimulationError(ValueError):
    """A rig, a command or a start that cannot be simulated; the message gives the reason."""


@dataclass(frozen=True, eq=False)
class SimulationRun:
    """Result of a run."""

    record: Record
    """Time, command and all outputs of the plant."""
    substeps: int
    """Integration steps in each sample; of a user's simulator, steps that are asked of it."""
    error: Mapping[str, float]
    """Largest difference of each output to a run with half the step, as a share of the output's
    range. By the order of the method, the error of this run is four thirds of it. A run of a user's
    simulator has none."""


@dataclass(frozen=True, eq=False)
class PreparedRig:
    """A checked rig that is ready to run."""

    rig: Rig
    dt_s: float
    values: Mapping[str, float]
    """Values of the rig and the values that replace them, by full name."""
    plant_values: FloatArray
    """Values of all plant parameters, shape (P,), in the order of `ehsid.plant_parameters()`."""
    substeps: int
    """Integration steps in each sample."""

    def plant(self, *, refinement: int = 1, quantised: bool = True) -> ehsid.Plant:
        """Returns the plant at its start, with `refinement` times as many integration steps."""
        plant_values = self.plant_values
        if not quantised:
            plant_values = plant_values.copy()
            plant_values[[p.name for p in ehsid.plant_parameters()].index(QUANTISATION)] = 0.0
        substeps = min(refinement * self.substeps, MOST_SUBSTEPS)
        return ehsid.Plant(
            self.rig.plant,
            np.hstack([plant_values, self.rig.table_values()]),
            dt_s=self.dt_s,
            substeps=substeps,
            tables=self.rig.table_shapes(),
        )


def prepare(
    rig: Rig,
    *,
    dt_s: float,
    position0_m: float | None = None,
    values: Mapping[str, float] | None = None,
    substeps: int | None = None,
) -> PreparedRig:
    """Checks a rig and its start; the arguments and errors are those of `simulate`."""
    overrides = dict(values or {})
    if position0_m is not None:
        overrides[ParameterKey.of_initial("position_m")] = position0_m
    all_values = {**rig.values, **overrides}
    problems = check_values(overrides) + check_relations(all_values)
    if problems:
        raise SimulationError("; ".join(problems))
    stroke = all_values.get("cylinder.stroke_m")
    start_m = all_values.get(ParameterKey.of_initial("position_m"))
    if stroke is not None and start_m is not None and not 0.0 <= start_m <= stroke:
        raise SimulationError(
            f"the start at {start_m:g} m is outside the stroke, 0 to {stroke:g} m"
        )
    plant_values = rig.plant_values(overrides)
    if substeps is None:
        substeps = REFINEMENT * ehsid.plant_substeps(rig.plant, plant_values, dt_s)
        if substeps > MOST_SUBSTEPS // 2:
            raise SimulationError(
                f"{rig.name} is too stiff to be integrated at {dt_s:g} s: its oil spring or its "
                f"seals need {substeps} steps a sample: expected at most {MOST_SUBSTEPS // 2}; "
                "take a shorter sampling time, or check masses, volumes, friction"
            )
    return PreparedRig(rig, dt_s, MappingProxyType(all_values), plant_values, substeps)


def simulate(
    rig: Rig,
    command_v: npt.ArrayLike,
    *,
    dt_s: float,
    position0_m: float | None = None,
    values: Mapping[str, float] | None = None,
    substeps: int | None = None,
    keep_inside: bool = False,
    noise: FloatArray | None = None,
    name: str | None = None,
    progress: Progress | None = None,
) -> SimulationRun:
    """Simulates a rig on a command, from rest in equilibrium.

    Parameters
    ----------
    rig
        rig to simulate.
    command_v
        command, V, shape (N,), finite; each sample is held until the next.
    dt_s
        sampling time in seconds.
    position0_m
        initial position, m, within the stroke; mid-stroke by default.
    values
        values that replace those of the rig, by full name.
    substeps
        integration steps in each sample; by default four times the minimum for the rig's fastest
        oscillation.
    keep_inside
        whether to refuse a run that reaches an end of the stroke.
    noise
        shape (N, 6), added to the outputs before the position is quantised: see `draw_noise`.
    name
        name of the record.
    progress
        called with the share of the work that is done, 0 to 1.

    Raises
    ------
    SimulationError
        the command is not finite, the start is outside the stroke, the rig is too stiff to be
        integrated, or the run is not finite or leaves the stroke.
    """
    command = checked_samples("command", command_v)
    if rig.simulator is not None:
        raise SimulationError(
            f"{rig.name}: its plant is a simulator of the user: expected a rig of a plant of "
            "ehsid; choose another rig file"
        )
    start = prepare(rig, dt_s=dt_s, position0_m=position0_m, values=values, substeps=substeps)
    report = progress or (lambda _share: None)
    # A step takes the same time in both runs. The first run is one third of the work, the second,
    # with half the step, two thirds.
    coarse = _run(start.plant(quantised=False), command, lambda done: report(done / 3.0))
    fine = _run(
        start.plant(refinement=2, quantised=False),
        command,
        lambda done: report((1.0 + 2.0 * done) / 3.0),
    )
    clean = columns_of(rig.plant, coarse)
    finer = columns_of(rig.plant, fine)
    bad = np.flatnonzero(~np.isfinite(np.column_stack(list(clean.values()))).all(axis=1))
    if bad.size:
        raise SimulationError(f"{rig.name}: the run is not finite from sample {bad[0] + 1} on")
    stroke = start.values.get("cylinder.stroke_m")
    if keep_inside and stroke is not None:
        check_inside(clean["position_m"], stroke, dt_s)
    measured = as_measured(coarse, np.zeros(()) if noise is None else noise, start.values)
    record = make_record(
        {
            "time_s": np.arange(command.size) * dt_s,
            "command_v": command,
            **columns_of(rig.plant, measured),
        },
        name=name or rig.name,
    )
    error = {
        output: float(np.max(np.abs(finer[output] - column)) / max(np.ptp(column), 1e-12))
        for output, column in clean.items()
    }
    return SimulationRun(record, start.substeps, MappingProxyType(error))


def checked_samples(what: str, samples: npt.ArrayLike) -> FloatArray:
    """Returns the samples as an array of shape (N,); raises SimulationError if they are unusable.

    At least two samples are needed; all must be finite and none masked. `what` names them in the
    message.
    """
    if masked_count(samples):
        raise SimulationError(
            f"the {what} has {masked_count(samples)} masked values: expected finite numbers; fill "
            "them in with filled()"
        )
    array = np.asarray(samples, dtype=np.float64)
    if array.ndim != 1 or array.size < 2:
        raise SimulationError(f"the {what} has shape {array.shape}: expected at least 2 samples")
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise SimulationError(f"the {what} is not finite at sample {bad[0] + 1}: {array[bad[0]]}")
    return array


def _run(plant: ehsid.Plant, command: FloatArray, progress: Progress) -> FloatArray:
    """Runs the plant on a command of N samples and returns its outputs, shape (N, 6)."""
    parts = []
    for first in range(0, command.size, CHUNK):
        parts.append(plant.run(command[first : first + CHUNK]))
        progress(min(1.0, (first + CHUNK) / command.size))
    return np.concatenate(parts)


def check_inside(position: FloatArray, stroke: float, dt_s: float) -> None:
    """Raises SimulationError where the rod is beyond an end of its stroke."""
    outside = np.flatnonzero((position < 0.0) | (position > stroke))
    if outside.size:
        raise SimulationError(
            f"the rod reaches an end of its stroke (0 to {stroke:g} m) after "
            f"{outside[0] * dt_s:.3g} s: take a smaller amplitude, a shorter duration, another "
            "start, or a closed loop, which holds it"
        )
