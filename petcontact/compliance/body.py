"""One elastic body eliminated to its contact nodes, which carry free traction vectors: u_c = u_0 + S t_c + R α.

Rigid motions R that no known displacement holds border the system,

    [[A, R], [RᵀW, 0]] [x, β] = [b, 0],

so that one factorisation serves; equilibrium of the tractions, RᵀW t + F = 0, is an equation for whoever chooses t_c and
α. The multipliers β measure how far the discrete tractions are from what the integral equations call equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..arrays import Array, Index, Mask
from ..bem.kelvin2d.point_force import displacement
from ..bem.kernels import kernel_for
from ..linalg.ksp import LinearSolver
from ..mesh.curve_mesh import CurveMesh
from ..model.problem import Material
from ..runtime.petsc import petsc

COLUMNS = 512
"""Nodes whose kernels are held at a time."""
PROBED = 24
"""Nodes at which the integral equations are checked."""


@dataclass(frozen=True)
class Loading:
    """Known data of one body in some load states.

    Attributes
    ----------
    traction_known : (n, 2) bool array
        Components x and y whose traction is known; of contact nodes both, their own being zero here.
    value : (K, n, 2) array
        Known displacement [length] or traction [stress] in K load states.
    point : (f, 2) array
        Points at which forces act [length].
    force : (K, f, 2) array
        [force/length]
    """

    traction_known: Mask
    value: Array
    point: Array
    force: Array


@dataclass
class BodyCompliance:
    """A body, eliminated.

    Attributes
    ----------
    mesh : CurveMesh
    contact : (m,) array
        Numbers of the nodes that carry free tractions.
    u_0 : (K, m, 2) array
        Displacement there for each load state without contact tractions [length].
    compliance : (2m, 2m) array
        S [length/stress], component c of node i being 2i + c.
    modes : (n, 2, r) array
        R: rigid motions that no known displacement holds, r = 0 to 3 [-].
    resultant : (K, r) array
        RᵀWt̂ + Rᵀ(point forces): F.
    """

    mesh: CurveMesh
    material: Material
    loading: Loading
    contact: Index
    u_0: Array
    compliance: Array
    modes: Array
    resultant: Array
    _rest: Array = field(repr=False)
    _influence: Array = field(repr=False)

    @property
    def balance(self) -> Array:
        """RᵀW at the contact nodes, (r, 2m)."""
        weighted = self.modes[self.contact] * self.mesh.weight[self.contact, None, None]
        return np.ascontiguousarray(weighted.reshape(2 * len(self.contact), -1).T)

    def boundary(self, shares: Array, traction: Array, alpha: Array) -> tuple[Array, Array]:
        """Displacement and traction (n, 2) for load states weighted by `shares` (K,), t_c (m, 2) and α (r,)."""
        n = self.mesh.n_nodes
        unknowns = (self._rest @ shares + self._influence @ traction.ravel())[: 2 * n].reshape(n, 2)
        known, value = self.loading.traction_known, np.tensordot(shares, self.loading.value, 1)
        scale = kernel_for(self.mesh, self.material).traction_scale
        u = np.where(known, unknowns, value) + self.modes @ alpha
        t = np.where(known, value, unknowns * scale)
        t[self.contact] = traction
        return u, t

    def multipliers(self, shares: Array, traction: Array) -> Array:
        """β (r,) [length]."""
        return np.asarray((self._rest @ shares + self._influence @ traction.ravel())[2 * self.mesh.n_nodes :])

    def residual(self, shares: Array, u: Array, traction: Array, alpha: Array) -> float:
        """Largest defect of the integral equations at some nodes, from exact entries, over the largest displacement."""
        mesh, count = self.mesh, min(PROBED, self.mesh.n_nodes)
        rows = np.sort(np.random.default_rng(20190).choice(mesh.n_nodes, count, replace=False))
        held = u - self.modes @ alpha
        defect = 0.5 * held[rows] + self.modes[rows] @ self.multipliers(shares, traction[self.contact])
        kernel = kernel_for(mesh, self.material)
        scaled = traction / kernel.traction_scale
        for batch in mesh.batches():
            g, h = kernel.integrals(mesh.targets(rows), batch.elements)
            assert g is not None and h is not None
            defect += np.einsum("ajkm,kj->ma", h, held[batch.nodes]) - np.einsum("ajkm,kj->ma", g, scaled[batch.nodes])
        force = np.tensordot(shares, self.loading.force, 1)
        defect -= displacement(mesh.x[rows], self.loading.point, force, self.material, mesh.unit_length)
        size = float(np.abs(u).max(initial=0.0))
        return float(np.abs(defect).max()) / size if size > 0.0 else float(np.abs(defect).max())


def free_motions(mesh: CurveMesh, traction_known: Mask, infinite: bool) -> Array:
    """Rigid motions (n, 2, r) that change no known displacement; of an infinite body there are none."""
    if infinite:
        return np.zeros((mesh.n_nodes, 2, 0))
    centre = mesh.weight @ mesh.x / mesh.weight.sum()
    away = mesh.x - centre
    radius = np.abs(away).max()
    all_ = np.zeros((mesh.n_nodes, 2, 3))
    all_[:, 0, 0] = all_[:, 1, 1] = 1.0
    all_[:, :, 2] = np.column_stack([-away[:, 1], away[:, 0]]) / radius
    seen = all_[~traction_known]
    if len(seen) == 0:
        return all_
    values, vectors = np.linalg.eigh(seen.T @ seen / len(seen))
    # translations along the axes stay what they are where they are free
    free = vectors[:, values < 1e-12]
    basis = free @ np.linalg.qr(free.T)[0] if free.shape[1] else free
    return np.asarray(all_ @ np.where(np.abs(basis) < 1e-12, 0.0, basis))


def eliminate(
    mesh: CurveMesh, material: Material, loading: Loading, contact: Index, *, infinite: bool = False
) -> BodyCompliance:
    """Factor a body once, for all load states and contact tractions.

    Raises
    ------
    SolverError
        If the factorisation fails.
    """
    n, m, states = mesh.n_nodes, len(contact), len(loading.value)
    modes = free_motions(mesh, loading.traction_known, infinite)
    r = modes.shape[2]
    matrix, loads, beside = _assemble(mesh, material, loading, contact, r)
    weighted = modes * (mesh.weight / mesh.weight.sum())[:, None, None]
    matrix[2 * n :, : 2 * n] = modes.reshape(2 * n, r).T
    matrix[: 2 * n, 2 * n :] = (weighted * loading.traction_known[:, :, None]).reshape(2 * n, r)
    # `matrix` holds columns of the system as rows: what PETSc calls a matrix by columns
    solution = _solved(matrix, np.concatenate([beside, loads]))
    influence, rest = solution[: 2 * m].T, solution[2 * m :].T
    places = (2 * contact[:, None] + np.arange(2)).ravel()
    influence = influence / kernel_for(mesh, material).traction_scale
    known = np.where(loading.traction_known, loading.value, 0.0) * mesh.weight[:, None]
    resultant = np.einsum("kic,icr->kr", known, modes)
    if loading.point.size:
        resultant = resultant + np.einsum("kfc,fcr->kr", loading.force, _modes_at(mesh, modes, loading.point))
    return BodyCompliance(
        mesh, material, loading, contact, rest[places].T.reshape(states, m, 2), influence[places], modes,
        resultant, rest, influence,
    )  # fmt: skip


def _modes_at(mesh: CurveMesh, modes: Array, point: Array) -> Array:
    """The rigid motions (f, 2, r) at other points: affine functions are told by their values at the nodes."""
    affine = np.column_stack([np.ones(mesh.n_nodes), mesh.x])
    coefficients = np.linalg.lstsq(affine, modes.reshape(mesh.n_nodes, -1), rcond=None)[0]
    return np.asarray(np.column_stack([np.ones(len(point)), point]) @ coefficients).reshape(len(point), 2, -1)


def _assemble(
    mesh: CurveMesh, material: Material, loading: Loading, contact: Index, r: int
) -> tuple[Array, Array, Array]:
    """The system by columns (2n + r, 2n + r), loads (K, 2n + r) and contact columns (2m, 2n + r)."""
    n, known, value = mesh.n_nodes, loading.traction_known, loading.value
    size = 2 * n + r
    matrix, beside, loads = np.zeros((size, size)), np.zeros((2 * len(contact), size)), np.zeros((len(value), size))
    by_node = matrix[: 2 * n, : 2 * n].reshape(n, 2, n, 2)
    slot = np.full(n, -1)
    slot[contact] = np.arange(len(contact))
    kernel = kernel_for(mesh, material)
    scaled = np.where(known, value, 0.0) / kernel.traction_scale
    moved = np.where(known, 0.0, value)
    wants_g = (~known).any(axis=1) | (slot >= 0) | scaled.any(axis=(0, 2))
    wants_h = known.any(axis=1) | moved.any(axis=(0, 2))
    targets = mesh.targets(slice(None))
    for numbers in _batches(mesh, wants_g, wants_h):
        nodes = (mesh.first_node[numbers][:, None] + np.arange(mesh.order[numbers[0]] + 1)).ravel()
        wanted = {"displacement": bool(wants_g[nodes].any()), "traction": bool(wants_h[nodes].any())}
        g, h = kernel.integrals(targets, mesh.elements(numbers), **wanted)
        for c in range(2):
            mine = known[nodes, c]
            for a in range(2):
                if h is not None and mine.any():
                    by_node[nodes[mine], c, :, a] = h[a, c, mine]
                if g is not None and not mine.all():
                    by_node[nodes[~mine], c, :, a] = -g[a, c, ~mine]
                if g is not None:
                    inside = slot[nodes] >= 0
                    beside[2 * slot[nodes[inside]] + c, a : 2 * n : 2] = g[a, c, inside]
                    loads[:, a : 2 * n : 2] += scaled[:, nodes, c] @ g[a, c]
                if h is not None:
                    loads[:, a : 2 * n : 2] -= moved[:, nodes, c] @ h[a, c]
    own = np.arange(n)
    for c in range(2):
        by_node[own, c, own, c] += 0.5 * known[:, c]
        loads[:, c : 2 * n : 2] -= 0.5 * moved[:, :, c]
    for state, force in enumerate(loading.force):
        loads[state, : 2 * n] += displacement(mesh.x, loading.point, force, material, mesh.unit_length).ravel()
    return matrix, loads, beside


def _batches(mesh: CurveMesh, wants_g: Mask, wants_h: Mask) -> list[Index]:
    """Elements of one order that need the same kernels, so many at a time."""
    first = mesh.first_node[:-1]
    either = [np.logical_or.reduceat(wants, first) for wants in (wants_g, wants_h)]
    group = mesh.kind * 4 + either[0] * 2 + either[1]
    result = []
    for kind in np.unique(group):
        numbers = np.flatnonzero(group == kind)
        step = max(1, COLUMNS // (int(mesh.order[numbers[0]]) + 1))
        result += [numbers[k : k + step] for k in range(0, len(numbers), step)]
    return result


def _solved(columns: Array, rhs: Array) -> Array:
    """Rows x_k with system · x_k = rhs_k; the system's columns are the rows of `columns`, which is overwritten."""
    module = petsc()
    comm = module.COMM_SELF
    size, count = len(columns), len(rhs)
    system = module.Mat().createDense((size, size), array=columns.T, comm=comm)
    right = module.Mat().createDense((size, count), array=rhs.T, comm=comm)
    system.assemble()
    right.assemble()
    solver = LinearSolver(comm, "elastic_", "factor", in_place=True)
    solver.set_operator(system)
    solution: Any = solver.solve_many(right)
    result = np.array(solution.getDenseArray().T)
    solver.close()
    for matrix in (solution, right, system):
        matrix.destroy()
    return result

