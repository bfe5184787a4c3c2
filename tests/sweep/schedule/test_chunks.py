"""Chunks: every case in exactly one, shrinking, and groups that stay together."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from sweep_files import CONFIGS, sweep_file

from petcontact.sweep.design.sweep import read_sweep
from petcontact.sweep.schedule.chunks import make_chunks
from petcontact.sweep.schedule.groups import make_groups


def chunked(sizes, case, prepare, teams):
    group = np.repeat(np.arange(len(sizes)), sizes)
    return make_chunks(np.arange(len(group)), group, np.array(case, float), np.array(prepare, float), teams), group


@given(st.lists(st.tuples(st.integers(1, 40), st.floats(0.01, 10.0), st.floats(0.0, 50.0)), min_size=1, max_size=12),
       st.integers(1, 64))  # fmt: skip
def test_every_case_is_in_exactly_one_chunk(groups, teams):
    sizes, case, prepare = zip(*groups, strict=True)
    chunks, group = chunked(sizes, case, prepare, teams)
    assert sorted(place for k in range(len(chunks)) for place in chunks[k]) == list(range(sum(sizes)))
    # groups lie one after another
    order = group[chunks.order]
    assert len(order[np.flatnonzero(np.diff(order, prepend=-1))]) == len(sizes)


def test_chunks_of_equal_cases_shrink_to_one():
    chunks, _ = chunked([10_000], [1.0], [0.0], 10)
    sizes = np.diff(chunks.bounds)
    assert sizes[0] == 500
    assert np.all(np.diff(sizes) <= 0)
    assert sizes[-1] == 1
    # about 2R ln(n / 2R) large ones and 2R single ones
    assert len(chunks) < 20 * (np.log(10_000 / 20) + 2)


def test_the_dearest_group_comes_first_and_whole_where_another_preparation_costs_more_than_waiting():
    chunks, group = chunked([4, 4, 4, 4], [1.0, 4.0, 2.0, 3.0], [4.0] * 4, 2)
    assert [sorted(set(group[chunks[k]])) for k in range(2)] == [[1], [3]]
    assert [len(chunks[k]) for k in range(2)] == [4, 4]


def test_a_group_is_not_prepared_for_less_than_its_preparation_is_worth():
    chunks, _ = chunked([100], [0.1], [5.0], 8)
    assert min(np.diff(chunks.bounds)) * 0.1 >= 5.0 - 1e-9
    one, _ = chunked([100], [0.1], [11.0], 8)
    assert len(one) == 1


def test_costs_that_are_wrong_by_half_leave_the_teams_balanced():
    # eight groups of one size, whose cases cost between 0.65 and 1.45 of what is believed: a chunk that took in the rest of
    # a group up to a whole share of the work let nine teams of ten wait for a quarter of the time
    group = np.random.default_rng(0).integers(0, 8, 10_000)
    real = np.linspace(0.65, 1.45, 8)[::-1]
    chunks = make_chunks(np.arange(10_000), group, np.linspace(1.06, 0.94, 8), np.zeros(8), 10)
    seconds = [real[group[chunks[k]]].sum() for k in range(len(chunks))]
    assert max(seconds) < 0.8 * real[group].sum() / 10


def test_groups_that_cost_most_to_prepare_go_to_different_teams():
    chunks, group = chunked([6, 6], [0.003, 0.003], [0.2, 0.05], 2)
    assert [set(group[chunks[k]]) for k in range(len(chunks))] == [{0}, {1}]


def test_one_team_takes_group_after_group():
    chunks, group = chunked([3, 5, 2], [2.0, 3.0, 1.0], [1.0, 1.0, 1.0], 1)
    assert group[chunks.order].tolist() == 5 * [1] + 3 * [0] + 2 * [2]
    assert np.array_equal(np.concatenate([chunks[k] for k in range(len(chunks))]), chunks.order)
    assert len(make_chunks(np.zeros(0, int), np.zeros(0, int), np.zeros(0), np.zeros(0), 4)) == 0


def test_cases_that_differ_in_the_method_alone_share_a_group():
    sweep = read_sweep(CONFIGS / "tables.toml")
    groups = make_groups(sweep)
    assert groups.size.tolist() == [16] * 8
    for number in range(8):
        places = np.flatnonzero(groups.of_case == number)
        assert groups.first[number] == places[0]
        assert len({(sweep.coordinates(k)["problem"], sweep.coordinates(k)["element_size"]) for k in places}) == 1
    readings = make_groups(read_sweep(CONFIGS / "sweep_readings.toml"))
    assert readings.size.tolist() == [128] * 8


def test_formulation_and_petsc_options_make_groups(tmp_path):
    path = sweep_file(tmp_path, """
problems = ["example1.toml"]
[cross]
formulation = ["condensed", "full"]
"petsc.ksp_type" = ["preonly", "gmres"]
"boundary.0.friction_bound" = [100.0, 150.0]
tolerance = [1e-5, 1e-6]
""")  # fmt: skip
    groups = make_groups(read_sweep(path))
    assert groups.size.tolist() == [2] * 8
    # the friction bound is not the mesh's
    assert len(groups.representatives()) == 2
