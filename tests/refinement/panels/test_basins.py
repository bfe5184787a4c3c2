"""Contacts that begin at several places: their basins, and the shares of one force."""

from types import SimpleNamespace

import numpy as np
import pytest
from shapes import cuboid, moved, problem, solid, touching

from petcontact.geometry.charts import chart_of
from petcontact.geometry.round_surfaces import CylinderSurface
from petcontact.geometry.surface import BoxSurface
from petcontact.given.values import as_given
from petcontact.pipeline.adapt.banded import Bands
from petcontact.pipeline.adapt.first_mesh import FirstMeshes
from petcontact.pipeline.adapt.long_contacts import ZonedContact, followed
from petcontact.refinement.panels.basins import basins
from petcontact.refinement.panels.face_gaps import face_gap
from petcontact.refinement.panels.zone import ContactEllipse

BOX = BoxSurface(np.array([-1.5, -1.5, -2.0]), np.array([1.5, 1.5, 0.0]))
ROUND = CylinderSurface(np.array([0.0, 0.0, -2.0]), np.array([0.0, 0.0, 2.0]), 1.0)
BALLS = "min((x - 0.6)**2 + (y + 0.2)**2, (x + 0.6)**2 + (y - 0.1)**2 + 0.003)/4"
SLANTED = "(0.8*x + 0.6*y)**2"


@pytest.mark.parametrize(
    ("surface", "part", "gap", "approach", "count"),
    [
        (BOX, "top", BALLS, 0.01, 2),
        (BOX, "top", BALLS, 1e-4, 1),
        (BOX, "top", BALLS, 1.0, 1),
        (BOX, "top", SLANTED, 1e-4, 1),
        (BOX, "top", f"{SLANTED} + 1e-4*sin(9*x)", 1e-3, 1),
        (BOX, "top", "min((0.8*x + 0.6*y - 0.5)**2, (0.8*x + 0.6*y + 0.5)**2)", 1e-4, 2),
        (BOX, "top", "(sqrt(x**2 + y**2) - 0.8)**2", 1e-4, 1),
        (ROUND, "side", "y**2 + z**2", 1e-2, 2),
        (ROUND, "side", "x**2 + z**2", 1e-2, 2),
    ],
)
def test_basins_are_as_many_as_places_that_touch_apart(surface, part, gap, approach, count):
    """Samples of slanted ridges are no basins; one of two on a side may lie where it is cut."""
    chart = chart_of(surface, part)
    gap = face_gap(chart, as_given(gap, "gap"), None, None)
    found = basins(gap, chart, approach)
    place = np.random.default_rng(1).uniform(chart.low, chart.high, (20000, 2))
    touching = place[gap(place) < approach]
    assert len(found) == count
    assert np.all(np.sum([within(touching) for within in found], axis=0) == 1)


def test_zones_of_one_contact_are_pressed_by_one_approach():
    """Of Hertz' circles F = 4 E* a³ k/3 and the approach is a² k, from the gap of each."""
    block = solid("block", cuboid([-1.5, -1.5, -2.0], [1.5, 1.5, 0.0]), moved("bottom", 3 * [0.0]))
    tool = {"name": "tool", "displacement": [0.0, 0.0, "free"], "force": [0.0, 0.0, -2e-4]}
    pair = touching("pair", "block.top", "tool", gap=BALLS)
    posed = problem(body=[block], obstacle=[tool], contact=[pair]).posed
    made, laid = Bands(posed, 0.05).first(FirstMeshes(posed, 4000).meshes, lambda made: made)
    zones = [long.zone for long in laid.long["pair"]]
    high, low = sorted(zones, key=lambda zone: zone.centre[0])
    radius = np.array([np.linalg.norm(zone.axes[0]) for zone in (high, low)])
    assert np.array([high.centre, low.centre]) == pytest.approx(
        np.array([[-0.6, 0.1], [0.6, -0.2]])
    )
    assert np.diff(0.5 * radius**2)[0] == pytest.approx(0.003 / 4.0, rel=1e-6)
    modulus = 1.0 / posed.softness(posed.interfaces[0])
    assert 4.0 / 3.0 * modulus * 0.5 * np.sum(radius**3) == pytest.approx(2e-4)
    x, nodes = made[0].x, made[0].nodes_of("top")
    assert made[0].weight[nodes].sum() == pytest.approx(9.0)
    areas = [made[0].weight[nodes] @ zone.holds(x[nodes, :2]) for zone in (high, low)]
    assert areas == pytest.approx(np.pi * radius**2, rel=1e-2)


def test_each_zone_follows_the_nodes_next_to_it():
    """Of Hertz' pressures on three circles, one of which has opened."""
    chart = chart_of(BOX, "top")
    centres, radii = np.array([[-1.0, 0.0], [0.0, 0.5], [1.0, 0.0]]), np.array([0.2, 0.1, 0.0])
    place = np.stack(np.meshgrid(*[np.linspace(-1.495, 1.495, 300)] * 2), axis=-1).reshape(-1, 2)
    away = np.linalg.norm(place[:, None] - centres, axis=2)
    pressure = np.sqrt(np.maximum(radii**2 - away**2, 0.0)).sum(axis=1)
    x = np.column_stack([place, np.zeros(len(place))])
    pair = SimpleNamespace(x=x, weight=np.full(len(x), 1e-4), pressure=pressure)
    step = SimpleNamespace(pairs={"c": pair}, load=1.0, step=1)
    longs = [
        ZonedContact(SimpleNamespace(name="c"), [chart], ContactEllipse(c + 0.02, 0.15 * np.eye(2)))
        for c in centres
    ]
    found = followed(longs, SimpleNamespace(steps=[step], tried=[step]), "c", False)
    assert [np.linalg.norm(long.zone.axes[0]) for long in found] == pytest.approx(
        [0.2, 0.1], rel=0.03
    )
    assert [long.zone.centre for long in found] == [
        pytest.approx(centre, abs=1e-3) for centre in centres[:2]
    ]
