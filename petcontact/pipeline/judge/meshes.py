"""Whether bodies and their meshes can be solved on, before they are eliminated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Mask
from ...geometry.surface import Boundary
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curved.panels import CurvedPanels
from ...model.problem import Problem
from ...results.report import Finding
from .findings import limit_of, new_finding
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


def too_long_to_bend(mesh: BoundaryMesh) -> Mask:
    """Elements on which linear ones would bend a tenth too little, (n_elements,); none where they
    are a small share of the body."""
    over, area = slenderness(mesh) > STIFF[0], np.bincount(mesh.element, mesh.measure)
    return np.asarray(over & bool(area[over].sum() > SHARE * area.sum()))


def check_meshes(
    problem: Problem,
    meshes: Sequence[BoundaryMesh],
    boundaries: Sequence[Boundary],
    adapted: bool,
) -> list[Finding]:
    """Find elements that are long next to the thickness of the body behind them, and distorted
    ones, unless they were adapted on a surface that is known.

    A body is refused if more than a tenth of its boundary has elements on which bending is not
    solved at all.
    """
    findings = []
    for body, mesh, boundary in zip(problem.body, meshes, boundaries, strict=True):
        name = body.name
        if not adapted or boundary.meshed:
            findings += _distorted(name, mesh)
        ratio, area = slenderness(mesh), np.bincount(mesh.element, mesh.measure)
        limit = np.array(LARGEST)[np.minimum(mesh.order, 2)]
        largest, over = float(ratio.max(initial=0.0)), ratio > limit
        text = (
            f"elements of body {name!r} are up to {largest:.3g} times as large as the body is "
            f"thick behind them"
        )
        if area[over].sum() > SHARE * area.sum():
            size = float((area[over] ** (1.0 / (mesh.dim - 1)) / ratio[over]).min())
            # the panels of a file are what they are
            how = "mesh the file anew with cells" if boundary.meshed else "choose an element_size"
            order = f", or order {len(LARGEST) - 1}" if np.all(ratio[over] <= LARGEST[-1]) else ""
            findings.append(
                new_finding(
                    "thickness",
                    f"{text}, of order {int(mesh.order[over].min())} at most "
                    f"{limit[over].min():g} is solved",
                    "mesh",
                    advice=f"{how} of about {size:.3g} there{order}",
                    measured=largest,
                    limit=float(limit[over].min()),
                )
            )
        elif area[ratio > np.array(STIFF)[mesh.order]].sum() > SHARE * area.sum():
            text += ": bending comes out wrong"
            findings.append(new_finding("bending", text, "mesh", measured=largest))
    return findings


def _distorted(name: str, mesh: BoundaryMesh) -> list[Finding]:
    """A finding of curved elements whose area factor varies, naming the worst one."""
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
    over = np.count_nonzero(ratio > limit_of("distortion"))
    if not over:
        return []
    worst = int(ratio.argmax())
    index = np.concatenate([panels.index for panels in curved])[worst]
    centre = np.concatenate([panels.chord.centre for panels in curved])[worst]
    place = ", ".join(f"{c:.4g}" for c in centre)
    text = (
        f"the area factor of {over} curved element{'s' if over > 1 else ''} of body {name!r} "
        f"varies by more than {limit_of('distortion'):g} within the element, most by "
        f"{ratio[worst]:.3g} in element {int(index)} at ({place}); its integrals keep fewer digits"
    )
    return [new_finding("distortion", text, "mesh", measured=float(ratio[worst]))]


def check_stiffness(problem: Problem) -> list[Finding]:
    """Find bodies whose displacements lose each other's digits: Young's moduli that differ by more
    than `STIFFEST`."""
    names = [body.name for body in problem.body]
    moduli = [body.material.young_modulus for body in problem.body]
    soft, stiff = int(np.argmin(moduli)), int(np.argmax(moduli))
    if moduli[stiff] <= limit_of("stiffness") * moduli[soft]:
        return []
    ratio = moduli[stiff] / moduli[soft]
    text = (
        f"body {names[stiff]!r} is {ratio:.1e} times as stiff as body {names[soft]!r}, at most "
        f"{limit_of('stiffness'):.0e} is solved"
    )
    advice = "make it a rigid [[obstacle]], or leave out the soft one"
    return [new_finding("stiffness", text, advice=advice, measured=ratio)]
