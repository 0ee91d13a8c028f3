# SPDX-License-Identifier: MIT
"""The Python of the page "From a record to the firmware" runs and prints what the page says."""

import pytest
from printed_pages import DOCS, made_by, text_of, without_digits


@pytest.mark.slow
def test_the_page_runs_and_prints_what_it_says() -> None:
    page = text_of(DOCS / "export.md")
    made, names = made_by("blocks.py")["run"](page)
    assert without_digits(made) == without_digits(page)
    assert page.count("```python") == 1
    assert len(names["estimator"].theta_hat) == names["orders"].n_parameters == 7
