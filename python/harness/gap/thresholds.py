# SPDX-License-Identifier: MIT
"""Every number that decides, with the reason for its value. Set on development records only."""

from __future__ import annotations

# Length of a simulation window, and what is skipped at the start of a record: as the contract of
# the diagnosis file fixes them.
WINDOW_S = 0.5
SKIP_S = 0.3

# A record of a limit cycle, most of whose pressure (else speed) is faster than commands are, is
# compared over a few periods of it.
SWING_HZ = 25.0
MOSTLY_SWINGS = 0.7
WINDOW_SWINGING_S = 0.1
# Fewer samples than these in a window leave nothing after its mean.
LEAST_WINDOW_SAMPLES = 10

# Without a record of its own to be held out: blocks of four windows, longer than the memory of a
# servo, every third of them held out, so that two thirds are left to fit.
BLOCK_S = 2.0
BLOCKS_TURN = 3

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
    "nuisance.spool_damping": 0.2,
    "nuisance.spool_slew_1_s": 1.2,
    "nuisance.null_bias": 0.002,
    "nuisance.edge_rounding": 0.7,
    "nuisance.laminar_pressure_pa": 0.7,
    "nuisance.presliding_m": 0.5,
    "nuisance.sliding_onset_m_s": 2.0,
    "nuisance.free_gas": 1.2,
    "nuisance.bulk_slope": 5.0,
    "nuisance.atmosphere": 0.5,
    "nuisance.edge_overlap_sides": 0.005,
    "nuisance.edge_overlap_tank": 0.005,
    "nuisance.edge_gain_direction": 0.02,
    "nuisance.edge_gain_sides": 0.02,
    "nuisance.edge_gain_tank": 0.02,
    "nuisance.flow_exponent": 0.02,
}
# Ends of a nuisance where those of the plant are too wide: a spool of 100 Hz, damping 1.5, is late
# by 5 ms, as only a lag or a delay is that deserves its name; one of 130 Hz and 1.1 by 2.7 ms.
NUISANCE_ENDS = {
    "nuisance.spool_bandwidth_hz": (130.0, 1000.0),
    "nuisance.spool_damping": (0.5, 1.1),
}
# Without pressures these cannot be told from a load force, which bends the speeds of both
# directions apart in the same way; they then stay at their typical values.
SEEN_BY_PRESSURES = (
    "nuisance.edge_gain_direction",
    "nuisance.edge_gain_sides",
    "nuisance.edge_gain_tank",
)
# Centres where no pressure is measured: whether the supply that is told is absolute or above the
# atmosphere is often not known; half is as far from either.
UNSEEN_CENTRE = {"nuisance.atmosphere": 0.5}
LOGARITHMIC_NUISANCES = (
    "nuisance.spool_bandwidth_hz",
    "nuisance.spool_slew_1_s",
    "nuisance.edge_rounding",
    "nuisance.laminar_pressure_pa",
    "nuisance.presliding_m",
    "nuisance.sliding_onset_m_s",
    "nuisance.free_gas",
)

# Limits of the spool's speed that are tried, 1/s: a limit that nothing reaches has no slope.
SLEWS_1_S = (60.0, 100.0, 160.0, 250.0, 400.0, 700.0)

# Steps of integration a sample of a fit: at 1 kHz they resolve an oil spring of 100 Hz to 0.1 %.
SUBSTEPS = 2

# Where it is decided: an oil spring of 70 Hz then keeps its phase over a window to 6 degrees.
DECISION_SUBSTEPS = 4

# Steps of a fit: from the calibration on the cost is near a parabola; a cold one needs few in each
# of its short windows, for the long ones follow. A first look shows who is in the running.
ITERATIONS = 12
ITERATIONS_COLD = 6
ITERATIONS_SCREEN = 3
ITERATIONS_FINE = 4

