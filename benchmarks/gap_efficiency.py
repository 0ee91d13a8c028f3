# SPDX-License-Identifier: MIT
"""How near are fitted sizes to the bound? python benchmarks/gap_efficiency.py

Machines of a rig are drawn from its uncertainties, each with one effect of a size between twice and
six times what its record could show. The effect is fitted with all values of the rig, and its error
is compared with the bound of van Trees (H. van Trees, Detection, Estimation, and Modulation Theory,
Wiley 1968, ch. 2.4): the inverse of the mean information of noise and priors together. The
simulator is exact, so that only noise is in the records. Two bounds are told: that of the noise
alone, and that with what the likelihood tolerates besides, as one error in each octave of each
window.
"""

from __future__ import annotations

import argparse
import os
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from gap_visible import SETTINGS, machine, record_of, scaled

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.base.parallel import single_threaded_algebra
from ehsid.harness.catalogue.spellings import sizes_of
from ehsid.harness.diagnosis.model.case import make_case
from ehsid.harness.diagnosis.model.parameters import effect_parameters
from ehsid.harness.diagnosis.model.problem import Problem
from ehsid.harness.diagnosis.search.candidates import calibrate, refine
from ehsid.harness.diagnosis.search.visible import ground_of, smallest
from ehsid.harness.rigs.checks import check_values

EFFECTS = ("internal_leakage", "coulomb_friction", "transport_delay", "supply_droop", "load_force")
# A normal error is below this many of its deviations in half of all cases.
MEDIAN = 0.6745


def bounds(problem: Problem, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Deviations of x by the noise alone, and with what is tolerated besides, shape (n,) each."""
    linear, spectrum = problem.linear(x), problem.spectrum
    free = problem.high > problem.low
    found = []
    for tolerant in (False, True):
        information = np.diag(problem.information())
        for name in problem.outputs:
            likelihood = problem.likelihoods[name]
            noise = likelihood.narrowed(0.0).tolerated
            # White noise: each coefficient is independent. What is tolerated comes once a window.
            weight = 1.0 / noise
            if tolerant:
                share = likelihood.counts / np.maximum(spectrum.sizes, 1.0)
                weight = 1.0 / (noise + likelihood.of_motion / np.maximum(share, 1e-9))
            information = information + np.tensordot(weight, linear.gram(name), axes=1)
        deviation = np.zeros(x.size)
        scale = 1.0 / np.sqrt(np.diag(information)[free])
        inner = information[np.ix_(free, free)] * np.outer(scale, scale)
        deviation[free] = np.sqrt(np.diag(np.linalg.pinv(inner, hermitian=True))) * scale
        found.append(deviation)
    return found[0], found[1]


def error_of(number: int, effect: str, seed: int) -> tuple[float, float] | None:
    """Error of the first size over both bounds; None where it takes a size that no servo has."""
    setting = SETTINGS[number]
    rig = setting.rig()
    told = smallest(ground_of(make_case(rig, [record_of(setting, seed, {})])), effect)
    if told.limit == "none":
        return None
    factor = float(np.exp(np.random.default_rng([seed, 8]).uniform(np.log(2.0), np.log(6.0))))
    sizes = scaled(effect, told.sizes, factor)
    if any(check_values(sizes)):
        return None
    case = make_case(rig, [record_of(setting, seed, sizes)])
    values = {**machine(rig, seed), **sizes}
    own = [x for _, x in effect_parameters(effect, sizes_of(effect, values), rig.plant)]
    start = [p.place(values[p.name]) for p in case.parameters()]
    # As in a search, the fit knows nothing of the values of the machine.
    fitted = refine(case, (effect,), np.array([*calibrate(case).x, *own]))
    problem = case.problem((effect,))
    place = len(start)
    away = abs(float(fitted.x[place]) - own[0])
    noise, tolerant = bounds(problem, np.array([*start, *own]))
    return away / float(noise[place]), away / float(tolerant[place])


def main() -> None:
    """Print the medians."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3, help="machines of each setting and effect")
    told = parser.parse_args()
    found: list[Any] = []
    with single_threaded_algebra():
        for seed in range(101, 101 + told.seeds):
            for number in range(len(SETTINGS)):
                for effect in EFFECTS:
                    ratio = error_of(number, effect, seed)
                    if ratio is not None:
                        found.append(ratio)
                        print(SETTINGS[number].words, effect, seed, *np.round(ratio, 2), flush=True)
    noise, tolerant = np.median(np.array(found), axis=0) / MEDIAN
    print(f"{len(found)} fits: {noise:.2f} of the bound by noise, {tolerant:.2f} with tolerance")


if __name__ == "__main__":
    main()
