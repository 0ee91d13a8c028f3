# SPDX-License-Identifier: MIT
"""The constants that decide the verdict, each with its reason; see `docs/gap/decision.md`.

Those of the likelihood are properties of servos and simulators. Those of the probabilities were
fitted on generated machines: `docs/gap/calibration.md` says on which. The losses are a choice.
"""

from __future__ import annotations

# --- Likelihood ----------------------------------------------------------------------------------
# Independent errors of one octave in one window of half a second. An octave of white noise at
# 128 Hz has 128; an error of the model is one wave form there, of one amplitude. Slow and fast
# octaves then have equal weight.
INDEPENDENT = 1.0
# Share of the measured motion, in each octave, to which no simulator is exact.
TOLERANCE = 0.003
# The same of a user's simulator, which has no values for what every servo has anyway: edges that
# differ, presliding, gas in the oil.
SIMULATOR_TOLERANCE = 0.02
# So much more in a pressure: on sound machines it is where such a simulator differs most.
OF_PRESSURE = 2.5
# The decision takes less where the best set leaves less: what it leaves in this share of the
# octaves, and at least this share of the tolerance. A set that brings nearly all octaves down to
# the noise shows that the simulator is as good as that.
OCTAVES_WITHIN, LEAST_SHARE = 0.75, 0.25
# Share of the whole motion that is tolerated in each octave as well: the noise of an ordinary
# sensor. Without it an octave in which nothing moves would judge by the seventh digit.
LEAST_TOLERANCE = 0.001

# Share by which friction differs from one break-away to the next, or from its law. It was chosen on
# one record of a rod that sticks and slips, of which a fifth would have taken all that was left.
REPEATS = 0.05

# --- Probabilities -------------------------------------------------------------------------------
# Number of independent errors in a diagnosis: evidence, nats, for errors that are smaller by a
# factor of e on the average. Errors of a model repeat from window to window: a longer record or a
# faster sampling shows the same ones again, and its evidence does not grow.
EVIDENCE = 37.0
# Prior cost of a law, nats: odds of one in fifteen that a machine has just this effect, with the
# factor of Occam for its size. A law that contains another counts as two, and one that acts nearly
# as two effects together as three.
EFFECT = 2.7
# Prior cost of values of the rig that are not those of the rig file within their uncertainty, nats:
# as much as two effects.
VALUES = 2.0 * EFFECT
# Cost of an effect that is no larger than what every servo has, nats. It falls to zero at a size e
# times as large: a small effect is more often the shape of another law than a cause.
SMALL = 3.4
# Errors, ln over what is tolerated, below which a simulator is as good as perfect.
LEAST_LEFT = 0.1
# Odds of a cause outside of the catalogue against the best set, ln, where left + LEAST_LEFT is 1:
# without and with an effect in the best set; and their increase with the ln of left + LEAST_LEFT
# and with what the set explains.
OUTSIDE, OUTSIDE_BESIDE = 1.0, -0.4
OUTSIDE_LEFT = 5.2
OUTSIDE_EXPLAINED = -1.2
# The same where only the position is measured, which shows less of any cause.
OUTSIDE_POSITION = 1.5

# Evidence for such a cause, nats, where the found values make one of the outputs clearly worse than
# it is with the simulator as configured: they stand in for something. Of 66 generated machines with
# known causes none had such an output; it weighs as much as a law.
WORSENED = 2.0 * EFFECT

# The same evidence, where values of the rig that change in the course of the records make the
# errors of the fitted and of the held-out data smaller by this, ln on the average. On 49 sound
# machines the largest gain was 0.019, on 19 of 22 whose oil heats it was 0.032 or more: a false
# alarm costs more than a miss. And the deviation of such a change, ln: that in 8 K.
DRIFTS = 0.025
DRIFT_SIGMA = 0.3

# The same with a user's simulator to which no effect of the catalogue could be given, nats; in
# proportion to the share of them that lack their port.
UNCARRIED = 4.0
# A value of such a simulator that moved by more standard deviations is evidence for something else
# that it stands in for; from the second number on the page says so.
MOVED_FREELY, MOVED_TOO_FAR = 2.0, 3.0

# Share of the probability that is spread over all answers alike: in three cases of a hundred the
# search has missed the cause, or the machine does what nobody thought of.
LAPSE = 0.03
# An answer is told, and an effect is named beside a cause outside, from one in ten on.
TOLD = 0.1
# From this probability on a cause outside of the catalogue is reason to fit all records together:
# the held-out ones may excite what the others do not.
FIT_TOGETHER = 0.2
# That is so where errors on held-out data are larger by a third, ln on the average.
WORSE_HELD_OUT = 0.3

# --- Losses --------------------------------------------------------------------------------------
# A wrong name sends someone to exchange a healthy part. So does an alarm on a sound machine.
WRONG_NAME = 10.0
FALSE_ALARM = 10.0
# A cause that is not found is looked for further, be it one of two.
MISSED = 3.0
# A known cause that is called unknown is looked for where it is not, as in a set without the truth.
NEEDLESS_OUTSIDE = 5.0
# A set costs an experiment for each further member; one without the truth costs it for nothing.
FURTHER_MEMBER = 1.0
SET_WITHOUT_TRUTH = 5.0

# --- Values of the rig ---------------------------------------------------------------------------
# A value has moved if it did so by this many standard deviations of the rig file, and of the fit.
MOVED_PRIOR = 1.0
MOVED_FIT = 2.0

# --- The simulator as configured -----------------------------------------------------------------
# It agrees with the machine where its gap is within three noise floors, or a twentieth of the
# motion within a window. The fit gains nothing where it takes less than a quarter of the gap, at
# the lower end of the interval.
NEAR_FLOOR = 3.0
NEAR_GAP = 0.05
# Evidence that nothing is missing, nats, where the gap as configured is within NEAR_GAP: of 42
# generated machines without a missing effect 8 had such a gap, of 167 with known effects 3.
AGREES = 2.4
LEAST_GAIN = 0.25
