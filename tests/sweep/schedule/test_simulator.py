"""Sweeps on a simulated clock."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.sweep.schedule.simulator import Latency, simulate

NONE = Latency(0.0, 0.0, 0.0, 0.0, 0.0)
NETWORK = Latency(1e-3, 5e-5, 5e-3, 2e-3, 3e-5)
SPREAD = 0.23
"""Of the iterations of the 128 cases of the paper: standard deviation over mean."""


def equal(cases, seconds=0.05):
    return np.full(cases, seconds), np.zeros(cases, np.int64), np.array([seconds]), np.array([0.0])


def test_one_team_takes_the_sum_of_all_cases_and_of_all_preparations():
    seconds = np.random.default_rng(0).uniform(0.01, 0.1, 500)
    group = np.arange(500) % 7
    found = simulate(seconds, group, np.full(7, 0.05), np.linspace(1.0, 2.0, 7), 1, NONE)
    assert found.makespan == pytest.approx(seconds.sum() + np.linspace(1.0, 2.0, 7).sum(), rel=1e-12)
    assert found.makespan == pytest.approx(found.ideal, rel=1e-12)


def test_a_claim_that_takes_a_second_is_waited_for():
    slow = simulate(*equal(4), 2, Latency(0.5, 0.0, 0.0, 0.0, 0.0))
    fast = simulate(*equal(4), 2, NONE)
    # two cases each, in one or two chunks; at the end each asks once more
    assert fast.makespan == pytest.approx(0.1)
    assert slow.makespan == pytest.approx(0.1 + 0.5 * 2 * slow.claims / 2)


def test_claims_queue_at_the_counter():
    found = simulate(*equal(100), 100, Latency(0.0, 0.1, 0.0, 0.0, 0.0))
    assert found.makespan == pytest.approx(0.05 + 100 * 0.1)


@pytest.mark.parametrize(("teams", "cases"), [(10, 1_000), (100, 10_000), (1000, 100_000)])
def test_cases_of_50_ms_are_within_5_percent_of_ideal(teams, cases):
    rng = np.random.default_rng(teams)
    seconds, group, expected, prepare = equal(cases)
    seconds = 0.05 * rng.lognormal(-0.5 * SPREAD**2, SPREAD, cases)
    for latency in (NONE, NETWORK):
        found = simulate(seconds, group, expected, prepare, teams, latency)
        assert 1.0 <= found.makespan / found.ideal < 1.05
        assert (found.claims + found.flushes) / cases < 0.25


def test_groups_that_are_dear_to_prepare_are_not_prepared_by_everybody():
    group = np.repeat(np.arange(8), 16)
    found = simulate(np.full(128, 0.01), group, np.full(8, 0.01), np.full(8, 1.0), 4, NONE)
    assert found.makespan == pytest.approx(2 * 1.0 + 32 * 0.01, rel=1e-9)
