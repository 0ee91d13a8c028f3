# SPDX-License-Identifier: MIT
"""Every number that decides, with the reason for its value. Set on development records only."""

from __future__ import annotations

# Length of a simulation window, and what is skipped at the start of a record: as the contract of
# the diagnosis file fixes them.
WINDOW_S = 0.5
SKIP_S = 0.3

# Windows of the first fits from a cold start, with all measured states put right in each: a limit
# cycle of 10 to 80 Hz must not slip by half a period within a window, or the fit settles on a wrong
# multiple of it.
COLD_WINDOWS_S = (0.03, 0.1, 0.25)

# Independent errors a second: samples of 1 kHz are not. Errors of a servo live below its oil
# spring, some 5 to 20 Hz wide once the mean of a window is gone.
INDEPENDENT_HZ = 20.0

# Values of a rig may move by this many of their stated deviations.
MOST_SIGMAS = 4.0

# Values that define others (the point of the rated flow) or are measured with a ruler stay as told.
HELD = (
    "cylinder.bore_m",
    "cylinder.rod_m",
    "cylinder.stroke_m",
    "valve.rated_pressure_drop_pa",
    "valve.rated_command_v",
    "supply.tank_pressure_pa",
)

# Deviation of a nuisance about its typical value: of its logarithm where it is a size, else in its
# own unit. A nuisance must not swallow an effect: a few of these reach the ends of its range.
NUISANCE_SIGMA = {
    "nuisance.spool_bandwidth_hz": 0.4,
    "nuisance.edge_rounding": 0.7,
    "nuisance.laminar_pressure_pa": 0.7,
    "nuisance.presliding_m": 0.5,
    "nuisance.free_gas": 1.2,
    "nuisance.edge_pa": 0.005,
    "nuisance.edge_at": 0.005,
    "nuisance.edge_pb": 0.005,
    "nuisance.edge_bt": 0.005,
    "nuisance.flow_exponent": 0.02,
}
LOGARITHMIC_NUISANCES = (
    "nuisance.spool_bandwidth_hz",
    "nuisance.edge_rounding",
    "nuisance.laminar_pressure_pa",
    "nuisance.presliding_m",
    "nuisance.free_gas",
)

# Steps of integration a sample of a fit: at 1 kHz they resolve an oil spring of 100 Hz to 0.1 %.
SUBSTEPS = 2

# Steps of a fit: from the calibration on the cost is near a parabola; a cold one needs few in each
# of its short windows, for the long ones follow.
ITERATIONS = 12
ITERATIONS_COLD = 6

# Intervals of the shrinkage: level as the contract has it, draws for a second digit of its ends.
SHRINKAGE_LEVEL = 0.9
BOOTSTRAP_DRAWS = 500

# Near null: where overlap, leakage and null bias act; a few times the overlap of a servo valve.
NEAR_NULL = 0.05
# Slow: where friction is not swamped by viscous forces.
SLOW_SHARE = 0.05

# What a record must visit before it can speak of an effect.
# Flow saturation and droop bend the curve by the square of the command: at 30 % of rated a limit
# at full opening takes 3 % of the flow.
LARGE_COMMAND = 0.3
# A few independent errors: one window in twenty seconds is half a second, a fortieth.
LEAST_SHARE = 0.02
# Friction and play show at turns; one turn is an accident, two each way are a pattern.
LEAST_REVERSALS = 4
# A lag of 2 ms turns the phase at this frequency by 2 degrees, 4 % of a sine.
FAST_HZ = 3.0
# A spring is a force until the rod has moved: over a tenth of the stroke it changes by a tenth.
LEAST_TRAVEL = 0.1
