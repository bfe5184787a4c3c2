"""A body known at its contact surface only: its faces, and how they move under forces, from a numpy
archive.

The archive is data: numpy's own format without pickled objects. `read_superelement` says what it
holds.
"""

from __future__ import annotations

import math
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import LARGEST_COORDINATE, AnyArray, Array, Index
from ..errors import InputError
from ..record import record
from ..round_off import SINGLE
from ..stored import Stored, check_declared, checked, demand_unique, foreign
from ..untyped import Keyed
from .surface import Boundary

LARGEST = 16_000_000_000
"""Bytes of the arrays."""
HEADERS: dict[tuple[int, int], Callable[[object], tuple[Any, bool, Any]]] = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
"""Readers of what an array declares, by the version of its format; 3.0 is for names of fields."""
SCHEMA = {
    "points": Stored("p d", low=-LARGEST_COORDINATE, high=LARGEST_COORDINATE),
    "elements": Stored("e c", "i", -1),
    "part": Stored("e", "i", 0),
    "part_names": Stored("names", "U"),
    "stiffness": Stored("d*p d*p"),
    "force": Stored("d*p|K d*p"),
    "compliance": Stored("d*n d*n"),
    "u_0": Stored("n d|K n d"),
    "modes": Stored("n d r"),
    "resultant": Stored("r|K r"),
    "order": Stored("e", "i", 0, 5),
    "curvature": Stored("e"),
    "line": Stored("e", "i"),
    "side_start": Stored("e", low=-LARGEST_COORDINATE, high=LARGEST_COORDINATE),
    "unit_length": Stored("", low=1.0 / LARGEST_COORDINATE, high=LARGEST_COORDINATE),
    "middles": Stored("e 5", "i", -1),
    "axial": Stored("", "i", 0, 1),
}
"""Arrays that are read, those first whose sizes others have."""
NOT_IN_A_PART = re.compile(r"[./]")


