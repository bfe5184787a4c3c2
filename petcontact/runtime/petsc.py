"""The only place that initialises PETSc; the differences between PETSc releases live here too.

PETSc and MPI start with the first solve, or operators: to read or draw results takes neither.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import itertools
import os
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from types import ModuleType
from typing import Any

from ..errors import (
    InputError,
    MissingPetscError,
    SingularMatrixError,
    SolverError,
    installed_by,
)
from ..untyped import Comm
from .memory import check_address_space
from .petsc_options import OF_THE_PROGRAM, check, files_first, of_files
from .signals import reinstall
from .threads import cap_blas_threads

_failures: list[object] = []
"""A communicator of all ranks on which nothing else is sent, so that a failed rank can ask whether
the others failed too."""
_clocks: list[dict[str, float]] = []
"""What `timed` blocks have noted so far, the innermost last."""
_from_tables: dict[str, bool] = {}
"""Options that `[petsc]` tables have set so far, and whether an object used them."""
_LAUNCHED = (
    "OMPI_COMM_WORLD_SIZE",
    "PMIX_RANK",
    "PMI_RANK",
    "PMI_SIZE",
    "MPI_LOCALNRANKS",
    "MV2_COMM_WORLD_SIZE",
    "PALS_RANKID",
    "SLURM_PROCID",
)
"""Variables of which a launcher of ranks sets one."""
_SINGLETON = {
    "OMPI_MCA_ess_singleton_isolated": "1",
    "OMPI_MCA_orte_create_session_dirs": "0",
    "OMPI_MCA_pml": "ob1",
}
"""No daemon; no folder, which without a daemon would be one for all that start and end at that
moment; no network."""


def is_launched() -> bool:
    """Return whether a launcher started this process, so that it may be one of several ranks."""
    return any(map(os.environ.__contains__, _LAUNCHED))


def initialise(argv: Sequence[str] = ()) -> None:
    """Start PETSc once, with the PETSc part of a command line.

    Parameters
    ----------
    argv : sequence of str
        PETSc options as on a command line (``["-ksp_type", "gmres"]``), without the program's name.
        Options given after PETSc has started are inserted into its data base.

    Raises
    ------
    MissingPetscError
        If petsc4py cannot be imported.
    InputError
        If PETSc refuses the options, a file of options is none, or a file that a viewer writes to
        cannot be written.
    SolverError
        If there is too little memory to start.
    """
    cap_blas_threads()
    started = "petsc4py.PETSc" in sys.modules
    environment = os.environ.get("PETSC_OPTIONS", "").split()
    files = [] if started or "-skip_petscrc" in [*environment, *argv] else of_files()
    check([*files, *environment, *argv])
    # the last word wins: the environment's over those of files
    arguments = [*files, *(environment if files else ()), *files_first(argv)]
    if not started:
        check_address_space()
    try:
        import petsc4py

        if not started:
            # -options_left no: petcontact reports unused options itself, by name, before PETSc is
            # gone
            quiet = [] if "-options_left" in arguments else ["-options_left", "no"]
            # a pipe that closes (`| head`) or a crash is Python's to report, not a banner of
            # PETSc's and an MPI abort
            quiet += ["-no_signal_handler", "-skip_petscrc"]
            told = _told_in_one_line() if arguments else contextlib.nullcontext()
            with _local(), told:
                petsc4py.init(["petcontact", *quiet, *arguments])
            reinstall()
        from petsc4py import PETSc

        if not started and PETSc.COMM_WORLD.getSize() > 1:  # one rank needs no mpi4py
            expect_failures(PETSc.COMM_WORLD.tompi4py())
    except ImportError as error:
        raise MissingPetscError(
            f"petsc4py cannot be loaded ({error}); install python3-petsc4py, or "
            f"{installed_by('petsc')}"
        ) from error
    if started and arguments:
        PETSc.Options().insertString(" ".join(arguments))


@contextlib.contextmanager
def _told_in_one_line() -> Iterator[None]:
    """What PETSc has against options when it starts, without its page on standard error."""
    import tempfile

    with tempfile.TemporaryFile() as page:
        kept, refused = os.dup(2), False
        os.dup2(page.fileno(), 2)
        try:
            yield
        except Exception as error:
            if not is_petsc_error(error):
                raise
            refused = True
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            page.seek(0)
            text = page.read()
            if not refused:
                os.write(2, text)
    if refused:
        lines = [
            line.partition("PETSC ERROR: ")[2]
            for line in text.decode(errors="replace").splitlines()
        ]
        raise InputError(
            "PETSc's options: "
            f"{' '.join(filter(None, lines[2:3])) or 'PETSc cannot start with them'}"
        )


@contextlib.contextmanager
def _local() -> Iterator[None]:
    """What Open MPI need not do for ranks of one machine: load the libraries of fast networks,
    which measure the processor's clock for 0.2 s; nor, for a process that no launcher started, run
    a daemon. Who has set any of it keeps that."""
    ours = dict[str, str]()
    if not any(name in os.environ for name in _SINGLETON):
        if not is_launched():
            ours = _SINGLETON
        elif os.environ.get("OMPI_COMM_WORLD_SIZE") == os.environ.get(
            "OMPI_COMM_WORLD_LOCAL_SIZE", ""
        ):
            ours = {"OMPI_MCA_pml": "ob1"}
    os.environ.update(ours)
    try:
        yield
    finally:
        for name in ours:
            del os.environ[name]  # an mpiexec that we start shall not see them
        if ours is _SINGLETON:
            _unset_what_mpi_set()


def _unset_what_mpi_set() -> None:
    """Take back the variables that Open MPI sets behind Python's back: programs that we start would
    take them for a launcher's, and start a daemon."""
    with contextlib.suppress(ValueError):  # no table of that name in the C library
        table = ctypes.POINTER(ctypes.c_char_p).in_dll(ctypes.CDLL(None), "environ")
        names = {
            entry.partition(b"=")[0]
            for entry in itertools.takewhile(bool, map(table.__getitem__, itertools.count()))
        }
        for name in names - os.environb.keys():
            os.unsetenv(name)


