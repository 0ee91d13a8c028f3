# SPDX-License-Identifier: MIT
"""The table of channels agrees with the compiled simulator and has what its readers need."""

import numpy as np
import pytest
from sources import ROOT

import ehsid
from ehsid.harness.catalogue.channels import CHANNELS, REQUIRED_COLUMNS, shown_channel
from ehsid.harness.catalogue.parameters import PLANTS
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.simulation import simulate

RIGS = ROOT / "examples" / "rigs"


@pytest.mark.parametrize("plant", [name for name in PLANTS if name != "simulator"])
def test_what_a_plant_has_is_what_the_simulator_computes(plant: str) -> None:
    name = {"ehs": "bench", "axis": "axis", "linear": "linear"}[plant]
    rig = read_rig(RIGS / f"{name}.toml")
    values = rig.plant_values()
    outputs, _ = ehsid.simulate_plant(plant, [values], np.zeros(10), dt_s=1e-3)
    finite = {
        output
        for output, column in zip(ehsid.plant_outputs(), outputs[0].T, strict=True)
        if np.isfinite(column).all()
    }
    assert finite == {one.name for one in CHANNELS.values() if plant in one.plants}
    assert set(simulate(rig, np.zeros(10), dt_s=1e-3).record.columns) == {"command_v", *finite}


def test_what_is_simulated_has_a_noise_and_what_is_compared_is_simulated() -> None:
    assert set(ehsid.plant_outputs()) == {one.name for one in CHANNELS.values() if one.plants}
    for channel in CHANNELS.values():
        assert (channel.noise is not None) == bool(channel.plants)
        assert not channel.compared or channel.plants


def test_names_end_in_their_unit() -> None:
    endings = {"s": "_s", "V": "_v", "m": "_m", "Pa": "_pa", "m/s": "_m_s", "N": "_n", "1": ""}
    for channel in CHANNELS.values():
        assert channel.name.endswith(endings.get(channel.unit, "_c"))
    assert set(REQUIRED_COLUMNS) <= set(CHANNELS)


def test_an_unknown_channel_is_shown_under_its_name() -> None:
    assert shown_channel("pressure_a_pa") == ("pressure A", 1e-5, "bar")
    assert shown_channel("oil") == ("oil", 1.0, "")


def test_documents_name_every_channel() -> None:
    records = (ROOT / "docs" / "records.md").read_text(encoding="utf-8")
    rigs = (ROOT / "docs" / "rigs.md").read_text(encoding="utf-8")
    for channel in CHANNELS.values():
        (row,) = [
            line
            for line in records.splitlines()
            if line.startswith("| `") and f"`{channel.name}`" in line
        ]
        assert f"| {channel.unit} |" in row
        assert channel.noise is None or f"`{channel.noise}`" in rigs
