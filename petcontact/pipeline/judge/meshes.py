"""Whether bodies and their meshes can be solved on, before they are eliminated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import InputError
from ...geometry.surface import Boundary, FacetSurface
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curved.panels import CurvedPanels
from ...mesh.surface_mesh import SurfaceMesh
from .thickness import SHARE, slenderness

LARGEST = (4.0, 4.0, 5.0)
"""Largest size of elements of order 0, 1 and above over the thickness behind them. Clamped plates
of order 1 deflect by 1.06 times what the theory says up to 1.25, beams and plates of order 2 by
0.56 to 1.18 up to 5, above by anything and with either sign. Order 1 up to 4 is warned of: without
bending it is right there. Of constant ones equilibrium is lost."""
STIFF = (1.5, 1.5, 1.5, 2.6, 3.4, 4.1)
"""Size over thickness from which bending is off by a tenth and more, which is warned of; of orders
0 to 5. A cantilever 20 times as long as thick bends by .912, .906, .908 and .920 of the truth with
orders 2 to 5 and sizes of 1.7, 2.5, 3.3, 4."""
PLANE = 0.05
"""Height of a panel over its chord, in its size, up to which it is as good as plane."""
DISTORTED = 2.0
"""Largest over smallest area factor of a curved element that is warned of."""
STIFFEST = 1e12
"""Largest ratio of the stiffness of two bodies: their displacements add up in 16 digits."""


def check_meshes(
    names: Sequence[str],
    meshes: Sequence[BoundaryMesh],
    boundaries: Sequence[Boundary],
    adapted: bool,
) -> list[str]:
    """Warnings of elements that are long next to the thickness of the body behind them, and of
    distorted ones, unless they were adapted on a surface that is known.

    Raises
    ------
    InputError
        If more than a tenth of the boundary of a body has elements on which bending is not solved
        at all.
    """
    warnings = []
    for name, mesh, boundary in zip(names, meshes, boundaries, strict=True):
        if not adapted or isinstance(boundary, FacetSurface):
            warnings += _distorted(name, mesh)
        ratio, area = slenderness(mesh), np.bincount(mesh.element, mesh.measure)
        limit = np.array(LARGEST)[np.minimum(mesh.order, 2)]
        largest, over = float(ratio.max(initial=0.0)), ratio > limit
        text = (
            f"mesh: elements of body {name!r} are up to {largest:.3g} times as large as the "
            f"body is thick behind them"
        )
        if area[over].sum() > SHARE * area.sum():
            size = float((area[over] ** (1.0 / (mesh.dim - 1)) / ratio[over]).min())
            # the panels of a file are what they are
            how = (
                "mesh the file anew with cells"
                if isinstance(boundary, FacetSurface)
                else "choose an element_size"
            )
            order = f", or order {len(LARGEST) - 1}" if np.all(ratio[over] <= LARGEST[-1]) else ""
            raise InputError(
                f"{text}, of order {int(mesh.order[over].min())} at most {limit[over].min():g} is "
                f"solved; "
                f"{how} of about {size:.3g} there{order}"
            )
        if area[ratio > np.array(STIFF)[mesh.order]].sum() > SHARE * area.sum():
            warnings.append(f"{text}: bending comes out wrong")
    return warnings


def _distorted(name: str, mesh: BoundaryMesh) -> list[str]:
    """A warning of curved elements whose area factor varies, naming the worst one."""
    if not isinstance(mesh, SurfaceMesh):
        return []
    curved = [
        batch.elements for batch in mesh.batches() if isinstance(batch.elements, CurvedPanels)
    ]
    # plane ones with curved sides keep their digits: p with a ratio of 3.9 is the same to 4e-10
    # with quadrature_tol = 1e-11, and to 1e-10 on rings of panels on balls, with one of 2.7
    plane = (np.abs(panels.box[:, :, 2]).max(axis=1) < PLANE for panels in curved)
    ratio = np.concatenate(
        [
            np.empty(0),
            *(
                np.where(flat, 1.0, panels.distortion)
                for flat, panels in zip(plane, curved, strict=True)
            ),
        ]
    )
    over = np.count_nonzero(ratio > DISTORTED)
    if not over:
        return []
    worst = int(ratio.argmax())
    index = np.concatenate([panels.index for panels in curved])[worst]
    centre = np.concatenate([panels.chord.centre for panels in curved])[worst]
    place = ", ".join(f"{c:.4g}" for c in centre)
    return [
        f"mesh: the area factor of {over} curved element{'s' if over > 1 else ''} of body {name!r} "
        f"varies by more than "
        f"{DISTORTED:g} within the element, most by {ratio[worst]:.3g} in element {int(index)} at "
        f"({place}); "
        "its integrals keep fewer digits"
    ]


def check_stiffness(names: Sequence[str], moduli: Sequence[float]) -> None:
    """Refuse bodies whose displacements lose each other's digits.

    Raises
    ------
    InputError
        If Young's moduli differ by more than `STIFFEST`.
    """
    soft, stiff = int(np.argmin(moduli)), int(np.argmax(moduli))
    if not moduli[stiff] <= STIFFEST * moduli[soft]:
        ratio = moduli[stiff] / moduli[soft]
        raise InputError(
            f"body {names[stiff]!r} is {ratio:.1e} times as stiff as body {names[soft]!r}, at most "
            f"{STIFFEST:.0e} is solved; make it a rigid [[obstacle]], or leave out the soft one"
        )
