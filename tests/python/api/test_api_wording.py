# SPDX-License-Identifier: MIT
import pytest

from ehsid.harness.api.wording import in_python, in_python_words


@pytest.mark.parametrize(
    ("command", "python"),
    [
        ("--duration 0, --dt 1e-05: expected", "duration_s=0, dt_s=1e-05: expected"),
        ("such as --map 'time_s=COLUMN [ms]'", "such as maps={'time_s': 'COLUMN [ms]'}"),
        ("--line-length, --line-bore: both", "line_length, line_bore: both"),
        ("--position0 -1: expected", "position0_m=-1: expected"),
        ("--amplitude 5 V", "amplitude=5 V"),
        ("name them with --map", "name them with maps"),
        ("my--file.csv: 3 -- 4", "my--file.csv: 3 -- 4"),
    ],
)
def test_options_become_arguments(command: str, python: str) -> None:
    assert in_python_words(command) == python


def test_an_error_keeps_its_type_and_changes_its_words() -> None:
    class OtherError(ValueError):
        pass

    with pytest.raises(OtherError, match=r"^dt_s=0: no$"), in_python():
        raise OtherError("--dt 0: no")
