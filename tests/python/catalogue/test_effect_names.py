# SPDX-License-Identifier: MIT
"""Effects have one name, in sentences and on pages, which reads as words."""

from __future__ import annotations

import pytest

from ehsid.harness.catalogue.parameters import effects, plain_name
from ehsid.harness.diagnosis import in_words


@pytest.mark.parametrize("effect", effects())
def test_sentences_and_pages_say_the_same(effect: str) -> None:
    assert in_words([effect]) == plain_name(effect)
    assert "_" not in plain_name(effect)


def test_ids_that_do_not_read_as_words_have_names_of_their_own() -> None:
    assert plain_name("coulomb_friction_sides") == "Coulomb friction by direction"
    assert plain_name("stribeck_friction") == "Stribeck friction"
    assert in_words(["makeup_check", "load_force"]) == "make-up valve and load force"
