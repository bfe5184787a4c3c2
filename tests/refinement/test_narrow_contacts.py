"""Edges of narrow contacts from the force that a coarse mesh has."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.refinement.contact_edges import Edge
from petcontact.refinement.narrow_contacts import NarrowContact

COMPLIANCE, RADIUS = 1e-3, 5.0


def line_load(centre: float, half: float) -> tuple[np.ndarray, np.ndarray]:
    """Arc lengths of nodes graded to 0, and what they carry of Hertz' pressure over 1/E* = COMPLIANCE."""
    ends = np.concatenate([-(2.0 ** -np.arange(12)), [0.0], 2.0 ** -np.arange(11.0, -1.0, -1.0)])
    fine = np.linspace(centre - half, centre + half, 4001)
    p = (
        half
        / (2.0 * RADIUS * COMPLIANCE)
        * np.sqrt(np.maximum(1.0 - ((fine - centre) / half) ** 2, 0.0))
    )
    load, _ = np.histogram(fine, ends, weights=p * (fine[1] - fine[0]))
    moment, _ = np.histogram(fine, ends, weights=p * fine * (fine[1] - fine[0]))
    middle = 0.5 * (ends[1:] + ends[:-1])
    return np.where(load > 0.0, moment / np.where(load > 0.0, load, 1.0), middle), load


@pytest.mark.parametrize("centre", [0.0, 0.01])
def test_hertz_half_width_of_a_coarse_contact(centre):
    """The nodes say that it ends somewhere between .06 and .25; the force says where."""
    s, load = line_load(centre, 0.1)
    contact = NarrowContact(lambda x: x**2 / (2.0 * RADIUS), COMPLIANCE)
    seen = [Edge(-0.2, 0.15), Edge(-0.1, 0.15), Edge(0.2, 0.15)]
    found = contact.edges(seen, s, load, load > 0.0)
    assert [edge.s for edge in found] == pytest.approx(
        [centre - 0.1, centre - 0.05, centre + 0.1], abs=2e-4
    )
    assert all(edge.width == pytest.approx(0.1, rel=1e-3) for edge in found)


def test_what_is_no_hertzian_contact_keeps_its_edges():
    """A flat punch, a zone at an end of the part, and edges that are nearer to the second moment."""
    s, load = line_load(0.0, 0.1)
    seen = [Edge(-0.2, 0.15), Edge(0.2, 0.15)]
    assert NarrowContact(np.zeros_like, COMPLIANCE).edges(seen, s, load, load > 0.0) == seen
    round_gap = NarrowContact(lambda x: x**2 / (2.0 * RADIUS), COMPLIANCE)
    inside = load > 0.0
    assert round_gap.edges(seen, s[inside], load[inside], inside[inside]) == seen
    close = [Edge(-0.1, 0.1), Edge(0.1, 0.1)]
    assert NarrowContact(lambda x: x**2 / RADIUS, COMPLIANCE).edges(close, s, load, inside) == close
    assert round_gap.edges([], s, load, inside) == []
    one = s == s[len(s) // 2]  # a zone of one node has no second moment
    assert round_gap.edges(close, s, load, one) == close
