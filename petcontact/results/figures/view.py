"""By how much a drawing of the deformed bodies magnifies displacements, and its window; the plane
that faces in space are drawn in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Index, Mask
from ...contact.law_protocol import OPEN
from ...errors import InputError
from ...given.interface_data import PosedInterface
from ...mesh.surface_mesh import SurfaceMesh
from ...record import record, replace
from ...round_off import WRITTEN
from ...runtime.figure_style import label, round_number
from ..data import SolutionData
from ..records import PairResult, StepResult

MAGNIFIED = 0.08
"""Largest displacement drawn, as a fraction of the size of the bodies."""
MISSED = 2e-3
"""Distance of sides that touch, over the size of the bodies, that is not seen: two dots of a figure
of 1000 dots."""
SLID = 0.02
"""Largest slip drawn, over the size of the bodies: a side of a tenth of this size as its radius is
then off the other one by slip²/2r, which is `MISSED`."""
NEARLY = 1.0 - 1e-4
"""Cosine of the angle to an axis from which on a direction is called by its name."""
AROUND, STRAIGHT, ONE_SIDED = 0.9, 1e-3, 1e-3
"""Length of the mean normal of what is in contact around an axis below which a face is unrolled,
the largest variance of normals along that axis over that across it, and how far from it the middle
of contact is that is drawn in the middle."""

FACING = 0.5
"""Length of the mean normal of what is in contact from which on it is seen along that."""


@record
class View:
    """Magnification and window of one drawing, or of all that are to be compared.

    Attributes
    ----------
    factor : float
        Of displacements: at least 1, unless they are larger than the bodies; 1 where contact closed
        a gap or an overlap that would be seen. Magnified the sides would not meet: a round one
        would look concave, and a press fit would have a white gap. Slip is drawn short, since
        sides that slide far by their tangents overlap.
    low, high : (d,) arrays
        What the bodies cover as they were and as they are drawn [length].
    largest : float
        |u| [length].
    eye : (float, float), optional
        In space, elevation and azimuth from which bodies are seen [degrees]; by default their
        contact is in view.
    """

    factor: float
    low: Array
    high: Array
    largest: float
    eye: tuple[float, float] | None = None

    @property
    def text(self) -> str:
        """How displacements are magnified, for a caption."""
        if self.factor == 1.0:
            return "displacements to scale"
        how = f"× {self.factor:g}" if self.factor > 1.0 else f"/ {1.0 / self.factor:g}"
        return f"displacements {how}"


def view_of(
    solution: SolutionData,
    steps: Sequence[StepResult] = (),
    *,
    share: float = MAGNIFIED,
    factor: float | None = None,
    eye: tuple[float, float] | None = None,
) -> View:
    """The view of some increments, of the last one by default, with displacements of about a share
    of the bodies' size, or times a factor."""
    x = {name: mesh.x for name, mesh in solution.meshes.items()}
    every = np.vstack(list(x.values()))
    size = float(np.linalg.norm(np.ptp(every, axis=0)))
    u = [
        (name, body.u[:, : every.shape[1]])
        for step in steps or [solution.last]
        for name, body in step.bodies.items()
    ]
    largest = max(float(np.linalg.norm(values, axis=1).max()) for _, values in u)
    if factor is None:
        factor = round_number(share * size, largest)
        if (slip := _largest_slip(steps or [solution.last])) > 0.0:
            factor = min(factor, max(1.0, round_number(SLID * size, slip)))
        if factor < 1.0:
            factor = factor if largest > size else 1.0
        elif _misfit(solution, factor) > MISSED * size:
            factor = 1.0
    places = np.vstack([every, *(x[name] + factor * values for name, values in u)])
    return View(factor, places.min(axis=0), places.max(axis=0), largest, eye)


def _largest_slip(steps: Sequence[StepResult]) -> float:
    """The largest slip of what touches [length]."""
    slips = [
        np.linalg.norm(pair.slip[pair.state != OPEN], axis=1)
        for step in steps
        for pair in step.pairs.values()
    ]
    return max((float(slip.max(initial=0.0)) for slip in slips), default=0.0)


def _misfit(solution: SolutionData, factor: float) -> float:
    """How far sides lie over one another with displacements times a factor, or apart though they
    touch [length]: a gap that was closed is drawn as an overlap."""
    largest = 0.0
    for side in solution.posed.interfaces:
        pair = solution.last.pairs.get(side.name)
        if side.periodic or pair is None:
            continue
        first = _first_gap(solution, side, pair)
        known = np.isfinite(first) & np.isfinite(pair.gap)
        gap = factor * pair.gap[known] - (factor - 1.0) * first[known]
        wrong = np.where(pair.state[known] == OPEN, -gap, np.abs(gap))
        largest = max(largest, float(wrong.max(initial=0.0)))
    return largest


def _first_gap(solution: SolutionData, side: PosedInterface, pair: PairResult) -> Array:
    """The gap (m,) of an interface before anything moved [length]."""
    mesh = solution.meshes[solution.sides[side.name][0]]
    if side.law.gap is not None:
        try:
            return side.law.gap.at(mesh.sites(solution.nodes[side.name]))
        except InputError:  # a function of Python, which no file holds: any gap is possible
            return np.full(len(pair.x), np.ptp(mesh.x))
    if side.primary is None or side.law.normal != "unilateral":
        return np.zeros(len(pair.x))
    body, part = side.primary
    primary = solution.meshes[solution.problem.body[body].name]
    return primary.faces(part)[1].cast(pair.x, pair.normal).distance


