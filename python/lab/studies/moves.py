# SPDX-License-Identifier: MIT
"""Changes of the settings that the offline procedure tries if a test fails, in their order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from .attempts import Attempt, Settings
from .problems import Problem

HIGHEST_ORDER = 6
MORE_DELAYS = 5

Proposal = tuple[Settings, str, str]
"""New settings, what they change, and the reason, both in words."""

Move = Callable[[Attempt, Attempt], Proposal | None]
"""Makes a proposal from the best attempt so far and the first one; None if it has no purpose."""


def _lower_orders(best: Attempt, first: Attempt) -> Proposal | None:
    assert best.result is not None
    lower = tuple(range(1, best.result.chosen.orders.na))
    if not best.has(Problem.NON_MINIMAL) or not lower:
        return None
    why = f"at order {lower[-1] + 1} a pole and a zero cancel within their uncertainty"
    return replace(best.settings, orders=lower), "lower orders", why


def _longer_delays(best: Attempt, first: Attempt) -> Proposal | None:
    assert best.result is not None
    delays = best.settings.delays
    longest = best.result.chosen.orders.nk == delays[-1] and len(delays) > 1
    if "independence" not in best.failed_tests and not longest:
        return None
    more = tuple(sorted({*delays, *range(delays[-1] + 1, delays[-1] + MORE_DELAYS + 1)}))
    why = (
        "the longest delay tried was chosen"
        if longest
        else "the residual still contains the input: a delay may be missing"
    )
    return replace(best.settings, delays=more), f"delays up to {more[-1]}", why


def _order(order: int) -> Move:
    def move(best: Attempt, first: Attempt) -> Proposal | None:
        assert best.result is not None
        if not best.failed_tests or order <= best.result.chosen.orders.na:
            return None
        why = f"{' and '.join(best.failed_tests)} of the residual failed: dynamics may be missing"
        return replace(best.settings, orders=(order,)), f"order {order}", why

    return move


def _lines_removed(best: Attempt, first: Attempt) -> Proposal | None:
    if not best.failed_tests:
        return None
    changed = replace(best.settings.preprocessing, trend="linear")
    settings = replace(best.settings, orders=_all_orders(best, first), preprocessing=changed)
    why = f"{' and '.join(best.failed_tests)} of the residual failed: a drift may be the cause"
    return settings, "lines removed", why


def _means_removed(best: Attempt, first: Attempt) -> Proposal | None:
    if not best.failed_tests or not best.settings.offset:
        return None
    changed = replace(best.settings.preprocessing, trend="mean")
    orders = _all_orders(best, first)
    settings = replace(best.settings, orders=orders, preprocessing=changed, offset=False)
    why = "the working point taken out as the paper does it, by means"
    return settings, "means removed, no constant term", why


def _constant_term(best: Attempt, first: Attempt) -> Proposal | None:
    if not best.failed_tests or best.settings.offset:
        return None
    why = "the working point may lie elsewhere than at the means"
    orders = _all_orders(best, first)
    return replace(best.settings, orders=orders, offset=True), "constant term", why


def _all_orders(best: Attempt, first: Attempt) -> tuple[int, ...]:
    """Returns all orders tried first or best, since changed signals may need another order."""
    return tuple(sorted({*first.settings.orders, *best.settings.orders}))


MOVES: tuple[Move, ...] = (
    _lower_orders,
    _longer_delays,
    *(_order(order) for order in range(2, HIGHEST_ORDER + 1)),
    _lines_removed,
    _means_removed,
    _constant_term,
)
