# SPDX-License-Identifier: MIT
"""The windows that are shown of an unknown input."""

from __future__ import annotations

import numpy as np
import pytest

from ehsid.harness.diagnosis.result import UnknownInput
from ehsid.harness.show.page import Beside, Note
from ehsid.harness.show.where_section import (
    FURTHER,
    SHOWN_WINDOWS,
    largest_windows,
    unknown_input_card,
)

NODES = 5


def made_input(windows: int, loud: int, of: str = "position_m") -> UnknownInput:
    """Two records of as many windows each; one window of the second record is loud."""
    record = np.repeat([0, 1], windows * NODES)
    window = np.tile(np.repeat(np.arange(windows), NODES), 2)
    value = np.where((record == 1) & (window == loud), 10.0, 1.0)
    time_s = np.tile(0.02 * np.arange(windows * NODES), 2)
    return UnknownInput(
        "force", record, window, time_s, value, np.full(value.size, 0.1), of, time_s, 0.5
    )


@pytest.mark.parametrize(("windows", "loud"), [(9, 0), (9, 4), (9, 8), (4, 2)])
def test_the_windows_around_the_largest_input_are_shown(windows: int, loud: int) -> None:
    found = made_input(windows, loud)
    shown = largest_windows(found)
    assert len(shown) == SHOWN_WINDOWS
    assert {int(found.record[nodes[0]]) for nodes in shown} == {1}
    assert loud in [int(found.window[nodes[0]]) for nodes in shown]
    for nodes in shown:
        assert nodes.size == NODES
        assert len(set(found.window[nodes].tolist())) == 1


def test_a_record_of_few_windows_shows_one() -> None:
    assert len(largest_windows(made_input(2, 1))) == 1


@pytest.mark.slow
@pytest.mark.parametrize("of", ["position_m", *FURTHER])
def test_the_card_names_the_variable(of: str) -> None:
    card = unknown_input_card(made_input(5, 1, of))
    note, pictures = card.blocks
    assert isinstance(note, Note)
    assert isinstance(pictures, Beside)
    words = FURTHER[of][0] if of in FURTHER else "position"
    assert words in note.text