# Search: long fits for the best few of a look, forward from the best of these.
KEPT = 5
# A look of three steps shows half of what a long fit gains, seldom less than a third: who gains a
# tenth of the first one's does not overtake it.
IN_THE_RUNNING = 0.1
BEAM = 2
MOST_EFFECTS = 3
# A set whose errors are this near the floor, as ln of the ratio, leaves nothing to look for.
AT_FLOOR = 0.05
# To look further from a set it must gain this on held-out data; the verdict asks for more.
FORWARD_NATS = 5.0
FORWARD_RELATIVE = 0.05

# Intervals of the shrinkage: level as the contract has it, draws for a second digit of its ends.
SHRINKAGE_LEVEL = 0.9
BOOTSTRAP_DRAWS = 500
BOOTSTRAP_SEED = 20261121

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

# --- Noise floor -------------------------------------------------------------------------------
# A servo forgets how it got here within a few periods of its oil spring, the valve sooner.
REPEAT_SETTLED_S = 0.5
# Between two repeats the rod may be elsewhere by this share of its range within one: volumes, and
# with them the oil spring, differ by less than that share, and the response by less than half.
REPEAT_DRIFT = 0.02
# What is even in that goes out of three repeats: half of the range leaves less than its square.
REPEAT_DRIFT_EVEN = 0.5
# At rest: a command within a two-hundredth of its range moves the rod by less than its friction
# holds; and a hundredth of the largest speed is creep, nearly a straight line.
REST_COMMAND = 0.005
REST_SPEED = 0.01
# Windows of half a second that make a floor: four of them have two significant digits at 20
# independent errors a second.
REST_WINDOWS = 4
# Of twenty medians of differences of white noise orders 7 and 9 agree within some 5 %; 4 times
# that is not white noise.
MOTION_SEEN = 0.2
# No sensor resolves a millionth of what it shows; below it are the digits of a file.
LEAST_FLOOR = 1e-6

# --- Gate --------------------------------------------------------------------------------------
# Jitter: at a tenth of what reading refuses, a sine of 10 Hz at 1 kHz is off by 6e-5 of its size.
JITTER_SHOWS = 1e-3
# Crystals keep 1e-4; what changes by more was not sampled by one.
CLOCK_DRIFT = 2e-4
# Four windows: two to fit, two to hold out.
LEAST_WINDOWS = 4
# Below ten samples a period a held command and its delay of half a sample swamp a lag.
SAMPLES_A_PERIOD = 10
# Within a hundredth of the stroke is at its end; a twentieth of the time there is seen in a mean,
# half of it leaves no record.
END_ZONE = 0.01
AT_END = 0.05
AT_END_ALL = 0.5
# Beyond the stroke: a hundredth is a sensor's zero, a tenth another machine or another unit.
BEYOND = 0.01
STROKE_BEYOND = 0.1
# Commands: a hundredth is the amplifier's zero, three times rated another unit.
COMMAND_BEYOND = 0.01
COMMAND_UNIT = 3.0
LIMIT_SHARE = 0.2
# Pressures that never reach a hundredth of the supply are in another unit: the least of these, kPa
# and psi, are a thousandth and less; tank pressure alone is above a hundredth.
PRESSURE_UNIT = 0.01
# White noise of 400,000 samples stays within five deviations.
VACUUM_FLOORS = 6.0
# The rig's own uncertainty of the supply, as far as a fit may go.
SUPPLY_SIGMAS = MOST_SIGMAS
# Water hammer passes in a hundredth of the time.
BEYOND_SHARE = 0.01
# Motion is compared in windows; below this many times its noise there is none.
MOVES = 10.0
# A sensor froze: longer than any window of a filter, and then a step of ten times the usual one.
FROZEN_S = 0.05
FROZEN_STEP = 10.0
# A sensor is saturated: five equal extremes in a row, entered in motion, three times.
CLIPPED_SAMPLES = 5
CLIPPED_RUNS = 3
# A spike: six times what 95 % of the samples are away from their neighbours' cubic (white noise: 16
# deviations), with nothing of a third of its size near by, as a swing of the oil would have.
# Below a thousandth of the channel's deviation it moves no figure.
SPIKE_SIZE = 6.0
SPIKE_MATTERS = 1e-3
SPIKE_ALONE = 0.3
# Noise of one sensor scatters by a tenth between records; three times is another one.
FLOORS_DIFFER = 3.0
# Command and speed: opposite without doubt. Oil springs and limit cycles turn the phase, by less
# than half a turn on the whole.
OPPOSITE = 0.3
# The force balance is looked at over this long, which keeps an oil spring of 20 Hz.
FORCE_SMOOTHED_S = 0.02
# Pressures are exchanged where that leaves less than this share of the force unexplained.
EXCHANGED = 0.3

