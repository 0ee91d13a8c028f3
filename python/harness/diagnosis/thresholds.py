# SPDX-License-Identifier: MIT
"""Thresholds of the diagnosis, each with its reason; they were set on development records only."""

from __future__ import annotations

# Length of a simulation window, s, and the time that is skipped at the start of a record, s. The
# contract of the diagnosis file fixes both.
WINDOW_S = 0.5
SKIP_S = 0.3

# A record is a limit cycle where more than the share MOSTLY_SWINGS of the power of its pressure
# (without pressures: of its speed) lies above SWING_HZ, which commands do not reach. It is compared
# in windows of a few periods.
SWING_HZ = 25.0
MOSTLY_SWINGS = 0.7
WINDOW_SWINGING_S = 0.1
# With fewer samples in a window, nothing is left after its mean is subtracted.
LEAST_WINDOW_SAMPLES = 10

# Where no record is held out, every third block of each record is held out. A block has four
# windows, which is longer than the memory of a servo; two thirds of the record are left to fit.
BLOCK_S = 2.0
BLOCKS_TURN = 3

# Window lengths of the first fits from a cold start; all measured states are reset at the start of
# each window. Within a window, a limit cycle of 10 to 80 Hz must not slip by half a period, or the
# fit settles on a wrong multiple of its frequency.
COLD_WINDOWS_S = (0.03, 0.1, 0.25)
# A window with fewer samples shows little but its own start. At a slow sampling only the long
# windows are left, or none: a limit cycle that would slip cannot be seen there.
LEAST_COLD_SAMPLES = 6
# Where the sampling is too slow for such windows, the stiffness of the oil is tried in this many
# steps over its whole range, and fits start from the best few. With a standard deviation of 30 %,
# neighbouring steps differ by 4 % in the frequency of the oil spring.
STIFFNESS_STEPS = 33
STIFFNESS_STARTS = 3

# Independent errors per second; the samples of a record at 1 kHz are not independent. The errors of
# a servo lie below the frequency of its oil spring. Their bandwidth is some 5 to 20 Hz after the
# mean of each window is subtracted.
INDEPENDENT_HZ = 20.0

# A fit may move a value of the rig by at most this many of its stated standard deviations.
MOST_SIGMAS = 4.0

# A fit does not move values that define others (the point of the rated flow) or that are measured
# with a ruler. They keep the value in the rig file.
HELD = (
    "cylinder.bore_m",
    "cylinder.rod_m",
    "cylinder.stroke_m",
    "valve.rated_pressure_drop_pa",
    "valve.rated_command_v",
    "supply.tank_pressure_pa",
)

# Prior standard deviation of each nuisance about its typical value: of its logarithm if it is one
# of LOGARITHMIC_NUISANCES, else in its own unit. A few of these deviations reach the ends of the
# range of a nuisance, so that a nuisance cannot hide an effect.
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
# Bounds of a nuisance where the bounds of the plant are too wide. A spool of 100 Hz with damping
# 1.5 has a delay of 5 ms, and only an effect (a lag or a delay) should have that much. A spool of
# 130 Hz with damping 1.1 has a delay of 2.7 ms.
NUISANCE_ENDS = {
    "nuisance.spool_bandwidth_hz": (130.0, 1000.0),
    "nuisance.spool_damping": (0.5, 1.1),
}
# Without measured pressures these nuisances cannot be separated from a load force, which also makes
# the speeds of the two directions unequal. They then keep their typical values.
SEEN_BY_PRESSURES = (
    "nuisance.edge_gain_direction",
    "nuisance.edge_gain_sides",
    "nuisance.edge_gain_tank",
)
# Prior centres where no pressure is measured. It is often not known whether the supply pressure in
# the rig file is absolute or above the atmosphere; 0.5 is in the middle of both.
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

# Limits of the spool speed that are tried, 1/s. A fit cannot find such a limit from a value that
# the spool never reaches, because the cost has no slope there.
SLEWS_1_S = (60.0, 100.0, 160.0, 250.0, 400.0, 700.0)

