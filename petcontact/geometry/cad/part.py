"""Solids of CAD files (STEP, IGES, BREP): their surfaces by number and name, and the curved facets
that mesh them."""

from __future__ import annotations

import contextlib
import functools
import importlib.util
import json
import math
import os
import re
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from ...arrays import LONGEST_NAME, Array, Index
from ...errors import InputError, MissingPackage, OutputError
from ...record import record
from ...round_off import WRITTEN
from ...untyped import Keyed
from ..gmsh import read_msh
from ..gmsh_surface import gmsh_surface
from ..surface import FacetSurface, SolidSurface
from . import worker
from .onto_surfaces import projector

LARGEST = 500_000_000
"""Bytes of a CAD file."""
MOST_CELLS = 5e6
"""Cells of a mesh."""
TRIED = (0.5, 0.25, 2.0)
"""Sizes that are tried where one does not work, over that one."""
CELLS = ("quadrilaterals", "triangles", "triangles across rims")
"""Kinds of cells, of which the first is taken that Gmsh can make: quadrilaterals, with triangles
where they do not fit, or triangles only. Cells end where faces of other solids of the file that
lie on the body end, but for the last kind. The tip of a cone has no quadrilaterals."""
LIMIT = 50.0
"""Time for Gmsh to read or to mesh a file; 60 s for both were asked for [s]."""
SOON = 0.2
"""Share of the time in which an attempt has to fail so that another one follows: so many fit."""
END = b"$EndElements\n"
"""Last line of the elements of a mesh file."""
LIBRARIES = "apt install libglu1-mesa libxft2 libxcursor1 libxinerama1"
"""What Gmsh's wheel needs and Debian's minimal systems lack."""

Made = TypeVar("Made")


def is_cad(file: str) -> bool:
    """Whether the name of a file is that of a CAD file."""
    return Path(file).suffix.lower() in worker.FORMATS


@record
class CadFace:
    """A surface of a CAD file: its number in the file, its name there or "", kind, area [length²]
    and centre [length]."""

    number: int
    name: str
    kind: str
    area: float
    centre: tuple[float, float, float]

    @property
    def part(self) -> str:
        """The part that it belongs to, where the user says nothing."""
        return self.name or str(self.number)