# --- Where -------------------------------------------------------------------------------------
# Test functions of the weak form: 20 ms hold a period of a spool of 50 Hz, so that lag and delay
# of the valve still show, and noise of 1 kHz samples goes down by three; 20 samples resolve psi''.
WEAK_FORM_S = 0.02
WEAK_FORM_SAMPLES = 20
# Finer samples add little to weighted means over 20 ms.
EQUATIONS_DT_S = 1e-3
# (1 - s^2)^4: psi'' still vanishes at the ends, so that the trapezoidal rule does well on it.
WEAK_FORM_ORDER = 4
# This near an end of the stroke, share of it, an end stop or its cushion may push.
STROKE_END = 0.01
# The prior of an equation's own values counts against what the equation leaves, which is known
# after a turn or two.
EQUATION_SETTLES = 4
# Zero error of a pressure sensor, share of the supply pressure: a class of 0.25 % of full scale. It
# covers gauge readings taken for absolute ones, too: 0.1 MPa of 12 within three deviations.
ZERO_ERROR = 0.0025

# --- Regimes -----------------------------------------------------------------------------------
# Air is compliance that goes with p^-1.77: over a factor of two in pressure it changes 3.4-fold;
# over less it is another bulk modulus.
PRESSURES_VARY = 2.0

# --- Suspects of the equations -----------------------------------------------------------------
# A gain must be this many deviations of its own scatter over windows: some 30 trials are made.
SUSPECT_DEVIATIONS = 3.0
# Weights of the equations follow from what they are left with: settled after a few turns.
SUSPECT_TURNS = 3

# --- The next experiment -----------------------------------------------------------------------
# Long enough for fifteen windows, short enough for an afternoon of them.
DESIGN_S = 8.0
# Past the corner of any servo valve whose lag matters.
DESIGN_FAST_HZ = 150.0
# The loop that holds the rod about its path turns no command of more than a few times this.
DESIGN_HELD_HZ = 0.2
# Free at either end of the span: ten per cent of it, half of that for what the rig does not know.
DESIGN_MARGIN = 0.1
# Chambers may rise above the supply by inertia and by unequal areas; above this relief valves open.
DESIGN_PRESSURE = 1.5
# Below half an atmosphere oil foams: bad for the machine, and no simulator is sure of it.
DESIGN_VACUUM_PA = 5e4
# Noise of a pressure sensor that is not there yet: a thousandth of its range is usual.
DESIGN_PRESSURE_NOISE = 1e-3
# Steps of a fit on each entry of the menu; the best entries are then fitted as the diagnosis does.
DESIGN_ITERATIONS = 4
DESIGN_FINALISTS = 6
# A difference of ten in log-likelihood: odds of 20,000 to 1 for windows that are as independent as
# is assumed, still 150 to 1 where only half of them are.
SEPARATED_NATS = 10.0
# The best rival must explain its own record: errors of integration stay below a hundredth of the
# motion, or below the noise.
DESIGN_ERROR = 0.01
# With nineteen in twenty no sensor needs to be bought.
DESIGN_POWER = 0.95
# A sensor that adds less than this to the power is not asked for.
DESIGN_GAIN = 0.1

