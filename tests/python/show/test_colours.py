# SPDX-License-Identifier: MIT
"""One table of colours: nothing that draws has a colour of its own, and each can be seen."""

import ast
import re
from pathlib import Path

import pytest
from matplotlib.colors import CSS4_COLORS, to_rgb

import ehsid.harness.show.plotting as table
from ehsid.workbench.look import THEMES

CODE = Path(__file__).parents[3]
DRAWING = ("python/harness/show", "python/hil", "python/lab", "python/workbench", "examples")
# The colours of lines, and those of paper and ink of the workbench.
TABLES = {Path(table.__file__).name, "look.py"}
OWN = re.compile(r"#[0-9a-fA-F]{3,8}|0?\.\d+|tab:\w+|[a-z]")


def own_colours(text: str) -> list[str]:
    """Colours in the text of a module: any hexadecimal one, and names given for a colour."""
    found = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            found += re.findall(r"#(?:[0-9a-fA-F]{6}|[0-9a-fA-F]{3})$", node.value)
        if isinstance(node, ast.keyword) and node.arg and "color" in node.arg:
            value = node.value.value if isinstance(node.value, ast.Constant) else ""
            if isinstance(value, str) and (value in CSS4_COLORS or OWN.fullmatch(value)):
                found.append(value)
    return found


def test_own_colours_are_seen() -> None:
    text = "plot(color='red')\nplot(facecolor='0.5')\nGRID = '#d5dae0'\nplot(color='C1', y='#x')"
    assert sorted(own_colours(text)) == ["#d5dae0", "0.5", "red"]


def test_no_module_has_colours_of_its_own() -> None:
    modules = [path for folder in DRAWING for path in (CODE / folder).rglob("*.py")]
    assert len(modules) > 100
    own = {
        str(path.relative_to(CODE)): colours
        for path in modules
        if path.name not in TABLES and (colours := own_colours(path.read_text(encoding="utf-8")))
    }
    assert own == {}


def luminance(colour: str) -> float:
    """The relative luminance as WCAG 2.2 defines it."""
    parts = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in to_rgb(colour)]
    return sum(share * part for share, part in zip((0.2126, 0.7152, 0.0722), parts, strict=True))


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_lines_stand_out_from_the_ground(theme: str) -> None:
    """WCAG 2.2 asks of what is drawn a contrast of 3."""
    together = (
        {"measured", "nominal", "calibrated", "augmented"},
        {"measured", "calibrated", "second", "third"},
    )
    assert set(table.ROLES[theme]) == set.union(*together)
    for roles in together:
        assert len({table.ROLES[theme][role] for role in roles}) == 4
    for colour in table.ROLES[theme].values():
        pair = sorted(luminance(one) + 0.05 for one in (colour, THEMES[theme]["paper"]))
        assert pair[1] / pair[0] >= 3.0, colour


def test_the_style_sheet_of_the_pages_has_the_same_colours() -> None:
    sheet = (CODE / "python/harness/show/templates/page.css").read_text(encoding="utf-8")
    for name in ("nominal", "calibrated", "augmented"):
        found = re.findall(rf"--{name}: (#[0-9a-f]{{6}});", sheet)
        assert found == [table.ROLES[theme][name] for theme in ("light", "dark")]