def load_mpi() -> ModuleType:
    """The module mpi4py.MPI, which starts MPI if that does not run."""
    if "mpi4py.MPI" not in sys.modules:
        cap_blas_threads()
        check_address_space()
        import mpi4py

        mpi4py.rc.thread_level = "funneled"  # as PETSc starts it
        with _local():
            from mpi4py import MPI
        reinstall()
    from mpi4py import MPI

    return MPI


def expect_failures(world: Comm) -> None:
    """Make the communicator on which failed ranks meet. Collective."""
    if world.Get_size() > 1 and not _failures:
        _failures.append(world.Dup())


def failure_comm() -> Comm:
    """mpi4py communicator of all ranks for use after a failure; None on one rank."""
    return _failures[0] if _failures else None


def petsc() -> ModuleType:
    """The petsc4py.PETSc module, initialised."""
    if "petsc4py.PETSc" not in sys.modules:
        initialise()
    return sys.modules["petsc4py.PETSc"]


@contextlib.contextmanager
def options(table: Mapping[str, str | int | float | bool]) -> Iterator[None]:
    """Options of a `[petsc]` table, in force inside the block only and never over the command line.

    The data base of PETSc is global: what one case of a sweep sets must not reach the next one.
    """
    if not table:
        yield
        return
    database = petsc().Options()
    earlier = database.getAll()  # hasName would count as a use
    inserted = [key for key in table if key not in earlier]
    for key in inserted:
        value = table[key]
        database.setValue(key, str(value).lower() if isinstance(value, bool) else str(value))
    try:
        yield
    finally:
        for key in inserted:
            _from_tables[key] = _from_tables.get(key, False) or _used(key)
            database.delValue(key)


def given_options() -> dict[str, str]:
    """All options in force by name; none counts as used."""
    return dict(petsc().Options().getAll())


def option(name: str) -> str | None:
    """The value of an option, which counts as used; None where it is not given."""
    database = petsc().Options()
    return str(database.getString(name)) if database.hasName(name) else None


