"""Closed surfaces in space: what is mended, and what is refused in one line."""

from __future__ import annotations

import re
from pathlib import Path

import meshio
import numpy as np
import pytest
from curved_bodies import written

from petcontact.errors import InputError
from petcontact.geometry.gmsh import read_msh
from petcontact.geometry.gmsh_surface import gmsh_surface, is_surface
from petcontact.geometry.surface import FacetSurface, checked_surface
from petcontact.mesh.panelling import facet_mesh

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
FACES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)


def surface(points: np.ndarray = CUBE, facets: np.ndarray = FACES) -> FacetSurface:
    if facets.shape[1] == 3:
        facets = np.column_stack([facets, np.full(len(facets), -1)])
    return FacetSurface(points, facets, np.zeros(len(facets), dtype=np.int64), ("all",))


def enclosed(checked: FacetSurface) -> float:
    """Volume by the divergence theorem, negative where normals point inward."""
    mesh = facet_mesh(checked, 3)
    return float(mesh.weight @ np.sum(mesh.x * mesh.normal, axis=1)) / 3.0


@pytest.mark.parametrize("seed", range(4))
def test_normals_are_mended(seed: int) -> None:
    rng = np.random.default_rng(seed)
    facets = FACES.copy()
    for k in np.flatnonzero(rng.random(6) < 0.5):
        facets[k] = facets[k, ::-1]
    assert enclosed(checked_surface(surface(facets=facets), "cube")) == pytest.approx(1.0)
    halves = np.vstack([facets[:, :3], facets[:, [0, 2, 3]]])
    assert enclosed(checked_surface(surface(facets=halves), "cube")) == pytest.approx(1.0)


def test_a_body_has_cavities_but_is_one_piece() -> None:
    cavity = 0.25 + 0.5 * CUBE
    beside = CUBE + np.array([2.0, 0.0, 0.0])
    within = 0.375 + 0.25 * CUBE
    both = surface(np.vstack([CUBE, cavity]), np.vstack([FACES, FACES + 8]))
    assert enclosed(checked_surface(both, "two")) == pytest.approx(1.0 - 0.125)
    for pieces in ((CUBE, beside), (CUBE, cavity, within)):
        numbers = np.vstack([FACES + 8 * k for k in range(len(pieces))])
        with pytest.raises(
            InputError, match=re.escape("b.msh: 2 separate pieces, at (0, 0, 0) and")
        ):
            checked_surface(surface(np.vstack(pieces), numbers), "b.msh")


@pytest.mark.parametrize(
    ("points", "facets", "message"),
    [
        (CUBE, FACES[:5], "is open: one facet at the edge"),
        (CUBE, np.vstack([FACES, FACES[:1]]), "no boundary of a body: 3 facets"),
        (np.vstack([CUBE, CUBE[:1]]), np.vstack([[[8, 1, 3, 2]], FACES[1:]]), "given by two nodes"),
        (np.where(CUBE == 1.0, [1.0, 1.0, 1e-6], CUBE), FACES, "sliver"),
        (np.where(CUBE == 1.0, [1.0, 1.0, np.nan], CUBE), FACES, "not finite"),
        (np.vstack([CUBE, CUBE + 0.5]), np.vstack([FACES, FACES + 8]), "crosses itself near"),
    ],
    ids=["open", "three at an edge", "duplicate nodes", "slivers", "nan", "crossing"],
)
def test_what_is_refused_in_one_line(points: np.ndarray, facets: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        checked_surface(surface(points, facets), "body.msh")
    assert "\n" not in str(caught.value) and str(caught.value).startswith("body.msh: ")


@pytest.mark.parametrize("kind", ["triangle6", "quad8", "quad9"])
def test_cells_of_second_order_are_kept_where_they_are_curved(kind: str, tmp_path: Path) -> None:
    """A cube whose faces are single cells of second order, one of them bulged."""
    faces = FACES if kind != "triangle6" else np.vstack([FACES[:, :3], FACES[:, [0, 2, 3]]])
    corners = CUBE[faces]
    sides = 0.5 * (corners + np.roll(corners, -1, axis=1))
    middle = corners.mean(axis=1, keepdims=True) if kind == "quad9" else corners[:, :0]
    cells = np.concatenate([corners, sides, middle], axis=1)
    cells[np.all(np.isclose(cells, [0.5, 0.5, 1.0]), axis=2)] += [0.0, 0.0, 0.1]
    mesh = read_msh(written(tmp_path / "cube.msh", {"skin": cells}))
    assert is_surface(mesh)
    found = gmsh_surface(mesh, "cube.msh")
    assert found.parts == ("skin",)
    # integrals of the shape functions of a quadrilateral's and of a diagonal's middle
    volume, curved = {
        "quad8": (1.0, 0),
        "quad9": (1.0 + 0.4 / 9.0, 1),
        "triangle6": (1.0 + 0.1 / 3.0, 2),
    }[kind]
    assert enclosed(found) == pytest.approx(volume, abs=1e-4)
    assert np.count_nonzero(found.middles[:, 0] >= 0) == curved


def test_cells_in_no_physical_surface_are_counted_where_the_rest_is_open() -> None:
    tags = [np.array([1, 1, 0, 0, 1, 1])]
    mesh = meshio.Mesh(CUBE, [("quad", FACES)], cell_data={"gmsh:physical": tags})
    with pytest.raises(
        InputError, match=r"is open.*; 2 triangles and quadrilaterals are in no physical surface"
    ):
        gmsh_surface(mesh, "m.msh")
