# SPDX-License-Identifier: MIT
"""Makes a rig of what an engineer knows of her machine; typical values fill the rest.

Rig of the published experiment, which commands use if no rig file is given.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from importlib.resources import files

from ..catalogue.parameters import plant_parameters
from . import quantities
from .checks import RigError
from .quantities import Quantity, Typical
from .rig import Rig
from .rig_file import Entry, parse_rig

# Relative 1-sigma of what is given, with the reason.
GIVEN = {
    "bore": (0.002, "from the drawing"),
    "rod": (0.002, "from the drawing"),
    "stroke": (0.002, "from the drawing"),
    "supply": (0.03, "accuracy of a manometer"),
    "tank": (0.2, "changes with flow and filter"),
    "mass": (0.05, "weighed, or summed up from drawings"),
    "rated-flow": (0.1, "tolerance of data sheets"),
    "rated-drop": (0.001, "defines the rated flow"),
    "rated-command": (0.001, "defines the rated flow"),
    "valve-bandwidth": (0.2, "depends on amplitude and supply"),
    "bulk-modulus": (0.15, "depends on air, pressure and temperature"),
    "dead-volume": (0.1, "from the drawing"),
    "friction": (0.3, "changes with pressure, temperature and age"),
    "viscous-friction": (0.3, "changes with temperature"),
    "force-gain": (0.05, "constants of motor and amplifier"),
}
LINES = (0.2, "lines as given, and 5 % of the swept volume for ports")


def ehs_entries(known: Mapping[str, Quantity], *, double_rod: bool, hoses: bool) -> list[Entry]:
    """Returns all values of a servo.

    Parameters
    ----------
    known
        what is known, by the names of `GIVEN`, "line-length", "line-bore", "accumulator-volume",
        "accumulator-precharge", "oil", "position-noise" and "pressure-noise"; with at least bore,
        rod, stroke, supply and rated-flow.
    double_rod
        whether the rod is on both sides; the simulator then has a piston of the same area without
        a rod.
    hoses
        whether flexible hoses connect valve and cylinder.

    Raises
    ------
    RigError
        the rod is not thinner than the bore, a length is not above 0, or the accumulator cannot be
        that of this supply.
    """
    problems = [
        f"--{name} {known[name].text}: expected more than 0"
        for name in ("bore", "stroke", "supply", "rated-flow")
        if known[name].value <= 0.0
    ]
    if not 0.0 <= known["rod"].value < known["bore"].value:
        problems.append(
            f"--rod {known['rod'].text}: expected a rod thinner than the bore, --bore "
            f"{known['bore'].text}"
        )
    if problems:
        raise RigError("rig new", problems)
    entries = _Entries(known)
    bore, rod = _piston(entries, double_rod)
    entries.given("cylinder.stroke_m", "stroke")
    stroke = entries.values["cylinder.stroke_m"]
    cap = 0.25 * math.pi * bore**2
    annulus = cap - 0.25 * math.pi * rod**2
    for side, area in (("a", cap), ("b", annulus)):
        _dead_volume(entries, f"cylinder.dead_volume_{side}_m3", area * stroke)
    oil = entries.either("fluid.bulk_modulus_pa", "bulk-modulus", quantities.bulk_modulus(hoses))
    half = 0.5 * stroke
    stiffness = oil * sum(
        area**2 / (entries.values[f"cylinder.dead_volume_{side}_m3"] + area * half)
        for side, area in (("a", cap), ("b", annulus))
    )
    entries.either("load.mass_kg", "mass", quantities.load_mass(stiffness))
    supply = entries.given("supply.pressure_pa", "supply")
    tank = entries.either("supply.tank_pressure_pa", "tank", quantities.tank_pressure())
    flow = entries.given("valve.rated_flow_m3_s", "rated-flow")
    drop = entries.either("valve.rated_pressure_drop_pa", "rated-drop", quantities.rated_drop())
    entries.either("valve.rated_command_v", "rated-command", quantities.rated_command())
    if min(drop, supply - tank) <= 0.0:
        raise RigError(
            "rig new", ["expected a rated drop above 0 and a supply above the tank pressure"]
        )
    # At full opening without load, about half the pressure is lost at each edge.
    speed = flow * math.sqrt(0.5 * (supply - tank) / drop) / cap
    entries.either(
        "load.viscous_friction_n_s_m",
        "viscous-friction",
        quantities.viscous_friction(
            supply * cap, speed, known["oil"].value if "oil" in known else None
        ),
    )
    if "accumulator-volume" in known:
        _accumulator(entries, supply, flow)
    entries.either(
        "effects.valve_lag.bandwidth_hz", "valve-bandwidth", quantities.valve_bandwidth(flow, drop)
    )
    entries.typical("effects.valve_lag.damping", quantities.valve_damping())
    if "friction" in known:
        entries.given("effects.coulomb_friction.force_n", "friction")
    entries.sensor("position_noise_m", "position-noise", quantities.position_noise(stroke))
    entries.sensor("velocity_noise_m_s", "", quantities.VELOCITY_NOISE_M_S)
    for name in ("pressure_a_noise_pa", "pressure_b_noise_pa", "supply_pressure_noise_pa"):
        entries.sensor(name, "pressure-noise", quantities.pressure_noise(supply))
    entries.sensor("spool_noise", "", quantities.SPOOL_NOISE)
    return entries.all


def axis_entries(known: Mapping[str, Quantity]) -> list[Entry]:
    """Returns all values of a motor-driven axis; `known` has at least mass and force-gain."""
    entries = _Entries(known)
    mass = entries.given("axis.mass_kg", "mass")
    entries.given("axis.force_per_volt", "force-gain")
    entries.either(
        "axis.viscous_friction_n_s_m", "viscous-friction", quantities.axis_friction(mass)
    )
    if "friction" in known:
        entries.given("effects.coulomb_friction.force_n", "friction")
    entries.sensor("position_noise_m", "position-noise", quantities.position_noise(0.0))
    return entries.all


class _Entries:
    """Entries as they are made, with their values by full name."""

    def __init__(self, known: Mapping[str, Quantity]) -> None:
        self.known = known
        self.all: list[Entry] = []
        self.values: dict[str, float] = {}

    def add(self, entry: Entry) -> float:
        self.all.append(entry)
        self.values[entry.key] = entry.value
        return entry.value

    def given(self, key: str, name: str) -> float:
        quantity = self.known[name]
        sigma, why = GIVEN[name]
        if quantity.sigma is not None:
            sigma, why = quantity.sigma, "uncertainty as given"
        return self.add(Entry(key, quantity.value, sigma, True, quantity.text, why))

    def typical(self, key: str, value: Typical) -> float:
        # A rule for usual machines can lead out of the range of the plant where the given values
        # do not fit each other, such as a large cylinder with a tiny valve.
        limits = plant_parameters()[key]
        number = min(max(value.value, limits.minimum), limits.maximum)
        return self.add(Entry(key, number, value.sigma, False, shown(key, number), value.why))

    def either(self, key: str, name: str, value: Typical) -> float:
        return self.given(key, name) if name in self.known else self.typical(key, value)

    def sensor(self, key: str, name: str, value: float) -> None:
        full = f"sensors.{key}"
        if name in self.known:
            quantity = self.known[name]
            self.add(Entry(full, quantity.value, None, True, quantity.text, "noise, 1-sigma"))
        else:
            why = "noise of a usual sensor, 1-sigma"
            self.add(Entry(full, value, None, False, shown(full, value), why))


def _piston(entries: _Entries, double_rod: bool) -> tuple[float, float]:
    """Adds bore and rod; returns them, m."""
    if not double_rod:
        return (
            entries.given("cylinder.bore_m", "bore"),
            entries.given("cylinder.rod_m", "rod"),
        )
    bore, rod = entries.known["bore"], entries.known["rod"]
    # Both sides have the area of a piston of this bore without a rod.
    same = math.sqrt(bore.value**2 - rod.value**2)
    why = f"a piston of {bore.text} with a rod of {rod.text} on both sides has this area"
    sigma = GIVEN["bore"][0]
    entries.add(Entry("cylinder.bore_m", same, sigma, True, shown("_m", same), why))
    entries.add(Entry("cylinder.rod_m", 0.0, sigma, True, "0 mm", "both sides are equal"))
    return same, 0.0


def _dead_volume(entries: _Entries, key: str, swept_m3: float) -> None:
    known = entries.known
    if "dead-volume" in known:
        entries.given(key, "dead-volume")
    elif "line-length" in known and "line-bore" in known:
        line = 0.25 * math.pi * known["line-bore"].value ** 2 * known["line-length"].value
        volume = line + quantities.port_volume(swept_m3)
        entries.add(Entry(key, volume, LINES[0], True, shown(key, volume), LINES[1]))
    else:
        entries.typical(key, quantities.dead_volume(swept_m3))


def _accumulator(entries: _Entries, supply_pa: float, flow_m3_s: float) -> None:
    """Adds the droop of a supply with an accumulator of known volume and pre-charge.

    Raises
    ------
    RigError
        the volume or the pre-charge is impossible, or so large that nothing droops.
    """
    volume, precharge = (entries.known[f"accumulator-{name}"] for name in ("volume", "precharge"))
    if volume.value <= 0.0 or not 0.0 < precharge.value < supply_pa:
        raise RigError(
            "rig new",
            [
                f"--accumulator-volume {volume.text}, --accumulator-precharge {precharge.text}: "
                "expected a volume above 0 and a pre-charge between 0 and the supply pressure"
            ],
        )
    key = "effects.supply_droop.accumulator_capacitance_m3_pa"
    found = quantities.accumulator_capacitance(volume.value, precharge.value, supply_pa)
    most = plant_parameters()[key].maximum
    if found.value > most:
        raise RigError(
            "rig new",
            [
                f"--accumulator-volume {volume.text}: it stores {found.value:.2g} m^3/Pa, expected "
                f"{most:g} at most; with so large an accumulator the supply pressure is constant: "
                "leave it out"
            ],
        )
    text = f"{volume.text}, charged to {precharge.text}"
    entries.add(Entry(key, found.value, found.sigma, True, text, found.why))
    entries.typical(
        "effects.supply_droop.source_resistance_pa_s_m3",
        quantities.source_resistance(supply_pa, flow_m3_s),
    )


# Ending of a full name -> factor from SI, and unit, in which engineers read the value.
_SHOWN = (
    ("_pa_s_m3", 1e-5 / 6e4, "bar per l/min"),
    ("_m3_pa", 1e11, "cm³/bar"),
    ("_m3", 1e6, "cm³"),
    ("_m3_s", 6e4, "l/min"),
    ("bulk_modulus_pa", 1e-9, "GPa"),
    ("_pa", 1e-5, "bar"),
    ("noise_m", 1e6, "µm"),
    ("noise_m_s", 1e3, "mm/s"),
    ("_kg", 1.0, "kg"),
    ("_n_s_m", 1.0, "N s/m"),
    ("_hz", 1.0, "Hz"),
    ("_m", 1e3, "mm"),
    ("_v", 1.0, "V"),
)


def shown(key: str, value: float) -> str:
    """Returns a value in the units of engineers."""
    for ending, factor, unit in _SHOWN:
        if key.endswith(ending):
            return f"{factor * value:.4g} {unit}"
    return f"{value:.4g}"


NAME = "published.toml"


def published_rig() -> Rig:
    """Returns the rig of the published experiment.

    Values that the paper does not give are chosen, see published.toml beside this file.
    """
    return parse_rig(published_text(), source=NAME)


def published_text() -> str:
    """Returns the rig file of the published experiment."""
    return files("ehsid.harness.rigs").joinpath(NAME).read_text(encoding="utf-8")