# Integration steps per sample in a fit. At 1 kHz, two resolve an oil spring of 100 Hz to 0.1 %.
SUBSTEPS = 2

# Integration steps per sample where candidates are compared. With four, the phase of an oil spring
# of 70 Hz stays within 6 degrees over a window.
DECISION_SUBSTEPS = 4

# Iterations of a fit. After the calibration the cost is nearly a parabola. A cold fit needs few
# iterations in each of its short windows, because fits with longer windows follow. A screening fit
# only shows which candidates are worth a long fit.
ITERATIONS = 12
ITERATIONS_COLD = 6
ITERATIONS_SCREEN = 4
ITERATIONS_FINE = 4

# The best few candidates of a screening get a long fit; the best of these are extended.
MOST_REFINED = 6
# A screening fit of four iterations shows half of the gain of a long fit, seldom less than a
# third. A candidate with a tenth of the gain of the first one does not overtake it.
LEAST_SCREENED_GAIN = 0.1
BEAM = 2
# A law that contains another is fitted again where its cost is higher by more than this. Less is
# what fits of a limited number of iterations differ by.
BEHIND_NATS = 1.0
MOST_EFFECTS = 3
# If the errors of a set of effects are this close to the noise floor (ln of the ratio), nothing is
# left to look for.
AT_FLOOR = 0.05
# A set of effects is extended only where its gain on held-out data is at least this. The verdict
# requires more.
FORWARD_NATS = 5.0
FORWARD_RELATIVE = 0.05

# Confidence intervals of the shrinkage. The contract fixes their level; the number of bootstrap
# draws gives the ends a second digit.
SHRINKAGE_LEVEL = 0.9
BOOTSTRAP_DRAWS = 500
BOOTSTRAP_SEED = 20261121

# Distances by which intervals of 90 % had to be wider to hold on 1,000 generated machines, at the
# low and the high end, with pressures (True) and with the position alone (False); see
# `inference.between_machines` and docs/gap/calibration.md. Of sizes of effects they are shares of
# the size, of shrinkage they are shrinkage.
SIZE_FURTHER = {True: (0.039, 0.014), False: (0.105, 0.033)}
SHRINKAGE_FURTHER = {True: (0.297, 0.253), False: (0.363, 0.367)}
SHRINKAGE_FURTHER_FROM_NOMINAL = {True: (0.169, 0.139), False: (0.357, 0.079)}

# The command is near null below this share of the rated command. There overlap, leakage and null
# bias act; the value is a few times the overlap of a servo valve.
NEAR_NULL = 0.05
# The command rests while it stays within this share of the rated command for this time: steps that
# are held, and ramps of half the rated command a second. There a spool sticks.
REST_WIDTH = 0.05
REST_S = 0.1
# Motion is slow below this share of the largest speed. There viscous forces do not hide friction.
SLOW_SHARE = 0.05

# Regimes that a record must visit before it can show or exclude an effect.
# Flow saturation and supply droop bend the flow curve by the square of the command. At 30 % of the
# rated command, a limit at full opening takes 3 % of the flow.
LARGE_COMMAND = 0.3
# Share of the time that gives a few independent errors. One window of half a second in twenty
# seconds is a fortieth.
LEAST_SHARE = 0.02
# Friction and play show at reversals of the motion. One reversal may be an accident; two in each
# direction are a pattern.
LEAST_REVERSALS = 4
# A lag of 2 ms turns the phase at this frequency by 2 degrees, which is 4 % of a sine.
FAST_HZ = 3.0
# A load spring looks like a constant force until the rod has moved. Over a tenth of the stroke its
# force changes by a tenth.
LEAST_TRAVEL = 0.1
# The least drift of the flow gain that counts has changed the flow by 0.25 % after this time, s: as
# much as the position over a window of half a second is known to.
LEAST_SECONDS = 5.0