@record
class Chart:
    """How a face in space is drawn in a plane: seen along a direction, or unrolled from a cylinder
    or cone.

    Attributes
    ----------
    directions : (2, 3) array
        Of the plane; unrolled the axis is the second one.
    names : (str, str)
        Of what is drawn along both.
    centre : (3,) array, optional
        On the axis of what is unrolled [length].
    middle : float
        The angle that is drawn in the middle [degrees].
    """

    directions: Array
    names: tuple[str, str]
    centre: Array | None = None
    middle: float = 0.0

    @classmethod
    def of(cls, solution: SolutionData, name: str) -> Chart:
        """Return the chart of an interface at the end. It is unrolled where contact goes round it,
        else along coordinate axes that lie in it."""
        pair, unit = solution.pairs[name], solution.problem.units.length
        closed = (
            pair.state != OPEN if np.any(pair.state != OPEN) else np.ones(len(pair.x), dtype=bool)
        )
        normal = solution.meshes[solution.sides[name][0]].normal[solution.nodes[name]]
        found = _round(normal, pair, closed)
        if found is not None:
            axis, centre = found
            first = SurfaceMesh.tangents_to(axis[None])[0, 0]
            names = f"angle from {_name(first)} [degree]", label(_name(axis), unit)
            chart = cls(np.stack([first, axis]), names, centre)
            mean = np.average(pair.x[closed], axis=0, weights=pair.weight[closed])
            off = (
                np.linalg.norm(np.cross(axis, mean - centre))
                > ONE_SIDED * np.ptp(pair.x, axis=0).max()
            )
            return replace(
                chart, middle=45.0 * round(float(chart.at(mean[None])[0, 0]) / 45.0) if off else 0.0
            )
        tangents = pair.tangent.mean(axis=0)
        outward = np.average(normal[closed], axis=0, weights=pair.weight[closed])
        if np.linalg.norm(outward) < FACING:  # what is in contact looks all ways
            outward = np.linalg.svd(pair.x - pair.x.mean(axis=0), full_matrices=False)[2][2]
        flat = np.allclose(pair.tangent, tangents, atol=WRITTEN)
        outward = np.round(outward / np.linalg.norm(outward), 3)
        directions = (
            tangents
            if flat
            else SurfaceMesh.tangents_to(outward[None] / np.linalg.norm(outward))[0]
        )
        directions = (
            directions * np.sign(directions[[0, 1], np.abs(directions).argmax(axis=1)])[:, None]
            + 0.0
        )
        return cls(
            directions, (label(_name(directions[0]), unit), label(_name(directions[1]), unit))
        )

    def at(self, x: Array, owner: Index | None = None) -> Array:
        """Where points (m, 3) are drawn, (m, 2), those of one owner beside each other."""
        if self.centre is None:
            return np.asarray(x @ self.directions.T)
        first, axis = self.directions
        away = x - self.centre
        angle = np.degrees(np.arctan2(away @ np.cross(axis, first), away @ first)) - self.middle
        angle = angle - 360.0 * np.round(angle / 360.0)
        if owner is not None:
            base = angle[np.unique(owner, return_index=True)[1]][
                np.unique(owner, return_inverse=True)[1]
            ]
            angle = angle - 360.0 * np.round((angle - base) / 360.0)
        return np.column_stack([angle + self.middle, x @ axis])

    def vectors(self, x: Array, vectors: Array) -> Array:
        """Tangential vectors (m, 3) at points as they are drawn, (m, 2)."""
        first = np.tile(self.directions[0], (len(x), 1))
        if self.centre is not None:
            first = np.cross(self.directions[1], x - self.centre)
            first /= np.linalg.norm(first, axis=1, keepdims=True)
        return np.column_stack(
            [np.einsum("mc,mc->m", vectors, first), vectors @ self.directions[1]]
        )


def _round(normal: Array, pair: PairResult, closed: Mask) -> tuple[Array, Array] | None:
    """Direction of the axis about which a face goes round, and a point of it; None where contact
    does not go round."""
    mean = np.average(normal, axis=0, weights=pair.weight)
    spread, directions = np.linalg.eigh(
        (normal - mean).T @ ((normal - mean) * pair.weight[:, None])
    )
    if not spread[0] < STRAIGHT * spread[1]:
        return None
    axis = directions[:, 0] * np.sign(directions[np.abs(directions[:, 0]).argmax(), 0]) + 0.0
    across = normal - np.outer(normal @ axis, axis)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    if np.linalg.norm(np.average(across[closed], axis=0, weights=pair.weight[closed])) > AROUND:
        return None
    # normals of a cylinder or a cone meet its axis
    apart = np.eye(3) - np.outer(axis, axis) - np.einsum("mi,mj->mij", across, across)
    return axis, np.linalg.lstsq(
        apart.sum(axis=0), np.einsum("mij,mj->i", apart, pair.x), rcond=WRITTEN
    )[0]


def _name(direction: Array) -> str:
    """Return the name of a direction: that of an axis if it is one, else its components."""
    if direction.max() > NEARLY:
        return "xyz"[int(direction.argmax())]
    return "along ({:g}, {:g}, {:g})".format(*(np.round(direction, 2) + 0.0))
