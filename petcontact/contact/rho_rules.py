"""Rules for the Robin parameter: how ρ_{k+1} follows from ρ_k and the balance w_k (section 4 of the
paper).

A rule is an object with one method, `update(rho, balance) -> rho`. It may count its updates. Each
run of Algorithm 1 begins with a copy of the rule as it was given, because the count c_k belongs to
one run (Lemma 3.1). Write your own and pass it to `solve`:

    class HalfWay:
        def update(self, rho, balance):
            return (rho * balance) ** 0.5

A rule of the package is a class here and its line in `given.tables.solver_options.RULES`.
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import Literal, Protocol, cast

from ..errors import InputError
from ..given.tables.solver_options import DEFAULT_RULE, RULES, Method


class Rule(Protocol):
    """The interface between the projection method and a rule for ρ."""

    def update(self, rho: float, balance: float) -> float:
        """Return ρ_{k+1} from ρ_k and w_k = ‖σ_t^{k+1} - σ_t^k‖ / ‖u_t^{k+1} - u_t^k‖
        [stress/length]."""
        ...


@dataclass
class Fixed:
    """The rule that leaves ρ as it is: ρ_{k+1} = ρ_k."""

    def update(self, rho: float, balance: float) -> float:
        """Return ρ_k, unchanged."""
        return rho


@dataclass
class SelfAdaptive:
    """Rule (4.2): ρ grows or shrinks by 1 + s_k where w_k/ρ_k leaves the window [1/(1+τ), 1+τ].

    Attributes
    ----------
    tau : float
        τ > 0, the half width of the window and the growth of the first c_max changes [-].
    max_changes : int
        c_max: later changes are damped, s_k = 1/(c_{k+1} - c_max)², so that the s_k are summable
        (Lemma 3.1).
    change_test : {"ratio", "literal"}
        What counts as a change of ρ: w_k/ρ_k outside the window, or w_k itself as printed in
        section 4.1.
    changes : int
        c_k, counted by `update`.
    growth : float
        s_k of the last update.
    """

    tau: float = 2.0
    max_changes: int = 10
    change_test: Literal["ratio", "literal"] = "ratio"
    changes: int = 0
    growth: float = 0.0

    def update(self, rho: float, balance: float) -> float:
        """Return the next ρ_{k+1} by equation (4.2)."""
        self.growth = self._next_growth(rho, balance)
        if balance > (1.0 + self.tau) * rho:
            return (1.0 + self.growth) * rho  # (4.2), first line
        if balance < rho / (1.0 + self.tau):
            return rho / (1.0 + self.growth)  # (4.2), second line
        return self._inside(rho, balance)

    def _inside(self, rho: float, balance: float) -> float:
        return rho

    def _next_growth(self, rho: float, balance: float) -> float:
        """Return s_k, and update the count c_{k+1}."""
        tested = balance / rho if self.change_test == "ratio" else balance
        if 1.0 / (1.0 + self.tau) <= tested <= 1.0 + self.tau:
            return 0.0
        self.changes += 1
        if self.changes <= self.max_changes:
            return self.tau
        return 1.0 / (self.changes - self.max_changes) ** 2


@dataclass
class Modified(SelfAdaptive):
    """Rule (4.3): as (4.2), but ρ_{k+1} = w_k inside the window.

    Inside the window s_k = 0, yet ρ moves: condition (3.4) and with it Theorem 3.1 do not cover
    this rule, whatever the paper says; `ModifiedSafeguarded` mends that.
    """

    def _inside(self, rho: float, balance: float) -> float:
        return balance  # (4.3), last line


@dataclass
class ModifiedSafeguarded(Modified):
    """Rule (4.3) with every step clipped to a summable s_k, so that (3.4) and Theorem 3.1 hold.

    Attributes
    ----------
    free_steps : int
        Updates with s_k = τ; the later ones have s_k = 1/(k - free_steps + 1)².
    step : int
        k, counted by `update`.
    """

    free_steps: int = 60
    step: int = 0

    def update(self, rho: float, balance: float) -> float:
        """Return ρ_{k+1} of (4.3), clipped to [ρ_k/(1+s_k), (1+s_k)ρ_k]."""
        wanted = super().update(rho, balance)
        bound = (
            self.tau
            if self.step < self.free_steps
            else 1.0 / (self.step - self.free_steps + 1) ** 2
        )
        self.step += 1
        self.growth = bound
        return min(max(wanted, rho / (1.0 + bound)), (1.0 + bound) * rho)


def make_rule(options: Method) -> Rule:
    """Return a new rule with the parameters of a `[method]` table."""
    kind: type[SelfAdaptive] = globals()[RULES[options.rule or DEFAULT_RULE]]
    parameters = ("tau", "max_changes", "change_test")
    taken = [name for name in parameters if name in kind.__dataclass_fields__]
    return cast(Rule, kind(**{name: getattr(options, name) for name in taken}))


def rule_of(rule: Rule | str | type | None, options: Method) -> Rule | None:
    """Return a rule by its name or class, with the parameters of a `[method]` table.

    An object is returned as it is, and None stays None.

    Raises
    ------
    InputError
        If it has no `update`.
    """
    if isinstance(rule, type) and rule.__module__ == __name__:
        rule = next((name for name, kind in RULES.items() if kind == rule.__name__), rule)
    if isinstance(rule, str):
        return make_rule(
            Method(**{**options.model_dump(exclude_unset=True), "name": None, "rule": rule})
        )
    if isinstance(rule, type) or not (rule is None or callable(getattr(rule, "update", None))):
        raise InputError(
            f"rule: a name ({', '.join(RULES)}), or an object with update(rho, balance); got "
            f"{rule!r}"
        )
    return rule


def begun(rule: Rule) -> Rule:
    """Return a copy of a rule for one run of Algorithm 1; the rule itself never counts.

    Raises
    ------
    InputError
        If the rule holds what cannot be copied, for example an open file.
    """
    try:
        return copy.deepcopy(rule)
    except Exception as error:
        raise InputError(
            f"rule: each run of Algorithm 1 begins with a copy of {type(rule).__name__}, which "
            f"cannot be copied ({error})"
        ) from error


def usable_balance(sigma_change: float, u_change: float) -> float:
    """Return w_k, or NaN if neither σ_t nor u_t moved: ρ has no reason to change then."""
    if u_change == 0.0:
        return math.inf if sigma_change > 0.0 else math.nan
    return sigma_change / u_change  # (4.1) holds where this is ρ_k
