# SPDX-License-Identifier: MIT
"""Fuzzes commands of ehsid with records, rigs or options that hypothesis makes.

    python tests/fuzz/fuzz_commands.py TARGET SECONDS SEED FOLDER

FOLDER gets `running.json`, the example that is running, which explains a process that died;
`statistics.json`; and `finding.json`, the smallest example that hypothesis has found. Exit code 1
with a finding.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import time
from pathlib import Path

# Before numpy and polars are imported: small limits, and one thread each.
os.environ |= {
    "OPENBLAS_NUM_THREADS": "1",
    "POLARS_MAX_THREADS": "1",
    "EHSID_MAX_BYTES": str(2**24),
    "EHSID_MAX_SAMPLES": "200000",
}

import hypothesis
from commands import Example, Finding, check
from hypothesis import HealthCheck, Phase, given, settings
from strategies import TARGETS

MEMORY_BYTES = 4 * 2**30  # of addresses; the libraries alone take 1 GiB
EXAMPLES = 200  # of one run of hypothesis: then it begins anew with the next seed
REPORT_S = 10.0


class Hunt:
    """Runs examples until the time is up.

    Attributes
    ----------
    runs
        examples so far.
    messages
        different first lines of the output: how far the examples reach.
    """

    def __init__(self, name: str, seconds: float, folder: Path) -> None:
        self.runs = 0
        self.messages: set[str] = set()
        self._strategy = TARGETS[name]()
        self._end = time.monotonic() + seconds
        self._folder = folder
        self._reported = 0.0
        self._smallest: tuple[Example, str] | None = None

    def run(self, seed: int) -> tuple[Example, str] | None:
        """Returns the smallest example that fails, and why; None where none was found in time."""
        while time.monotonic() < self._end:
            try:
                self._round(seed)
            except (BaseExceptionGroup, Finding):
                return self._smallest
            seed += 1
        return None

    def _round(self, seed: int) -> None:
        @hypothesis.seed(seed)
        @settings(
            max_examples=EXAMPLES,
            deadline=None,
            database=None,
            phases=(Phase.generate, Phase.shrink),
            suppress_health_check=list(HealthCheck),
        )
        @given(self._strategy)
        def attempt(example: Example) -> None:
            if time.monotonic() < self._end or self._smallest is not None:
                self._run_one(example)

        attempt()

    def _run_one(self, example: Example) -> None:
        (self._folder / "running.json").write_text(example.to_json(), encoding="utf-8")
        self.runs += 1
        try:
            printed = check(example)
        except Finding as finding:
            self._smallest = (example, str(finding))
            raise
        self.messages.add(printed.strip().splitlines()[0][:60])
        if time.monotonic() - self._reported > REPORT_S:
            self._reported = time.monotonic()
            self.write_statistics()

    def write_statistics(self) -> None:
        """Writes how many examples were run, and how many different answers they got."""
        plain = {"executions": self.runs, "answers": len(self.messages)}
        (self._folder / "statistics.json").write_text(json.dumps(plain), encoding="utf-8")


def main() -> int:
    """Runs one target; returns the exit code."""
    name, seconds, seed, folder = sys.argv[1], float(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    hunt = Hunt(name, seconds, Path(folder))
    found = hunt.run(seed)
    hunt.write_statistics()
    if found is None:
        return 0
    example, why = found
    (Path(folder) / "finding.json").write_text(example.to_json(), encoding="utf-8")
    print(f"{name}: ehsid {' '.join(map(repr, example.arguments))}: {why}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
