# SPDX-License-Identifier: MIT
"""What a recursive estimation is worth, in words, and what to try where it is worth little."""

from __future__ import annotations

from ehsid.harness.estimation.result import Estimate

_NOT_WHITE = "The residuals are not white (statistic {:.4g}, at most 22.5 expected): "
_OF_THE_SENSOR = (
    "the intervals, though widened, may not hold. Reasons: coloured noise of the sensor, wrong "
    "orders or delay, friction, saturation; with a disturbance of the servo itself take the method "
    "`armax` or `rls`."
)
_WHY_NOT_WHITE = {
    "rls": "the parameters are biased, and their intervals, though widened, may not hold. The "
    "usual reason is noise on the measured output; the methods `riv` and `oe` stay correct there. "
    "Other reasons: a coloured disturbance (method `armax`), wrong orders or delay, friction, "
    "saturation.",
    "riv": _OF_THE_SENSOR,
    "oe": _OF_THE_SENSOR,
    "armax": "the parameters may be biased, and their intervals, though widened, may not hold. "
    "Reasons: noise of the sensor (methods `riv` and `oe`), wrong orders or delay, friction, "
    "saturation.",
}
# From this share of samples without information on, the excitation is too weak or too short.
MOST_SKIPPED = 0.5


def not_white_words(estimate: Estimate) -> str:
    """Says that the residuals are not white, what this means, and the usual reasons."""
    return _NOT_WHITE.format(estimate.whiteness) + _WHY_NOT_WHITE[estimate.method]


def what_to_try(estimate: Estimate) -> list[str]:
    """Returns what may make an estimate converge, in sentences; none where it has converged."""
    if estimate.converged:
        return []
    tries = []
    if estimate.resets:
        tries.append(
            "Each reset begins the estimation anew. If the machine did not change in this record, "
            "switch the reset off."
        )
    if estimate.skipped > MOST_SKIPPED * estimate.n_samples:
        tries.append(
            f"{estimate.skipped} of {estimate.n_samples} samples carried no information: take a "
            "record in which the command moves the machine most of the time."
        )
    if estimate.orders.na + estimate.orders.nb > 4:
        tries.append(
            "Take fewer coefficients: this record may not determine all of them. Na = nb = 2 is "
            "the least for a valve that is much faster than the cylinder."
        )
    tries.append(
        "Let the estimator forget more slowly, with a factor closer to 1 or a longer memory: the "
        "coefficients then vary less."
    )
    tries.append("Take a longer record.")
    return tries
