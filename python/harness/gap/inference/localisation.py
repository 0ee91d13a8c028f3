# SPDX-License-Identifier: MIT
"""Place of the structural gap by subsystem, regime, frequency and time, with contradictions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.gap.inference.attribution import (
    Attribution,
    attribute_equations,
    attribute_errors,
)
from ehsid.harness.gap.inference.candidates import FittedCandidate
from ehsid.harness.gap.inference.maps import maps
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.model.process_noise import NoiseNeeded, noise_needed
from ehsid.harness.gap.schema import SUBSYSTEMS, Where
from ehsid.harness.gap.thresholds import SUBSYSTEM_SMALL, SUBSYSTEM_TAKES_PART


@dataclass(frozen=True)
class Evidence:
    """Evidence on the place of the gap before any effect is fitted.

    Attributes
    ----------
    attribution
        result from the equations where their signals are measured, else from the position errors.
    noise
        process noise that each subsystem would need; None where the equations are used, or where
        it cannot be computed.
    """

    attribution: Attribution
    noise: NoiseNeeded | None

    @property
    def subsystem(self) -> dict[str, float]:
        """Share of the gap by subsystem, sum 1; empty where the data do not show it."""
        shares = dict(self.attribution.subsystem)
        if not shares and self.noise is not None:
            shares = dict(self.noise.subsystem)
        return shares


def gather(case: Case, calibrated: FittedCandidate, exclude: Sequence[str] = ()) -> Evidence:
    """Gathers the evidence from the equations of measured signals, else from the position errors.

    The equations take the values in the rig file, because a calibration has already moved where it
    could hide an effect. The position errors are those of the calibrated simulation.

    Parameters
    ----------
    case
        rig and records.
    calibrated
        the fit without effects.
    exclude
        ids of effects that are not tried.
    """
    attribution = attribute_equations(case.records, case.rig, {}, exclude)
    if attribution.equations or "position_m" not in case.outputs:
        return Evidence(attribution, None)
    problem = case.problem()
    attribution = attribute_errors(problem, calibrated.x, exclude)
    error = problem.errors(calibrated.x)["position_m"]
    return Evidence(attribution, noise_needed(problem, calibrated.values, error))


def localise(
    case: Case,
    calibrated: FittedCandidate,
    best: FittedCandidate | None,
    *,
    shares: Mapping[str, float] | None = None,
    laws: Sequence[tuple[str, float]] = (),
    evidence: Evidence | None = None,
) -> Where:
    """Combines the evidence, the selected effects and the maps of the gap.

    Parameters
    ----------
    case
        rig and records.
    calibrated
        the fit without effects.
    best
        the fit with the selected effects; None, or a fit without effects, where there are none.
    shares
        share of the held-out gain by id of the effect; by default all are equal.
    laws
        subsystem and share of the held-out gain of each law without a name.
    evidence
        result of `gather`, if it is already there.
    """
    if evidence is None:
        evidence = gather(case, calibrated)
    problem = case.problem(held_out=True)
    floors = {name: floor.value for name, floor in case.floors.items()}
    mapped = maps(problem.records, problem.errors(calibrated.x), floors, case.rig)
    evidence_shares = evidence.subsystem
    notes = [*evidence.attribution.notes, *_noise_notes(evidence)]
    selected = best.effects if best is not None else ()
    if selected or laws:
        subsystem = _effect_shares(selected, shares, laws)
        notes = [
            *_contradictions(subsystem, evidence_shares, bool(evidence.attribution.equations)),
            *notes,
        ]
    else:
        subsystem = evidence_shares
    all_subsystems = {name: subsystem.get(name, 0.0) for name in SUBSYSTEMS} if subsystem else {}
    return Where(
        all_subsystems,
        mapped.regimes,
        mapped.frequency,
        mapped.time,
        evidence.attribution.equations,
        tuple(notes),
    )


def _effect_shares(
    selected: Sequence[str],
    shares: Mapping[str, float] | None,
    laws: Sequence[tuple[str, float]] = (),
) -> dict[str, float]:
    """Returns the shares of the subsystems of these effects; a negative share counts as zero."""
    weights = {effect: max(shares.get(effect, 0.0), 0.0) if shares else 1.0 for effect in selected}
    total = sum(weights.values()) + sum(share for _, share in laws)
    if total <= 0.0:
        weights, total = dict.fromkeys(selected, 1.0), float(len(selected))
    parts = [(effects()[effect].subsystem, weight) for effect, weight in weights.items()]
    subsystem: dict[str, float] = {}
    for name, weight in (*parts, *laws):
        subsystem[name] = subsystem.get(name, 0.0) + weight / total
    return subsystem


def _contradictions(
    simulated: Mapping[str, float], evidence_shares: Mapping[str, float], equations: bool
) -> list[str]:
    """Returns sentences on subsystems with a large share in one source, hardly any in the other."""
    basis = "the equations of the measured signals" if equations else "the errors of the position"
    if not evidence_shares:
        return [f"From {basis} alone nothing can be said of the subsystem."] if equations else []
    missing = [name for name, share in evidence_shares.items() if share >= SUBSYSTEM_TAKES_PART]
    missing = [name for name in missing if simulated.get(name, 0.0) < SUBSYSTEM_SMALL]
    extra = [name for name, share in simulated.items() if share >= SUBSYSTEM_TAKES_PART]
    extra = [name for name in extra if evidence_shares.get(name, 0.0) < SUBSYSTEM_SMALL]
    sentences = []
    if missing:
        listed = ", ".join(f"{name} {100.0 * evidence_shares[name]:.0f} %" for name in missing)
        sentences.append(
            f"{basis.capitalize()} see a part of the gap where no effect was found: {listed}."
        )
    if extra:
        sentences.append(
            f"{basis.capitalize()} do not show the part that was found in: {', '.join(extra)}."
        )
    return sentences


def _noise_notes(evidence: Evidence) -> list[str]:
    """Returns what the process noise says of the subsystem where the attribution has no shares."""
    noise = evidence.noise
    if noise is None or evidence.attribution.subsystem:
        return []
    near = [name for name, share in noise.subsystem.items() if share >= SUBSYSTEM_SMALL]
    if not near:
        return ["The error of the position is hardly more than the noise of its sensor."]
    if len(near) == 1:
        return [
            f"The error of the position looks like noise in one subsystem: {near[0]}, "
            f"{1e3 * noise.deviation[near[0]]:.3g} mm rms within a window."
        ]
    return [
        "With the position alone the data do not show in which of these the gap lies: "
        f"{', '.join(near)}; measured chamber pressures would tell."
    ]
