# SPDX-License-Identifier: MIT
"""The page "From Python" prints what it says."""

import pytest
from printed_pages import DOCS, made_by, text_of, without_digits


@pytest.mark.thorough
def test_the_page_runs_and_prints_what_it_says(caplog: pytest.LogCaptureFixture) -> None:
    page = text_of(DOCS / "python.md")
    made, names = made_by("python/make.py")["run"](page)
    assert without_digits(made) == without_digits(page)
    assert page.count("```python") == page.count("```text") == 4
    assert (DOCS / "python" / "diagnosis.png").stat().st_size > 50_000
    (effect,) = names["diagnosis"].result.effects
    assert effect.id == "coulomb_friction"
    assert effect.parameters["force_n"].value == pytest.approx(400.0, rel=0.05)
    assert names["found"].result.simulation_fit_percent > 90.0
    assert "resampled to an even 0.01 s" in caplog.text
