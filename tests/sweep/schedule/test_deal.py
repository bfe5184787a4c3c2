"""Dealing: every case once, the dearest group first, and no preparation that takes longer than what
it helps."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from petcontact.sweep.progress import DONE, FAILED, Progress
from petcontact.sweep.schedule.cost import Cost
from petcontact.sweep.schedule.deal import Counters, dealt, make_parts


def costs_of(case, prepare):
    return [Cost(0, 0, first, each, 0.0) for first, each in zip(prepare, case, strict=True)]


def parts_of(sizes, case, prepare, teams):
    group = np.repeat(np.arange(len(sizes)), sizes)
    return make_parts(np.arange(len(group)), group, costs_of(case, prepare), teams), group


def dealt_out(folder, parts, group, case, prepare, teams):
    """What each team computes on a clock of its own: the team that is free first claims next. Its
    batches and its time."""
    counters = Counters(folder)
    batches = [[] for _ in range(teams)]
    clocks = np.zeros(teams)
    holds = [-1] * teams
    claims = [dealt(parts, counters) for _ in range(teams)]
    busy = set(range(teams))
    while busy:
        team = min(busy, key=lambda team: clocks[team])
        batch = next(claims[team], None)
        if batch is None:
            busy.discard(team)
            continue
        batches[team].append(batch.tolist())
        for place in batch:
            clocks[team] += case[group[place]] + prepare[group[place]] * (
                holds[team] != group[place]
            )
            holds[team] = group[place]
    return batches, clocks


@given(
    st.lists(
        st.tuples(st.integers(1, 40), st.floats(1e-3, 10.0), st.floats(0.0, 50.0)),
        min_size=1,
        max_size=12,
    ),
    st.integers(1, 16),
)
def test_every_case_is_computed_once(tmp_path_factory, groups, teams):
    sizes, case, prepare = zip(*groups, strict=True)
    parts, group = parts_of(sizes, case, prepare, teams)
    batches, _ = dealt_out(tmp_path_factory.mktemp("d"), parts, group, case, prepare, teams)
    assert sorted(place for some in batches for batch in some for place in batch) == list(
        range(sum(sizes))
    )


def test_the_dearest_group_is_begun_first_and_one_team_takes_group_after_group(tmp_path):
    case, prepare = [2.0, 3.0, 1.0], [1.0, 1.0, 1.0]
    parts, group = parts_of([3, 5, 2], case, prepare, 1)
    ((*batches,),), _ = dealt_out(tmp_path, parts, group, case, prepare, 1)
    assert group[np.concatenate(batches)].tolist() == 5 * [1] + 3 * [0] + 2 * [2]
    assert make_parts(np.zeros(0, int), np.zeros(3, int), costs_of(case, prepare), 4) == []


def test_teams_end_near_together_though_costs_are_wrong_by_half(tmp_path):
    rng = np.random.default_rng(0)
    sizes, prepare = [1250] * 8, [0.0] * 8
    real = np.linspace(0.65, 1.45, 8)[::-1] * rng.uniform(0.9, 1.1, 8)
    parts, group = parts_of(sizes, np.linspace(1.06, 0.94, 8), prepare, 10)
    _, clocks = dealt_out(tmp_path, parts, group, real, prepare, 10)
    assert clocks.max() < 1.05 * clocks.mean()


def test_the_progress_line_counts_what_is_on_the_disk(tmp_path):
    counters = Counters(tmp_path)
    progress = Progress(counters, 8)
    assert progress.line(1.0) == "0 of 8 cases done, 0 failed"
    counters.count({DONE: 2, FAILED: 1})  # they waited for what all cases share
    assert progress.line(600.0) == "2 of 8 cases done, 1 failed"
    counters.count({DONE: 2})
    assert progress.line(620.0) == "4 of 8 cases done, 1 failed, 40 s left"
    assert progress.line(4200.0).endswith("2 h 00 min left")
