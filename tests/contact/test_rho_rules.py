"""The rules on hand-made sequences of w_k: (4.2), (4.3), s_k and c_k of section 4.1, and condition
(3.4)."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from petcontact.contact.rho_rules import (
    Modified,
    ModifiedSafeguarded,
    SelfAdaptive,
    usable_balance,
)


def test_self_adaptive_grows_shrinks_and_keeps():
    rule = SelfAdaptive(tau=2.0, max_changes=10)
    assert rule.update(1.0, 3.1) == 3.0  # w > (1+τ)ρ: times 1 + s = 1 + τ
    assert (rule.changes, rule.growth) == (1, 2.0)
    assert rule.update(3.0, 0.9) == 1.0  # w < ρ/(1+τ)
    assert rule.changes == 2
    assert rule.update(1.0, 3.0) == 1.0  # on the window's edge: no change
    assert (rule.changes, rule.growth) == (2, 0.0)
    assert rule.update(1.0, 1.0 / 3.0) == 1.0


def test_changes_after_c_max_are_damped():
    rule = SelfAdaptive(tau=2.0, max_changes=2)
    growths = []
    rho = 1.0
    for _ in range(6):
        rho = rule.update(rho, 1e9)
        growths.append(rule.growth)
    assert growths == [2.0, 2.0, 1.0, 1.0 / 4.0, 1.0 / 9.0, 1.0 / 16.0]
    assert rho == pytest.approx(3 * 3 * 2 * 1.25 * (10 / 9) * (17 / 16))


def test_modified_takes_w_inside_the_window():
    rule = Modified(tau=2.0, max_changes=10)
    assert rule.update(1.0, 2.5) == 2.5
    assert rule.changes == 0
    assert rule.update(2.5, 100.0) == 7.5
    assert rule.changes == 1


def test_literal_reading_counts_w_itself():
    rule = SelfAdaptive(tau=2.0, max_changes=10, change_test="literal")
    # w = 5 lies outside [1/3, 3] although w/ρ = 1 lies inside: c counts, ρ stays
    assert rule.update(5.0, 5.0) == 5.0
    assert rule.changes == 1
    # w = 1 lies inside although w/ρ = 1/100 does not: s = 0, ρ cannot move
    assert rule.update(100.0, 1.0) == 100.0
    assert (rule.changes, rule.growth) == (1, 0.0)


@given(
    st.lists(st.floats(1e-9, 1e9), min_size=1, max_size=200),
    st.floats(0.1, 10.0),
    st.integers(0, 20),
)
def test_self_adaptive_and_safeguarded_satisfy_3_4_with_summable_steps(balances, tau, max_changes):
    for rule in (
        SelfAdaptive(tau=tau, max_changes=max_changes),
        ModifiedSafeguarded(tau=tau, free_steps=max_changes),
    ):
        rho, total = 1.0, 0.0
        for balance in balances:
            new = rule.update(rho, balance)
            assert (
                rho / (1.0 + rule.growth) * (1 - 1e-12)
                <= new
                <= rho * (1.0 + rule.growth) * (1 + 1e-12)
            )
            rho, total = new, total + rule.growth
        assert total <= tau * max_changes + math.pi**2 / 6 + 1e-9


def test_printed_modified_rule_breaks_3_4():
    rule = Modified()
    new = rule.update(1.0, 2.9)
    assert rule.growth == 0.0 and new == 2.9  # s_k = 0, yet ρ moved


def test_balance_of_steps_that_do_not_move():
    assert usable_balance(2.0, 4.0) == 0.5
    assert usable_balance(2.0, 0.0) == math.inf
    assert math.isnan(usable_balance(0.0, 0.0))
