"""The program that reads and meshes a CAD file with Gmsh.

It reads requests for one file from standard input, a line of JSON each, and writes the answers to
standard output.

It runs as a process of its own: OpenCASCADE writes to standard output, ends on signals where a file
is damaged, and has one state for all. It imports nothing of petcontact.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import math
import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

FORMATS = {".step": "step", ".stp": "step", ".iges": "iges", ".igs": "iges", ".brep": "brep"}
"""Formats that OpenCASCADE reads, by the suffix of a file."""
FINEST = 0.03
"""Least size of cells over the one asked for. The tip of a cone, whose curvature has no bound, had
no end of cells without one, and a thousand with it."""
ASPECT = 3.0
"""Length of cells over the width of the strip in which they lie [-]: curved cells of 5.2 widths,
between circles of 5 and 5.5, were folded."""
SEWN = 1e-5
"""Distance of edges that are sewn, over the size of all: IGES files have six digits or more."""


def listed(gmsh: ModuleType, file: str) -> dict[str, Any]:
    """Solids with their surfaces: number, name, kind, area and centre of each; and the surfaces of
    no solid."""
    model, solids = gmsh.model, []
    faces = {number: _face(model, number) for _, number in model.getEntities(2)}
    loose = set(faces)
    for _, number in model.getEntities(3):
        faces_of_body = [abs(face) for face in model.getAdjacencies(3, number)[1].tolist()]
        loose -= set(faces_of_body)
        low, high = [model.getBoundingBox(3, number)[k : k + 3] for k in (0, 3)]
        name = model.getEntityName(3, number).rpartition("/")[2]
        solids.append(
            {
                "number": number,
                "name": name,
                "low": low,
                "high": high,
                "faces": [faces[face] for face in faces_of_body],
            }
        )
    _name_faces(solids, file)
    return {"solids": solids, "loose": len(loose)}


def _name_faces(solids: list[dict[str, Any]], file: str) -> None:
    """Give faces the names of a STEP file, and drop their vertices."""
    vertices = [[face.pop("vertices") for face in solid["faces"]] for solid in solids]
    if FORMATS[Path(file).suffix.lower()] == "step":
        # a module beside this program, whose folder is the first that Python looks in
        named = importlib.import_module("step_names").face_names(Path(file), vertices)
        for solid, names in zip(solids, named, strict=True):
            for face, own in zip(solid["faces"], names, strict=True):
                face["name"] = own


def _face(model: Any, number: int) -> dict[str, Any]:
    corners = model.getBoundary([(2, number)], combined=False, oriented=False, recursive=True)
    return {
        "number": number,
        "name": "",
        "kind": model.getType(2, number),
        "area": model.occ.getMass(2, number),
        "centre": model.occ.getCenterOfMass(2, number),
        "vertices": [model.getValue(0, tag, []).tolist() for _, tag in sorted(set(corners))],
    }


def meshed(gmsh: ModuleType, request: dict[str, Any]) -> dict[str, object]:
    """Write a .msh file of the surface of a solid: cells of about a size, a physical surface for
    each part."""
    model, option = gmsh.model, gmsh.option.setNumber
    for number, (name, faces) in enumerate(request["parts"].items(), 1):
        model.addPhysicalGroup(2, faces, number, name)
    wanted = {face for faces in request["parts"].values() for face in faces}
    rims = _rims_on(model, wanted, request["size"]) if request["imprint"] else {}
    unwanted = [(2, tag) for _, tag in model.getEntities(2) if tag not in wanted]
    model.removeEntities(model.getEntities(3) + unwanted, recursive=False)
    option("Mesh.MeshSizeMax", request["size"])
    option("Mesh.MeshSizeFromPoints", 0)  # OpenCASCADE's points have sizes of their own
    # eight cells go round a full circle at least: curved panels keep a good shape
    option("Mesh.MeshSizeFromCurvature", 8)
    option("Mesh.MeshSizeMin", FINEST * request["size"])
    option("Mesh.ElementOrder", request["order"])
    # of the same points the same cells, whatever the number of threads
    option("Mesh.Algorithm", 6)
    if request["quadrilaterals"]:
        _recombine(model, wanted)
    _imprint(model, rims)
    model.mesh.generate(2)
    gmsh.write(request["target"])
    return {}


def _recombine(model: Any, faces: set[int]) -> None:
    """Join triangles in pairs: quadrilaterals can be cut across one direction only, as strips along
    rims are."""
    for face in faces:
        model.mesh.setRecombine(2, face)
        if model.getType(2, face) == "Plane":  # whose points may lie in rows
            model.mesh.setAlgorithm(2, face, 8)


def _rims_on(model: Any, faces: set[int], size: float) -> dict[tuple[int, int], float]:
    """Curves of other solids inside faces, by curve and face, and the width of the strip beside
    each: a contact ends there, and p may be infinite.

    Curves that cross or meet others are left out, and strips that `ASPECT` makes finer than a
    quarter of the size.
    """
    own = {curve for face in faces for curve in _curves(model, face)}
    others = [curve for _, curve in model.getEntities(1) if curve not in own]
    result = dict[tuple[int, int], float]()
    for face in faces:
        met = _curves(model, face)
        for curve in (each for each in others if _lies_on(model, each, face)):
            strip = min((_distance(model, curve, each) for each in met), default=size)
            if ASPECT * strip > 0.25 * size:
                result[curve, face] = min(strip, size)
                met.append(curve)
    return result


def _curves(model: Any, face: int) -> list[int]:
    return [abs(tag) for _, tag in model.getBoundary([(2, face)], combined=False, oriented=False)]


def _distance(model: Any, one: int, two: int) -> float:
    """Distance of curves; infinite where they have an end in common."""
    ends = [{*model.getAdjacencies(1, curve)[1].tolist()} for curve in (one, two)]
    return math.inf if ends[0] & ends[1] else float(model.occ.getDistance(1, one, 1, two)[0])


def _lies_on(model: Any, curve: int, face: int) -> bool:
    """Whether points of a curve lie on a face, within the accuracy of files."""
    own, box = model.getBoundingBox(1, curve), model.getBoundingBox(2, face)
    within = SEWN * max(box[k + 3] - box[k] for k in range(3))
    if any(own[k] < box[k] - within or own[k + 3] > box[k + 3] + within for k in range(3)):
        return False
    low, high = (ends[0] for ends in model.getParametrizationBounds(1, curve))
    points = model.getValue(1, curve, [low + k / 8.0 * (high - low) for k in range(9)])
    off = abs(model.getClosestPoint(2, face, points)[0] - points).max()
    return bool(off < within and model.isInside(2, face, points) == 9)


def _imprint(model: Any, rims: dict[tuple[int, int], float]) -> None:
    """Let cells end at curves inside faces, and be as long there as their strips allow."""
    field, lengths = model.mesh.field, list[int]()
    for (curve, face), strip in rims.items():
        model.mesh.embed(1, [curve], 2, face)
        number = field.add("Distance")
        field.setNumbers(number, "CurvesList", [curve])
        field.setNumber(number, "Sampling", 100)
        lengths.append(field.add("MathEval"))
        field.setString(lengths[-1], "F", f"{ASPECT * strip} + F{number}")
    if lengths:
        least = field.add("Min")
        field.setNumbers(least, "FieldsList", lengths)
        field.setAsBackgroundMesh(least)


def brought(gmsh: ModuleType, panels: list[dict[str, Any]], rim: float) -> dict[str, object]:
    """Return the points of panels, projected onto one of some surfaces.

    Each panel takes the surface to which the whole panel is nearest. Points are projected onto an
    edge of the surface where they are close to it: closer than the share `rim` of the panel's size,
    and than an eighth of its width across the edge.
    """
    import numpy as np

    model, boxes, edges = gmsh.model, dict[tuple[int, int], Any](), dict[int, list[int]]()

    def apart(dim: int, number: int, points: object, within: object) -> Any:
        """Whether points are further away from the box around an entity than some distance."""
        if (dim, number) not in boxes:
            boxes[dim, number] = np.array(model.getBoundingBox(dim, number)).reshape(2, 3)
        box = boxes[dim, number]
        return np.any((points < box[0] - within) | (points > box[1] + within), axis=-1)

    def nearest(dim: int, number: int, points: Any) -> Any:
        return (
            np.reshape(model.getClosestPoint(dim, number, points.ravel())[0], (-1, 3))
            if len(points)
            else points
        )

    answer = []
    for panel in panels:
        points = np.array(panel["points"])
        size, best, found = np.linalg.norm(np.ptp(points, axis=0)), np.inf, points
        for number in panel["surfaces"]:
            if apart(2, number, points, size).any():
                continue
            near = nearest(2, number, points)
            if number not in edges:
                edges[number] = [
                    edge
                    for _, edge in model.getBoundary([(2, number)], oriented=False)
                    if model.getType(1, edge) != "Unknown"
                ]
            closest = np.full(len(points), rim * size)
            for edge in edges[number]:
                if apart(1, edge, points, rim * size).all():
                    continue
                on_edge = nearest(1, edge, points)
                distance = np.linalg.norm(on_edge - points, axis=1)
                closer = distance < np.minimum(closest, distance.max() / 8.0)
                near[closer], closest[closer] = on_edge[closer], distance[closer]
            if (off := np.sum((near - points) ** 2)) < best:
                best, found = off, near
        answer.append(found.tolist())
    return {"points": answer}


def answers(requests: Iterable[dict[str, Any]]) -> Iterator[dict[str, object]]:
    """What was asked for, or what Gmsh says against it."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        yield {"missing": str(error)}
        return
    # a user's .gmshrc would change the mesh; signals stay Python's
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    opened = False
    answer: dict[str, object]
    for request in requests:
        try:
            if not opened:
                _open(gmsh, request["file"])
                opened = True
            if "apart" in request:
                answer = {
                    "apart": [
                        gmsh.model.occ.getDistance(2, a, 2, b)[0] for a, b in request["apart"]
                    ]
                }
            elif "panels" in request:
                answer = brought(gmsh, request["panels"], request["rim"])
            else:
                answer = (
                    meshed(gmsh, request) if "target" in request else listed(gmsh, request["file"])
                )
        except Exception as error:  # Gmsh's are of no class of their own
            answer = {"error": str(error).strip() or type(error).__name__}
        yield answer
    gmsh.finalize()


