# SPDX-License-Identifier: MIT
"""What the forgetting policies say of themselves, and the files that are written from it."""

import inspect
import keyword
import re
import runpy

import pytest
from sources import ROOT

import ehsid

SCRIPT = runpy.run_path(str(ROOT / "script" / "policies.py"))
SETTINGS = [(info, setting) for info in ehsid.policies() for setting in info.settings]


def test_descriptions_name_what_is_there() -> None:
    infos = ehsid.policies()
    assert [info.number for info in infos] == list(range(1, len(infos) + 1))
    assert [info.policy for info in infos] == list(ehsid.Forgetting.__args__)
    assert len({info.id for info in infos}) == len(infos)
    for info in infos:
        assert info.policy.info is info
        assert info.policy.__name__ == info.id.title().replace("_", "")
        assert getattr(ehsid, info.policy.__name__) is info.policy
        assert info.summary
        assert info.source
        assert info.settings


@pytest.mark.parametrize(("info", "setting"), SETTINGS)
def test_a_setting_is_argument_property_and_documented(
    info: ehsid.PolicyInfo, setting: ehsid.PolicySetting
) -> None:
    made = getattr(info.policy(), setting.name)
    assert made == setting.default
    assert setting.name == setting.member + "_" * keyword.iskeyword(setting.member)
    text = inspect.getdoc(info.policy)
    assert text is not None
    assert f"{setting.name} : float" in text
    assert setting.range in text
    assert setting.meaning in text


@pytest.mark.parametrize(("info", "setting"), SETTINGS)
@pytest.mark.parametrize("wrong", [float("nan"), float("inf"), -1.0])
def test_a_setting_out_of_its_range_is_named(
    info: ehsid.PolicyInfo, setting: ehsid.PolicySetting, wrong: float
) -> None:
    expected = f"{setting.name} must be finite and {setting.range}"
    with pytest.raises(ValueError, match=re.escape(expected)):
        info.policy(**{setting.name: wrong})


@pytest.mark.parametrize("path", sorted({path for path, _, _ in SCRIPT["BLOCKS"]}))
def test_files_are_those_of_the_script(path: str) -> None:
    assert (ROOT / path).read_text(encoding="utf-8") == SCRIPT["files"]()[path], (
        "write them anew: python script/policies.py"
    )


def test_the_script_replaces_only_its_block() -> None:
    text = "before\n# x: written by script/policies.py\nold\n# end of x\nbehind\n"
    assert SCRIPT["with_block"](text, "x", "new\n") == text.replace("old", "new")
    with pytest.raises(ValueError, match="0 blocks named y"):
        SCRIPT["with_block"](text, "y", "new\n")


@pytest.mark.parametrize(
    ("policy", "forgets"),
    [
        (ehsid.Constant(), True),
        (ehsid.Constant(1.0), False),
        (ehsid.Exponential(), True),
        (ehsid.Exponential(0.99, 1.0), False),
        (ehsid.ErrorDriven(), True),
        (ehsid.FRatio(), False),
    ],
)
def test_which_policies_forget_the_start(policy: ehsid.Forgetting, forgets: bool) -> None:
    assert policy.forgets_the_start is forgets
