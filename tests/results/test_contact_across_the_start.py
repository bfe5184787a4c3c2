"""A contact that lies where the arc lengths of its part begin is one contact."""

from types import SimpleNamespace

import numpy as np
import pytest

from petcontact.results.contact_zones import pair_edges


def pressed(start, turn=2.0 * np.pi, contact=1.0, half=0.3, nodes=200):
    """A circle, or an arc of it, of radius 1 whose arc lengths begin at the angle `start`, closed
    within `half` of the angle `contact` with Hertz's pressure."""
    s = (np.arange(nodes) + 0.5) * turn / nodes
    angle = start + s
    away = np.abs((angle - contact + np.pi) % (2.0 * np.pi) - np.pi)
    closed, still = away < half, np.zeros((nodes, 1))
    return SimpleNamespace(
        arc_length=s,
        x=np.column_stack([np.cos(angle), np.sin(angle)]),
        state=np.where(closed, 0, 2),
        gap=np.maximum(away - half, 0.0) ** 1.5,
        pressure=np.sqrt(np.maximum(half**2 - away**2, 0.0)),
        sigma_t=still,
        slip_increment=still,
        bound=np.full(nodes, np.inf),
    )


@pytest.mark.parametrize("start", [0.0, 0.75, 1.0, 1.28, 4.0])
def test_edges_are_the_same_wherever_the_circle_begins(start):
    found = pair_edges(pressed(start))
    places = sorted((start + edge.s) % (2.0 * np.pi) for edge in found)
    assert places == pytest.approx([0.7, 1.3], abs=0.01)
    assert [edge.width for edge in found] == pytest.approx([0.3, 0.3], abs=0.03)
    assert all(0.0 <= edge.s < 2.0 * np.pi for edge in found)


def test_an_arc_has_ends():
    found = pair_edges(pressed(1.0, turn=5.0))
    assert [edge.s for edge in found] == pytest.approx([0.3], abs=0.01)
    assert found[0].width == pytest.approx(0.15, abs=0.03)