@record
class CadSurface(SolidSurface):
    """The surface of one solid of a CAD file, which is meshed where a size is known.

    Attributes
    ----------
    file, solid : str
        As they are called in messages.
    stamp : int
        When the file was changed last.
    faces : tuple of CadFace
    part_of : tuple of str
        The part of each face.
    low, high : tuples
        Corners of the box around it [length].
    """

    file: str
    solid: str
    stamp: int
    faces: tuple[CadFace, ...]
    part_of: tuple[str, ...]
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    known = exact = True

    @property
    def parts(self) -> tuple[str, ...]:
        """Names of the parts, in the order of their first faces."""
        return tuple(dict.fromkeys(self.part_of))

    @functools.cached_property
    def _numbers(self) -> dict[str, tuple[int, ...]]:
        """Numbers of the faces of each part."""
        pairs = list(zip(self.faces, self.part_of, strict=True))
        return {
            part: tuple(face.number for face, own in pairs if own == part) for part in self.parts
        }

    @property
    def diameter(self) -> float:
        """Length of the diagonal of the box around it [length]."""
        return float(np.linalg.norm(np.subtract(self.high, self.low)))

    @property
    def area(self) -> float:
        """[length²]."""
        return float(sum(face.area for face in self.faces))

    def area_of(self, part: str) -> float:
        """The area of a part [length²]."""
        pairs = zip(self.faces, self.part_of, strict=True)
        return float(sum(face.area for face, own in pairs if own == part))

    @property
    def usual_size(self) -> float:
        """Size of cells where none is given [length]."""
        # without a size: twelve cells along the diagonal of the box around the solid
        return self.diameter / 12

    def facets(self, size: float | None = None) -> FacetSurface:
        """Curved cells of about a size, of the second order.

        Raises
        ------
        InputError
            If Gmsh cannot mesh it, or the mesh is none of a body (see `checked_surface`). A size
            that works is named, if one of those that are tried does.
        """
        size, began = size or self.usual_size, time.monotonic()
        try:
            return _facets(self, size)
        except InputError as error:
            others = (size * factor for factor in TRIED if time.monotonic() - began < SOON * LIMIT)
            works = [f"{other:.3g}" for other in others if self._is_meshed(other)][:1]
            remedy = (
                f"mesh.element_size = {works[0]} works"
                if works
                else "mend the solid in the CAD program, or leave out its small faces, of which "
                f"the least is {min(self.faces, key=lambda face: face.area).part!r}"
            )
            raise InputError(f"{error}; {remedy}") from None

    def _is_meshed(self, size: float) -> bool:
        with contextlib.suppress(InputError):
            return _facets(self, size) is not None
        return False

    def onto(self, part: Index, points: Array) -> Array:
        """Onto the surface of the part that a whole panel is nearest to, and onto its edges
        (`Projector.onto`)."""
        surfaces = list(self._numbers.values())
        return projector(self.file, self.stamp, os.getpid()).onto(
            [surfaces[k] for k in part.tolist()], points
        )

    def write_msh(self, target: str | Path, size: float | None = None, order: int = 2) -> None:
        """Write the mesh as a Gmsh file, format 4.1, with a physical surface for each part.

        Raises
        ------
        InputError
            If Gmsh cannot mesh it, or would fill it with too many cells.
        OutputError
            If not all of the file could be written, of which Gmsh says nothing.
        """
        size = size or self.usual_size
        if (cells := self.area / size / size) > MOST_CELLS:
            enough = 1.1 * size * float(cells / MOST_CELLS) ** 0.5
            raise InputError(
                f"{self.file}: cells of size {size:g} on {self.area:.4g} of surface are about "
                f"{cells:.2g}, {MOST_CELLS:.0e} at most are made; a size of {enough:.2g} will do"
            )
        _first_of(lambda kind: self._write(target, size, order, kind))

    def _write(self, target: str | Path, size: float, order: int, kind: str) -> None:
        """Write the mesh with cells of one of `CELLS`."""
        request: Keyed = {"parts": self._numbers, "size": size, "order": order}
        request |= {"imprint": kind != CELLS[-1], "quadrilaterals": kind == CELLS[0]}
        ask(self.file, target=str(target), **request)
        with open(target, "rb") as file:
            file.seek(max(0, os.path.getsize(target) - len(END)))
            if file.read() != END:
                raise OutputError(
                    f"{self.file}: its mesh cannot be written whole to {Path(target).parent}; is "
                    "there room?"
                )

    def table(self) -> list[list[str]]:
        """Number, part, kind, area and centre of each face, after a head."""
        small = WRITTEN * self.diameter
        centres = [
            " ".join(f"{0.0 if abs(value) < small else value:.4g}" for value in face.centre)
            for face in self.faces
        ]
        rows = [
            [str(face.number), part, face.kind, f"{face.area:.6g}", centre]
            for face, part, centre in zip(self.faces, self.part_of, centres, strict=True)
        ]
        return [["surface", "part", "kind", "area", "centre"], *rows]


@functools.lru_cache(maxsize=8)
def _facets(surface: CadSurface, size: float) -> FacetSurface:
    import tempfile

    def made(kind: str) -> FacetSurface:
        with tempfile.TemporaryDirectory(prefix="petcontact-") as folder:
            target = Path(folder) / "part.msh"
            surface._write(target, size, 2, kind)
            return gmsh_surface(read_msh(str(target)), f"{surface.file}: {surface.solid}")

    return _first_of(made)


def _first_of(made: Callable[[str], Made]) -> Made:
    """Return what is made of the first kind of `CELLS` that works, or of none that takes long."""
    began = time.monotonic()
    for kind in CELLS[:-1]:
        try:
            return made(kind)
        except InputError:
            if time.monotonic() - began > SOON * LIMIT:
                raise
    return made(CELLS[-1])


def cad_surface(
    file: str, parts: Mapping[str, Sequence[int]] | None = None, solid: str | int | None = None
) -> CadSurface:
    """The surface of a solid of a CAD file.

    Parameters
    ----------
    file : str
    parts : mapping of names to numbers of surfaces, optional
        The others keep their names in the file, or are called by their numbers.
    solid : str or int, optional
        Name or number of the solid, where the file has several.

    Raises
    ------
    InputError
        If Gmsh's package is missing, the file cannot be read, it has no solid or several, or there
        is no such surface.
    """
    path = Path(file)
    stamp = path.stat().st_mtime_ns
    body = _solid(_listed(file, stamp), file, solid)
    faces = tuple(CadFace(*face) for face in body["faces"])
    own = {number: name for name, numbers in (parts or {}).items() for number in numbers}
    face_numbers = {face.number for face in faces}
    for number in own:
        if number not in face_numbers:
            raise InputError(
                f"{file}: geometry.parts: no surface {number}; there are {_numbers(face_numbers)} "
                f"(petcontact mesh {path.name} lists them)"
            )
    name = f"solid {body['number']} {body['name']!r}"
    part_of = tuple(own.get(face.number, face.part) for face in faces)
    return CadSurface(file, name, stamp, faces, part_of, tuple(body["low"]), tuple(body["high"]))


