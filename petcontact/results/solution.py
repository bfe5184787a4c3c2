"""The outcome of a solve: fields on the boundary, the contact zone, history, and the verdict."""

from __future__ import annotations

import html
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array, Index, Names, States
from ..bem.boundary_data import BoundaryData
from ..contact.criterion import FLOOR
from ..contact.friction_law import balanced_rho, contact_norm, contact_state, projection_residual
from ..contact.state import ContactState, History
from ..fields.interior import field_at
from ..mesh.boundary_mesh import BoundaryMesh
from ..model.case import Case
from ..refinement.zones import Zone, zones_of


@dataclass(frozen=True)
class ContactFields:
    """Nodal fields on Γ_C.

    Attributes
    ----------
    nodes : (m,) array
        Numbers of the contact nodes.
    x : (m, d) array
        Nodes [length].
    tangent : (m, d-1, d) array
        In the plane the outward normal turned by +90° (+x on a bottom side).
    weight, arc_length : (m,) arrays
        Quadrature weights [length or area], and arc length along the part, 0 in space [length].
    u_t, sigma_t : (m, d-1) arrays
        Components of displacement [length] and traction [stress] along the tangents.
    sigma_n, friction_bound : (m,) arrays
        Normal traction, negative in compression, and g [stress].
    state : (m,) array
        0 stick, 1 slip.
    part : (m,) array of str
    """

    nodes: Index
    x: Array
    tangent: Array
    weight: Array
    arc_length: Array
    u_t: Array
    sigma_t: Array
    sigma_n: Array
    friction_bound: Array
    state: States
    part: Names


