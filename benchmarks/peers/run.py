# SPDX-License-Identifier: MIT
"""Our update beside those of others, in one run: python benchmarks/peers/run.py

Builds the recursions of cpp/, checks that all of them find the parameters of batch least squares,
measures time, accuracy in float and how long a held input is survived, and writes a page with
charts that zoom (build/peers/peers.html) and docs/peers.md with its pictures. Needs a C++ compiler
and python -m pip install '.[bench]'; dlib and liquid-dsp come from the system (apt-get install
libdlib-dev libliquid-dev). What is not installed becomes a row that says so. About four minutes on
two cores, of which half is for compiling; nothing else should run meanwhile.

--quick: seconds instead of minutes, only build/peers/; --bank FILE: adds the figures of a bank.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

# Before numpy is imported: threads of its BLAS would wait for each other on matrices this small.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from bank import bank_table
from measuring import TINY, Plan, measure
from native import BUILD, ROOT
from pages import Media, make_page
from results import Results

from ehsid.harness.base.files import write_text
from ehsid.harness.show.page import Page
from ehsid.harness.show.rendering import markdown, write_page, write_pictures

DOCS = ROOT / "docs"


def say(text: str) -> None:
    """Progress, beside the result."""
    print(text, file=sys.stderr, flush=True)


def write_document(page: Page) -> None:
    """docs/peers.md, and its pictures in docs/peers."""
    folder = DOCS / "peers"
    pictures = write_pictures(folder, page)
    text = markdown(page, pictures)
    for picture in pictures:
        text = text.replace(f"]({picture.name})", f"](peers/{picture.name})")
    write_text(DOCS / "peers.md", text)


def wrong_answers(results: Results) -> list[str]:
    """Recursions of ours with a wrong answer: the run then fails."""
    return [
        f"{one.name.text} ({one.name.scalar})"
        for one in results.answers
        if one.name.ours and not one.own and not one.right
    ]


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a run of seconds, without docs/")
    parser.add_argument("--bank", type=Path, help="JSON file with the figures of a bank")
    chosen = parser.parse_args()
    plan = TINY if chosen.quick else Plan()
    bank = bank_table(chosen.bank)
    results = measure(plan, say=say)
    for name, how in results.missing.items():
        say(f"not installed: {name}; {how}")
    BUILD.mkdir(parents=True, exist_ok=True)
    write_page(BUILD / "peers.html", make_page(results, plan, Media(zoomable=True), bank))
    say(f"written: {BUILD / 'peers.html'}")
    if not chosen.quick:
        write_document(make_page(results, plan, Media(zoomable=False), bank))
        say(f"written: {DOCS / 'peers.md'}")
    if wrong := wrong_answers(results):
        sys.exit(f"peers: wrong: {', '.join(wrong)}")


if __name__ == "__main__":
    main()
