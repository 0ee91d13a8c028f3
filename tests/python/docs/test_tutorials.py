# SPDX-License-Identifier: MIT
"""The tutorials, how-to pages and explanations do what they say, and print what they show."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from printed_pages import DOCS, made_by, text_of, without_digits
from sources import ROOT
from user_simulators import needs_linux64

MAKE = made_by("tutorials/make.py")


def ran(name: str) -> tuple[str, dict[str, Any]]:
    """Runs a page; returns it as it is made now, and its Python names."""
    page = DOCS / name
    made, names = MAKE["run"](page)
    assert without_digits(made) == without_digits(text_of(page))
    return made, names


def shown(made: str, start: str) -> str:
    """The first line of a page that starts so, without the start."""
    (line, *_) = (line for line in made.splitlines() if line.strip().startswith(start))
    return line.strip().removeprefix(start)


def test_every_page_with_code_is_run_here() -> None:
    source = text_of(Path(__file__))
    pages = [page.relative_to(DOCS).as_posix() for page in MAKE["pages"]()]
    assert len(pages) >= 7
    assert [page for page in pages if f'"{page}"' not in source] == []


def test_pictures_of_the_pages_are_there() -> None:
    for page in MAKE["pages"]():
        for picture in MAKE["PICTURE"].finditer(text_of(page)):
            file = page.parent / picture["folder"] / f"{picture['name']}.png"
            assert 5_000 < file.stat().st_size < 300_000, file


@pytest.mark.thorough
def test_my_rig_in_twenty_minutes() -> None:
    made, names = ran("tutorials/my_rig_in_twenty_minutes.md")
    (effect,) = names["diagnosis"].result.effects
    assert effect.id == "transport_delay"
    secret = names["secret"]["effects.transport_delay.delay_s"]
    assert effect.parameters["delay_s"].low < secret < effect.parameters["delay_s"].high
    # The command and the Python give the same answer.
    assert " ".join(made.split()).count(names["diagnosis"].sentence) == 2
    assert names["rig"].values["fluid.bulk_modulus_pa"] == pytest.approx(1e9)


@pytest.mark.thorough
@needs_linux64
def test_my_simulink_model() -> None:
    _, names = ran("tutorials/my_simulink_model.md")
    assert names["effect"].id == "coulomb_friction"
    assert names["size"].low < names["secret"]["effects.coulomb_friction.force_n"]
    assert names["secret"]["effects.coulomb_friction.force_n"] < names["size"].high
    assert names["answer"].verdict == "effects"


@pytest.mark.thorough
def test_two_causes_are_told_apart_by_the_next_experiment() -> None:
    made, names = ran("how_to/ambiguous.md")
    assert re.search(
        r"The gap is due to transport delay \(\d+ %\), or to sensor lag \(\d+ %\)\.", made
    )
    assert "The gap is due to transport delay: adding it" in made
    # Its size is the first number behind the probability, and the secret of the page is in ms.
    size = float(shown(made.split("## 4.")[1], "│ transport delay │").split()[3])
    secret = names["secret"]["effects.transport_delay.delay_s"]
    assert size == pytest.approx(1e3 * secret, abs=0.6)


@pytest.mark.thorough
def test_estimator_on_my_controller() -> None:
    made, names = ran("tutorials/estimator_on_my_controller.md")
    rows = [
        [float(number) for number in re.findall(r"\d+\.\d+", line)]
        for line in made.splitlines()
        if re.match(r" *\d+\.\d+ s  K = ", line)
    ]
    assert [row[0] for row in rows] == [19.98, 39.98, 59.98, 79.98]
    for time_s, gain, half_width, gain_v_m, adapted_mm, other_mm in rows:
        truth = 30.0 if time_s < 40.0 else 60.0
        assert abs(gain - truth) < half_width < 0.05 * truth
        assert gain_v_m == pytest.approx(5.0e3 / truth, rel=0.03)  # bandwidth / K
        assert adapted_mm < 6.0
        assert (other_mm > 2.0 * adapted_mm) == (time_s > 40.0)
    (suspected, *_) = re.findall(r"(\d+\.\d+) s  gain  80.0 V/m, fixed: change_suspected", made)
    assert 40.0 < float(suspected) < 40.3
    assert "30.00 s  gain  80.0 V/m, fixed: invalid_input" in made
    assert names["record"].dt_s == pytest.approx(names["DT_S"])


@pytest.mark.slow
def test_reproduce_the_paper() -> None:
    made, names = ran("tutorials/reproduce_the_paper.md")
    assert made.count("order 3 is chosen") == 2
    errors = {
        (factor, start): float(names["error"](names["estimated"](*record, factor, start)[0][-1]))
        for record in [names["record"](0.0028)]
        for factor in names["FACTORS"]
        for start in (0.5, 1e6)
    }
    # lambda = 1 keeps a wrong start that is trusted, and no other run does.
    assert errors.pop(("lambda = 1", 0.5)) > 0.2
    assert max(errors.values()) < 0.01
    assert "noise 0.0028, with the reset: 1 resets" in made
    assert "noise 0.151, with the reset: 1 resets" in made
    assert names["reading"].zoh_mismatch > 1.0


@pytest.mark.parametrize(
    "name",
    [
        "explanation/from_servo_to_arx.md",
        "explanation/likelihood_and_decision.md",
        "explanation/recursive_least_squares.md",
        "explanation/sensitivities.md",
    ],
)
def test_explanations(name: str) -> None:
    """Each prints whether its formulas agree with the compiled module."""
    made, _ = ran(name)
    assert "True" in made
    assert "False" not in made


def test_the_effect_of_the_tutorial_is_the_one_that_is_compiled() -> None:
    page = text_of(DOCS / "tutorials/add_an_effect.md")
    assert f"```cpp\n{text_of(ROOT / 'tests/python/catalogue/hard_spring.hpp')}```\n" in page
    listed = "LoadForce<Scalar>, HardSpring<Scalar>"
    assert listed in page
    compiled = text_of(ROOT / "tests/python/catalogue/test_new_effect.py")
    assert listed in compiled


def test_the_policy_of_the_tutorial_is_the_one_that_is_compiled() -> None:
    page = text_of(DOCS / "tutorials/add_a_policy.md")
    (struct,) = re.findall(r"```cpp\n(///.*?)```", page, flags=re.DOTALL)
    assert struct in text_of(ROOT / "tests/cpp/test_new_policy.cpp")
    assert "FRatio<Scalar>>;" in text_of(ROOT / "cpp/include/ehsid/forgetting.hpp")


@pytest.mark.parametrize("name", ["add_an_effect", "add_a_policy"])
def test_files_that_a_tutorial_names_are_there(name: str) -> None:
    page = text_of(DOCS / f"tutorials/{name}.md")
    new = {"effects/hard_spring.hpp", "forgetting/floored_constant.hpp"}
    named = set(re.findall(r"`((?:cpp|docs|python|script|tests|benchmarks)/[\w/.]+)`", page))
    assert len(named) >= 5
    for path in named:
        if not path.endswith(tuple(new)):
            assert (ROOT / path).exists(), path