def _solid(found: Keyed, file: str, wanted: str | int | None) -> Keyed:
    """The solid of the file that the config names."""
    solids = _some(found, file)
    names = ", ".join(f"{solid['number']} {solid['name']!r}" for solid in solids)
    chosen = [solid for solid in solids if wanted in (None, solid["number"], solid["name"])]
    if not chosen:
        raise InputError(f"{file}: geometry.solid: no solid {wanted!r}; there are {names}")
    if len(chosen) > 1:
        raise InputError(
            f"{file}: holds {len(solids)} solids ({names}), and a body is one: geometry.solid "
            "(--solid of petcontact mesh) names or numbers it, a [[body]] each; petcontact init "
            f"NAME --from {Path(file).name} proposes them"
        )
    return chosen[0]


def _some(found: Keyed, file: str) -> list[Keyed]:
    """The solids of the file, if there are some."""
    solids: list[Keyed] = found["solids"]
    if not solids:
        loose = found["loose"]
        surfaces = f"{loose} surface{'s' * (loose != 1)}, which do not close, but " * bool(loose)
        raise InputError(
            f"{file}: holds {surfaces}no solid; a body is one solid with a closed surface: sew it "
            "in the CAD program, and save it as STEP"
        )
    return solids


def apart(pairs: Sequence[tuple[CadSurface, str, CadSurface, str]]) -> list[float]:
    """Least distances of parts of solids of a file, which are one face each, else NaN [length]."""
    faces = [(one._numbers[a], two._numbers[b]) for one, a, two, b in pairs]
    single = {k: (a[0], b[0]) for k, (a, b) in enumerate(faces) if len(a) == len(b) == 1}
    found = ask(pairs[0][0].file, apart=[*single.values()])["apart"] if single else []
    distances = dict(zip(single, found, strict=True))
    return [distances.get(k, math.nan) for k in range(len(pairs))]


def solids_of(file: str) -> dict[int, str]:
    """Numbers of the solids of a CAD file, with a name for each that no other has.

    Raises
    ------
    InputError
        If the file cannot be read, or holds no solid.
    """
    solids = _some(_listed(file, Path(file).stat().st_mtime_ns), file)
    names = [solid["name"] for solid in solids]
    return {
        solid["number"]: solid["name"]
        if names.count(solid["name"]) == 1 and re.fullmatch(r"[^./]{1,30}", solid["name"])
        else f"body{solid['number']}"
        for solid in solids
    }


@functools.lru_cache(maxsize=16)
def _listed(file: str, stamp: int) -> Keyed:
    """What the worker lists, faces as tuples; `stamp` is part of the key."""
    answer = ask(file)
    for solid in answer["solids"]:
        solid["faces"] = [
            (
                face["number"],
                face["name"] if len(face["name"]) <= LONGEST_NAME else "",
                face["kind"],
                face["area"],
                tuple(face["centre"]),
            )
            for face in solid["faces"]
        ]
    return answer


def ask(file: str, **request: object) -> Keyed:
    """The worker's answer.

    Raises
    ------
    InputError
        If Gmsh's package is missing or does not load, or what it says of the file.
    """
    import subprocess

    if importlib.util.find_spec("gmsh") is None:
        raise MissingPackage(f"{file}: a CAD file", "gmsh", "cad")
    words, doing = [sys.executable, worker.__file__], "meshed" if "target" in request else "read"
    try:
        done = subprocess.run(
            words,
            input=json.dumps({"file": file, **request}),
            capture_output=True,
            text=True,
            check=False,
            timeout=LIMIT,
        )
    except subprocess.TimeoutExpired:
        raise InputError(
            f"{file}: not {doing} in {LIMIT:g} s; give a larger mesh.element_size"
        ) from None
    try:
        answer: Keyed = json.loads(done.stdout)
    except ValueError:
        raise InputError(
            f"{file}: Gmsh ended while it read or meshed it (status {done.returncode}); mend the "
            "geometry in the CAD program"
        ) from None
    if "missing" in answer:
        raise InputError(
            f"{file}: Gmsh's Python package does not load ({answer['missing']}); {LIBRARIES}"
        )
    if "error" in answer:
        raise InputError(f"{file}: cannot be {doing} ({answer['error'].splitlines()[0]})")
    return answer


def _numbers(numbers: set[int]) -> str:
    low, high = min(numbers), max(numbers)
    return (
        f"{low} to {high}"
        if len(numbers) == high - low + 1
        else ", ".join(map(str, sorted(numbers)))
    )
