# SPDX-License-Identifier: MIT
"""A blind case: the rig as configured, records of the true machine, and the separate answer."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from ehsid.harness.base.numbers import FloatArray

from . import machine as equations
from .effects import ADDED_EFFECTS, CATALOGUE, EXCLUSIVE_PAIRS, Effect, Sizes, excludes, sized
from .excitation import (
    EXCITATION_SETS,
    EXCITATIONS,
    WEAK_LOOP_RAD_S,
    Excitation,
    ExcitationSet,
    Task,
    draw_excitations,
    draw_task,
    weak_loop,
)
from .linkage import EFFECT as BOOM
from .linkage import LAWS, LINKAGE, LOADS, draw_linkage_rig, over_the_stroke, with_told_load
from .noise import Noise, draw_logger, draw_noise, usual_logger
from .nominal_rig import (
    FIELD_RANGE,
    LAG,
    USUAL,
    NominalRig,
    PlantKind,
    draw_nominal_rig,
    draw_true_values,
    draw_wide_rig,
    rig_text,
)
from .pressure_sensors import pressure_reading
from .truth import Truth
from .unnamed import FIELD, OUTSIDE, UNNAMED, Faults, faults
from .variants import (
    WIDE,
    Grade,
    Variants,
    build,
    draw_field_variants,
    draw_structure,
    draw_variants,
    families,
    with_variants,
)

Kind = Literal["one", "two", "none", "params", "open"]
Sensors = Literal["position", "pressures", "pressures+supply", "pressures+supply+spool"]
KINDS: tuple[Kind, ...] = ("one", "two", "none", "params", "open")
# After which share of the size of its effects is left a machine is recorded once more.
EDITS: Mapping[str, float] = MappingProxyType({"removed": 0.0, "halved": 0.5})
BEFORE_S = 1.0  # the machine runs for this time before the record begins
LEAST_SLIDING_S = 1.5e-5  # in which the seals of a wide machine bend to where they slide

COLUMNS: Mapping[Sensors, tuple[str, ...]] = MappingProxyType(
    {
        "position": (),
        "pressures": ("pressure_a_pa", "pressure_b_pa"),
        "pressures+supply": ("pressure_a_pa", "pressure_b_pa", "supply_pressure_pa"),
        "pressures+supply+spool": (
            "pressure_a_pa",
            "pressure_b_pa",
            "supply_pressure_pa",
            "spool",
        ),
    }
)


# Chambers by the column of the outputs of `machine.run`.
SIDES = MappingProxyType({equations.OUT_P_A: "a", equations.OUT_P_B: "b"})


@dataclass(frozen=True)
class RealityCase:
    """A blind case: what the diagnosis may read, and what is withheld from it."""

    name: str
    """Name of the folder; it is random and has no information on the case."""
    rig_toml: str
    """Text of the rig file."""
    train: Mapping[str, FloatArray]
    validate: Mapping[str, FloatArray]
    """Columns of the record schema by name, each (n,), SI."""
    transfer: Mapping[str, FloatArray]
    """A third record, under an excitation of another kind; it is withheld like the answer, to see
    whether the diagnosed rig holds there, too."""
    answer: Mapping[str, Any]
    """What is withheld, as plain data."""
    truth: Truth
    healthy: Truth
    """Constants of the true machine, with the effects and without them."""
    edited: Mapping[str, Mapping[str, FloatArray]]
    """By a name of `EDITS` a further record, after the effects of the catalogue were removed or
    halved; withheld, and only where it was asked for."""


def make_case(
    seed: int,
    grade: Grade = "plain",
    kind: Kind = "one",
    effects: Sequence[str] | Mapping[str, Sizes] | None = None,
    sensors: Sensors = "pressures+supply",
    excitation: tuple[Excitation, Excitation] | None = None,
    plant: PlantKind = "ehs",
    seconds: float = 20.0,
    dt_s: float = 0.001,
    logged_every: int = 1,
    among: ExcitationSet = "all",
    edited: bool = False,
) -> RealityCase:
    """Makes one blind case; the same arguments always make the same case.

    Rig, excitation and noise have random streams of their own, so another kind or effect does not
    change them. The transfer record has its own streams, too. Its amplitude is never small: a wrong
    cause may shrink the gap at small amplitudes, but not at large ones.

    Parameters
    ----------
    seed
        not negative.
    effects
        ids of the effects, or their sizes by id, for kinds with effects; drawn where None.
    excitation
        excitation of the first two records; drawn where None.
    dt_s, logged_every
        sampling time of the records, s, and how many samples of the controller it takes.
    among
        set of which the excitations of a wide case are drawn.
    edited
        whether to make records of the machine after its effects were changed, too. They have
        streams of their own, one for both: the excitation of the second record is drawn anew.

    Raises
    ------
    ValueError
        an effect is not known, the kind has another number of effects, or a wide case is asked of
        an axis or a set of excitations of another grade.

    A machine of the grade "linkage" is a wide one whose cylinder turns a boom. Its kind tells the
    effects beside the linkage; that of its answer is "open".
    """
    linkage, field = grade == "linkage", grade == "field"
    wide = grade in WIDE
    if wide and plant != "ehs":
        raise ValueError(f"grade '{grade}' has hydraulic servos only; leave out --plant")
    log_s, dt_s = dt_s, dt_s / logged_every
    if among != "all" and not wide:
        raise ValueError(f"--excitations {among}: only grade 'wide' has sets, not '{grade}'")
    streams = [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(11)]
    rig_rng, value_rng, task_rng, noise_rng, effect_rng, fault_rng, transfer_rng = streams[:7]
    severity_rng, variant_rng, logger_rng, excitation_rng = streams[7:]
    if linkage:
        rig = draw_linkage_rig(rig_rng)
    elif wide:
        rig = draw_wide_rig(rig_rng, FIELD_RANGE if field else USUAL)
    else:
        rig = draw_nominal_rig(rig_rng, plant)
    name = f"{int(rig_rng.integers(2**32)):08x}"
    sizes_by_effect = _sizes(effect_rng, rig, kind, effects, grade, sensors)
    if "valve_lag" in sizes_by_effect:  # a lag that the rig file states would be no gap
        rig = replace(rig, values={k: v for k, v in rig.values.items() if k not in LAG})
    accuracy: Literal["exact", "within", "moved"] = "within"
    if kind == "none":
        accuracy = "exact"
    elif kind == "params":
        accuracy = "moved"
    true_values = draw_true_values(value_rng, rig, accuracy)
    if linkage:
        boom_rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(13)[12])
        sizes_by_effect[LINKAGE] = BOOM.draw(boom_rng, rig)
        rig, kind = with_told_load(boom_rng, rig, sizes_by_effect[LINKAGE]), "open"
    severity = float(severity_rng.random()) if wide else float(grade == "hard")
    structure = draw_structure(value_rng, rig, severity)
    if wide:  # at full speed, seals bend and slide within a time that does not take tiny steps
        structure["bristle_m"] = max(structure["bristle_m"], LEAST_SLIDING_S * rig.speed_m_s)
    machine = build(rig, true_values, structure)
    if severity >= 0.5:  # its saturation differs from the tanh by at most 2.2 % of the limit
        machine = machine._replace(limit_power=2.7)
    variants = draw_variants(variant_rng) if wide else Variants()
    if field:
        field_rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(13)[12])
        variants = draw_field_variants(field_rng, variants)
    healthy = with_variants(machine, variants, ())
    sound = machine

    def with_sizes(sizes_by_effect: Mapping[str, Sizes]) -> Truth:
        afflicted = sound
        for effect, sizes in sizes_by_effect.items():
            afflicted = definition_of(effect).put(afflicted, sizes, structure["bristle_m"])
        return with_variants(afflicted, variants, sizes_by_effect)

    machine = with_sizes(sizes_by_effect)
    hard = grade == "hard"
    logger = draw_logger(logger_rng, rig, log_s) if wide else usual_logger(rig, log_s, hard)

    excitations = excitation or (
        draw_excitations(excitation_rng, among) if wide else _draw_excitation(task_rng, grade)
    )
    open_loop = (False, bool(task_rng.random() < 0.25))
    samples = round((seconds + BEFORE_S) / dt_s)

    def record(
        excitation_kind: Excitation,
        is_open: bool,
        small: bool,
        draws: Draws,
        machine: Truth = machine,
        sizes_by_effect: Mapping[str, Sizes] = sizes_by_effect,
    ) -> dict[str, FloatArray]:
        weak_rad_s = None
        if is_open:
            weak_rad_s = weak_loop(rig) if wide else WEAK_LOOP_RAD_S
        task = draw_task(draws.task, rig, excitation_kind, samples, dt_s, small, weak_rad_s)
        if linkage:
            task = over_the_stroke(draws.task, task, rig, dt_s)
        noise = draw_noise(draws.noise, rig, samples, logger)
        record_faults = faults(sizes_by_effect, draws.faults, samples, dt_s)
        step = max(
            noise.position_step_m, sizes_by_effect.get("sensor_quantisation", {}).get("step_m", 0.0)
        )
        quantised = machine._replace(sensor_step_m=step)
        every = record_of(quantised, rig, task, noise, record_faults, sensors, dt_s)
        return {name: column[::logged_every] for name, column in every.items()}

    draws, small = Draws(task_rng, noise_rng, fault_rng), grade == "confusable"
    train, validate = (
        record(excitation_kind, is_open, small, draws)
        for excitation_kind, is_open in zip(excitations, open_loop, strict=True)
    )
    kinds = EXCITATION_SETS[among] if wide else EXCITATIONS
    transfer_excitation = _another_excitation(transfer_rng, kinds, excitations)
    transfer = record(transfer_excitation, False, False, Draws(*transfer_rng.spawn(3)))
    records_after = {}
    if edited and kind in ("one", "two"):
        for edit, share in EDITS.items():
            left = {
                effect: sized(sizes, share) for effect, sizes in sizes_by_effect.items() if share
            }
            own = np.random.default_rng(np.random.SeedSequence(seed).spawn(12)[11])
            records_after[edit] = record(
                excitations[1], False, small, Draws(*own.spawn(3)), with_sizes(left), left
            )
    answer: dict[str, Any] = {
        "kind": kind,
        "plant": plant,
        "grade": grade,
        "effects": {effect: dict(sizes) for effect, sizes in sizes_by_effect.items()},
        "subsystem": [definition_of(effect).subsystem for effect in sizes_by_effect],
        "excitation": list(excitations),
        "transfer_excitation": transfer_excitation,
        "open_loop": list(open_loop),
        "seconds": seconds,
        "largest_command": [
            float(np.abs(record_columns["command_v"]).max())
            / rig.values.get("valve.rated_command_v", 10.0)
            for record_columns in (train, validate)
        ],
        "sensors": sensors,
        "seed": seed,
        "dt_s": log_s,
        "logged_every": logged_every,
        "true": true_values,
        "told": dict(rig.values),
        "structure": structure,
    }
    if linkage:
        answer["laws"] = LAWS
    if wide:
        answer |= {
            "severity": severity,
            "variants": asdict(variants),
            "logger": asdict(logger),
            "families": families(
                rig, machine, structure, logger, log_s, sizes_by_effect, excitations
            ),
        }
    return RealityCase(
        name,
        rig_text(rig, f"rig-{name}"),
        train,
        validate,
        transfer,
        answer,
        machine,
        healthy,
        records_after,
    )


class Draws(NamedTuple):
    """Random streams of one record."""

    task: np.random.Generator
    noise: np.random.Generator
    faults: np.random.Generator


def definition_of(effect: str) -> Effect:
    """Returns how an effect is drawn and put into a machine.

    Raises
    ------
    ValueError
        there is no effect of this name.
    """
    unnamed = {name: law.effect for name, law in UNNAMED.items()}
    known = {**CATALOGUE, **ADDED_EFFECTS, **OUTSIDE, **FIELD, **unnamed, LINKAGE: BOOM}
    if effect not in known:
        raise ValueError(f"effect '{effect}' is not known; there are {', '.join(known)}")
    return known[effect]


def _sizes(
    rng: np.random.Generator,
    rig: NominalRig,
    kind: Kind,
    requested: Sequence[str] | Mapping[str, Sizes] | None,
    grade: Grade,
    sensors: Sensors,
) -> dict[str, Sizes]:
    """Returns the sizes of the wanted or drawn effects, by id and parameter.

    Those beside a linkage are of the catalogue, and no load, which its weight is already. A machine
    of the grade "field" may have more causes, as far as its sensors are there.
    """
    linkage, field = grade == "linkage", grade == "field"
    count = {"one": 1, "two": 2, "none": 0, "params": 0, "open": 0 if linkage else 1}[kind]
    pool = OUTSIDE if kind == "open" else CATALOGUE
    if field:
        pool = {**OUTSIDE, **FIELD} if kind == "open" else {**CATALOGUE, **ADDED_EFFECTS}
        if sensors == "position":  # what is wrong with a transducer that is not there does not show
            pool = {name: pool[name] for name in pool if not name.startswith("pressure_sensor")}
    names = [name for name, definition in pool.items() if definition.axis or rig.plant == "ehs"]
    if linkage:
        names = [name for name in names if name not in LOADS]
    order = [str(name) for name in rng.permutation(names)]
    drawn = order[:count]
    if field and count == 2:
        drawn[1] = next(name for name in order[1:] if not excludes(drawn[0], name))
    elif frozenset(drawn) in EXCLUSIVE_PAIRS:
        drawn[1] = "transport_delay"
    chosen = list(requested) if requested is not None else drawn
    if len(chosen) != count:
        raise ValueError(f"kind '{kind}' has {count} effects, {len(chosen)} are given: {chosen}")
    given = requested if isinstance(requested, Mapping) else {}
    return {name: given.get(name) or definition_of(name).draw(rng, rig) for name in chosen}


def _draw_excitation(rng: np.random.Generator, grade: Grade) -> tuple[Excitation, Excitation]:
    if grade == "confusable":
        return "multisine", "multisine"
    first, second = (str(kind) for kind in rng.permutation(list(EXCITATIONS))[:2])
    return first, second  # type: ignore[return-value]


def _another_excitation(
    rng: np.random.Generator, kinds: Sequence[Excitation], used: tuple[Excitation, Excitation]
) -> Excitation:
    """Draws a kind of excitation that the first two records do not use."""
    unused = [kind for kind in kinds if kind not in used]
    return unused[int(rng.integers(len(unused)))]


def record_of(
    machine: Truth,
    rig: NominalRig,
    task: Task,
    noise: Noise,
    record_faults: Faults,
    sensors: Sensors,
    dt_s: float,
) -> dict[str, FloatArray]:
    """Returns the columns that the logger writes, SI, from the end of BEFORE_S on."""
    sent, out = _run(machine, task, noise, record_faults, dt_s)
    first = round(BEFORE_S / dt_s)
    if record_faults.clock_rate != 0.0:
        sent, out = _by_other_clock(sent, out, first, machine.sensor_step_m, record_faults)
    rated = rig.values.get("valve.rated_command_v", 10.0)
    record: dict[str, FloatArray] = {
        "time_s": np.asarray(dt_s * np.arange(sent.size - first)),
        "command_v": rated * sent[first:],
        "position_m": out[first:, equations.OUT_Y],
    }
    if rig.plant == "axis":
        return record
    for name, column in (
        ("pressure_a_pa", equations.OUT_P_A),
        ("pressure_b_pa", equations.OUT_P_B),
        ("supply_pressure_pa", equations.OUT_P_S),
    ):
        if name in COLUMNS[sensors]:
            shown = out[:, column]
            if column in SIDES:
                shown = pressure_reading(shown, SIDES[column], machine, dt_s)
            noisy = shown[first:] + noise.pressures_pa[name][first : sent.size]
            record[name] = noise.pressure_step_pa * np.rint(noisy / noise.pressure_step_pa)
    if "spool" in COLUMNS[sensors]:
        record["spool"] = out[first:, equations.OUT_X] + noise.spool[first : sent.size]
    return record


def _by_other_clock(
    sent: FloatArray, out: FloatArray, first: int, step_m: float, record_faults: Faults
) -> tuple[FloatArray, FloatArray]:
    """Returns commands (m,) and outputs (m, 6) whose clocks agree at the sample `first`.

    Splines give the outputs between the samples; the record ends where there are no more of them.
    """
    at = first + np.arange(sent.size - first) * (1.0 + record_faults.clock_rate)
    shown = CubicSpline(np.arange(sent.size), out)(at[at <= sent.size - 1.0])
    shown[:, equations.OUT_Y] = step_m * np.rint(shown[:, equations.OUT_Y] / step_m)
    return sent[: first + shown.shape[0]], np.concatenate([out[:first], shown])


def _run(
    machine: Truth, task: Task, noise: Noise, record_faults: Faults, dt_s: float
) -> tuple[FloatArray, FloatArray]:
    """Simulates the machine and returns its commands (n,) and outputs (n, 6).

    The integration step is chosen from the state before a sample. A large step of the command
    makes a stiff machine stiffer within the sample than that state shows, and once in hundreds of
    records the integration diverges. Then it is repeated with `refinement` four times as large.
    """
    for refinement in (2, 8):
        try:
            sent, out = equations.run(
                machine,
                start_state(machine, float(task.reference[0])),
                dt_s,
                task.forward,
                task.reference,
                task.gain,
                noise.command_step,
                noise.position_m + record_faults.error,
                noise.late_s,
                record_faults.lost,
                refinement,
            )
        except ZeroDivisionError:
            continue
        if np.isfinite(out).all():
            return sent, out
    raise ValueError("the machine cannot be integrated; take another seed")


def start_state(machine: Truth, position: float) -> FloatArray:
    """State (19,) at rest: the valve is closed, and the chamber pressures balance the load."""
    s = np.zeros(equations.STATES)
    s[equations.Y] = s[equations.Y_2] = s[equations.M] = position
    weight = 0.0
    if machine.boom_kg_m2 > 0.0:
        angle = s[equations.ANGLE] = equations.boom_angle(position, machine)
        weight = equations.weight_moment(angle, machine) / equations.arm(angle, machine)
    if machine.force_per_unit_n > 0.0:
        return s
    atmosphere = equations.ATMOSPHERE_PA
    load = weight + machine.load_n + machine.spring_n_m * (position - 0.5 * machine.stroke_m)
    load += equations.contact_force(position, 0.0, machine)
    low = 0.5 * machine.source_pa * machine.area_a_m2 / (machine.area_a_m2 + machine.area_b_m2)
    p_b = max(low, 5e5 - load / machine.area_b_m2)
    p_a = atmosphere + (machine.area_b_m2 * (p_b - atmosphere) + load) / machine.area_a_m2
    for state, gas, p in (
        (equations.C_A, equations.G_A, max(p_a, 1e5)),
        (equations.C_B, equations.G_B, max(p_b, 1e5)),
    ):
        s[gas] = equations.free_gas(p, machine)
        s[state] = equations.compression(
            p,
            machine.bulk_slope,
            machine.bulk_modulus_0_pa,
            machine.gas_fraction + s[gas],
        )
    if machine.counterbalance_pa > 0.0:
        s[equations.L_A] = equations.lift(p_a, p_b, machine)
        s[equations.L_B] = equations.lift(p_b, p_a, machine)
    s[equations.P_S] = machine.source_pa
    assert math.isfinite(s.sum())
    return s
