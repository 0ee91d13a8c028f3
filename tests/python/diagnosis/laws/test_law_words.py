# SPDX-License-Identifier: MIT
"""Words for laws whose form is known."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from made_diagnoses import missing_law
from msgspec.structs import replace

from ehsid.harness.diagnosis.laws.forms import describe, sentence
from ehsid.harness.rigs.rig import TableLaw

X = np.linspace(-0.3, 0.4, 12)


def law(adds_to: str, of: str, values: npt.NDArray[np.float64]) -> TableLaw:
    return TableLaw(adds_to, of, tuple(X.tolist()), tuple(values.tolist()))


CASES = {
    "a load force": (law("force", "time_s", np.full(12, 1200.0)), "constant at 1200 N"),
    "a load spring": (law("force", "position_m", 7000.0 * X - 350.0), "rises 7 N per mm, as"),
    "as of something that the rod touches": (
        law("force", "position_m", 26e3 * np.maximum(X - 0.086, 0.0) + 50.0),
        "rises 25.7 N per mm beyond 8",
    ),
    "viscous friction": (law("force", "velocity_m_s", 2000.0 * X), "rises 2 N per mm/s"),
    "Coulomb friction of 500 N": (law("force", "velocity_m_s", 500.0 * np.sign(X)), "by 1000 N"),
    "Stribeck friction": (
        law("force", "velocity_m_s", np.sign(X) * (300.0 + 500.0 * np.exp(-np.abs(X) / 0.05))),
        "N beyond 5",
    ),
    "turbulent drag": (law("force", "velocity_m_s", 3000.0 * X * np.abs(X)), "square"),
    "a dead band": (law("spool", "spool", -np.clip(X, -0.05, 0.05)), "first 5"),
    "a saturation near": (law("spool", "spool", 0.3 * np.tanh(X / 0.3) - X), "near 29"),
    "a valve null bias": (law("spool", "spool", np.full(12, 0.02)), "constant at 2 %"),
    "a transport delay": (law("delay", "time_s", np.full(12, 0.004)), "4 ms"),
    "then rises 21 mm per s": (
        law("sensor", "time_s", np.maximum(X - 0.05, 0.0) * 0.02),
        "up to",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_a_law_with_the_form_of_an_effect_is_told_so(name: str) -> None:
    made, words = CASES[name]
    told = describe(made, [1.0 / 12] * 12)
    assert name in told.words
    assert words in told.words
    assert told.form is not None
    error = np.array(told.form) - np.array(made.values)
    # What counts as "fits": 5 % of the mean square.
    assert np.sum(error**2) <= 0.05 * np.sum(np.array(made.values) ** 2)


def test_a_law_without_a_simple_form_is_told_by_its_ends() -> None:
    told = describe(law("sensor", "position_m", 1e-3 * np.sin(20.0 * X)), [1.0 / 12] * 12)
    assert told.form is None
    assert "lies between" in told.words
    assert "mm" in told.words


def test_a_knot_where_the_record_hardly_was_does_not_hide_the_form() -> None:
    values = 500.0 * np.sign(X)
    values[-1] = 900.0
    weights = np.full(12, 1.0 / 11)
    weights[-1] = 0.0
    assert "Coulomb friction" in describe(law("force", "velocity_m_s", values), weights).words


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (600.0 * (X + 0.3), "grows by 42 %, from 1000 kg at -300 mm to 1420 kg at 400 mm, as in a"),
        (-600.0 * (X + 0.3), "falls by 42 %, from 1000 kg at -300 mm to 580 kg at 400 mm, as in a"),
        (np.full(12, 30.0) + 10.0 * X, "is nearly constant at 1030 kg"),
        (-2500.0 * (X + 0.3), "reaches from -750 to 1000 kg"),
    ],
)
def test_a_mass_is_told_as_the_whole(values: npt.NDArray[np.float64], words: str) -> None:
    told = describe(law("mass", "position_m", values), [1.0 / 12] * 12, 1000.0)
    assert words in told.words


def test_a_mass_and_a_force_over_the_position_are_a_linkage() -> None:
    force = replace(missing_law(), of="position_m")
    mass = replace(force, adds_to="mass")
    assert "a linkage, such as a boom" in sentence([mass, force])
    assert "linkage" not in sentence([force, missing_law()])


def test_one_law_is_told_with_its_form_and_several_by_their_equations() -> None:
    found = missing_law()
    assert sentence([found]) == (
        "The simulator lacks a term: force against extension over the velocity. It jumps by 824 N "
        "at zero and is level on both sides, as Coulomb friction of 412 N."
    )
    other = replace(found, adds_to="flow_a", of="pressure_a_pa")
    assert sentence([found, other]) == (
        "The simulator lacks 2 terms: force against extension over the velocity, and flow into the "
        "cap side over the cap-side pressure."
    )
