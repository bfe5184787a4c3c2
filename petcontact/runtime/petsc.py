"""The only place that initialises PETSc; the differences between PETSc releases live here too."""

from __future__ import annotations

import contextlib
import ctypes
import itertools
import os
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError, MissingPetscError, SolverError
from .signals import reinstall
from .threads import cap_blas_threads

if TYPE_CHECKING:
    from petsc4py import PETSc

_failures: list[Any] = []
"""A communicator of all ranks on which nothing else is sent, so that a failed rank can ask whether the others failed too."""
_clocks: list[dict[str, float]] = []
"""What `timed` blocks have noted so far, the innermost last."""
_from_tables: dict[str, bool] = {}
"""Options that `[petsc]` tables have set so far, and whether an object used them."""
_LAUNCHED = ("OMPI_COMM_WORLD_SIZE", "PMIX_RANK", "PMI_RANK", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_PROCID")
"""Variables of which a launcher of ranks sets one."""
_SINGLETON = {"OMPI_MCA_ess_singleton_isolated": "1", "OMPI_MCA_orte_create_session_dirs": "0", "OMPI_MCA_pml": "ob1"}
"""No daemon; no folder, which without a daemon would be one for all that start and end at that moment; no network."""
_PROGRAM_OPTIONS = ("options_", "help", "log_", "malloc", "info", "skip_petscrc", "no_signal_handler", "on_error_",
                    "start_in_debugger", "debugger", "fp_trap", "get_total_flops", "citations", "check_pointer_intensity",
                    "memory_view", "objects_dump", "version", "petsc_ci")  # fmt: skip
"""What PETSc reads itself, when it starts or ends."""


def initialise(argv: Sequence[str] = ()) -> None:
    """Start PETSc once, with the PETSc part of a command line.

    Parameters
    ----------
    argv : sequence of str
        PETSc options as on a command line (``["-ksp_type", "gmres"]``), without the program's name. Options given
        after PETSc has started are inserted into its data base.

    Raises
    ------
    MissingPetscError
        If petsc4py cannot be imported.
    InputError
        If an `-options_file` does not exist or includes itself, or a viewer's file cannot be written.
    """
    cap_blas_threads()
    arguments = _files_first(argv)
    started = "petsc4py.PETSc" in sys.modules
    try:
        import petsc4py

        if not started:
            # -options_left no: petcontact reports unused options itself, by name, before PETSc is gone
            quiet = [] if "-options_left" in arguments else ["-options_left", "no"]
            # a pipe that closes (`| head`) or a crash is Python's to report, not a banner of PETSc's and an MPI abort
            quiet += ["-no_signal_handler"]
            with _local():
                petsc4py.init(["petcontact", *quiet, *arguments])
            reinstall()
        from petsc4py import PETSc

        if not started and PETSc.COMM_WORLD.getSize() > 1:
            _failures.append(PETSc.COMM_WORLD.tompi4py().Dup())
    except ImportError as error:
        raise MissingPetscError(
            f"petsc4py cannot be loaded ({error}); install python3-petsc4py, or pip install 'petcontact[petsc]'"
        ) from error
    if started and arguments:
        PETSc.Options().insertString(" ".join(arguments))
    if arguments:
        _check_viewers()


@contextlib.contextmanager
def _local() -> Iterator[None]:
    """What Open MPI need not do for ranks of one machine: load the libraries of fast networks, which measure the processor's
    clock for 0.2 s; nor, for a process that no launcher started, run a daemon. Who has set any of it keeps that."""
    ours = dict[str, str]()
    if not any(name in os.environ for name in _SINGLETON):
        if not any(name in os.environ for name in _LAUNCHED):
            ours = _SINGLETON
        elif os.environ.get("OMPI_COMM_WORLD_SIZE") == os.environ.get("OMPI_COMM_WORLD_LOCAL_SIZE", ""):
            ours = {"OMPI_MCA_pml": "ob1"}
    os.environ.update(ours)
    try:
        yield
    finally:
        for name in ours:
            del os.environ[name]  # an mpiexec that we start shall not see them


def _files_first(argv: Sequence[str]) -> list[str]:
    """PETSc lets the last word win: with its files first, the command line has precedence over them in any order."""
    files: list[str] = []
    others: list[str] = []
    words = iter(argv)
    for word in words:
        if word == "-options_file":
            name = next(words, "")
            _check_options_file(name, ())
            files += [word, name]
        else:
            others.append(word)
    return files + others


def _check_options_file(name: str, within: tuple[str, ...]) -> None:
    """Refuse an options file that is not there or, directly or not, includes itself: PETSc would follow it for ever."""
    if not Path(name).is_file():
        raise InputError(f"-options_file {name}: no such file")
    real = os.path.realpath(name)
    if real in within:
        raise InputError(f"-options_file {name}: includes itself")
    try:
        lines = Path(name).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise InputError(f"-options_file {name}: cannot be read ({error.strerror})") from None
    for words in (line.partition("#")[0].split() for line in lines):
        for word, included in itertools.pairwise(words):
            if word == "-options_file":
                _check_options_file(included.strip("\"'"), (*within, real))


def _check_viewers() -> None:
    """Refuse viewers that write to a file in a folder that is not there: those of PETSc's own end fail unnoticed."""
    from petsc4py import PETSc

    database = PETSc.Options()
    for option, value in database.getAll().items():
        kind, colon, rest = (value or "").partition(":")
        file = Path(rest.partition(":")[0])
        if not (colon and kind in ("", "ascii", "binary", "hdf5") and file.name):
            continue
        if file.is_dir() or not os.access(file.parent, os.W_OK | os.X_OK):
            database.delValue(option)
            raise InputError(f"-{option} {value}: {file} cannot be written")


def failure_comm() -> Any:
    """mpi4py communicator of all ranks for use after a failure; None on one rank."""
    return _failures[0] if _failures else None


def petsc() -> Any:
    """The petsc4py.PETSc module, initialised."""
    if "petsc4py.PETSc" not in sys.modules:
        initialise()
    from petsc4py import PETSc

    return PETSc


@contextlib.contextmanager
def options(table: Mapping[str, str | int | float | bool]) -> Iterator[None]:
    """Options of a `[petsc]` table, in force inside the block only and never over the command line.

    The data base of PETSc is global: what one case of a sweep sets must not reach the next one.
    """
    database = petsc().Options()
    known = database.getAll()  # hasName would count as a use
    inserted = [key for key in table if key not in known]
    for key in inserted:
        value = table[key]
        database.setValue(key, str(value).lower() if isinstance(value, bool) else str(value))
    try:
        yield
    finally:
        for key in inserted:
            _from_tables[key] = _from_tables.get(key, False) or _used(key)
            database.delValue(key)


def unused_options() -> list[str]:
    """Names of the PETSc options that no object has asked for: command line, options file, environment and tables."""
    database = petsc().Options()
    given = {name: _used(name) for name in database.getAll()} | _from_tables
    return [f"-{name}" for name, used in given.items() if not used and not name.startswith(_PROGRAM_OPTIONS)]


def _used(name: str) -> bool:
    """Whether an object has asked for an option."""
    database = petsc().Options()
    if hasattr(database, "used"):
        return bool(database.used(name))
    # petsc4py before 3.20 has no such call; the symbol is in the PETSc library that its module is linked to
    answer = ctypes.c_int(0)
    ctypes.CDLL(petsc().__file__).PetscOptionsUsed(None, name.encode(), ctypes.byref(answer))
    return answer.value != 0


def has_scalapack() -> bool:
    """Whether this PETSc was built with ScaLAPACK (Debian's was, the wheel of PyPI was not)."""
    return bool(petsc().Sys.hasExternalPackage("scalapack"))


def reason_name(reason: int) -> str:
    """PETSc's own name of a KSP reason, for example ``DIVERGED_BREAKDOWN``."""
    table = petsc().KSP.ConvergedReason
    names = sorted(name for name in dir(table) if name.isupper() and getattr(table, name) == reason and reason != 0)
    # aliases: the longest name says the most (DIVERGED_ITS and DIVERGED_MAX_IT are the same number)
    preferred = [name for name in names if name.startswith(("CONVERGED", "DIVERGED"))]
    return (preferred or names or [f"reason {reason}"])[0]


@contextlib.contextmanager
def timed() -> Iterator[dict[str, float]]:
    """Wall seconds of the stages inside the block, by name; of nested blocks the innermost one notes a stage."""
    seconds: dict[str, float] = {}
    _clocks.append(seconds)
    try:
        yield seconds
    finally:
        _clocks.pop()


@contextlib.contextmanager
def stage(name: str) -> Iterator[None]:
    """A named stage of `-log_view`, timed by `timed`; a PETSc error inside becomes a `SolverError` that names it."""
    module = petsc()
    began = time.perf_counter()
    log = module.Log.Stage(name)
    log.push()
    try:
        yield
    except module.Error as error:
        raise solver_error(name, error) from error
    finally:
        log.pop()
        if _clocks:
            _clocks[-1][name] = _clocks[-1].get(name, 0.0) + time.perf_counter() - began


def solver_error(name: str, error: PETSc.Error) -> SolverError:
    """What a PETSc error code means for the user of a solver."""
    if error.ierr == 71:
        return SolverError(name, "zero pivot in LU (PETSC_ERR_MAT_LU_ZRPVT)", "the matrix is singular: is the body fixed?")
    # PETSc 3.18 gives the number of a source line where its dense matrices find no memory
    if error.ierr == 55 or "PetscMalloc" in str(error):
        return SolverError(name, "out of memory (PETSC_ERR_MEM)", "use -bem_mat_type hodlr, a coarser mesh or more ranks")
    if error.ierr in (56, 86, 92):
        return SolverError(
            name, f"PETSc cannot do this combination of types (error {error.ierr}: {_last_line(error)})",
            "choose another -ksp_type or -pc_type (-help lists them)",
        )
    return SolverError(name, f"PETSc error {error.ierr}: {_last_line(error)}", "see -help and -ksp_error_if_not_converged")


def options_error(prefix: str, error: PETSc.Error) -> InputError:
    """A PETSc option with a value that its object refuses."""
    return InputError(f"PETSc options -{prefix}ksp_..., -{prefix}pc_...: {_last_line(error)} (-help lists what there is)")


def _last_line(error: PETSc.Error) -> str:
    lines = [line.split("] ", 1)[-1] for line in str(error).splitlines() if line.strip()]
    return lines[-1].strip() if lines else "no message"