# --- Maps of the gap ---------------------------------------------------------------------------
# Turns that count, share of the signal's range, as in `regimes`; what follows one: a servo settles
# within some periods of its oil spring.
TURN_OF_COMMAND = 0.05
TURN_OF_ROD = 0.02
AFTER_TURN_S = 0.1
# Free gas and entrained air are felt below some five atmospheres.
LOW_PRESSURE_PA = 5e5
# A condition that holds for less than a hundredth of the time is one of 20 s for 0.2 s.
LEAST_TIME = 0.01
# Drift; what a position loop follows; oil spring and valve; above both.
BANDS_HZ = (0.0, 2.0, 10.0, 50.0)
# A stretch of the record: 2.5 s that hold half as much again as is theirs.
SPAN_WINDOWS = 5
SPAN_EXCESS = 1.5

# --- Attribution without a fit -----------------------------------------------------------------
# What textbook equations get right of a real servo. Of the largest term of an equation: edges,
# areas and oil to a hundredth.
EQUATION_TOLERANCE = 0.01
# Of the supply pressure: hum and sag of a pump and its line.
SUPPLY_TOLERANCE = 0.005
# Of the force at full supply: friction of seals that nobody calls a fault.
SEAL_TOLERANCE = 0.003
# When a command takes effect: jitter, and the spool's own dynamics beyond a second order.
TIMING_S = 0.0004
# How much gas has come out of the oil near vacuum, and whether it has gone into it again.
FREE_GAS_TIMES = 10.0
# An equation speaks up where its residual is this many times what noise and these allow, in all of
# the interval.
EQUATION_LOUD = 1.5
# A suspect is taken for real where it takes a tenth off what is left beside the tolerance.
SUSPECT_GAIN = 0.1
# Suspects of this share of the best gain are alike: trials hit a size by some per cent only.
SUSPECT_NEAR = 0.95
# Effects that are put in one after another.
MOST_SUSPECTS = 3
# Error of the speed, share of the speed: a limit cycle is then off by as many radians, and what is
# linear about the calibration says nothing. A drift of the position, however large, passes.
LOST_PHASE = 0.5

# --- Process noise of a subsystem, position alone ----------------------------------------------
# Errors are averaged over this long: an oil spring of 70 Hz is still seen.
PROCESS_NOISE_S = 0.005
# Corner frequencies of the disturbances that are tried: those of slow motion, of a loop that
# follows, of a fast valve.
DISTURBANCES_HZ = (1.0, 5.0, 25.0)
# Subsystems whose likelihood is within this many nats per averaged error of the best cannot be told
# apart: on the development records without pressures, those of the true subsystem were within 0.17.
NOISE_TELLS = 0.25
# Intensities that are tried, as variance of the averaged error over that of the floor: from nothing
# to a thousand times the deviation, in steps that miss less than a hundredth of a nat.
NOISE_INTENSITIES = (1e-3, 1e6)
NOISE_STEPS = 60

# --- Contradictions of where and which ---------------------------------------------------------
# A subsystem with a quarter of the gap takes part in it; one with a twentieth hardly does.
SUBSYSTEM_TAKES_PART = 0.25
SUBSYSTEM_SMALL = 0.05

