# SPDX-License-Identifier: MIT
"""What a recursive estimation is worth, in words, and what to try."""

from __future__ import annotations

from .advice import Advice
from .result import Estimate
from .servo import ServoPath

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
    "dead band or a load that changes widen it, for which `ehsid gap` looks, and so does a command "
    "that seldom moves the servo",
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
