# SPDX-License-Identifier: MIT
"""Makes the pictures of the documents: python docs/pictures/make.py."""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from ehsid.harness.fitness import RecordCheck, check_rig
from ehsid.harness.rigs import read_rig
from ehsid.harness.show.rig_check import rig_check_figure
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import draw_noise, simulate

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "examples"
sys.path.insert(0, str(EXAMPLES))

from withheld_record import found_in_records, position_figure  # noqa: E402  the folder is known only now

DT_S, SAMPLES, SEED = 1e-3, 10_000, 1
# The rig file says so much less than the flow of the valve.
FLOW_FACTOR = 1.4


def too_small_flow() -> RecordCheck:
    """The bench on a multisine, checked with a rig file whose rated flow is too small."""
    rig = read_rig(EXAMPLES / "rigs" / "bench.toml")
    rng = np.random.default_rng(SEED)
    command = multisine(SAMPLES, DT_S, band_hz=(0.5, 10.0), peak=5.0, rng=rng)
    run = simulate(rig, command, dt_s=DT_S, noise=draw_noise(rig, SAMPLES, rng))
    flow = "valve.rated_flow_m3_s"
    wrong = rig.with_values({flow: rig.values[flow] / FLOW_FACTOR})
    return check_rig(replace(run.record, name="run1"), wrong)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        found = found_in_records(Path(folder), lambda share: None)
    position_figure(found).savefig(HERE / "first_run.png", dpi=100)
    check = too_small_flow()
    rig_check_figure(check).savefig(HERE / "rig_check.png", dpi=120)
    for finding in check.findings:
        print(f"{finding.check}: {finding.status}: {finding.text}")
