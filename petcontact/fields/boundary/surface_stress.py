"""The full stress tensor on the boundary, from the traction and the slopes of the displacement.

D = ∇_s u is the surface gradient, P = I - n n and e = sym(P D). Hooke's law determines the
components that the traction t does not (ν' is that of plane strain):

    σ = 2µ e + ν'/(1-ν') (2µ tr e + t·n) P + t n + n t - (t·n) n n

For a body of revolution tr e includes the hoop strain u_r/r.
"""

from __future__ import annotations

import functools

import numpy as np

from ...arrays import Array, Index
from ...bem.kernel import tensor_components
from ...geometry.rotation import lifted
from ...given.tables.material import Material
from ...mesh.boundary_mesh import BoundaryMesh
from ..smoothing import smoothed
from .curve_slopes import CurveSlopes
from .linear import linear_parts
from .panel_slopes import PanelSlopes
from .recovery import slopes_of


class BoundaryField:
    """Displacement and stress on the boundary of a body.

    Data on constant elements are made smooth first, see `smoothing`. Slopes are those of
    `recovery`. The stress has the order p + 1 of the displacement and the traction.

    Parameters
    ----------
    mesh : BoundaryMesh
        n nodes.
    u, traction : (n, d) arrays
        Displacement [length] and traction [stress] at the nodes.
    material : Material
    state : (n,) int array, optional
        States of contact. Slopes are smooth only between nodes of the same state.
    """

    def __init__(
        self,
        mesh: BoundaryMesh,
        u: Array,
        traction: Array,
        material: Material,
        state: Index | None = None,
    ) -> None:
        self.mesh, self.material = mesh, material
        label = np.zeros(mesh.n_elements, dtype=np.int64)
        if state is not None:
            low, high = (
                ufunc.reduceat(state, mesh.first_node[:-1]) for ufunc in (np.minimum, np.maximum)
            )
            # an element with several states has no neighbours
            label = np.where(
                low == high, low, -2 - np.arange(mesh.n_elements) + min(0, int(low.min(initial=0)))
            )
        self._label = label
        # the position is made smooth like the displacement, so that linear fields stay exact
        self._mesh, moved, traction = smoothed(mesh, np.hstack([u, mesh.x]), traction)
        self._u, self._x = np.hsplit(moved, [mesh.components])
        self._u = self._mesh.on_axis(self._u)
        self._nodal = np.hstack([self._u, self._x, traction])

    @functools.cached_property
    def _slopes(self) -> CurveSlopes | PanelSlopes:
        return slopes_of(self._mesh, self._u, self._x, self._linear, self._label)

    @functools.cached_property
    def _linear(self) -> Array:
        return linear_parts(self._mesh, self._x, self._u)

    def at(self, element: Index, place: Array) -> tuple[Array, Array, Array]:
        """Return the points (q, d), the displacement (q, d) and the stress (q, d(d+1)/2) at places
        of elements (see `Hits`) [length, stress].

        The components are those of `field_at`.
        """
        x, normal = self._mesh.at(element, place)
        u, smooth, traction = np.hsplit(
            self._mesh.basis_at(element, place) @ self._nodal,
            np.cumsum([self._mesh.components, self._mesh.dim]),
        )
        u = u + np.einsum("qij,qj->qi", self._linear[element], x - smooth)
        slopes, hoop = self._mesh.strained(x, u, self._slopes.at(element, place))
        normal = lifted(normal, self._mesh.components)
        return x, u, tensor_components(hooke(traction, normal, slopes, self.material, hoop))


def hooke(
    traction: Array, normal: Array, gradient: Array, material: Material, hoop: object = 0.0
) -> Array:
    """Return σ (q, d, d) on the boundary [stress].

    `traction` and the outward unit normals are (q, d), `gradient` (q, d, d) is the surface gradient
    of the displacement, and `hoop` (q,) is the strain across the plane.

    Examples
    --------
    >>> import numpy as np
    >>> from petcontact import Material
    >>> free, up = np.zeros((1, 2)), np.array([[0.0, 1.0]])
    >>> stretched = np.array([[[1e-3, 0.0], [0.0, 0.0]]])
    >>> float(hooke(free, up, stretched, Material(200.0, 0.3, plane="stress"))[0, 0, 0].round(12))
    0.2
    """
    mu, ratio, d = material.shear_modulus, material.plane_strain_ratio, traction.shape[1]
    tangential = np.eye(d) - normal[:, :, None] * normal[:, None, :]
    strain = tangential @ gradient
    strain = 0.5 * (strain + strain.transpose(0, 2, 1))
    across = np.sum(traction * normal, axis=1)
    trace = np.trace(strain, axis1=1, axis2=2) + hoop
    even = ratio / (1.0 - ratio) * (2.0 * mu * trace + across)
    outer = traction[:, :, None] * normal[:, None, :]
    return np.asarray(
        2.0 * mu * strain
        + even[:, None, None] * tangential
        + outer
        + outer.transpose(0, 2, 1)
        - across[:, None, None] * normal[:, :, None] * normal[:, None, :]
    )
