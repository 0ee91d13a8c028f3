# SPDX-License-Identifier: MIT
"""How fast the workbench pans and zooms: python benchmarks/app_speed.py [--samples 1e7]

Makes a record, opens it in the step Map in a real browser, turns the wheel and drags over a plot,
and measures the time from each event until the browser has drawn the new points. Needs the extras
app and browser, and Chromium.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "app"))

from served_workbench import Served, found_browser  # noqa: E402

TIMES = 20
# Resolves with the time in ms from the event until new points are drawn. All lines change together.
CHANGED = """() => new Promise((done) => {
  let began = null;
  for (const event of ["wheel", "pointermove"]) {
    addEventListener(event, () => { began ??= performance.now(); }, {capture: true, once: true});
  }
  const sources = Bokeh.documents.flatMap((one) => [...one.all_models])
    .filter((one) => one.type === "ColumnDataSource");
  const changed = () => {
    for (const source of sources) source.properties.data.change.disconnect(changed);
    requestAnimationFrame(() => requestAnimationFrame(() => done(performance.now() - began)));
  };
  for (const source of sources) source.properties.data.change.connect(changed);
})"""


def record(path: Path, samples: int) -> None:
    """Writes a record of three signals, 1 ms a sample."""
    rng = np.random.default_rng(1)
    time_s = 1e-3 * np.arange(samples)
    command = np.sin(0.7 * time_s) + 0.3 * np.sin(9.0 * time_s)
    position = 0.1 + 1e-2 * np.sin(0.7 * time_s - 1.0) + 1e-5 * rng.standard_normal(samples)
    pressure = 6e6 + 1e6 * command + 1e4 * rng.standard_normal(samples)
    columns = {"time_s": time_s, "command_v": command, "position_m": position}
    pl.DataFrame(columns | {"pressure_a_pa": pressure}).write_parquet(path)


def measured(page: Any, act: Any) -> float:
    """Returns the time in ms from an event until its points are drawn."""
    page.evaluate(f"window.ehsidChanged = ({CHANGED})(); null")
    act()
    return float(page.evaluate("window.ehsidChanged"))


def shown(name: str, times: list[float]) -> None:
    """Prints median and range."""
    print(f"| {name} | {np.median(times):.0f} ms | {min(times):.0f} to {max(times):.0f} ms |")


def main() -> None:
    """Measures, and prints a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=float, default=1e7)
    samples = int(parser.parse_args().samples)
    with tempfile.TemporaryDirectory() as top, sync_playwright() as playwright:
        log = Path(top) / "long.parquet"
        record(log, samples)
        served = Served(Path(top) / "machines")
        browser = playwright.chromium.launch(
            executable_path=found_browser(), args=["--no-sandbox", "--disable-gpu"]
        )
        page = browser.new_page(viewport={"width": 1400, "height": 1000})
        page.set_default_timeout(600_000)
        page.goto(served.address)
        began = time.monotonic()
        page.get_by_label("or the path of a file or folder on this machine").fill(str(log))
        page.get_by_role("button", name="Add").click()
        page.get_by_role("button", name="Next: Map").click()
        page.get_by_text(f"{samples} samples").wait_for()
        read_s = time.monotonic() - began
        plot = page.locator(".bk-Figure").first
        plot.scroll_into_view_if_needed()
        box = plot.bounding_box()
        x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
        page.mouse.move(x, y)
        zooms = [measured(page, lambda: page.mouse.wheel(0, -240)) for _ in range(TIMES)]

        def pan(number: int) -> None:
            page.mouse.move(x + 20 * (number % 2 or -1), y)

        page.mouse.down()
        pan(0)
        page.wait_for_timeout(1000)
        pans = [measured(page, lambda number=number: pan(number)) for number in range(1, TIMES)]
        page.mouse.up()
        browser.close()
        served.stop()
    print(f"{samples} samples, read and drawn the first time in {read_s:.0f} s\n")
    print("| what | median | range |\n|---|---|---|")
    shown("wheel", zooms)
    shown("drag", pans)


if __name__ == "__main__":
    main()
