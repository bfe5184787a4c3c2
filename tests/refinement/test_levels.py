"""Which meshes an accuracy climbs."""

from __future__ import annotations

import pytest

from petcontact.refinement.levels import CONTACT_LADDER, SLIP_LADDER


@pytest.mark.parametrize("ladder", [SLIP_LADDER, CONTACT_LADDER])
def test_a_rough_accuracy_leaves_out_the_second_level(ladder):
    fine, rough = ladder.reaching(0.99 * ladder.rough), ladder.reaching(ladder.rough)
    assert fine == ladder.levels and not ladder.believes([1e-9], 0.99 * ladder.rough)
    assert rough[0] == ladder.levels[0] and rough[-5:] == ladder.levels[-5:]
    assert ladder.levels[1] not in rough
    assert ladder.believes([1e-9], ladder.rough) and not ladder.believes([1e-9, 1e-9], ladder.rough)
    # what confirms is better than what it confirms, and coarser than what follows
    milder = ladder.reaching(ladder.rougher)[1]
    assert ladder.levels[2].resolved < milder.resolved < ladder.levels[0].resolved / 4.0
