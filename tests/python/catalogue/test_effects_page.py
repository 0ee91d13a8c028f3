# SPDX-License-Identifier: MIT
"""The page of the effects says what the compiled catalogue says."""

import importlib.util
from collections.abc import Callable

import pytest
from sources import ROOT

import ehsid

PAGE = (ROOT / "docs" / "effects.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def section() -> Callable[[ehsid.EffectInfo], str]:
    spec = importlib.util.spec_from_file_location("make", ROOT / "docs" / "effects" / "make.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    made: Callable[[ehsid.EffectInfo], str] = module.section
    return made


@pytest.mark.parametrize("effect", ehsid.effects(), ids=lambda effect: effect.id)
def test_the_page_has_the_effect_as_it_is(
    effect: ehsid.EffectInfo, section: Callable[[ehsid.EffectInfo], str]
) -> None:
    assert section(effect) in PAGE, "run docs/effects/make.py"
    assert (ROOT / "docs" / "effects" / f"{effect.id}.png").is_file()
