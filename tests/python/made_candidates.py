# SPDX-License-Identifier: MIT
"""Fitted candidates made by hand, whose errors are known, and a case that holds them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, cast

import numpy as np
from gap_rig import RIG
from made_spectra import spectrum_of

from ehsid.harness.diagnosis.data.floor import NoiseFloor
from ehsid.harness.diagnosis.deciding import INDEPENDENT
from ehsid.harness.diagnosis.decision.effect_selection import Selection, select_effects
from ehsid.harness.diagnosis.decision.hypotheses import posterior
from ehsid.harness.diagnosis.model.case import Case
from ehsid.harness.diagnosis.model.parameters import Parameter
from ehsid.harness.diagnosis.model.spectrum import BANDS, OutputLikelihood
from ehsid.harness.diagnosis.search.candidates import FittedCandidate
from ehsid.harness.diagnosis.search.gap_reduction import WindowSums
from ehsid.harness.diagnosis.search.search import SearchResult

WINDOWS, SAMPLES, FLOOR, VARIATION = 40, 500, 1e-6, 1e-2
SPECTRUM = spectrum_of((WINDOWS, SAMPLES))


def _likelihood() -> OutputLikelihood:
    """That of a position: the mean of each window does not count. Only the floor is tolerated."""
    counts = np.minimum(INDEPENDENT * WINDOWS, SPECTRUM.sizes)
    counts[0] = 0.0
    return OutputLikelihood(SPECTRUM, counts, np.full(BANDS, FLOOR**2))


LIKELIHOOD = _likelihood()


@dataclass(frozen=True)
class _Problem:
    likelihoods: Mapping[str, OutputLikelihood]


class _Record:
    dt_s = 1e-3


class MadeCase:
    """The attributes of a case that the selection reads."""

    outputs = ("position_m",)
    floors: Mapping[str, NoiseFloor] = MappingProxyType(
        {"position_m": NoiseFloor(FLOOR, FLOOR, FLOOR)}
    )
    records = (_Record(),)
    rig = RIG
    all_states = False
    engine = None
    unknown: Mapping[bool, Any] = MappingProxyType({})
    commands_are_missing = False
    pressures = True

    def parameters(self, effects: Sequence[str] = ()) -> tuple[Parameter, ...]:
        """As many values as x has, none of which is near an end of its range."""
        return tuple(
            Parameter(f"load.value_{k}", False, 0.0, 1.0, -4.0, 4.0) for k in range(20)
        ) + (
            tuple(
                Parameter(f"effects.{effect}.size", False, 0.0, 1.0, -4.0, 4.0)
                for effect in effects
            )
        )

    def with_unsteady_friction(self, _effects: Sequence[str], _x: object) -> MadeCase:
        """No rod sticks and slips."""
        return self

    def problem(self, *, held_out: bool = False) -> _Problem:
        """Both parts of the data have the same windows."""
        return _Problem({"position_m": LIKELIHOOD})


CASE = cast(Case, cast(Any, MadeCase()))
SIZES = {
    "effects.coulomb_friction.force_n": 400.0,
    "effects.stribeck_friction.coulomb_n": 400.0,
    "effects.stribeck_friction.static_n": 600.0,
    "effects.stribeck_friction.stribeck_velocity_m_s": 0.02,
    "effects.valve_dead_band.overlap": 0.03,
    "effects.transport_delay.delay_s": 5e-3,
    "effects.sensor_lag.time_constant_s": 5e-3,
}


def candidate(
    *effects: str, rms: float, parameters: int | None = None, **sizes: float
) -> FittedCandidate:
    """A candidate whose errors have this rms (m), scattered by a tenth over windows.

    The errors are white. Those of the records to fit are as large as the held-out ones.
    """
    seed = sum(map(ord, "".join(effects)))
    scatter = np.random.default_rng(seed).uniform(0.9, 1.1, WINDOWS)
    scatter /= scatter.mean()
    squares = SAMPLES * rms**2 * scatter[:, np.newaxis]
    counts = np.full(WINDOWS, float(SAMPLES))
    powers = rms**2 * scatter[:, np.newaxis, np.newaxis] * SPECTRUM.sizes / WINDOWS
    cost = LIKELIHOOD.cost_of(np.full(BANDS, rms**2))
    values = SIZES | {f"effects.{name}": size for name, size in sizes.items()}
    x = np.zeros(20 + (parameters or len(effects)))
    sums = WindowSums({"position_m": squares[:, 0]}, {"position_m": counts * VARIATION**2}, counts)
    return FittedCandidate(
        effects, x, values, cost, cost, True, squares, counts, powers, powers, sums
    )


def search_result(
    calibrated: FittedCandidate, *candidates: FittedCandidate, nominal: float = 1e-3
) -> SearchResult:
    ordered = tuple(sorted(candidates, key=lambda each: each.held_out_cost))
    return SearchResult(CASE, candidate(rms=nominal), calibrated, ordered, ())


def chosen(found: SearchResult) -> Selection:
    """The answer that loses least under the probabilities of these fits."""
    return select_effects(found, posterior(CASE, found.calibrated, found.refined))