def unused_options() -> list[str]:
    """Names of the PETSc options that no object has asked for: command line, options file,
    environment and tables."""
    given = {name: _used(name) for name in given_options()} | _from_tables
    return [
        f"-{name}"
        for name, used in given.items()
        if not used and not name.startswith(OF_THE_PROGRAM)
    ]


def _used(name: str) -> bool:
    """Whether an object has asked for an option."""
    # petsc4py before 3.20 has no such call
    answer = ctypes.c_int(0)
    petsc_library().PetscOptionsUsed(None, name.encode(), ctypes.byref(answer))
    return answer.value != 0


@functools.cache
def petsc_library() -> ctypes.CDLL:
    """Return the C library that petsc4py's module is linked to, for calls that petsc4py lacks."""
    return ctypes.CDLL(petsc().__file__)


def petsc_version() -> str:
    """Return the version of the PETSc that runs; empty where none does."""
    module = sys.modules.get("petsc4py.PETSc")
    return "" if module is None else ".".join(map(str, module.Sys.getVersion()))


@functools.cache
def reason_name(reason: int) -> str:
    """PETSc's own name of a KSP reason, for example ``DIVERGED_BREAKDOWN``."""
    table = petsc().KSP.ConvergedReason
    names = sorted(
        name
        for name in dir(table)
        if name.isupper() and getattr(table, name) == reason and reason != 0
    )
    # aliases: the longest name says the most (DIVERGED_ITS and DIVERGED_MAX_IT are the same number)
    preferred = [name for name in names if name.startswith(("CONVERGED", "DIVERGED"))]
    return (preferred or names or [f"reason {reason}"])[0]


@contextlib.contextmanager
def timed() -> Iterator[dict[str, float]]:
    """Wall seconds of the stages inside the block, by name; of nested blocks the innermost one
    notes a stage."""
    seconds: dict[str, float] = {}
    _clocks.append(seconds)
    try:
        yield seconds
    finally:
        _clocks.pop()


@contextlib.contextmanager
def stage(name: str) -> Iterator[None]:
    """A named stage of `-log_view`, timed by `timed`; a PETSc error inside becomes a `SolverError`
    that names it."""
    log, began = petsc().Log.Stage(name), time.perf_counter()
    log.push()
    try:
        yield
    except Exception as error:
        if not is_petsc_error(error):
            raise
        raise solver_error(name, error) from error
    finally:
        log.pop()
        if _clocks:
            _clocks[-1][name] = _clocks[-1].get(name, 0.0) + time.perf_counter() - began


def is_petsc_error(error: object) -> bool:
    """Whether PETSc raised an exception, asked without loading PETSc."""
    return type(error).__module__.startswith("petsc4py")


def solver_error(name: str, error: Any, prefix: str = "") -> SolverError:
    """What a PETSc error code means for the user of a solver, whose options have a prefix."""
    if isinstance(error.__cause__, SolverError):  # of a PC in Python; PETSc 3.18 passes it through
        return error.__cause__
    if error.ierr == 71:
        return SingularMatrixError(name, "PETSC_ERR_MAT_LU_ZRPVT")
    # PETSc 3.18 gives the number of a source line where its dense matrices find no memory
    if error.ierr == 55 or "PetscMalloc" in str(error):
        return SolverError(
            name,
            "out of memory (PETSC_ERR_MEM)",
            "use -bem_mat_type hodlr or a coarser mesh",
        )
    if error.ierr in (56, 86, 92):
        return SolverError(
            name,
            f"PETSc cannot do this combination of types (error {error.ierr}: {_last_line(error)})",
            f"choose another -{prefix}ksp_type or -{prefix}pc_type (-help lists them)",
        )
    return SolverError(
        name,
        f"PETSc error {error.ierr}: {_last_line(error)}",
        f"see -help and -{prefix}ksp_error_if_not_converged",
    )


def options_error(prefix: str, error: object) -> InputError:
    """A PETSc option with a value that its object refuses."""
    return InputError(
        f"PETSc options -{prefix}ksp_..., -{prefix}pc_...: {_last_line(error)} (-help lists what "
        "there is)"
    )


def _last_line(error: object) -> str:
    lines = [line.split("] ", 1)[-1] for line in str(error).splitlines() if line.strip()]
    return lines[-1].strip() if lines else "no message"
