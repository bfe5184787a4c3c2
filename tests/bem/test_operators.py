"""G and H on whole outlines: identities from theory, and blocks against each other."""

from __future__ import annotations

import numpy as np
from prepared import filled, operators
from shapes import closing, drawn, elastic, moved, problem

CORNERS = [[0, 0], [3, 0.2], [3.5, 2], [1.4, 3.1], [-0.4, 1.3]]


def pentagon(order):
    return problem(
        material=elastic(210.0, 0.28),
        geometry={"shape": "polygon", "vertices": CORNERS, "parts": list("abcde")},
        mesh={"element_size": 0.25, "order": order},
        boundary=[
            closing("a", friction_bound=1.0),
            moved("b", ["0.1*(x - 3)", "y - 0.2"]),
            drawn("c", [3.0, "x"]),
            {"part": "d", "condition": "traction", "pressure": 2.0},
            moved("e", [0.0, "free"]),
        ],
    )


def test_blocks_are_the_whole_matrix():
    for order in (0, 2):
        ops = operators(pentagon(order))
        everything = np.arange(ops.mesh.n_nodes)
        filled_system, contact, loads = filled(ops)
        assert np.allclose(filled_system, ops.system_entries(everything, everything), atol=1e-14)
        outer = ops.outer_entries(everything, everything)
        carriers = ops.right_hand_sides.node
        in_contact = ops.of_contact
        assert np.array_equal(in_contact, np.isin(carriers, ops.data.contact_nodes))
        assert outer.shape[1] == len(carriers) and 0 < np.count_nonzero(in_contact) < len(carriers)
        assert np.allclose(contact, outer[:, in_contact], atol=1e-14)
        assert not loads[:, 0].any() and loads[:, 1].any()
        assert np.allclose(outer @ ops.amplitudes, loads, atol=1e-13)
        rng = np.random.default_rng(1)
        rows, columns = (np.sort(rng.permutation(ops.mesh.n_nodes)[:count]) for count in (17, 23))
        pairs = (2 * rows[:, None] + [0, 1]).ravel(), (2 * columns[:, None] + [0, 1]).ravel()
        expected = filled_system[np.ix_(*pairs)]
        assert np.allclose(ops.system_entries(rows, columns), expected, atol=1e-14)
        slots = np.flatnonzero(np.isin(carriers, columns))
        assert np.allclose(
            ops.outer_entries(rows, columns), outer[np.ix_(pairs[0], slots)], atol=1e-14
        )
        system, beside = ops.all_entries(rows, columns)
        assert np.array_equal(system, ops.system_entries(rows, columns))
        assert np.allclose(beside, outer[np.ix_(pairs[0], slots)], atol=1e-14)