# --- Noise floor -------------------------------------------------------------------------------
# The response of a servo no longer depends on its past after a few periods of its oil spring; a
# valve settles sooner.
REPEAT_SETTLED_S = 0.5
# Between two repeats the rod may move away by this share of its range within one repeat. The
# volumes, and with them the oil spring, then differ by less than that share, and the response by
# less than half of it.
REPEAT_DRIFT = 0.02
# The same where three repeats are combined so that an even drift cancels. A drift of half of the
# range leaves less than its square.
REPEAT_DRIFT_EVEN = 0.5
# Limits of a rest. A command that stays within a two-hundredth of its range moves the rod by less
# than friction holds. A hundredth of the largest speed is creep, which is nearly a straight line.
REST_COMMAND = 0.005
REST_SPEED = 0.01
# With fewer than four samples in a period of the oil spring, neighbouring samples differ by motion
# as much as by noise, and differences of any order show both.
SPRING_HIDES_NOISE = 0.25
# Noise of usual sensors, where motion hides it and the rig file does not tell it: of a position
# sensor, share of the stroke; of others, share of the range in the record. For pressures see
# DESIGN_PRESSURE_NOISE.
NOISE_OF_STROKE = 5e-5
NOISE_OF_RANGE = 1e-3
# Smallest number of windows of half a second that give a noise floor. With 20 independent errors
# per second, four windows give it two significant digits.
REST_WINDOWS = 4
# For white noise, the medians over twenty blocks of the differences of orders 7 and 9 agree within
# some 5 %. A disagreement of four times that is not white noise.
MOTION_SEEN = 0.2
# No sensor resolves a millionth of the variation that it shows. What is smaller comes from the
# digits of the file.
LEAST_FLOOR = 1e-6

