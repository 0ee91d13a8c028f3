# SPDX-License-Identifier: MIT
"""Run by test_new_effect.py with a catalogue of one effect more: says what each room makes of it.

Arguments: the project with the further effect, and a folder for the report.
"""

import importlib.util
import json
import sys
from pathlib import Path

import numpy as np

import ehsid
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.diagnosis import diagnose
from ehsid.harness.diagnosis.data.regimes import visited
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.diagnosis.search.identifiability import unidentifiable_effects
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig, read_rig, rig_text
from ehsid.harness.show.gap_page import write_diagnosis
from ehsid.harness.signals.excitation import multisine, triangle
from ehsid.harness.signals.injection import InjectError, inject
from ehsid.harness.signals.simulation import draw_noise, simulate

NAME = "hard_spring"
SIZE = 4e7
DT_S = 2e-3
PRESSURES = ("position_m", "pressure_a_pa", "pressure_b_pa")

project, folder = (Path(argument) for argument in sys.argv[1:])
bench = read_rig(project / "examples" / "rigs" / "bench.toml")
rig = Rig(
    "bench",
    "ehs",
    bench.values,
    sensors={"position_noise_m": 5e-6, "pressure_a_noise_pa": 1e4, "pressure_b_noise_pa": 1e4},
)
machine = rig.with_values({ParameterKey.of_effect(NAME, "stiffness_n_m3"): SIZE})


def record(of: Rig, seed: int, seconds: float, amplitude: float) -> Record:
    """A multisine, then a slow triangle over much of the stroke."""
    rng = np.random.default_rng(seed)
    half = round(0.5 * seconds / DT_S)
    fast = multisine(half, DT_S, band_hz=(0.5, 25.0), rms=1.5, rng=rng)
    command = np.concatenate([fast, triangle(half, DT_S, amplitude=amplitude, period_s=2.0)])
    run = simulate(of, command, dt_s=DT_S, noise=draw_noise(of, command.size, rng)).record
    columns = {name: run.column(name) for name in ("command_v", *PRESSURES)}
    return make_record({"time_s": run.time_s, **columns}, name=f"record{seed}")


fit, held_out = record(machine, 1, 6.0, 3.0), record(machine, 2, 6.0, 3.0)
plain = record(rig, 1, 6.0, 3.0)
others = [
    info.id
    for info in ehsid.effects()
    if info.id not in (NAME, "load_spring", "load_force", "coulomb_friction")
]
folder.mkdir()
diagnosis = diagnose([fit], rig, validate=[held_out], options=DiagnosisOptions(others))
write_diagnosis(folder, diagnosis, [fit, held_out], "rig.toml")
try:
    inject(plain, rig, {NAME: {"stiffness_n_m3": SIZE}})
    refusal = ""
except InjectError as error:
    refusal = str(error)
small = record(machine, 3, 1.0, 0.1)
gallery = importlib.util.spec_from_file_location("make", project / "docs" / "effects" / "make.py")
assert gallery is not None
assert gallery.loader is not None
module = importlib.util.module_from_spec(gallery)
gallery.loader.exec_module(module)
(info,) = (effect for effect in ehsid.effects() if effect.id == NAME)
json.dump(
    {
        "change_m": float(np.abs(fit.column("position_m") - plain.column("position_m")).max()),
        "verdict": diagnosis.verdict,
        "effects": {one.id: one.parameters["stiffness_n_m3"].value for one in diagnosis.effects},
        "tried": [list(one.effects) for one in diagnosis.candidates],
        "augmented": rig_text(diagnosis.augmented_rig),
        "cannot_judge": [one.why for one in unidentifiable_effects([visited(small, rig)], [NAME])],
        "refusal": refusal,
        "document": module.section(info),
    },
    sys.stdout,
)
