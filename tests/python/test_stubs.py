# SPDX-License-Identifier: MIT
import subprocess
import sys
from pathlib import Path

import pytest

import ehsid

# Where pybind11 and the stub must differ:
ALLOWED = r"""
# classes: their metaclass is pybind11's
ehsid\._core\.[A-Z]\w*
# enums: a member of pybind11's own
ehsid\._core\.\w+\.__pybind11_native_enum__
# results, which only the module makes: their __init__ takes anything, and raises
ehsid\._core\.(EffectInfo|PlantParameter|ServoReading|Trajectory)\.__init__
"""


def test_stub_has_every_name_and_argument_of_the_module(tmp_path: Path) -> None:
    allowed = tmp_path / "allowed"
    allowed.write_text(ALLOWED)
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "mypy.stubtest",
            "ehsid._core",
            "--allowlist",
            str(allowed),
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(
    "options",
    [ehsid.Scaling(), ehsid.RlsOptions(), ehsid.RmseResetOptions(), ehsid.ConvergenceOptions()],
)
def test_settings_are_shown_as_they_are_made(options: object) -> None:
    shown = repr(options)
    again = eval(shown, vars(ehsid))  # the text is the call that makes an equal object
    assert repr(again) == shown
    assert shown.startswith(type(options).__name__ + "(")
    assert "=" in shown


def test_signatures_name_no_address() -> None:
    for made in (ehsid.ServoEstimator, ehsid.Rls):
        text = made.__init__.__doc__
        assert text is not None
        assert " at 0x" not in text
        assert "::" not in text