# --- Sizes that matter ---------------------------------------------------------------------------
# Anti-aliasing, a bus and a held sample are together up to a millisecond.
LEAST_DELAY_S = 1e-3
# Lap and threshold of a servo valve as delivered are within half a per cent.
LEAST_OPENING = 0.004
# A valve whose corner is above this counts as fast; nuisance.spool_bandwidth_hz stands for it.
SLOWEST_HIDDEN_HZ = 120.0
# Of the flow at rated command: leakage of a spool at null is a per cent of it.
LEAST_LEAKAGE = 0.01
# Of the volume, at atmospheric pressure: below, 50 bar hide it within 1 % of the bulk modulus.
LEAST_AIR = 1e-3
# Of supply pressure times piston area: seals have up to some tenths of a per cent; forces of a per
# cent are zero errors of pressure sensors and the atmosphere on the rod.
LEAST_FRICTION = 0.003
LEAST_FORCE = 0.01
# Static friction of a tenth more than sliding friction is its scatter.
LEAST_RISE = 1.1
# Seals and guides stick with up to twice, seldom three times what they slide with.
MOST_RISE = 3.0
# Any sensor's electronics have half a millisecond and some micrometres.
LEAST_LAG_S = 5e-4
LEAST_PLAY_M = 5e-6
# And a transducer fifty millionths of its stroke.
LEAST_PLAY = 5e-5

# --- Verdict -------------------------------------------------------------------------------------
# One set of effects is decidedly better than another where the held-out likelihood is by this many
# nats, at 95 % of the draws of windows at all, and the errors, floor included, by this share.
DECIDED_NATS = 10.0
DECIDED_RELATIVE = 0.05
# An effect more must take this share of what is left above the floor.
DECIDED_SHARE = 0.1
# No simulator comes nearer to a machine than a hundredth of its gap, ln of it, however fine the
# sensor.
NEAREST = 4.6
# And this share of the errors of the calibrated rig itself, so that what is next to the floor
# anyway gets no name.
DECIDED_OF_ALL = 0.05
# A force must be this many of its deviations, those of edges that cannot be seen among them.
FORCE_DEVIATIONS = 2.0
# Nobody calls a gap what is less than this share of the variation: 0.15 mm on a stroke of 0.3 m.
DECIDED_OF_MOTION = 5e-4
# The effects together must take this share of the errors above the floor.
DECIDED_TOGETHER = 0.25
# Outside the catalogue: the best set leaves this share of the gap of the calibrated rig above the
# floor, and errors of this share of the variation, and ln of their ratio to the floor is this.
LEFT_SHARE = 0.3
LEFT_NRMSE = 0.03
LEFT_ABOVE = 0.7
# With more than this left, and errors as above, all records are fitted together: it may be what the
# others do not excite.
LEFT_AGAIN = 0.1
# In a limit cycle half a per cent of its frequency is a twentieth of a period after ten of them,
# and an error of a sixth of the variation: the simulator knows it no better.
LEFT_NRMSE_SWINGING = 0.15
# Values of the rig are other than told where errors are smaller by this share of those of the rig
# as told than with the same values as told: on the development records at most 0.02 where they were
# true, 0.24 and more where some were 2 to 3 deviations off.
VALUES_SHARE = 0.1
# A value has moved where it did so by this many deviations of what was told, and of the fit.
MOVED_TOLD = 1.0
MOVED_FIT = 2.0
# Probability of an effect: likelihoods of held-out windows are too sure of themselves where the
# rest is structured, by about this factor; and three in a hundred causes nobody thought of.
TEMPERATURE = 10.0
SURE = 0.97
# What a set leaves over may have a cause that would take its place: each share of the gap that is
# left takes so much of the probability.
DOUBT = 0.7
# What a simulator with other edges, seals and oil is wrong by in the size of an effect, where it
# reaches the floor all the same, and where only the position says so (development records of an
# independent generator: with these nine intervals in ten held the truth, with neither five).
MODEL_ERROR = 0.015
MODEL_ERROR_POSITION = 0.025

# --- Steps of the position sensor ----------------------------------------------------------------
# Rounding makes most of the noise where it is half of its deviation: without an effect it was a
# twentieth to a ninth on the development records, with one three quarters and more.
STEP_OF_FLOOR = 0.5
# More than twice what is told of the sensor is no longer that.
STEP_OF_TOLD = 2.0
# Fourteen bits over the stroke are usual.
LEAST_STEP = 6e-5
# Levels are written with four digits and more.
STEP_SCATTER = 1e-3
