# SPDX-License-Identifier: MIT
"""Makes the picture of a report: python docs/gap/make.py REPORT NAME.png.

It needs the extra browser. user_simulator.png is of the report of
docs/tutorials/my_simulink_model.md.
"""

import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "app"))

from served_workbench import found_browser  # noqa: E402

# The head of the page: the verdict, the answers, and the picture of the gap, whole.
WIDTH = 1000
END = ".bars"
MARGIN = 8


def main() -> None:
    """Opens the report and takes the picture."""
    report, name = Path(sys.argv[1]), sys.argv[2]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=found_browser(), args=["--no-sandbox", "--disable-gpu"]
        )
        page = browser.new_page(viewport={"width": WIDTH, "height": WIDTH}, color_scheme="light")
        page.goto(report.resolve().as_uri())
        path = Path(__file__).with_name(name)
        last = page.locator(END).first.bounding_box()
        height = last["y"] + last["height"] + MARGIN
        page.screenshot(path=path, clip={"x": 0, "y": 0, "width": WIDTH, "height": height})
        browser.close()
    # As many colours as it needs, which is a third of the size.
    Image.open(path).convert("RGB").quantize(128).save(path, optimize=True)


if __name__ == "__main__":
    main()
