"""A body known at its contact surface only: its faces, and how they move under forces, from a numpy
archive.

The archive is data: numpy's own format without pickled objects. `read_superelement` says what it
holds.
"""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..arrays import Array, Index
from ..errors import InputError
from ..frozen import frozen

LARGEST = 16_000_000_000
"""Bytes of the arrays."""
SYMMETRIC = 1e-6
"""Difference of a stiffness from its transpose, over its largest entry, that is taken for round-off
of who made it."""


@frozen
class CondensedSurface:
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
    exterior: ClassVar[bool] = False
    closed: ClassVar[bool] = False

    @property
    def dim(self) -> int:
        """Dimension d of its points."""
        return self.points.shape[1]

    @property
    def diameter(self) -> float:
        """Length of the diagonal of the bounding box [length]."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    @property
    def order(self) -> Index:
        """Of each element; those of a finite-element mesh are linear."""
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
    """The superelement of a .npz file.

    Arrays (numpy.savez), for a surface of p points and e faces in d dimensions:

    - `points` (p, d); `elements` (e, 2), the body on the left, in space (e, 3) or (e, 4),
      counter-clockwise seen from outside, -1 last in triangles;
    - `part` (e,), numbers of the names in `part_names`; without them the one part is "contact";
    - `stiffness` (d p, d p): forces at the points for their displacements, component c of point i
      being d i + c, condensed to the surface, symmetric, positive semi-definite [force/length];
      rigid motions that it does not resist are free;
    - `force` (d p,), optional: K u = contact forces + force, of loads inside, at the end of every
      step; or (K, d p): without load first, then at the end of each step;

    or, as `petcontact export --superelement` writes, for n collocation nodes of elements of given
    `order` (e,):

    - `compliance` (d n, d n): displacement of the nodes for tractions there [length/stress];
    - `u_0` (n, d) or (K, n, d), `modes` (n, d, r), `resultant` (r,) or (K, r), optional:
      displacement without tractions, and rigid motions that nothing but contact holds with the
      loads along them; `curvature`, `line`, `side_start` (e,) and `unit_length` of elements in the
      plane; `middles` (e, 5) of curved faces in space: points in the middles of the sides, and of
      quadrilaterals in the middle, -1 where there are none.

    Raises
    ------
    InputError
        If the file cannot be read, or an array is missing, not finite or of another shape.
    """
    arrays = _loaded(Path(path))
    for name in ("points", "elements"):
        if name not in arrays:
            raise InputError(f"{path}: has no array {name!r}; it has {', '.join(arrays) or 'none'}")
    points, elements = arrays.pop("points"), arrays.pop("elements")
    if points.ndim != 2 or points.shape[1] not in (2, 3) or elements.ndim != 2 or not len(elements):
        raise InputError(
            f"{path}: points must be (p, 2) or (p, 3) and elements (e, 2), (e, 3) or (e, 4), "
            f"got {points.shape} and {elements.shape}"
        )
    (p, d), e = points.shape, len(elements)
    if elements.shape[1] not in {2: (2,), 3: (3, 4)}[d]:
        raise InputError(
            f"{path}: elements: faces in {d} dimensions have {2 if d == 2 else '3 or 4'} points, "
            f"got {elements.shape[1]}"
        )
    if d == 3 and elements.shape[1] == 3:
        elements = np.column_stack([elements, np.full(e, -1)])
    real = elements[:, :2] if d == 2 else elements[:, :3]
    if (
        elements.dtype.kind not in "iu"
        or real.min() < 0
        or elements.max() >= p
        or elements.min() < -1
    ):
        raise InputError(f"{path}: elements: must be numbers of points, 0 to {p - 1}")
    names = tuple(str(name) for name in arrays.pop("part_names", np.array(["contact"])))
    part = arrays.pop("part", np.zeros(e, dtype=np.int64))
    if (
        part.shape != (e,)
        or part.dtype.kind not in "iu"
        or part.min() < 0
        or part.max() >= len(names)
    ):
        raise InputError(
            f"{path}: part: must be {e} numbers of the {len(names)} names in part_names"
        )
    if ("stiffness" in arrays) == ("compliance" in arrays):
        raise InputError(f"{path}: needs either an array 'stiffness' or an array 'compliance'")
    whole = (elements.astype(np.int64), part.astype(np.int64))
    surface = CondensedSurface(str(path), points.astype(float), *whole, names, arrays)
    if "stiffness" in arrays:
        _check_stiffness(surface)
    if "middles" in arrays:
        _check_middles(surface)
    return surface


def _check_middles(surface: CondensedSurface) -> None:
    middles = expect(surface, "middles", (len(surface.elements), 5))
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
            f"quadrilaterals, or "
            "all -1, beside a compliance in space"
        )


def _loaded(path: Path) -> dict[str, Array]:
    """The arrays of a file, none of which is larger than it may be, or no number."""
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(item.file_size for item in archive.infolist()) > LARGEST:
                raise InputError(f"{path}: larger than {LARGEST:.0e} bytes")
        with np.load(path, allow_pickle=False) as file:
            arrays: dict[str, Array] = {name: file[name] for name in file.files}
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or 'damaged'})") from None
    except (ValueError, zipfile.BadZipFile, KeyError) as error:
        raise InputError(
            f"{path}: is no .npz file of plain arrays ({' '.join(str(error).split())[:80]})"
        ) from None
    for name, values in arrays.items():
        if values.dtype.kind not in ("U" if name == "part_names" else "iuf") or (
            values.dtype.kind == "f" and not np.isfinite(values).all()
        ):
            raise InputError(
                f"{path}: array {name!r} must hold "
                f"{'text' if name == 'part_names' else 'finite numbers'}"
            )
    return arrays


def _check_stiffness(surface: CondensedSurface) -> None:
    stiffness, size = surface.arrays["stiffness"], surface.points.size
    expect(surface, "stiffness", (size, size))
    largest = float(np.abs(stiffness).max(initial=0.0))
    if largest == 0.0 or np.abs(stiffness - stiffness.T).max() > SYMMETRIC * largest:
        raise InputError(f"{surface.source}: stiffness must be symmetric and other than zero")
    used = surface.elements[surface.elements >= 0]
    loose = np.setdiff1d(np.arange(len(surface.points)), used)
    if len(loose):
        raise InputError(
            f"{surface.source}: point {loose[0]} belongs to no element ({len(loose)} such points); "
            f"condense "
            "the stiffness to the points of the contact surface"
        )


def expect(surface: CondensedSurface, name: str, *shapes: tuple[int, ...]) -> Any:
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
