# SPDX-License-Identifier: MIT
"""Variables of a function block: the constants and the state of an estimator, as literals.

The block has the numbers of the C++ estimator, each rounded once to REAL or LREAL.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal
from xml.sax.saxutils import escape

import numpy as np
import numpy.typing as npt

from .configuration import EstimatorConfiguration
from .header import policy_members, upper_triangle

Section = Literal["VAR_INPUT", "VAR_OUTPUT", "VAR", "VAR CONSTANT"]
TYPES = {"float32": "REAL", "float64": "LREAL"}


@dataclass(frozen=True)
class Variable:
    """A variable of the block."""

    section: Section
    name: str
    type: str
    """Elementary type, such as REAL."""
    comment: str
    length: int = 0
    """Number of elements of an array, which begins at 0; 0: no array."""
    initial: tuple[str, ...] = ()
    """Initial values as literals, one or `length`; empty: zero."""

    @property
    def declaration(self) -> str:
        """The variable as a line of Structured Text."""
        kind = f"ARRAY[0..{self.length - 1}] OF {self.type}" if self.length else self.type
        values = ", ".join(self.initial)
        start = f" := [{values}]" if self.length else f" := {values}"
        return f"  {self.name} : {kind}{start if self.initial else ''}; (* {self.comment} *)"

    @property
    def element(self) -> str:
        """The variable as an element of PLCopen XML."""
        kind = f"<{self.type} />"
        if self.length:
            bounds = f'<dimension lower="0" upper="{self.length - 1}" />'
            kind = f"<array>{bounds}<baseType>{kind}</baseType></array>"
        values = [f'<simpleValue value="{value}" />' for value in self.initial]
        if self.length:
            inner = "".join(f"<value>{value}</value>" for value in values)
            values = [f"<arrayValue>{inner}</arrayValue>"]
        start = f"<initialValue>{values[0]}</initialValue>" if self.initial else ""
        note = (
            f'<documentation><xhtml xmlns="{XHTML}">{escape(self.comment)}</xhtml></documentation>'
        )
        return f'<variable name="{self.name}"><type>{kind}</type>{start}{note}</variable>'


XHTML = "http://www.w3.org/1999/xhtml"
SECTIONS: dict[Section, str] = {
    "VAR_INPUT": "inputVars",
    "VAR_OUTPUT": "outputVars",
    "VAR CONSTANT": 'localVars constant="true"',
    "VAR": "localVars",
}


class BlockNumbers:
    """Constants and initial values of the block, each rounded once to its type."""

    def __init__(self, configuration: EstimatorConfiguration, dtype: str) -> None:
        self.of = configuration
        self.dtype = dtype
        self.type = TYPES[dtype]
        self.float: type[np.float32 | np.float64] = np.float32 if dtype == "float32" else np.float64
        self.n = configuration.orders.n_parameters
        self.limits = np.finfo(self.float)

    def literal(self, value: float | np.floating) -> str:
        """The shortest decimal that is read as this number; it has a point."""
        number = self.float(value)
        if number == 0.0 or 1e-3 <= abs(float(number)) < 1e7:
            return np.format_float_positional(number, unique=True, trim="0")
        text = np.format_float_scientific(number, unique=True, trim="0", exp_digits=1)
        return text.replace("e+", "E").replace("e", "E")

    def typed(self, value: float) -> str:
        """The number with its type, so that no expression becomes wider."""
        return f"{self.type}#{self.literal(value)}"

    def variables(self) -> Iterable[Variable]:
        """All variables, in the order of their sections."""
        yield from self._interface()
        yield from self._constants()
        yield from self._state()
        yield from self._scratch()

    def _number(
        self, section: Section, name: str, comment: str, value: float | None = None
    ) -> Variable:
        initial = () if value is None else (self.literal(value),)
        return Variable(section, name, self.type, comment, 0, initial)

    def _list(
        self,
        section: Section,
        name: str,
        comment: str,
        length: int,
        values: npt.ArrayLike | None = None,
    ) -> Variable:
        initial: tuple[str, ...] = ()
        if values is not None:
            initial = tuple(self.literal(value) for value in np.atleast_1d(values))
        return Variable(section, name, self.type, comment, max(length, 1), initial)

    def _interface(self) -> Iterable[Variable]:
        names = ", ".join(self.of.orders.names)
        yield self._number("VAR_INPUT", "command", "sent at this cycle, unit of the record")
        yield self._number("VAR_INPUT", "position", "measured at this cycle, unit of the record")
        yield Variable(
            "VAR_INPUT", "enable", "BOOL", "FALSE: only the history moves on", 0, ("TRUE",)
        )
        yield Variable("VAR_INPUT", "restart", "BOOL", "lambda and P begin anew behind this sample")
        yield Variable("VAR_INPUT", "cycle_lost", "BOOL", "the cycle before was lost or late")
        yield Variable("VAR_OUTPUT", "status", "INT", "see the top of this file", 0, ("1",))
        start = self.of.estimator(self.dtype)
        yield self._list("VAR_OUTPUT", "theta", names, self.n, start.theta_hat)
        yield self._list(
            "VAR_OUTPUT",
            "deviation",
            "standard deviations of theta",
            self.n,
            start.standard_deviation,
        )
        yield self._number("VAR_OUTPUT", "innovation", "prediction error, unit of the position")
        yield self._number("VAR_OUTPUT", "lambda", "forgetting factor of the last step", 1.0)
        variance = "sigma^2, squared unit of the position"
        yield self._number("VAR_OUTPUT", "residual_variance", variance, start.residual_variance)
        yield Variable(
            "VAR_OUTPUT", "settled", "BOOL", "deviations are small, were the residuals white"
        )
        yield Variable("VAR_OUTPUT", "converged", "BOOL", "settled, and the residuals are white")
        yield self._number(
            "VAR_OUTPUT", "excitation", "share of recent samples that told something"
        )
        yield Variable("VAR_OUTPUT", "alarms", "DINT", "changes of the plant so far")

    def _constants(self) -> Iterable[Variable]:
        of, convergence, eps = self.of, self.of.convergence, float(self.limits.eps)
        most, n = float(self.limits.max), self.n

        def constant(name: str, value: float, comment: str) -> Variable:
            return self._number("VAR CONSTANT", name, comment, value)

        for name, value in (("ZERO", 0.0), ("ONE", 1.0), ("TWO", 2.0), ("PARAMETERS", float(n))):
            yield constant(name, value, "as a number of this type")
        yield constant("LARGEST", most, "largest finite number")
        yield constant("LEAST_NORMAL", float(self.limits.tiny), "least number that is not denormal")
        squarable = 2.0**63 if self.float is np.float32 else 2.0**511
        yield constant("SQUARABLE", squarable, "a smaller number has a finite square")
        for side, offset, scale in (
            ("COMMAND", of.scaling.command_offset, of.scaling.command_scale),
            ("POSITION", of.scaling.position_offset, of.scaling.position_scale),
        ):
            yield constant(f"{side}_OFFSET", offset, "unit of the signal")
            yield constant(f"{side}_SCALE", scale, "unit of the signal")
        yield constant("INPUT_LIMIT", of.input_limit, "largest plausible scaled signal")
        yield self._list("VAR CONSTANT", "PARAMETER_UNIT", "of scaled parameters", n, self.units())
        yield self._list(
            "VAR CONSTANT",
            "START_D",
            "P of a restart, scaled, units of sigma^2",
            n,
            self._start_d(),
        )
        weights = self.float(1) / (self.float(n) * self._start_d())
        yield self._list("VAR CONSTANT", "CEILING_WEIGHT", "1 / (n P0_ii)", n, weights)
        for member, value in policy_members(of.forgetting):
            yield constant(f"FORGETTING_{member.upper()}", value, "setting of the policy")
        match of.forgetting.info.id:
            case "exponential":
                yield constant("LEAST_DEFICIT", eps / 4.0, "1 - lambda that rounds to nothing")
            case "error_driven":
                yield constant("MOST_POSTERIOR", 1e18, "its square is finite")
                yield constant("POLICY_MOST_SQUARE", 8.0, "what a square adds at most, in means")
            case "f_ratio":
                yield constant("SHORT_WINDOW", 10.0, "samples")
                yield constant("LONG_WINDOW", 100.0, "samples")
                yield constant(
                    "MOST_POLICY_SQUARE",
                    float(self.float(most) / self.float(800)),
                    "sums of 100 are finite",
                )
        margin = of.rls.information_margin
        if margin < 0.0:
            margin = float(np.sqrt(self.float(n))) if n > 1 else 0.0
        yield constant("INFORMATION_MARGIN", margin, "of a sample, in losses of forgetting")
        yield constant("COVARIANCE_CEILING", of.rls.covariance_ceiling, "mean of P_ii / P0_ii")
        yield constant("RECENT_RATE", 1.0 / 16.0, "of the mean of recent squares")
        yield constant("STARVED", 0.4, "share of the information that was forgotten")
        yield constant("SURPRISE", 4.0, "recent squares over usual ones")
        yield constant("ROUNDING_SQUARE", (64.0 * eps) ** 2, "of phi' theta")
        yield constant("LONGEST_WAIT", 0.08, "exp(-2.5): two and a half memories")
        yield constant("NOTHING", 1e-6, "a share below counts as none")
        yield constant("FULL_SIZE", 2e6, "phi' P0 phi of a regressor of full size")
        yield constant("NOISE_SIZE", 25.0, "phi' P0 phi of noise")
        yield constant("FALLEN", 10.0, "sigma^2 over recent squares that have fallen")
        yield constant("WELL_PREDICTED", 1e-4, "square of an error of 1 % of the output")
        yield constant("BADLY_PREDICTED", 0.03, "square of one of 17 %")
        yield constant("MOST_SQUARE", 24.0, "what a square adds at most to the usual one")
        yield constant("MOST_RISE", 1.0 / 16.0, "of the usual square in a step")
        yield constant("MOST_WEIGHT", 1e6, "samples that a mean counts at most")
        yield constant("TOLERANCE", convergence.tolerance, "deviation over parameter")
        yield constant("MAGNITUDE", convergence.magnitude, "least scaled parameter to judge by")
        yield Variable(
            "VAR CONSTANT", "HOLD", "DINT", "samples in a row", 0, (str(convergence.hold),)
        )
        yield constant(
            "SMALLEST_SQUARE", float(self.float(1e-5) * self.float(1e-5)), "less is rounding"
        )
        yield constant("LARGEST_ERROR", 3.0, "deviations that an error counts at most")
        yield constant("LARGEST_COMMAND", 1e6, "scaled")
        one = self.float(1)
        yield constant("SHORTEST_MEMORY", float(one - one / self.float(500)), "500 samples")
        yield constant("LONGEST_MEMORY", float(one - one / self.float(1e5)), "100,000 samples")
        yield constant("WHITE_ALARM", 22.458, "chi-squared, 6 degrees of freedom, 99.9 %")
        yield constant("WHITE_RELEASE", 12.592, "95 %")
        yield constant("MOST_MOVED", 12.0, "squared deviations that one error may move theta")
        if of.reset is not None:
            for name, value in (
                ("SHORT_WINDOW", of.reset.short_window),
                ("LONG_WINDOW", of.reset.long_window),
                ("TRIGGER_RATIO", of.reset.trigger_ratio),
                ("RELEASE_RATIO", of.reset.release_ratio),
                ("FLOOR", of.reset.floor),
            ):
                yield constant(f"CHANGE_{name}", value, "setting of the reset")
            cool_down = (str(of.reset.cool_down),)
            yield Variable("VAR CONSTANT", "CHANGE_COOL_DOWN", "DINT", "samples", 0, cool_down)
            yield constant("MOST_SHORT", 2.45, "what one square counts in the short mean")
            yield constant("MOST_LONG", 6.0, "what one square counts in the long mean")
            yield constant("FORGETS", 0.0023, "a policy that forgets so much loses a glitch")

    def units(self) -> npt.NDArray[Any]:
        """Factors from scaled parameters to those in the units of the signals, (n,)."""
        scaling, orders, real = self.of.scaling, self.of.orders, self.float
        b = real(scaling.position_scale) / real(scaling.command_scale)
        values = [real(1)] * orders.na + [b] * orders.nb
        return np.array(values + [real(scaling.position_scale)] * int(orders.offset), dtype=real)

    def _start_d(self) -> npt.NDArray[Any]:
        return np.full(self.n, self.of.variance0, dtype=self.float)

    def _start_theta(self) -> npt.NDArray[Any]:
        seed = self.of.seed
        theta: npt.NDArray[Any] = np.zeros(self.n) if seed is None else seed.theta
        scaled: npt.NDArray[Any] = theta.astype(self.float) / self.units()
        return scaled

    def _noise(self) -> np.floating:
        """sigma^2 of the seed, scaled; 0 where it is unknown."""
        scale = self.float(self.of.scaling.position_scale)
        return (
            self.float(0.0 if self.of.seed is None else self.of.seed.noise_variance) / scale / scale
        )

    def _state(self) -> Iterable[Variable]:
        orders, n, real = self.of.orders, self.n, self.float
        seed, noise, policy = self.of.seed, self._noise(), self.of.forgetting.info.id

        def number(name: str, comment: str, value: float = 0.0) -> Variable:
            return self._number("VAR", name, comment, value)

        def counter(name: str, comment: str, value: int = 0) -> Variable:
            return Variable("VAR", name, "DINT", comment, 0, (str(value),))

        pairs = n * (n - 1) // 2
        d = self._start_d() if seed is None else seed.d
        upper = np.zeros(max(pairs, 1)) if seed is None or not pairs else upper_triangle(seed)
        yield self._list("VAR", "theta_scaled", "theta(k-1)", n, self._start_theta())
        yield self._list("VAR", "remainder", "what rounding took off theta", n, np.zeros(n))
        yield self._list("VAR", "d", "D of P = U D U'", n, d)
        yield self._list("VAR", "u", "U above its diagonal, by columns", pairs, upper)
        yield self._list("VAR", "regained", "account of the information", n, np.ones(n))
        yield number("postponed", "forgetting that waits", 1.0)
        yield number("waited", "how long it has waited", 1.0)
        known = bool(noise > 0)
        mean = real(noise) * real(2) / real(n + 2)
        start_weight = float(n + 2) if known else 0.0
        yield number("mean_square", "weighted mean of the squares", float(mean))
        yield number("usual_square", "the same, rising slowly", float(mean))
        yield number("weight", "of both, in samples", start_weight)
        yield number("weight_square", "sum of the squared weights", start_weight)
        yield number("weight_share", "sum(w^2) / sum(w)", 1.0)
        yield number("freedom", "degrees of freedom, at least 1", 2.0 if known else 1.0)
        yield number("recent_square", "mean of about 16 squares")
        yield number("square", "normalised square of the last step")
        yield number("innovation_scaled", "of the last step")
        if policy == "exponential":
            initial = dict(policy_members(self.of.forgetting))["lambda_initial"]
            yield number("deficit", "1 - lambda(k)", float(real(1) - real(initial)))
        elif policy == "error_driven":
            yield number("policy_square", "own estimate of sigma0^2")
            yield counter("policy_seen", "samples since the restart")
        elif policy == "f_ratio":
            for window, length in (("short", 10), ("long", 100)):
                yield self._list(
                    "VAR", f"{window}_slots", "squares, and sums of the block before", length
                )
                yield number(f"{window}_head", "sum of this block")
                yield counter(f"{window}_place", "of the coming square")
            yield counter("policy_seen", "samples since the restart, up to 100")
        yield self._list("VAR", "past_outputs", "scaled", orders.na)
        yield self._list("VAR", "past_commands", "scaled", orders.nk + orders.nb)
        yield counter("known_samples", "complete past samples")
        yield counter("steady", "samples in a row within the tolerance")
        yield counter("monitor_samples", "since the start or the last change")
        for name, length in (("errors", 3), ("commands", 5), ("sums", 6), ("squares", 6)):
            yield self._list("VAR", f"white_{name}", "of the test of the residuals", length)
        yield number("white_partial", "of the statistic")
        yield number("white_statistic", "chi-squared, 6 degrees of freedom")
        for name in ("samples", "tested", "next"):
            yield counter(f"white_{name}", "of the test of the residuals")
        yield Variable("VAR", "coloured", "BOOL", "the residuals are not white")
        if self.of.reset is not None:
            yield number("short_square", "mean of the squares, short window", float(noise))
            yield number("long_square", "the same, long window", float(noise))
            seen = int(min(float(self.of.reset.long_window), 1e9)) + 1 if known else 0
            yield counter("change_seen", "samples so far", seen)
            yield counter("change_cooling", "samples without another alarm")
            yield counter("change_armed", "0 after an alarm, 2 after a jump of theta", 1)

    def _scratch(self) -> Iterable[Variable]:
        """Variables that live within a cycle."""
        n, policy = self.n, self.of.forgetting.info.id
        common = (
            "scaled_command scaled_position predicted error variance_of_phi sum v old share "
            "before after loss fresh square_new recent_new power usual_variance at_start noise "
            "wanted postponed_new waited_new shrink alpha alpha_before slope increment samples "
            "leaving rho white_error begin_variance"
        )
        words = common.split()
        words += {
            "constant": [],
            "exponential": ["deficit_new"],
            "error_driven": ["posterior", "allowance"],
            "f_ratio": ["policy_square", "short_mean", "usual"],
        }[policy]
        flags = "ready kept skipped alarm usable frozen well limited inside moved_far begin_anew"
        if self.of.reset is not None:
            words += ["long_before", "count", "trigger", "in_short", "in_long"]
            flags += " warm"
        for name in words:
            yield self._number("VAR", name, "of this cycle")
        for name, length in (
            *((name, n) for name in ("phi", "gain_new", "theta_new", "remainder_new", "d_new")),
            ("u_new", n * (n - 1) // 2),
            ("variances", n),
            ("white_past", 6),
        ):
            yield self._list("VAR", name, "of this cycle", length)
        for name in flags.split():
            yield Variable("VAR", name, "BOOL", "of this cycle")
        for name in ("i", "j", "place"):
            yield Variable("VAR", name, "DINT", "of this cycle")