# --- Gate --------------------------------------------------------------------------------------
# Jitter, as a share of the sampling time: a tenth of what the reader of records refuses. A sine of
# 10 Hz at 1 kHz is then wrong by 6e-5 of its amplitude.
JITTER_SHOWS = 1e-3
# A quartz clock keeps its rate to 1e-4. A sampling time that changes by more was not made by one.
CLOCK_DRIFT = 2e-4
# Smallest number of windows in a record: two to fit and two to hold out.
LEAST_WINDOWS = 4
# With fewer than ten samples per period, the held command with its delay of half a sample hides a
# lag.
SAMPLES_A_PERIOD = 10
# Within a hundredth of the stroke from an end, the rod counts as at that end. A mean shows a
# twentieth of the time spent there; with half of the time there, the record cannot be used.
END_ZONE = 0.01
AT_END = 0.05
AT_END_ALL = 0.5
# Positions beyond the stroke: by a hundredth it is the zero error of a sensor, by a tenth it is
# another machine or another unit.
BEYOND = 0.01
STROKE_BEYOND = 0.1
# Speeds fit a unit of length within a factor of three, which load, friction and a rough rated flow
# take; neighbouring units differ by ten. They are taken over a time in which noise hardly counts.
SPEED_FITS = 3.0
SPEED_OVER_S = 0.05
# Commands beyond the rated command: by a hundredth it is the zero error of the amplifier; three
# times the rated command is another unit. LIMIT_SHARE is the share of the time at the limit that
# the gate reports.
COMMAND_BEYOND = 0.01
COMMAND_UNIT = 3.0
LIMIT_SHARE = 0.2
# Pressures that never reach a hundredth of the supply pressure are in another unit. In kPa, the
# closest one, and in psi the numbers are a thousandth and less of those in Pa. The tank pressure
# alone is more than a hundredth.
PRESSURE_UNIT = 0.01
# Absolute pressures below zero by this many noise floors are not noise: white noise of 400,000
# samples stays within five standard deviations.
VACUUM_FLOORS = 6.0
# The measured supply pressure may differ from the rig file as far as a fit may move it.
SUPPLY_SIGMAS = MOST_SIGMAS
# The supply is down below this share of its pressure for this time, and up again from SUPPLY_AGAIN
# on. A droop under flow leaves more: with a source that loses 35 % at full flow, 65 % remain. A
# supply that never reaches a quarter of what the rig says is that of a pump which is off.
SUPPLY_LOW = 0.6
SUPPLY_LOW_S = 0.2
SUPPLY_AGAIN = 0.9
SUPPLY_OFF = 0.25
# The signals are smoothed over this time: below it, compression of the oil also makes pressures.
SUPPLY_SMOOTHED_S = 0.05
# Without its sensor, the end of a span is known up to the time in which a pump comes up, s.
SUPPLY_SETTLED_S = 0.5
# A rod stands below this share of the full speed. It does not follow a valve that is opened by more
# than STALL_OPENING if it has less than this share of the speed of that opening, for so long that
# it would have gone as far as at full speed in STALL_S. A dead band holds it shorter.
STANDS = 0.02
STALL_OPENING = 0.05
STALL_SPEED = 0.2
STALL_S = 0.06
# Share of the time for which the rod follows such openings elsewhere.
FOLLOWS = 0.9
# Through an opening above this, flows of the valve are large beside any leakage.
WIDE_OPENING = 0.25
# Share of the time for which a chamber pressure may exceed what the supply can give: water hammer
# is over in a hundredth of the time.
BEYOND_SHARE = 0.01
# Motion is compared in windows. If the rms of the position is below this many times its noise,
# there is no motion to compare.
MOVES = 10.0
# A sensor froze if it shows one value for longer than any window of a filter and then jumps by ten
# times the usual step.
FROZEN_S = 0.05
FROZEN_STEP = 10.0
# A sensor is saturated if it shows five equal extremes in a row, reached in motion, three times.
CLIPPED_SAMPLES = 5
CLIPPED_RUNS = 3
# A spike is farther from the cubic through its neighbours than six times the distance within which
# 95 % of the samples are (for white noise this is 16 deviations). A swing of the oil would have
# others of a third of its size nearby; a spike has none. Below a thousandth of the standard
# deviation of the channel, a spike changes no result.
SPIKE_SIZE = 6.0
SPIKE_MATTERS = 1e-3
SPIKE_ALONE = 0.3
# The noise of one sensor differs by a tenth between records. A factor of three means that something
# was changed.
FLOORS_DIFFER = 3.0
# With a correlation of command and speed below minus this value, the signs are certainly opposite.
# Oil springs and limit cycles turn the phase, but on the whole by less than half a turn.
OPPOSITE = 0.3
# The position is smoothed over this time for the force balance; an oil spring of 20 Hz is kept.
FORCE_SMOOTHED_S = 0.02
# The chamber pressures may be exchanged if the exchange leaves less than this share of the force
# that the columns as named leave unexplained.
EXCHANGED = 0.3
# A sign is certain where the value is this many of its standard deviations: because a refusal must
# be certain, a false one may occur in some ten thousand records only. The deviations come from this
# many blocks of a record.
PORTS_DEVIATIONS = 4.0
PORTS_BLOCKS = 10

# --- Regimes -----------------------------------------------------------------------------------
# The compliance of air goes with p^-1.77. Over a factor of two in pressure it changes 3.4-fold;
# over a smaller range, air looks like another bulk modulus.
PRESSURES_VARY = 2.0
# At rest the chambers have the supply pressure together, about half of it each. A relief valve
# shows only where one of them is driven above that; share of the supply pressure.
HIGH_PRESSURE = 0.6
# A make-up valve opens below the tank pressure. That of a rig file is right within a half.
LOW_PRESSURE = 1.5

