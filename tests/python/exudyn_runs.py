# SPDX-License-Identifier: MIT
"""A servo as a model of exudyn: its HydraulicActuatorSimple between the ground and a mass.

The actuator has our two pressure equations and the square-root law; its valve is one signed
opening a chamber. Importing this skips the tests of the importing file where exudyn is not.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from plant_reference import ATMOSPHERE

exudyn = pytest.importorskip(
    "exudyn",
    reason="exudyn cannot be imported: no wheel for this platform, or no libGL.so.1 (libgl1)",
    exc_type=ImportError,
)

FloatArray = npt.NDArray[np.float64]
OUTPUTS = ("position_m", "velocity_m_s", "pressure_a_pa", "pressure_b_pa")
# m, between the bushings with the rod in: the direction of its force needs a length.
OFFSET = 0.3


def areas(rig: Mapping[str, float]) -> tuple[float, float]:
    cap = np.pi / 4.0 * rig["cylinder.bore_m"] ** 2
    return cap, cap - np.pi / 4.0 * rig["cylinder.rod_m"] ** 2


def actuator(rig: Mapping[str, float], walls: float) -> dict[str, float]:
    """Parameters of the actuator; walls: modulus of cylinder and hoses, Pa, zero where rigid.

    Pressures are gauge: there is no atmosphere on the rod then.
    """
    area_a, area_b = areas(rig)
    modulus = rig["fluid.bulk_modulus_pa"]
    return {
        "strokeLength": rig["cylinder.stroke_m"],
        "chamberCrossSection0": area_a,
        "chamberCrossSection1": area_b,
        "hoseVolume0": rig["cylinder.dead_volume_a_m3"],
        "hoseVolume1": rig["cylinder.dead_volume_b_m3"],
        "actuatorDamping": rig["load.viscous_friction_n_s_m"],
        # 1 / K = 1 / K_oil + 1 / K_walls where cylinder and hoses are alike
        "oilBulkModulus": 1.0 / (1.0 / modulus - 1.0 / walls) if walls else modulus,
        "cylinderBulkModulus": walls,
        "hoseBulkModulus": walls,
        # m^3/(s sqrt(Pa)) in its equations, although its manual has m^3/s
        "nominalFlow": rig["valve.rated_flow_m3_s"] / np.sqrt(rig["valve.rated_pressure_drop_pa"]),
        "systemPressure": rig["supply.pressure_pa"] - ATMOSPHERE,
        "tankPressure": rig["supply.tank_pressure_pa"] - ATMOSPHERE,
    }


def run(
    rig: Mapping[str, float],
    parameters: Mapping[str, float],
    opening: FloatArray,
    dt_s: float,
    substeps: int,
) -> dict[str, FloatArray]:
    """Outputs at the samples, by the classical Runge-Kutta method; absolute pressures.

    opening: fraction of rated, each held until the next sample; towards chamber A if positive.
    """
    item = exudyn.itemInterface
    container = exudyn.SystemContainer()  # owns the system: it must live as long
    system = container.AddSystem()
    ground = system.AddObject(item.ObjectGround())
    node = system.AddNode(
        item.NodePoint(
            referenceCoordinates=[OFFSET, 0.0, 0.0],
            initialCoordinates=[rig["initial.position_m"], 0.0, 0.0],
            initialVelocities=[rig["initial.velocity_m_s"], 0.0, 0.0],
        )
    )
    body = system.AddObject(item.MassPoint(mass=rig["load.mass_kg"], nodeNumber=node))
    base = system.AddMarker(item.MarkerBodyPosition(bodyNumber=ground))
    rod = system.AddMarker(item.MarkerBodyPosition(bodyNumber=body))
    load = rig["effects.load_force.force_n"]
    system.AddLoad(item.Force(markerNumber=rod, loadVector=[-load, 0.0, 0.0]))
    system.AddObject(
        item.CartesianSpringDamper(
            markerNumbers=[base, rod],
            stiffness=[rig["effects.load_spring.stiffness_n_m"], 0.0, 0.0],
            offset=[OFFSET + rig["cylinder.stroke_m"] / 2.0, 0.0, 0.0],
        )
    )
    pressures = system.AddNode(
        item.NodeGenericODE1(
            referenceCoordinates=[0.0, 0.0],
            initialCoordinates=[rig[f"initial.pressure_{k}_pa"] - ATMOSPHERE for k in "ab"],
            numberOfODE1Coordinates=2,
        )
    )
    cylinder = system.AddObject(
        item.HydraulicActuatorSimple(
            markerNumbers=[base, rod],
            nodeNumbers=[pressures],
            offsetLength=OFFSET,
            useChamberVolumeChange=True,
            **parameters,
        )
    )

    def before_step(system: Any, end_of_step: float) -> bool:
        held = opening[int(end_of_step / dt_s - 0.5 / substeps)]
        system.SetObjectParameter(cylinder, "valveOpening0", held)
        system.SetObjectParameter(cylinder, "valveOpening1", -held)
        return True

    system.SetPreStepUserFunction(before_step)
    kind = exudyn.OutputVariableType
    sensors = [
        system.AddSensor(item.SensorNode(nodeNumber=n, storeInternal=True, outputVariableType=what))
        for n, what in (
            (node, kind.Coordinates),
            (node, kind.Coordinates_t),
            (pressures, kind.Coordinates),
        )
    ]
    system.Assemble()
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = (opening.size - 1) * substeps
    settings.timeIntegration.endTime = (opening.size - 1) * dt_s
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = dt_s
    system.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK44)

    position, velocity, pressure = (system.GetSensorStoredData(sensor) for sensor in sensors)
    np.testing.assert_allclose(position[:, 0], np.arange(opening.size) * dt_s, atol=1e-9)
    columns = (position[:, 1], velocity[:, 1], *(pressure[:, 1:].T + ATMOSPHERE))
    return dict(zip(OUTPUTS, columns, strict=True))
