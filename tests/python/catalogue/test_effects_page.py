# SPDX-License-Identifier: MIT
"""The page of the effects says what the compiled catalogue says."""

from collections.abc import Callable

import pytest
from sources import ROOT, loaded

import ehsid

PAGE = (ROOT / "docs" / "effects.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def section() -> Callable[[ehsid.EffectInfo], str]:
    made: Callable[[ehsid.EffectInfo], str]
    made = loaded(ROOT / "docs" / "effects" / "make.py").section
    return made


@pytest.mark.parametrize("effect", ehsid.effects(), ids=lambda effect: effect.id)
def test_the_page_has_the_effect_as_it_is(
    effect: ehsid.EffectInfo, section: Callable[[ehsid.EffectInfo], str]
) -> None:
    assert section(effect) in PAGE, "run docs/effects/make.py"
    assert (ROOT / "docs" / "effects" / f"{effect.id}.png").is_file()
