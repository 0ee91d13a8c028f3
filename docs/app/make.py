# SPDX-License-Identifier: MIT
"""Makes the pictures of docs/app.md: python docs/app/make.py, with the extras app and browser."""

import sys
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT / "tests" / "python"), str(ROOT / "tests" / "app")]

from app_diagnosed import diagnosed_session  # noqa: E402
from app_sessions import ANSWERS, german_log  # noqa: E402
from made_history import made_history  # noqa: E402
from served_workbench import Served, found_browser  # noqa: E402

from ehsid.harness.rigs.questions import QUESTIONS  # noqa: E402

OUT = Path(__file__).parent
STEPS = ("Load", "Map", "Rig", "Check", "Model", "Gap", "Next")
WIDE = {"width": 1400, "height": 900}
COLOURS = 128  # of a picture: enough for plots, and a quarter of the size


def shoot(page: Any, step: str) -> None:
    """Takes a picture of a page."""
    page.evaluate("scrollTo(0, 0)")
    page.locator("body:not(.busy)").wait_for()
    page.wait_for_timeout(1500)
    path = OUT / f"{step.lower()}.png"
    page.screenshot(path=path)
    lighten(path)


def lighten(path: Path) -> None:
    """Keeps the colours that a picture needs."""
    Image.open(path).convert("RGB").quantize(COLOURS).save(path, optimize=True)


def film() -> None:
    """Makes one moving picture of the steps."""
    names = ("load", "map", "rig", "check", "model", "recursive", "so_far", "gap", "next")
    frames = [Image.open(OUT / f"{name}.png").convert("RGB").resize((910, 585)) for name in names]
    palette = [frame.quantize(64) for frame in frames]
    palette[0].save(
        OUT / "steps.gif", save_all=True, append_images=palette[1:], duration=2500, loop=0
    )


def walk(page: Any, logs: list[Path]) -> None:
    """Goes through all steps."""
    page.get_by_text("Drop logs here").wait_for()
    page.locator("input[type=file]").set_input_files([str(log) for log in logs])
    for step, following in zip(STEPS, (*STEPS[1:], ""), strict=True):
        page.get_by_role("heading", name=step, level=1).wait_for()
        if step == "Rig":
            words = {one.name: one.words for one in QUESTIONS["ehs"]}
            for name, text in ANSWERS.items():
                page.get_by_label(words[name], exact=True).fill(text)
                page.keyboard.press("Tab")
        if step == "Model":
            page.get_by_role("button", name="Identify").click()
            page.get_by_text("on the validation half").first.wait_for()
        if step == "Gap":
            page.get_by_role("button", name="Start the diagnosis").click()
            page.locator("b", has_text="fitting the best effects at length").wait_for()
            page.screenshot(path=OUT / "so_far.png")
            lighten(OUT / "so_far.png")
            page.get_by_text("report, to be sent").wait_for()
        onward = "Next: use what was found" if following == "Next" else f"Next: {following}"
        if following:
            page.get_by_role("button", name=onward, exact=True).wait_for()
        shoot(page, step)
        if step == "Model":
            page.get_by_role("button", name="Recursive", exact=True).click()
            page.get_by_text("Computed with the code of the firmware").wait_for()
            shoot(page, "Recursive")
        if following:
            page.get_by_role("button", name=onward, exact=True).click()


def views(page: Any, folder: Path) -> None:
    """Shows the pages beside the steps."""
    for name, verdict in (("Presse 8", "ambiguous"), ("Presse 9", "no_gap")):
        diagnosed_session(folder / name.replace(" ", "_"), verdict)
    page.get_by_role("link", name="Machines").click()
    page.get_by_role("link", name="Presse_9").wait_for()
    shoot(page, "Machines")
    made_history(folder.parent / "history")
    page.get_by_role("link", name="Begin a new history").click()
    page.get_by_label("folder of the history").fill(str(folder.parent / "history"))
    page.get_by_label("folder of the history").press("Tab")
    page.get_by_role("button", name="Only show the history").click()
    page.frame_locator("iframe").get_by_text("Something changed").wait_for()
    shoot(page, "History")
    page.get_by_role("link", name="Playground").click()
    page.get_by_text("Switch an effect on").wait_for()
    for effect in ("Valve dead band", "Load spring"):
        page.get_by_role("checkbox", name=effect, exact=True).check()
        page.get_by_text("simulated in").wait_for()
    shoot(page, "Playground")


def live(page: Any, root: str) -> None:
    """Takes a picture of a run in which an effect was moved."""
    page.goto(f"{root}/live")
    page.get_by_role("button", name="Start", exact=True).click()
    page.get_by_role("button", name="Store a snapshot").wait_for()
    page.wait_for_timeout(15_000)
    page.locator(".noUi-handle").first.focus()
    for _ in range(10):
        page.keyboard.press("ArrowRight")
    page.wait_for_timeout(10_000)
    shoot(page, "Live")
    page.get_by_role("button", name="Stop").click()
    page.get_by_text("bit for bit").first.wait_for()


def main() -> None:
    """Makes all pictures."""
    with tempfile.TemporaryDirectory() as top, sync_playwright() as playwright:
        logs = [german_log(Path(top) / f"Lauf {i}.csv", 10.0, float(i)) for i in (1, 2)]
        served = Served(Path(top) / "machines")
        browser = playwright.chromium.launch(
            executable_path=found_browser(), args=["--no-sandbox", "--disable-gpu"]
        )
        page = browser.new_page(viewport=WIDE)
        page.set_default_timeout(600_000)
        page.goto(served.address)
        walk(page, logs)
        film()
        views(page, Path(top) / "machines")
        live(page, served.root)
        browser.close()
        served.stop()


if __name__ == "__main__":
    main()
