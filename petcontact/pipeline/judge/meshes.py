"""Checks of bodies and meshes before the elimination: thickness, distortion, stiffness, gaps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...arrays import Array, Index, Mask
from ...errors import the_body
from ...geometry.surface import Boundary
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curved.curved_panels import CurvedPanels
from ...results.report import Finding
from ...round_off import WRITTEN
from .findings import limit_of, new_finding
from .thickness import SHARE, slenderness

LARGEST = 4.0
"""Largest accepted size of elements over the thickness behind them [-]. Constant elements lose
equilibrium above it. Order 1 deflects clamped plates by 1.06 of the theory up to 1.25, and without
bending it is right up to 4. Plates and beams of order 2 bend by 0.56 to 1.18 of the theory up to 5,
and by any amount beyond."""
STIFF = 0.75
"""Size over thickness from which bending is wrong by a tenth, over the order, which counts as two
at least [-]; a warning. A cantilever of length 20 and thickness 1 bends by 0.912, 0.906, 0.908 and
0.920 of the truth with orders 2 to 5 and sizes of 1.7, 2.5, 3.3 and 4."""


def stiff_size(order: Index | int) -> Array:
    """Return the size over thickness from which elements of orders (n,) are too stiff to bend
    [-]."""
    return STIFF * np.maximum(order, 2)


def too_long_to_bend(mesh: BoundaryMesh) -> Mask:
    """Return which elements are so long that linear ones bend a tenth too little, (n_elements,).

    None is marked where they are a small share of the body's surface.
    """
    over, area = slenderness(mesh) > stiff_size(1), np.bincount(mesh.element, mesh.measure)
    return np.asarray(over & bool(area[over].sum() > SHARE * area.sum()))


def check_meshes(
    posed: Posed,
    meshes: Sequence[BoundaryMesh],
    boundaries: Sequence[Boundary],
    adapted: bool,
) -> Iterator[Finding]:
    """Find elements that are large next to the thickness of the body behind them, and distorted
    ones.

    Elements that were adapted on an exactly known surface are not checked for distortion. A body is
    refused if elements that cannot solve bending are more than a tenth of its boundary.
    """
    for body, mesh, boundary in zip(posed.bodies, meshes, boundaries, strict=True):
        name = body.name
        if not adapted or boundary.meshed:
            yield from _distorted(name, mesh)
        ratio, area = slenderness(mesh), np.bincount(mesh.element, mesh.measure)
        largest, over = float(ratio.max(initial=0.0)), ratio > LARGEST
        text = (
            f"elements of {the_body(name)} are up to {largest:.3g} times as large as the body is "
            f"thick behind them"
        )
        if area[over].sum() > SHARE * area.sum():
            size = float((area[over] ** (1.0 / (mesh.dim - 1)) / ratio[over]).min())
            # the program cannot change the panels of a file
            how = "mesh the file anew with cells" if boundary.meshed else "choose an element_size"
            yield new_finding(
                "thickness",
                f"{text}, at most {LARGEST:g} is solved",
                "mesh",
                advice=f"{how} of about {size:.3g} there",
                measured=largest,
                limit=LARGEST,
            )
        elif area[ratio > stiff_size(mesh.order)].sum() > SHARE * area.sum():
            text += ": bending comes out wrong"
            yield new_finding("bending", text, "mesh", measured=largest)


def _distorted(name: str, mesh: BoundaryMesh) -> Iterator[Finding]:
    """Find curved elements whose area factor varies too much, and name the worst one."""
    curved = [
        batch.elements for batch in mesh.batches() if isinstance(batch.elements, CurvedPanels)
    ]
    # plane panels with curved sides keep their digits: with a ratio of 3.9 p changes by 4e-10 at
    # quadrature_tol = 1e-11; on rings of panels on balls it changes by 1e-10 with a ratio of 2.7
    plane = (np.abs(panels.box[:, :, 2]).max(axis=1) < WRITTEN for panels in curved)
    ratio = np.concatenate(
        [
            np.empty(0),
            *(
                np.where(flat, 1.0, panels.distortion)
                for flat, panels in zip(plane, curved, strict=True)
            ),
        ]
    )
    over = np.count_nonzero(ratio > limit_of("distortion"))
    if not over:
        return
    worst = int(ratio.argmax())
    index = np.concatenate([panels.index for panels in curved])[worst]
    centre = np.concatenate([panels.chord.centre for panels in curved])[worst]
    point = ", ".join(f"{c:.4g}" for c in centre)
    yield new_finding(
        "distortion",
        f"the area factor of {over} curved element{'s' if over > 1 else ''} of "
        f"{the_body(name)} varies by more than {limit_of('distortion'):g} within the element, "
        f"most by {ratio[worst]:.3g} in element {int(index)} at ({point}); its integrals keep "
        "fewer digits",
        "mesh",
        measured=float(ratio[worst]),
    )


def check_stiffness(posed: Posed) -> Iterator[Finding]:
    """Find bodies whose displacements lose digits, since the Young's moduli differ too much."""
    names = [body.name for body in posed.bodies]
    moduli = [body.material.young_modulus for body in posed.bodies]
    soft, stiff = int(np.argmin(moduli)), int(np.argmax(moduli))
    if moduli[stiff] > limit_of("stiffness") * moduli[soft]:
        ratio = moduli[stiff] / moduli[soft]
        yield new_finding(
            "stiffness",
            f"body {names[stiff]!r} is {ratio:.1e} times as stiff as body {names[soft]!r}, at most "
            f"{limit_of('stiffness'):.0e} is solved",
            advice="make it a rigid [[obstacle]], or leave out the soft one",
            measured=ratio,
        )


def check_distances(
    interfaces: Sequence[PosedInterface], boundaries: Sequence[Boundary], distances: Sequence[float]
) -> Iterator[Finding]:
    """Find interfaces with large initial gaps or overlaps; an overlap of a whole body is
    refused."""
    least = dict[str, float]()
    for posed, distance in zip(interfaces, distances, strict=True):
        least[posed.group] = min(least.get(posed.group, np.inf), distance)
    for posed, distance in zip(interfaces, distances, strict=True):
        if distance > max(0.0, least[posed.group]):
            continue  # another one of several parts is nearer
        size = min(boundaries[number].diameter for number in posed.bodies)
        kind = "through" if -distance > limit_of("through") * size else "far apart"
        if np.isfinite(distance) and abs(distance) > limit_of(kind) * size:
            far = distance > 0.0
            how = f"lies {distance:.3g} apart" if far else f"overlaps by {-distance:.3g}"
            yield new_finding(
                kind,
                f"pair {posed.name!r} {how}, {abs(distance) / size:.0%} of the size of a body, far "
                "for the theory of small displacements",
                advice="check where the bodies lie, gaps, and radii",
                measured=abs(distance) / size,
            )
