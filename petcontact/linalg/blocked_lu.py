"""A dense LU by blocks of columns, which ranks share: `-pc_type petcontact` of PETSc's dense
matrices.

A = P L U with partial pivoting. Blocks of 128 columns go to the ranks in turn; the one that has a
block factorises it and sends it to the others, and each does to its columns what follows from it.
Some unknowns may go last, so that the rows of A⁻¹ B that belong to them need forward substitution
and a small solve only, at half the price of all; the others follow from one back substitution for
each combination of columns that is asked for.
"""

from __future__ import annotations

import ctypes
import functools

import numpy as np

from .. import native
from ..arrays import Array, Index, scattered
from ..errors import SingularMatrixError
from ..runtime.petsc import petsc, petsc_library
from ..runtime.ranks import mpi
from ..untyped import PC, Comm, Vec, Viewer
from .row_layout import even_ranges, exchanged, gathered, summed_at, total

TYPE = "petcontact"
PANEL, BLOCK = 32, 128
"""Columns of native/lu.c."""
_factorise = native.function("petcontact_lu_block", "piiiIDNDpp")
_update = native.function("petcontact_lu_update", "piDIiipiiDp")
_back = native.function("petcontact_back", "piiipiiDp")


class BlockedLU:
    """The context of the PC.

    Parameters
    ----------
    comm : PETSc.Comm
    stage : str
        Stage named in errors.
    last : (k,) int array
        Numbers of the unknowns that go last.
    in_place : bool
        Whether the matrix is not read again once the ranks have exchanged it.
    """

    def __init__(self, comm: Comm, stage: str, last: Index, *, in_place: bool) -> None:
        self._stage, self._last, self._in_place = stage, last, in_place
        self._rank: int = comm.getRank()
        self._ranks: int = comm.getSize()
        self._mpi = mpi(comm)

    def setUp(self, pc: PC) -> None:
        """Factorise the matrix of the KSP.

        Raises
        ------
        SingularMatrixError
            If there is a zero pivot.
        """
        matrix = pc.getOperators()[1]
        self._n, self._own = matrix.getSize()[0], slice(*matrix.getOwnershipRange())
        self._order, stays = np.arange(self._n), np.zeros(self._n, dtype=bool)
        inner, stays[self._last] = self._n - len(self._last), True
        out, into = np.flatnonzero(stays[:inner]), inner + np.flatnonzero(~stays[inner:])
        self._order[into], self._order[out] = out, into
        starts = range(0, self._n, BLOCK)
        blocks = [self._order[first : first + BLOCK] for first in starts]
        shares = [blocks[rank :: self._ranks] for rank in range(self._ranks)]
        owned = [np.concatenate([out[:0], *share]) for share in shares]
        # read only: PETSc would take a written matrix for a new one, and factorise it at each solve
        columns = matrix.getDenseArray(readonly=True).T
        self._columns = exchanged(columns, owned, self._mpi, used_up=self._in_place)
        self._pivots = np.empty(self._n, dtype=np.int32)
        self._inverses = np.empty((self._n, PANEL))
        for first in starts:
            self._factorised(first)
            self._updated(first, self._columns[self._place(first + BLOCK) :])
        petsc().Log.logFlops(2.0 / 3.0 * self._n**3 / self._ranks)

    def _place(self, first: int) -> int:
        """Where the columns of this rank from some block on begin among all that it has."""
        rounds, rest = divmod(-(-first // BLOCK), self._ranks)
        return min((rounds + (self._rank < rest)) * BLOCK, len(self._columns))

    def _owner(self, first: int) -> int:
        return (first // BLOCK) % self._ranks

    def _factorised(self, first: int) -> None:
        """Factorise the block that begins with a column; its pivots go to all ranks."""
        wide, failed = min(BLOCK, self._n - first), np.zeros(1, dtype=np.int64)
        pivots, inverses = self._pivots[first : first + wide], self._inverses[first : first + wide]
        if self._owner(first) == self._rank:
            block = native.pointer(self._columns[self._place(first) :, first:])
            sizes, work = (self._n, self._n - first, wide), np.empty(PANEL * BLOCK)
            _factorise(block, *sizes, pivots, inverses, failed, work, *_routines())
        for array in (pivots, inverses, failed):
            self._mpi.Bcast(array, root=self._owner(first))
        if failed[0]:
            raise SingularMatrixError(self._stage, f"row {first + failed[0]}")

    def _updated(self, first: int, columns: Array) -> None:
        """What a factorised block does to whole columns (c, n), in their place. Collective."""
        block = self._block(first)
        owns = self._owner(first) == self._rank
        block = np.ascontiguousarray(block) if owns else np.empty(block.shape)
        self._mpi.Bcast(block, root=self._owner(first))
        self._update(first, block, columns)

    def _block(self, first: int) -> Array:
        """The columns of a factorised block from its diagonal on, (wide, rows); on ranks that do
        not own it only its shape counts."""
        shape = min(BLOCK, self._n - first), self._n - first
        if self._owner(first) != self._rank:
            return np.broadcast_to(np.zeros(1), shape)
        return np.asarray(self._columns[self._place(first) :, first:][: shape[0]])

    def _update(self, first: int, block: Array, columns: Array) -> None:
        """What a factorised block does to whole columns (c, n), in their place."""
        if len(columns):
            _update(
                native.pointer(block),
                block.strides[0] // block.itemsize,
                self._inverses[first:],
                self._pivots[first:],
                self._n - first,
                len(block),
                native.pointer(columns[:, first:]),
                self._n,
                len(columns),
                np.empty(PANEL * len(columns)),
                _routines()[1],
            )

    def begun(self, rhs: Array) -> Array:
        """L⁻¹ P of right-hand sides, this rank's columns of it (c', n). Collective.

        Parameters
        ----------
        rhs : (c, rows) array
            This rank's rows of each; of no use afterwards.
        """
        ranges = [np.arange(*bounds) for bounds in even_ranges(len(rhs), self._ranks)]
        petsc().Log.logFlops(float(self._n) ** 2 * len(ranges[self._rank]))
        if len(rhs) < BLOCK:
            return np.asarray(self._begun_by_owners(rhs)[ranges[self._rank]])
        columns = exchanged(rhs, ranges, self._mpi, used_up=True)
        for first in range(0, self._n, BLOCK):
            self._updated(first, columns)
        return columns

    def _begun_by_owners(self, rhs: Array) -> Array:
        """As `begun`, all columns on every rank: few of them are sent on from the owner of each
        block, which would be more to send. Collective."""
        columns = np.ascontiguousarray(gathered(rhs.T, self._mpi).T)
        for first in range(0, self._n, BLOCK):
            owner = self._owner(first)
            if owner == self._rank:
                self._update(first, self._block(first), columns)
            below = np.ascontiguousarray(columns[:, first:])
            self._mpi.Bcast(below, root=owner)
            columns[:, first:] = below
        return columns

    def kept(self, begun: Array) -> Array:
        """The unknowns that go last of all columns, (k, c), on every rank. Collective."""
        inner, count, product = self._n - len(self._last), len(begun), _routines()[1]
        result, work = np.array(begun[:, inner:]), np.empty(PANEL * (PANEL + count))
        left = native.pointer(result), len(self._last), count
        for first in reversed(range(inner // BLOCK * BLOCK, self._n, BLOCK)):
            start, end = max(first, inner), min(first + BLOCK, self._n)
            block, owner = np.empty((end - start, end - inner)), self._owner(first)
            if owner == self._rank:
                place = self._place(first) + start - first
                block[:] = self._columns[place:, inner:end][: len(block)]
            self._mpi.Bcast(block, root=owner)
            _back(native.pointer(block), end - inner, end - inner, len(block), *left, work, product)
        petsc().Log.logFlops(float(len(self._last)) ** 2 * count)
        return gathered(result[:, np.argsort(self._order)[self._last] - inner], self._mpi).T

    def combined(self, *pairs: tuple[Array, Array]) -> Array:
        """All unknowns of A⁻¹ (B_1 y_1 + B_2 y_2 + ...), (n, ...), on every rank, from what was
        `begun` with each B and its y (c, ...). Collective."""
        left = np.zeros((self._n, *pairs[0][1].shape[1:]))
        for begun, y in pairs:
            first, last = even_ranges(len(y), self._ranks)[self._rank]
            left += begun.T @ y[first:last]
        return self._back(left)

    def _back(self, left: Array) -> Array:
        """U⁻¹ of the sum of what the ranks have, (n, ...), which is overwritten."""
        flat = left.reshape(self._n, -1)
        solved = np.zeros(flat.shape)
        for first in reversed(range(0, self._n, BLOCK)):
            rows = slice(first, min(first + BLOCK, self._n))
            part, owner = np.array(flat[rows].T, order="C"), self._owner(first)
            part = summed_at(owner, part, self._mpi)
            if owner == self._rank:
                place, wide, count = self._place(first), rows.stop - first, flat.shape[1]
                columns = self._columns[place : place + wide]
                work = np.empty(PANEL * (PANEL + count))
                pair = native.pointer(columns[:, first:]), native.pointer(part)
                _back(pair[0], self._n, wide, wide, pair[1], wide, count, work, _routines()[1])
                solved[rows] = part.T
                flat[:first] -= columns[:, :first].T @ solved[rows]
        return scattered(total(solved, self._mpi), self._order, self._n).reshape(left.shape)

    def apply(self, pc: PC, x: Vec, y: Vec) -> None:
        """PETSc asks for A⁻¹ x."""
        rhs = np.array(x.getArray(readonly=True))[None]
        y.setArray(self.combined((self.begun(rhs), np.ones(1)))[self._own])
        petsc().Log.logFlops(float(self._n) ** 2 / self._ranks)

    def view(self, pc: PC, viewer: Viewer) -> None:
        """The line of -ksp_view."""
        viewer.printfASCII(
            f"    LU by blocks of {BLOCK} columns, partial pivoting; {len(self._last)} unknowns "
            "are eliminated last\n"
        )


@functools.cache
def _routines() -> tuple[int, int]:
    """Where LAPACK's dgetrf and the BLAS' dgemm begin, for code in C; 0 where they take other
    integers."""
    from scipy.linalg import cython_blas, cython_lapack

    capsules: list[object] = [
        cython_lapack.__pyx_capi__["dgetrf"],
        cython_blas.__pyx_capi__["dgemm"],
    ]
    name_of, address_of = ctypes.pythonapi.PyCapsule_GetName, ctypes.pythonapi.PyCapsule_GetPointer
    name_of.restype, name_of.argtypes = ctypes.c_char_p, [ctypes.py_object]
    address_of.restype, address_of.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    names = [name_of(capsule) for capsule in capsules]
    if any(b"int *" not in name for name in names):
        return 0, 0
    factor, product = (
        address_of(capsule, name) for capsule, name in zip(capsules, names, strict=True)
    )
    return factor, product


def direct_type(comm: Comm) -> str:
    """The PC that factorises dense matrices: LAPACK's LU on one rank, and where the BLAS of scipy
    takes other integers; else this one."""
    return TYPE if comm.getSize() > 1 and all(_routines()) else "lu"


@functools.cache
def register() -> object:
    """Make `-pc_type petcontact` known to PETSc: a PC of type python under this name.

    petsc4py has no call for PCRegister; what is returned has to live as long as PETSc does.
    """
    library = petsc_library()

    def create(pc: int) -> int:
        handle = ctypes.c_void_p(pc)
        error = library.PCSetType(handle, b"python")
        return int(error or library.PetscObjectChangeTypeName(handle, TYPE.encode()))

    callback = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_void_p)(create)
    library.PCRegister(TYPE.encode(), callback)
    return callback
