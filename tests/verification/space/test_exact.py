"""Space against closed forms: Boussinesq and Cerruti, Lamé's hollow sphere, plane strain, linear
fields on random bodies."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import scipy
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from petcontact.bem.kelvin3d.integrals import integrals
from petcontact.geometry.surface import BoxSurface
from petcontact.mesh.panelling import box_mesh
from petcontact.mesh.surface_mesh import SurfaceMesh

pytestmark = pytest.mark.usefixtures("unestimated")

NU = 0.3
Field = Callable[[np.ndarray], np.ndarray]


def operators(mesh: SurfaceMesh, nu: float = NU) -> tuple[np.ndarray, np.ndarray]:
    """G (2µ) and ½ + H as matrices."""
    n = 3 * mesh.n_nodes
    kernel_g, kernel_h = np.empty((2, 3, 3, mesh.n_nodes, mesh.n_nodes))
    for batch in mesh.batches():
        kernel_g[:, :, batch.nodes], kernel_h[:, :, batch.nodes] = integrals(
            mesh.x, batch.elements, nu
        )
    return kernel_g.transpose(3, 0, 2, 1).reshape(n, n), kernel_h.transpose(3, 0, 2, 1).reshape(
        n, n
    ) + 0.5 * np.eye(n)


def traction(field: Field, x: np.ndarray, normal: np.ndarray, nu: float = NU) -> np.ndarray:
    """Traction over 2µ of a displacement field that is analytic: its derivatives by complex steps,
    exact."""
    gradient = np.stack([field(x + 1e-30j * e).imag / 1e-30 for e in np.eye(3)], axis=2)
    strain = 0.5 * (gradient + gradient.transpose(0, 2, 1))
    stress = strain + nu / (1.0 - 2.0 * nu) * np.trace(strain, axis1=1, axis2=2)[
        :, None, None
    ] * np.eye(3)
    return np.einsum("nij,nj->ni", stress, normal)


def boussinesq(x: np.ndarray) -> np.ndarray:
    """4πG u of a unit force along z on the half space z > 0 (Johnson, Contact Mechanics, 3.18)."""
    rho, z = np.sqrt(np.sum(x * x, axis=1)), x[:, 2]
    radial = z / rho**3 - (1.0 - 2.0 * NU) / (rho * (rho + z))
    return np.stack(
        [x[:, 0] * radial, x[:, 1] * radial, 2.0 * (1.0 - NU) / rho + z * z / rho**3], axis=1
    )


def cerruti(x: np.ndarray) -> np.ndarray:
    """4πG u of a unit force along x on the half space z > 0 (Johnson, 3.75)."""
    (a, b, z), rho = x.T, np.sqrt(np.sum(x * x, axis=1))
    k, s = 1.0 - 2.0 * NU, rho + z
    return np.stack(
        [
            1.0 / rho + a * a / rho**3 + k * (1.0 / s - a * a / (rho * s * s)),
            a * b / rho**3 - k * a * b / (rho * s * s),
            a * z / rho**3 + k * a / (rho * s),
        ],
        axis=1,
    )


@pytest.mark.parametrize("field", [boussinesq, cerruti])
def test_block_cut_out_of_a_loaded_half_space(field: Field) -> None:
    """The block touches the free surface beside the force: no traction there, u known below,
    tractions on the sides."""
    low, errors = np.array([0.6, -0.7, 0.0]), []
    for size in (1.0, 0.5):
        mesh = box_mesh(
            BoxSurface(low, low + np.array([2.0, 1.5, 1.0])), lambda part, h=size: h, 2, 1.0
        )
        u, t = field(mesh.x), traction(field, mesh.x, mesh.normal)
        surface = mesh.nodes_of("bottom")  # z = 0
        assert np.abs(t[surface]).max() < 1e-12
        held = np.repeat(np.isin(np.arange(mesh.n_nodes), mesh.nodes_of("top")), 3)
        g, h = operators(mesh)
        rhs = g @ np.where(held, 0.0, t.ravel()) - h @ np.where(held, u.ravel(), 0.0)
        found = np.linalg.solve(np.where(held, -g, h), rhs).reshape(-1, 3)
        weight = np.repeat(mesh.weight, 3)
        errors.append(
            [
                np.sqrt(weight[c] @ (found.ravel() - e)[c] ** 2 / (weight[c] @ e[c] ** 2))
                for c, e in ((~held, u.ravel()), (held, t.ravel()))
            ]
        )
    orders = np.log2(np.array(errors[0]) / errors[1])
    assert errors[1][0] < 4e-3 and errors[1][1] < 1e-2 and orders.min() > 2.5, (errors, orders)


@settings(max_examples=2, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(seed=st.integers(0, 2**32 - 1), order=st.integers(1, 3))
def test_motions_and_linear_fields_in_random_polyhedra(seed: int, order: int) -> None:
    """Convex hulls of random points: triangles of any shape and size."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(12, 3)) * 10.0 ** rng.uniform(-3.0, 3.0)
    hull = scipy.spatial.ConvexHull(points)
    triangles = points[hull.simplices]
    turned = (
        np.sum(
            np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
            * (triangles.mean(axis=1) - points.mean(axis=0)),
            axis=1,
        )
        < 0.0
    )
    triangles[turned] = triangles[turned][:, ::-1]
    sides = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2)
    area = 0.5 * np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    )
    assume(
        np.all(2.0 * area > 0.05 * sides.max(axis=1) ** 2)
    )  # slivers are refused when a body is read
    corners = np.concatenate([triangles, np.full((len(triangles), 1, 3), np.nan)], axis=1)
    mesh = SurfaceMesh(
        corners, np.full(len(corners), order), np.zeros(len(corners), dtype=np.int64), ("hull",)
    )
    g, h = operators(mesh)
    gradient = rng.normal(size=(3, 3))
    spin, strain = 0.5 * (gradient - gradient.T), 0.5 * (gradient + gradient.T)
    size = np.abs(mesh.x - mesh.x.mean(axis=0)).max()
    stress = strain + NU / (1.0 - 2.0 * NU) * np.trace(strain) * np.eye(3)
    x = mesh.x - points.mean(axis=0)
    assert np.abs(h @ np.tile(np.eye(3), (mesh.n_nodes, 1))).max() < 1e-8
    assert np.abs(h @ (x @ spin.T).ravel()).max() < 1e-8 * size
    assert (
        np.abs(h @ (x @ strain.T).ravel() - g @ (mesh.normal @ stress).ravel()).max() < 1e-8 * size
    )
