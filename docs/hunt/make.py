# SPDX-License-Identifier: MIT
"""Draws the hunt of docs/hunt.md: python docs/hunt/make.py

A press has 8 ms of transport delay, of which its rig file knows nothing. There is one slow record.
"""

import base64
import tempfile
from pathlib import Path

import numpy as np

import ehsid
from ehsid.harness.show.hunt_page import moving_picture
from ehsid.harness.show.rendering import moving

press = ehsid.Rig.new(
    name="press",
    bore="63 mm",
    rod="35 mm",
    stroke="300 mm",
    supply="120 bar",
    mass="120 kg",
    rated_flow="38 l/min",
    rated_drop="70 bar",
    drop_over="both",
    valve_bandwidth="250 Hz",
    viscous_friction="900 N s/m",
    position_noise="10 um",
)
secret = {"effects.transport_delay.delay_s": 0.008}
time_s = np.arange(0.0, 5.0, 0.001)
phase = np.random.default_rng(11).uniform(0.0, 2.0 * np.pi, 4)
slow = 0.3 * np.sin(2.0 * np.pi * np.outer(time_s, [0.31, 0.73, 1.17, 1.61]) + phase).sum(axis=1)
run = ehsid.simulate(press, slow, dt_s=0.001, values=secret, noise=True, seed=11)
record = run.to_polars()[["time_s", "command_v", "position_m"]]
machine = ehsid.Rig(press.result.with_values(secret))
with tempfile.TemporaryDirectory() as folder:
    machine.save(Path(folder) / "secret.toml")
    found = ehsid.hunt(Path(folder) / "secret.toml", press, record)
print(found.summary())
picture = moving(moving_picture(found.hunted))
(Path(__file__).parent / "hunt.png").write_bytes(base64.b64decode(picture.partition(",")[2]))
