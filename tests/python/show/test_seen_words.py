# SPDX-License-Identifier: MIT
"""How small a cause could still be seen, in words and in units of people."""

from __future__ import annotations

import pytest
from made_diagnoses import made_diagnosis, seen

from ehsid.harness.show.gap_page import render_diagnosis
from ehsid.harness.show.page import Folded, Table
from ehsid.harness.show.seen_words import seen_blocks, seen_sentence, seen_size, seen_table

NB = "\N{NO-BREAK SPACE}"


@pytest.mark.parametrize(
    ("name", "size", "shown"),
    [
        # 5.52e-13 m^3/(s Pa) 1e7 Pa 6e4 (l/min)/(m^3/s) = 0.331 l/min
        ("effects.internal_leakage.coefficient_m3_s_pa", 5.52e-13, "0.33 l/min at 100 bar"),
        # 6e4 1e5 = 6e9: a flow for each bar above the cracking pressure
        ("effects.relief_valve.flow_gain_m3_s_pa", 1e-11, "0.06 l/min per bar"),
        # 6e9 Pa s/m^3 (10 / 6e4) m^3/s = 1e6 Pa
        ("effects.supply_droop.source_resistance_pa_s_m3", 6e9, "10 bar at 10 l/min"),
        ("effects.transport_delay.delay_s", 0.002049, "2 ms"),
        ("effects.load_spring.stiffness_n_m", 13664.0, "14000 N/m"),
        ("effects.valve_dead_band.overlap", 0.004, "0.4 % of rated command"),
        ("effects.flow_gain_drift.rate_1_s", 0.003, "0.3 % in a second"),
    ],
)
def test_sizes_have_the_units_that_are_asked_for(name: str, size: float, shown: str) -> None:
    assert seen_size(name, size).replace(NB, " ") == shown


def test_the_sentence_has_the_effects_that_are_asked_for_first() -> None:
    assert seen_sentence(seen()).replace(NB, " ") == (
        "internal leakage below 0.33 l/min at 100 bar, valve dead band below 0.4 % of rated command"
    )
    assert seen_sentence(seen(), shown=True).startswith("internal leakage from 0.33")
    assert seen_sentence(()) == ""


def test_the_table_says_which_way_is_larger_and_what_decides() -> None:
    lag, band, _, spring = (tuple(map(str, row[1:])) for row in seen_table(seen()).rows)
    assert lag == (f"down from 79{NB}Hz", "with damping 0.8")
    assert band == (f"from 0.4{NB}% of rated command", "every sound servo has what is smaller")
    assert spring == ("at no size", "")


def test_the_page_has_it_folded() -> None:
    first, folded = seen_blocks(seen())
    assert isinstance(folded, Folded)
    assert any(isinstance(block, Table) for block in folded.blocks)
    page = render_diagnosis(made_diagnosis("effects"), [], "rig.toml")
    assert str(first)[:40] in page
    assert "How small a cause could be (4 effects)" in page
    assert seen_blocks(()) == []