@record
class CondensedSurface(Boundary):
    """The contact surface of a body, and its condensed stiffness or compliance.

    Attributes
    ----------
    source : str
        The file.
    points : (p, d) array
        [length]
    elements : (e, 2) array, in space (e, 4)
        Numbers of the points: in the plane from start to end with the body on the left, in space
        counter-clockwise seen from outside, -1 last in triangles.
    part : (e,) array
        Number of the part in `parts`.
    parts : tuple of str
    arrays : dict
        `stiffness` and `force`; or `compliance`, `u_0`, `modes`, `resultant`; `order` and the like,
        see `read_superelement`.
    """

    source: str
    points: Array
    elements: Index
    part: Index
    parts: tuple[str, ...]
    arrays: dict[str, Array]
    meshed = True
    closed = has_inside = False

    @property
    def dim(self) -> int:
        """Dimension d of its points."""
        return self.points.shape[1]

    @property
    def components(self) -> int:
        """Number of components of a displacement, 2 or 3."""
        return self.dim

    @property
    def axial(self) -> bool:
        """Whether it is a body of revolution, whose points are (r, z)."""
        return bool(self.arrays.get("axial", 0))

    def demand(self, axial: bool, twisted: bool = False) -> None:
        """Refuse a body of revolution among others, and others among bodies of revolution; and
        torsion, of which a superelement knows nothing.

        Raises
        ------
        InputError
            One line that names the file.
        """
        beyond = self.dim == 3 or self.points[:, 0].min() < 0.0
        if self.axial != axial or (axial and beyond):
            raise InputError(
                f"{self.source}: axial: "
                + (
                    'with symmetry = "axial" it must be 1, and points (r, z) with r >= 0'
                    if axial
                    else 'this superelement is a body of revolution; write symmetry = "axial"'
                )
            )

        if twisted:
            raise InputError(f"{self.source}: a superelement of revolution has no torsion")

    @property
    def diameter(self) -> float:
        """Length of the diagonal of the bounding box [length]."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @property
    def order(self) -> Index:
        """Order of each element (n_elements,); elements of a finite-element mesh are linear."""
        return self.whole_numbers("order", np.ones(len(self.elements)))

    @property
    def middles(self) -> Index:
        """Numbers of the points in the middles of the sides of curved faces and of quadrilaterals,
        (e, 5), else -1."""
        return self.whole_numbers("middles", np.full((len(self.elements), 5), -1.0))

    def whole_numbers(self, name: str, default: Array) -> Index:
        """An array of whole numbers that may be there."""
        return np.asarray(self.arrays.get(name, default)).astype(np.int64)


def read_superelement(path: str | Path) -> CondensedSurface:
    """Return the superelement of a .npz file.

    The file has these arrays (numpy.savez), for a surface of p points and e faces in d dimensions:

    - `points` (p, d) are coordinates [length].
    - `elements` (e, 2) are numbers of points, with the body on the left. In space they are (e, 3)
      or (e, 4), counter-clockwise seen from outside. Triangles among quadrilaterals end with -1.
    - `part` (e,) has numbers of the names in `part_names`. Without both, the one part is "contact".
    - `stiffness` (d p, d p) is K, condensed to the surface [force/length]. Component c of point i
      has the number d i + c. K is symmetric and positive semi-definite. Rigid motions that K does
      not resist are free.
    - `force` (d p,), optional, is that of loads inside: K u = contact forces + force at the end of
      every step. With (K, d p) the first row is without load, and each step has a row.

    Or it has the arrays that `petcontact export --superelement` writes. They are for the n
    collocation nodes of elements of given `order` (e,):

    - `compliance` (d n, d n) gives displacements of the nodes for tractions there [length/stress].
    - `u_0` (n, d) or (K, n, d), optional, is the displacement without tractions.
    - `modes` (n, d, r), optional, are the rigid motions that only contact holds. `resultant` (r,)
      or (K, r) are the loads along them.
    - `curvature`, `line`, `side_start` (e,) and `unit_length`, optional, describe elements in the
      plane.
    - `middles` (e, 5), optional, are points of curved faces in space. They lie in the middles of
      the sides, and of quadrilaterals in the middle, too. -1 means that there is none.

    `axial` is 1 where points are (r, z), r >= 0, of a body of revolution. Forces are then those on
    whole rings.

    Raises
    ------
    InputError
        If the file cannot be read, or an array is missing, not finite or of another shape.
    """
    with foreign(path):
        arrays = _loaded(Path(path))
    points, elements = arrays.pop("points"), arrays.pop("elements")
    (p, d), e = points.shape, len(elements)
    if elements.shape[1] not in {2: (2,), 3: (3, 4)}.get(d, ()) or not e:
        raise InputError(
            f"{path}: points must be (p, 2) or (p, 3) and elements (e, 2), in space (e, 3) or "
            f"(e, 4), got {points.shape} and {elements.shape}"
        )
    if d == 3 and elements.shape[1] == 3:
        elements = np.column_stack([elements, np.full(e, -1)])
    real = elements[:, :2] if d == 2 else elements[:, :3]
    if real.min() < 0 or elements.max() >= p:
        raise InputError(f"{path}: elements: must be numbers of points, 0 to {p - 1}")
    demand_unique(f"{path}: elements", np.sort(elements, axis=1))
    following = points[np.where(elements < 0, elements[:, :1], elements)]
    sides = np.linalg.norm(following - np.roll(following, -1, axis=1), axis=2)[elements >= 0]
    if not sides.min() >= 1.0 / LARGEST_COORDINATE:
        raise InputError(f"{path}: elements: a side has no length")
    names = tuple(arrays.pop("part_names", np.array(["contact"])).tolist())
    demand_unique(f"{path}: part_names", np.array(names))
    if any(map(NOT_IN_A_PART.search, names)):
        raise InputError(f"{path}: part_names: a name has no dot and no slash")
    part = arrays.pop("part", np.zeros(e, dtype=np.int64))
    if part.max() >= len(names):
        raise InputError(
            f"{path}: part: must be {e} numbers of the {len(names)} names in part_names"
        )
    surface = CondensedSurface(str(path), points, elements, part, names, arrays)
    if "stiffness" in arrays:
        _check_stiffness(surface)
    _check_compliance(surface, sides)
    if "middles" in arrays:
        _check_middles(surface)
    return surface


def _check_compliance(surface: CondensedSurface, sides: Array) -> None:
    """What is beside a compliance, and that a traction moves its own node its own way."""
    arrays, where = surface.arrays, surface.source
    if "compliance" not in arrays:
        return
    if not np.all(np.diag(arrays["compliance"]) > 0.0):
        raise InputError(f"{where}: compliance: must be positive on its diagonal")
    turn = np.abs(arrays.get("curvature", np.zeros(1))) * (sides[::2] if surface.dim == 2 else 0.0)
    if turn.max() > 2.0:
        raise InputError(f"{where}: curvature: a circle's radius is at least half of a chord")
    if "modes" in arrays and not np.all(np.any(arrays["modes"], axis=(0, 1))):
        raise InputError(f"{where}: modes: one moves nothing")
    if "resultant" in arrays and "modes" not in arrays:
        raise InputError(f"{where}: resultant: is along modes, which are not there")


def _check_middles(surface: CondensedSurface) -> None:
    middles = surface.arrays["middles"]
    sides = (
        np.where(surface.elements[:, 3:] < 0, np.arange(5) < 3, True)
        if surface.dim == 3
        else np.zeros((1, 1), dtype=bool)
    )
    whole = np.array_equal(middles >= 0, sides & (middles[:, :1] >= 0))
    if (
        "stiffness" in surface.arrays
        or not whole
        or middles.dtype.kind not in "iu"
        or middles.max() >= len(surface.points)
    ):
        raise InputError(
            f"{surface.source}: middles: must be numbers of points, 3 of triangles and 5 of "
            "quadrilaterals, or all -1, beside a compliance in space"
        )


def _loaded(path: Path) -> Keyed:
    """The arrays of a file that the schema names; what they declare is checked before they are
    read."""
    arrays, sizes = Keyed(), dict[str, int]()
    with zipfile.ZipFile(path) as archive:
        entries = archive.namelist()
        members = [name for name in SCHEMA if f"{name}.npy" in entries]
        for name in ("points", "elements"):
            if name not in members:
                raise InputError(
                    f"{path}: has no array {name!r}; it has {', '.join(members) or 'none'}"
                )
        if ("stiffness" in members) == ("compliance" in members):
            raise InputError(f"{path}: needs either an array 'stiffness' or an array 'compliance'")
        for name in members:
            file, wanted = f"{name}.npy", SCHEMA[name]
            if entries.count(file) > 1:
                raise InputError(f"{path}: {name}: is there twice")
            info = archive.getinfo(file)
            with archive.open(info) as stream:
                shape, _, dtype = HEADERS[np.lib.format.read_magic(stream)](stream)
                check_declared(f"{path}: {name}", shape, dtype.kind, wanted, sizes)
                size = math.prod(shape) * dtype.itemsize
                if size != info.file_size - stream.tell() or size > LARGEST:
                    raise InputError(f"{path}: damaged ({name} declares {size} bytes)")
            with archive.open(info) as stream:
                values = np.lib.format.read_array(stream, allow_pickle=False)
                arrays[name] = checked(f"{path}: {name}", values, wanted)
    return arrays


def _check_stiffness(surface: CondensedSurface) -> None:
    stiffness = surface.arrays["stiffness"]
    largest = float(np.abs(stiffness).max(initial=0.0))
    if (
        largest * LARGEST_COORDINATE < 1.0
        or np.abs(stiffness - stiffness.T).max() > SINGLE * largest
    ):
        raise InputError(f"{surface.source}: stiffness must be symmetric and other than zero")
    if np.diag(stiffness).min() < 0.0:
        raise InputError(
            f"{surface.source}: stiffness must be positive semi-definite; its diagonal is not"
        )
    used = surface.elements[surface.elements >= 0]
    loose = np.setdiff1d(np.arange(len(surface.points)), used)
    if len(loose):
        raise InputError(
            f"{surface.source}: point {loose[0]} belongs to no element ({len(loose)} such "
            "points); condense the stiffness to the points of the contact surface"
        )


def expect(surface: CondensedSurface, name: str, *shapes: tuple[int, ...]) -> AnyArray:
    """An array of one of some shapes.

    Raises
    ------
    InputError
        If it has another.
    """
    values = surface.arrays[name]
    if values.shape not in shapes:
        allowed = " or ".join(str(shape) for shape in shapes)
        raise InputError(f"{surface.source}: {name}: must have shape {allowed}, has {values.shape}")
    return values