# --- The next experiment -----------------------------------------------------------------------
# Duration of an experiment, s: long enough for fifteen windows, and short enough to run several of
# them in an afternoon.
DESIGN_S = 8.0
# Upper end of the excited band: above the corner frequency of any servo valve whose lag matters.
DESIGN_FAST_HZ = 150.0
# Bandwidth of the loop that holds the rod about its path. It leaves the command unchanged above a
# few times this frequency.
DESIGN_HELD_HZ = 0.2
# Share of the span that stays free at either end. Half of it is for what the rig file does not
# tell.
DESIGN_MARGIN = 0.1
# Chamber pressures may exceed the supply pressure through inertia and unequal areas. Above this
# multiple of it, relief valves open.
DESIGN_PRESSURE = 1.5
# Below half an atmosphere oil foams, which harms the machine, and no simulator is accurate there.
DESIGN_VACUUM_PA = 5e4
# Assumed noise of a pressure sensor that is not installed yet, share of the supply pressure. A
# thousandth of its range is usual.
DESIGN_PRESSURE_NOISE = 1e-3
# Iterations of a fit on each entry of the menu. The best entries are then fitted as in the
# diagnosis.
DESIGN_ITERATIONS = 4
DESIGN_FINALISTS = 6
# Evidence for a name: odds of 150 to 1. A set is named in full where the odds are below ten to one,
# so that half of this evidence would do.
SEPARATED_NATS = 5.0
# The best candidate must explain its own record: its errors of integration must stay below a
# hundredth of the motion, or below the noise.
DESIGN_ERROR = 0.01
# With a power of nineteen in twenty, no sensor needs to be bought.
DESIGN_POWER = 0.95
# A sensor that adds less than this to the power is not requested.
DESIGN_GAIN = 0.1

# --- Maps of the gap ---------------------------------------------------------------------------
# Smallest reversals that count, share of the range of the signal, as in `regimes`. AFTER_TURN_S is
# the time after a reversal in which a servo settles: some periods of its oil spring.
TURN_OF_COMMAND = 0.05
TURN_OF_ROD = 0.02
AFTER_TURN_S = 0.1
# Free gas and entrained air have an influence below some five atmospheres.
LOW_PRESSURE_PA = 5e5
# Conditions that hold for less than a hundredth of the time are not listed: that is 0.2 s of 20 s.
LEAST_TIME = 0.01
# Lower ends of the bands: drift; what a position loop follows; oil spring and valve; above both.
BANDS_HZ = (0.0, 2.0, 10.0, 50.0)
# A stretch of the record is listed if its windows, 2.5 s or more, hold 1.5 times their share of the
# gap.
SPAN_WINDOWS = 5
SPAN_EXCESS = 1.5

# --- Contradictions of where and which ---------------------------------------------------------
# A subsystem with a quarter of the gap takes part in it; one with a twentieth hardly does.
SUBSYSTEM_TAKES_PART = 0.25
SUBSYSTEM_SMALL = 0.05

# --- Verdict -------------------------------------------------------------------------------------
# Probability of an effect that the record itself shows. In three of a hundred cases the cause is
# one that nobody thought of.
LARGEST_PROBABILITY = 0.97
# Relative error in the size of an effect, made by a simulator with other metering edges, seals and
# oil although it reaches the floor: with measured pressures, and with the position alone. On
# development records of an independent generator, nine intervals in ten held the truth with these
# values, five in ten without.
MODEL_ERROR = 0.015
MODEL_ERROR_POSITION = 0.025

# --- Steps of the position sensor ----------------------------------------------------------------
# Rounding makes most of the noise if its deviation is half of that of the noise. On the development
# records it was a twentieth to a ninth without the effect, and three quarters and more with it.
STEP_OF_FLOOR = 0.5
# More than twice the sensor noise in the rig file is no longer that noise.
STEP_OF_RIG_NOISE = 2.0
# Smallest step, share of the stroke: a resolution of fourteen bits over the stroke is usual.
LEAST_STEP = 6e-5
# Files hold the levels with four digits and more.
STEP_SCATTER = 1e-3

# --- What the page says beside the verdict -------------------------------------------------------
# The fitted values are called worse than those of the rig file where the gap on held-out data is
# larger by a twentieth: the same tolerance by which sets of effects are told apart.
WORSE_CALIBRATED = 1.05
# A set that is not named is spoken of where it would remove a quarter of the gap.
MUCH_REMOVED = 0.25
# A fitted value is at an end of its range where less than a thousandth of the range is left.
AT_BOUND = 1e-3
# A cause is called open where all other answers together are as probable as one in five. An answer
# is told from one in ten on.
OPEN = 0.2
TOLD = 0.1
