# SPDX-License-Identifier: MIT
"""GrowthMonitor once more, in float32 of numpy, statement by statement: it must have the same bits.

The work behind a block is done at once here and step by step there, so that statistics are compared
when it is done.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

F = np.float32
LIMIT, LEAD, SHARE = F(4.0), F(6.0), F(0.03)


def tables(rng: np.random.Generator, signatures: int, tests: int, block: int) -> dict[str, Any]:
    """Returns arguments of a monitor of a servo with 0.001 a sample and V, drawn at random."""
    effect = [
        int(i)
        for i in np.sort(
            np.concatenate([np.arange(tests), rng.integers(0, tests, signatures - tests)])
        )
    ]
    return {
        "servo": [1e-3, 0.06, 0.17, 0.71, 0.4, 0.39, 0.3],
        "correction": [0.6, 0.3, 0.05],
        "delay": int(rng.integers(1, 9)),
        "settle": 10,
        "block": block,
        "command_edges": np.sort(rng.normal(size=7)),
        "acceleration_edges": np.sort(1e-4 * rng.normal(size=4)),
        "mean": 1e-6 * rng.normal(size=40) - 3e-6,
        "weight": rng.uniform(5e4, 2e5, 40),
        "other": 0.3 * rng.normal(size=(40, 2)),
        "signature": 0.1 * rng.normal(size=(40, signatures)) + 0.15,
        "effect": effect,
        "tests": [(effect.index(i), float(rng.uniform(0.2, 1.0)), 0.25) for i in range(tests)],
        "prior": 0.01,
        "limit": 8.0,
    }


class Reference:
    """The monitor; arguments as those of `ehsid.GrowthMonitor`."""

    def __init__(self, **t: Any) -> None:
        self.t = {
            k: v if k in ("delay", "settle", "block", "effect", "tests") else np.asarray(v, F)
            for k, v in t.items()
        }
        self.rows = 2 + self.t["signature"].shape[1]
        self.started = False
        self.counted = 0
        self.block: npt.NDArray[np.float32] = np.zeros((2, 40), F)
        self.windows: list[npt.NDArray[np.float32] | None] = [None] * len(self.t["tests"])
        self.statistic = np.zeros(len(self.windows), F)
        self.alarmed = np.zeros(len(self.windows), bool)
        self.first = self.named = -1
        self.innovation = F(0.0)

    def step(self, command: float, position: float) -> None:
        u, y = F(command), F(position)
        if not (np.isfinite(u) and np.isfinite(y) and abs(u) <= 1e12 and abs(y) <= 1e12):
            self.started = False
            return
        if not self.started:
            self.started, self.settled = True, 0
            self.commands = [u] * 8
            self.y, self.innovation = y, F(0.0)
            self.v = self.a = self.mv = self.ma = F(0.0)
            return
        gain, s, w, e, i, decay, pull = self.t["servo"]
        c = self.t["correction"]
        acting = self.commands[self.t["delay"] - 1]
        demand = gain * acting
        error, a = self.v - demand, self.a
        moved = self.v - s * error + i * a
        innovation = (y - self.y) - ((c[0] - F(1.0)) * self.innovation + moved)
        if not abs(innovation) < F(2.0**63):
            self.started = False
            return
        self.v = (self.v + e * a - w * error) + c[1] * innovation
        self.a = (decay * a - pull * error) + c[2] * innovation
        error, a = self.mv - demand, self.ma
        self.mv = self.mv + e * a - w * error
        self.ma = decay * a - pull * error
        self.innovation, self.y = innovation, y
        cell = int(np.sum(acting > self.t["command_edges"])) * 5
        cell += int(np.sum(self.ma > self.t["acceleration_edges"]))
        self.commands = [u, *self.commands[:-1]]
        if self.settled < self.t["settle"]:
            self.settled += 1
            return
        x = (innovation - self.t["mean"][cell]) * self.t["weight"][cell]
        self.block[0, cell] += min(max(x, -LIMIT), LIMIT)
        self.block[1, cell] += F(1.0)
        self.counted += 1
        if self.counted == self.t["block"]:
            self.counted = 0
            self.judge()

    def judge(self) -> None:
        """What follows a block. Rows: score, information, with the first and the second other."""
        other, all_ = self.t["other"], np.hstack([self.t["other"], self.t["signature"]])
        done = np.zeros((self.rows, 4), F)
        for cell in range(40):
            counted = all_[cell] * self.block[1, cell]
            done[:, 0] += all_[cell] * self.block[0, cell]
            done[:, 1] += all_[cell] * counted
            done[:, 2] += other[cell, 0] * counted
            done[:, 3] += other[cell, 1] * counted
        self.block = np.zeros((2, 40), F)
        for test, (signature, trust, margin) in enumerate(self.t["tests"]):
            kept = self.windows[test]
            sums = done if kept is None else kept + done
            both = sums[1, 2]
            inverse0 = F(1.0) / (sums[0, 1] + self.t["prior"])
            share = both * inverse0
            inverse1 = F(1.0) / ((sums[1, 1] - share * both) + self.t["prior"])
            score0, score1 = sums[0, 0], sums[1, 0] - share * sums[0, 0]
            best, most, second = 0, F(0.0), F(0.0)
            for n, row in enumerate(sums[2:]):
                part0 = row[2] * inverse0
                rest = row[3] - share * row[2]
                part1 = rest * inverse1
                score = row[0] - part0 * score0 - part1 * score1
                left = row[1] - part0 * row[2] - part1 * rest
                information = max(left, F(0.0))
                size = score / information if information > 0 else F(0.0)
                explained = F(0.5) * score * size if size > 0 else F(0.0)
                effect = self.t["effect"][n]
                if explained > most:
                    second = second if effect == best else most
                    most, best = explained, effect
                elif effect != best and explained > second:
                    second = explained
                if n == signature:
                    growth = score - F(0.5) * (F(1.0) + F(margin)) * information
                    self.statistic[test] = F(trust) * (F(1.0) - F(margin)) * growth
            if not self.alarmed[test] and not self.statistic[test] > 0:
                self.statistic[test] = F(0.0)
                self.windows[test] = None
                continue
            self.windows[test] = sums
            if self.statistic[test] > self.t["limit"]:
                self.alarmed[test] = True
                self.first = test if self.first < 0 else self.first
            if (
                self.first == test
                and self.named < 0
                and F(trust) * (most - second) > LEAD
                and most - second > SHARE * most
            ):
                self.named = best
