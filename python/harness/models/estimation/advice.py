# SPDX-License-Identifier: MIT
"""What to try where an estimate is worth little: each change was tried on the same record.

A change is only advised if the estimate then converges, so that the advice is a measurement. Where
none helps, the figures of the run say what the record lacks.

What a recursive estimation is worth, in words, and what to try.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

import ehsid

from ..identification import IdentificationError, IoData, fit_arx, independence_test
from ..identification.residuals import MAX_LAG
from .many import replay
from .recursion import Estimate, EstimationResult, Recursion
from .servo import ServoPath

LEAST_COEFFICIENTS = 1
MOST_COEFFICIENTS, MOST_DELAY = 6, 20  # of the compiled estimator
MOST_ADVISED = 3
# From this share of samples without information on, the command moves the machine too little.
MOST_SKIPPED = 0.5
# Simulation fit, %, from which on a model predicts the motion of its record well.
GOOD_SIMULATION = 80.0
# Delays beside the present one that are compared, and the share of the loss that counts.
FURTHER_DELAYS, CLEARLY_LESS = 6, 0.1
# A record that would have to be so many times as long is not a matter of length.
MOST_TIMES_LONGER = 100.0
# Memory, in samples, of the slower forgetting that is tried; see `_forgetting`.
LONGER_MEMORY = (1_000, 10_000)


@dataclass(frozen=True)
class Setting:
    """A change of settings as users write it: options of the command, arguments in Python."""

    options: str
    arguments: str


@dataclass(frozen=True)
class Trial:
    """A change with which the estimate converges on this record."""

    why: str
    """What the run showed that suggested it, in a sentence."""
    setting: Setting
    """What to change."""
    one_step_fit_percent: float
    residuals_white: bool
    """Of the estimate with the change."""


@dataclass(frozen=True)
class Advice:
    """What to try: changes that help on this record, best first, and what the record lacks."""

    trials: tuple[Trial, ...] = ()
    lacks: tuple[str, ...] = ()


def advise(data: IoData, recursion: Recursion, result: EstimationResult) -> Advice:
    """Returns what to try; nothing where the estimate has converged and its residuals are white.

    Parameters
    ----------
    data, recursion
        what was estimated, and with which settings.
    result
        what came out.
    """
    if result.converged and result.residuals_white:
        return Advice()
    servo = result.servo
    if not result.converged and servo is not None and servo.gain.trusted:
        # No change is tried: on 60 such records of servos none helped.
        return Advice(lacks=(_SERVO_IS_KNOWN,))
    helping = []
    for why, setting, changed in _changes(data, recursion, result):
        try:
            tried = replay(data, changed)
        except (IdentificationError, ValueError):  # too short for it, or no such combination
            continue
        if tried.converged and (tried.residuals_white or not result.converged):
            fit, white = tried.one_step_fit_percent, tried.residuals_white
            helping.append(Trial(why, setting, fit, white))
        if len(helping) == MOST_ADVISED:
            break
    # White residuals first: only then the intervals hold. `sorted` keeps the order otherwise.
    helping.sort(key=lambda trial: not trial.residuals_white)
    lacks = [] if helping or result.converged else _lacks(data, recursion, result)
    return Advice(tuple(helping), tuple(lacks))


_SERVO_IS_KNOWN = (
    "K of the servo is known, as the first table says: a controller needs no coefficients. They "
    "are not determined: noise on the position, friction and a dead band mislead least squares."
)

_Change = tuple[str, Setting, Recursion]


def _changes(data: IoData, recursion: Recursion, result: EstimationResult) -> Iterator[_Change]:
    """Yields changes that the figures of the run suggest."""
    if not recursion.orders.offset:
        yield (
            "The model has no constant term: it takes the mean command of the record for the one "
            "at which the output stands still.",
            Setting("--offset", "offset=True"),
            replace(recursion, orders=replace(recursion.orders, offset=True)),
        )
    if not result.converged:
        yield from _slower(recursion, result)
    yield from _delays(data, recursion, result)
    if not result.residuals_white:
        yield from _methods(recursion)
    if not result.converged:
        yield from _fewer(data, recursion, result)


def _slower(recursion: Recursion, result: EstimationResult) -> Iterator[_Change]:
    """Resets and a short memory keep the deviations large."""
    if result.resets and recursion.reset:
        times = "once" if result.resets == 1 else f"{result.resets} times"
        yield (
            f"The RMSE showed a change of the plant {times}, and each reset begins the estimation "
            "anew.",
            Setting("--no-reset", "reset=False"),
            replace(recursion, reset=False),
        )
    lambdas = result.forgetting_factor[np.isfinite(result.forgetting_factor)]
    factor = float(np.mean(lambdas[lambdas.size // 2 :])) if lambdas.size else 1.0
    memory = 1.0 / max(1.0 - factor, 1e-12)
    for longer in LONGER_MEMORY:
        if memory < 0.5 * longer and longer <= result.n_samples:
            value = 1.0 - 1.0 / longer
            yield (
                f"With a mean forgetting factor of {factor:.4g} the estimator remembers about "
                f"{memory:.0f} samples.",
                Setting(
                    f"--forgetting constant --lambda0 {value:g}",
                    f"forgetting=ehsid.Constant({value:g})",
                ),
                replace(recursion, forgetting=ehsid.Constant(value)),
            )


def _delays(data: IoData, recursion: Recursion, result: EstimationResult) -> Iterator[_Change]:
    """A residual that depends on the input shows a wrong delay; so does a leading b near zero."""
    orders = recursion.orders
    lag = _dependent_lag(data, result)
    if lag is not None and lag < orders.nk:
        yield _delay(
            recursion,
            lag,
            f"The residual depends on the input {lag} samples before, which is less than the delay "
            f"of {orders.nk}.",
        )
        return
    if lag is not None and lag >= orders.nk + orders.nb and orders.nb < MOST_COEFFICIENTS:
        nb = min(lag - orders.nk + 1, MOST_COEFFICIENTS)
        yield (
            f"The residual depends on the input {lag} samples before, which the model does not "
            "use.",
            Setting(f"--nb {nb}", f"nb={nb}"),
            replace(recursion, orders=replace(orders, nb=nb)),
        )
    best, less = _best_delay(data, recursion)
    if best != orders.nk:
        yield _delay(
            recursion,
            best,
            f"With a delay of {best} instead of {orders.nk}, least squares over the whole record "
            f"leave {100.0 * less:.0f} % less squared error.",
        )


def _delay(recursion: Recursion, nk: int, why: str) -> _Change:
    setting = Setting(f"--nk {nk}", f"nk={nk}")
    return why, setting, replace(recursion, orders=replace(recursion.orders, nk=nk))


def _best_delay(data: IoData, recursion: Recursion) -> tuple[int, float]:
    """Returns the delay with which least squares fit best, and the share of the loss it removes.

    It is the present delay where no other one removes `CLEARLY_LESS` of the loss.
    """
    orders = recursion.orders
    tried = range(max(orders.nk - FURTHER_DELAYS, 0), orders.nk + FURTHER_DELAYS + 1)
    skip = max(replace(orders, nk=tried[-1]).n_history, orders.n_history)
    losses = {}
    for nk in tried:
        try:
            fitted = fit_arx(data, replace(orders, nk=nk, offset=True), skip=skip)
        except IdentificationError:  # the record does not determine it
            continue
        losses[nk] = fitted.loss
    if orders.nk not in losses:
        return orders.nk, 0.0
    best = min(losses, key=lambda nk: losses[nk])
    less = 1.0 - losses[best] / losses[orders.nk] if losses[orders.nk] > 0.0 else 0.0
    return (best, less) if less > CLEARLY_LESS and best <= MOST_DELAY else (orders.nk, 0.0)


def _dependent_lag(data: IoData, result: EstimationResult) -> int | None:
    """Returns the lag in samples at which the residual depends most on the input; None if none."""
    known = np.isfinite(result.innovation)
    settled = known & (np.cumsum(known) > result.n_start)
    residual, u = result.innovation[settled], data.u[data.index][settled]
    if residual.size <= 4 * MAX_LAG:
        return None
    test = independence_test(residual, u)
    causal = test.lags >= 0
    if test.passed:
        return None
    return int(test.lags[causal][np.argmax(np.abs(test.correlation[causal]))])


def _methods(recursion: Recursion) -> Iterator[_Change]:
    """Noise of the position sensor needs the recursion that is right with it."""
    if recursion.method == "rls":
        yield (
            "The residuals are not white, as with noise of the position sensor.",
            Setting("--method riv", 'method="riv"'),
            replace(recursion, orders=replace(recursion.orders, offset=True), method="riv"),
        )


def _fewer(data: IoData, recursion: Recursion, result: EstimationResult) -> Iterator[_Change]:
    """A record that does not determine all coefficients may determine fewer."""
    orders = recursion.orders
    name, times = _worst(result)
    why = f"The standard deviation of {name} is {_about(times)} times what counts as converged."
    for less in range(1, max(orders.na, orders.nb)):
        na, nb = orders.na - less, orders.nb - less
        if min(na, nb) < LEAST_COEFFICIENTS:
            return
        yield (
            why,
            Setting(f"--na {na} --nb {nb}", f"na={na}, nb={nb}"),
            replace(recursion, orders=replace(orders, na=na, nb=nb)),
        )


def _lacks(data: IoData, recursion: Recursion, result: EstimationResult) -> list[str]:
    """Says what the record lacks and what the estimate is good for, where no change helps."""
    found = []
    if not result.residuals_white and recursion.method == "rls":
        found.append(
            "The estimate does not converge with the method riv either. The plant may not be "
            "linear in this record, as with friction, a dead band or saturation: `ehsid gap` looks "
            "for such effects in the records of a servo."
        )
    found += _use(result)
    found += _without_information(result)
    name, times = _worst(result)
    # The deviations are enlarged where the residuals are not white; `settled` takes the plain ones.
    if not result.settled and np.isfinite(times) and times > 1.0:
        longer = (
            f"with this command the record would have to be {_about(times**2)} times as long"
            if times**2 <= MOST_TIMES_LONGER
            else "a longer record with this command would not do"
        )
        found.append(
            f"The standard deviation of {name} is {_about(times)} times what counts as converged "
            "(5 % of the coefficient). It falls with the square root of the length, and in "
            f"proportion to the amplitude of the command: {longer}. Take a command that turns at "
            "other intervals or, if the valve takes a larger one, moves the machine further; "
            "`ehsid simulate` tries one first."
        )
    scatter = float(np.std(data.y[data.index]))
    if scatter > 0.0 and result.rmse > 0.1 * scatter:
        found.append(
            f"The prediction by one step misses {100.0 * result.rmse / scatter:.0f} % of the "
            "output's standard deviation: check that the two columns belong together, and that the "
            "sampling is neither much faster nor much slower than the plant."
        )
    return found


def _use(result: EstimationResult) -> Iterator[str]:
    """Says what an estimate is good for that is not called converged."""
    if result.settled:
        yield (
            "The estimate has settled: each coefficient is determined to 5 %, if the residuals are "
            "taken for white. They are not, so the intervals may not hold, and the estimate is not "
            "called converged. This is usual where the machine is not linear. A controller may use "
            "such an estimate by `settled`, within limits of its own."
        )
    if result.simulation_fit_percent >= GOOD_SIMULATION:
        yield (
            "Simulated over the whole record, the model fits the output by "
            f"{result.simulation_fit_percent:.1f} %: it predicts this motion well, also where its "
            "coefficients are not known one by one."
        )


def _without_information(result: EstimationResult) -> Iterator[str]:
    """Says that most samples carried no information."""
    if result.skipped > MOST_SKIPPED * result.n_samples:
        yield (
            f"{result.skipped} of {result.n_samples} samples carried no information. Record the "
            "machine while the command moves it most of the time."
        )


def _worst(result: EstimationResult) -> tuple[str, float]:
    """Returns the coefficient that is furthest from converged, and by which factor."""
    worst = int(np.argmax(np.nan_to_num(result.times_tolerance, nan=np.inf)))
    return result.orders.names[worst], float(result.times_tolerance[worst])


def _about(number: float) -> str:
    """Returns a number with two digits and no exponent."""
    if not np.isfinite(number):
        return "many"
    digits = max(0, int(np.floor(np.log10(number))) - 1)
    return f"{round(number, -digits):.0f}" if number >= 10.0 else f"{number:.1f}"


_NOT_WHITE = "The residuals are not white (statistic {:.4g}, at most 22.5 expected): "
_WHY_NOT_WHITE = {
    "rls": "the parameters are biased, and their intervals, though widened, may not hold. The "
    "usual reason is noise on the measured output; the method `riv` stays correct there. "
    "Other reasons: a coloured disturbance, wrong orders or delay, friction, saturation.",
    "riv": "the intervals, though widened, may not hold. Reasons: coloured noise of the sensor, "
    "wrong orders or delay, friction, saturation; with a disturbance of the servo itself take the "
    "method `rls`.",
}

# Of each TrustReason, what it means, and what to do.
_REASONS = {
    "starting": "too little has been seen: move the servo for some seconds",
    "resting": "the servo stands still, and the interval has grown",
    "single_sine": "the command is one sine, or as smooth as one within the time that the servo "
    "takes, which does not show this value: command steps, or several frequencies",
    "change_suspected": "the plant has just changed: wait",
    "model_does_not_fit": "the model that runs alone does not move like this output: either it is "
    "no servo, or look for the cause with `ehsid gap`",
    "not_precise": "the interval is wider than 10 % of K, or 15 % of omega_n and xi. Friction, a "
    "dead band or a load that changes widen it, for which `ehsid gap` looks, and so do a command "
    "that seldom moves the servo and a sampling time that is too long for it, omega_n dt > pi",
}


def servo_words(servo: ServoPath) -> list[str]:
    """Says how long each value of a servo could be trusted, and why not at the end."""
    lines = []
    reasons: dict[str, list[str]] = {}
    for value in servo:
        if value.reason.name != "trusted":
            reasons.setdefault(value.reason.name, []).append(value.name)
    for reason, names in reasons.items():
        which = " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
        lines.append(f"At the end {which} cannot be trusted: {_REASONS[reason]}.")
    if servo.resets:
        times = "once" if servo.resets == 1 else f"{servo.resets} times"
        lines.append(f"The model was lost and begun anew {times}.")
    return lines


def not_white_words(estimate: Estimate) -> str:
    """Says that the residuals are not white, what this means, and the usual reasons."""
    return _NOT_WHITE.format(estimate.whiteness) + _WHY_NOT_WHITE[estimate.method]


def state_words(estimate: Estimate) -> str:
    """Returns how far the estimate has come at the end of the record."""
    if estimate.converged:
        return "converged"
    return "settled, not converged" if estimate.settled else "not converged"


def advice_words(advice: Advice, *, python: bool = False) -> list[str]:
    """Returns advice in sentences, which name the options of the command, or those of Python."""
    tries = []
    for trial in advice.trials:
        setting = trial.setting.arguments if python else trial.setting.options
        white = "white" if trial.residuals_white else "still not white"
        tries.append(
            f"{trial.why} With `{setting}` the estimate converges on this record; the prediction "
            f"by one step then fits {trial.one_step_fit_percent:.2f} %, and the residuals are "
            f"{white}."
        )
    return [*tries, *advice.lacks]