@dataclass(frozen=True, repr=False)
class Solution:
    """What a solve returns and a result file holds; it can be pickled.

    Attributes
    ----------
    case : Case
    mesh : BoundaryMesh
    u, traction : (n, 2) arrays
        On the whole boundary [length], [stress].
    contact : ContactFields
    zones : list of Zone
    history : History
    status : {"converged", "not converged", "failed"}
    reason : str
    rho : float
        Robin parameter of the last step [stress/length].
    residual : float
        ‖R_ρ‖ in L2(Γ_C) with that ρ [stress · length^½].
    elastic_residual : float
        Largest defect of (4.10) at random nodes over the largest displacement [-].
    timings : dict of str to float
        Wall seconds by stage.
    info : dict
        argv, PETSc options, versions, formulation, KSP.
    """

    case: Case
    mesh: BoundaryMesh
    u: Array
    traction: Array
    contact: ContactFields
    zones: list[Zone]
    history: History
    status: str
    reason: str
    rho: float
    residual: float
    elastic_residual: float
    timings: dict[str, float]
    info: dict[str, Any] = field(default_factory=dict)

    @property
    def iterations(self) -> int:
        """Iterations of the method."""
        return len(self.history)

    @property
    def converged(self) -> bool:
        """Whether the stopping criterion, the friction residual and the elastic residual were all met."""
        return self.status == "converged"

    @property
    def relative_residual(self) -> float:
        """‖R_ρ‖/‖σ_t‖ with the balanced ρ: does not depend on the method's ρ nor on units."""
        c = self.contact
        balanced = balanced_rho(c.u_t, c.sigma_t, c.weight, self.rho, least_displacement(self.u, c.weight))
        size = contact_norm(c.sigma_t, c.weight)
        value = contact_norm(projection_residual(c.u_t, c.sigma_t, c.friction_bound, balanced), c.weight)
        return value / size if size > 0.0 else value

    @property
    def tension_share(self) -> float:
        """Part of Γ_C on which a foundation that does not pull would let go, σ_n > 0 [-]."""
        contact = self.contact
        return float(contact.weight[contact.sigma_n > 0.0].sum() / contact.weight.sum())

    def reactions(self) -> dict[str, Array]:
        """Resultant of the tractions on each part, (d,) each [stress · length]; their sum is of the mesh's error."""
        mesh = self.mesh
        forces = mesh.weight[:, None] * self.traction
        return {name: forces[mesh.node_part == k].sum(axis=0) for k, name in enumerate(mesh.part_names)}

    def at(self, points: Any) -> Array:
        """Displacement at points (m, d) inside the body, (m, d) [length]; see `fields.interior.field_at`."""
        return field_at(self.mesh, self.u, self.traction, self.case.material, points)[0]

    def stress_at(self, points: Any) -> Array:
        """σ_xx, σ_yy, σ_xy at points (m, 2) inside the body, (m, 3); in space xx, yy, zz, xy, xz, yz, (m, 6) [stress]."""
        return field_at(self.mesh, self.u, self.traction, self.case.material, points)[1]

    def save(self, path: str | Path) -> None:
        """Write a result file, see `write_solution`."""
        from .hdf5 import write_solution

        write_solution(path, self)

    @staticmethod
    def load(path: str | Path) -> Solution:
        """A solution from a result file, see `read_solution`."""
        from .hdf5 import read_solution

        return read_solution(path)

    def to_dataframe(self) -> Any:
        """The contact nodes as a pandas table: x, y, arc_length, weight, u_t, sigma_t, sigma_n, friction_bound, state, part.

        Raises
        ------
        ImportError
            If pandas is not installed; petcontact does without it.
        """
        import pandas

        contact = self.contact
        x, y = contact.x.T
        columns = {"x": x, "y": y, "u_t": contact.u_t[:, 0], "sigma_t": contact.sigma_t[:, 0]}
        names = ("arc_length", "weight", "sigma_n", "friction_bound", "state", "part")
        return pandas.DataFrame({**columns, **{name: getattr(contact, name) for name in names}})

    def plot(self, ax: Any = None) -> Any:
        """Draw initial and deformed outline and the states of the contact nodes; returns the axes.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            A new figure's by default.
        """
        from .figures import deformed_on

        if ax is None:
            from matplotlib import pyplot

            ax = pyplot.subplots(layout="constrained")[1]
        deformed_on(ax, self)
        return ax

    def __repr__(self) -> str:
        title = f" {self.case.title!r}" if self.case.title else ""
        return (f"<Solution{title}: {self.status} after {self.iterations} iterations, {self.mesh.n_elements} elements, "
                f"{len(self.contact.nodes)} contact nodes>")  # fmt: skip

    def _repr_html_(self) -> str:
        """The verdict, for notebooks."""
        return f"<pre>{html.escape(self.verdict())}</pre>"

    def verdict(self) -> str:
        """A few lines that say how the solve ended."""
        from .summary import verdict

        return verdict(self)


def least_displacement(u: Array, weight: Array) -> float:
    """‖u_t‖ below which it is round-off and no measure of itself, as where all nodes stick: a share of u on Γ."""
    return FLOOR * float(np.abs(u).max(initial=0.0)) * math.sqrt(float(weight.sum()))


def contact_fields(
    mesh: BoundaryMesh, data: BoundaryData, u: Array, traction: Array, state: ContactState
) -> tuple[ContactFields, list[Zone]]:
    """Nodal fields and zones on Γ_C from the last iterate of a method."""
    nodes = data.contact_nodes
    weight = mesh.weight[nodes]
    rho = balanced_rho(state.v, state.sigma, weight, float(np.max(state.rho)), least_displacement(u, weight))
    normal_traction = np.einsum("ij,ij->i", traction[nodes], mesh.normal[nodes])
    slips = contact_state(state.v, state.sigma, data.friction_bound, rho)
    names = np.array(mesh.part_names)[mesh.node_part[nodes]]
    arc_length = mesh.variables(nodes).get("s", np.zeros(len(nodes)))
    contact = ContactFields(
        nodes, mesh.x[nodes], data.tangent, weight, arc_length, state.v, state.sigma, normal_traction,
        data.friction_bound, slips, names,
    )  # fmt: skip
    sign = (slips * np.sign(state.v[:, 0] - state.sigma[:, 0] * 1e-300)).astype(int)
    return contact, zones_of(mesh, nodes, sign)