def _open(gmsh: ModuleType, file: str) -> None:
    for key in ("General.Terminal", "General.NumThreads"):
        gmsh.option.setNumber(key, int(key.endswith("Threads")))
    gmsh.model.add("part")
    # never gmsh.open: what it takes for a script it runs
    gmsh.model.occ.importShapes(
        file, highestDimOnly=False, format=FORMATS[Path(file).suffix.lower()]
    )
    gmsh.model.occ.synchronize()
    if not gmsh.model.getEntities(3):
        _sew(gmsh.model)


def _sew(model: Any) -> None:
    """Make solids of surfaces that close, as IGES files have them."""
    low, high = [model.getBoundingBox(-1, -1)[k : k + 3] for k in (0, 3)]
    size = max(b - a for a, b in zip(low, high, strict=True))
    model.occ.healShapes([], SEWN * size, False, False, False, True, False)
    model.occ.synchronize()
    shells: list[tuple[list[int], list[int]]] = []
    for _, face in model.getEntities(2):
        own, edges = [face], list(map(abs, model.getAdjacencies(2, face)[1].tolist()))
        for shell in [shell for shell in shells if set(shell[1]) & set(edges)]:
            shells.remove(shell)
            own, edges = own + shell[0], edges + shell[1]
        shells.append((own, edges))
    for faces, _ in shells:
        if not model.getBoundary([(2, face) for face in faces], oriented=False):
            with contextlib.suppress(Exception):  # Gmsh's are of no class of their own
                model.occ.addVolume([model.occ.addSurfaceLoop(faces, sewing=True)])
    model.occ.synchronize()


def main() -> None:
    """Answer on what was standard output; everything else that is printed goes nowhere."""
    out = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for number in (1, 2):
        os.dup2(nowhere, number)
    with os.fdopen(out, "w") as stream:
        for answer in answers(map(json.loads, sys.stdin)):
            print(json.dumps(answer), file=stream, flush=True)


if __name__ == "__main__":
    main()
