"""Every exception a user of petcontact can meet, and the exit status each one has on the command
line."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

ONE_BODY = "body"
"""Name of the body of a file without [[body]], which messages do not name."""


def the_body(name: str) -> str:
    """A body in words.

    >>> the_body("upper"), the_body("body")
    ("body 'upper'", 'the body')
    """
    return "the body" if name == ONE_BODY else f"body {name!r}"


def in_body(name: str) -> str:
    """What stands before a key of a body.

    >>> in_body("upper"), in_body("body")
    ("body 'upper': ", '')
    """
    return "" if name == ONE_BODY else f"{the_body(name)}: "


class PetcontactError(Exception):
    """Base of all errors raised on purpose; `exit_status` is what the command line returns."""

    exit_status = 1


class InputError(PetcontactError, ValueError):
    """A config, argument or file that cannot be used: one line that names it and says what is
    allowed."""

    exit_status = 2


@contextlib.contextmanager
def in_file(path: object) -> Iterator[None]:
    """Mistakes found in the block name the file that holds them."""
    try:
        yield
    except InputError as error:
        if type(error) is not InputError or str(error).startswith((f"{path}:", "-")):
            raise
        raise InputError(f"{path}: {error}") from None


class ResultError(InputError):
    """A result file that is missing, truncated, of another program or of another format version."""


class OutputError(PetcontactError):
    """A file that cannot be written: the folder is read-only, the disk is full, another program was
    first."""


class SolverError(PetcontactError, ArithmeticError):
    """A solve that failed: names the stage, PETSc's reason, and what to try.

    Parameters
    ----------
    stage : str
        The stage that failed (assemble, factor, iterate, check).
    reason : str
        PETSc's own name of the reason (for example ``DIVERGED_ITS``), or the numerical defect.
    advice : str
        What a user can try.
    """

    def __init__(self, stage: str, reason: str, advice: str) -> None:
        super().__init__(f"{stage}: {reason}; {advice}")
        self.stage, self.reason, self.advice = stage, reason, advice


class SingularMatrixError(SolverError):
    """A zero pivot in LU."""

    def __init__(self, stage: str, row: str) -> None:
        super().__init__(
            stage, f"zero pivot in LU ({row})", "the matrix is singular: is the body fixed?"
        )


class NoEquilibrium(SolverError):
    """Loads that no admissible traction holds, found before a solve: not converged, as one that
    finds it out."""

    exit_status = 3

    def __str__(self) -> str:
        return f"{self.reason}; {self.advice}"


class RanksError(PetcontactError):
    """A solve over several ranks that ends because of another rank: it failed, did something else,
    or never began."""


class InaccurateOperator(SolverError):
    """Compressed operators that miss their tolerance."""


class MissingPetscError(PetcontactError, ImportError):
    """petsc4py is not installed, or cannot be loaded."""


class MissingKernelsError(PetcontactError, ImportError):
    """The compiled kernels are missing, or do not fit these C files or this processor.

    Parameters
    ----------
    reason : str
        Which file it is, and what is wrong with it.
    """

    def __init__(self, reason: str) -> None:
        super().__init__(
            f"compiled kernels: {reason}; scripts/setup or pip install builds them again"
        )


EXTRAS = {
    "cad": "gmsh",
    "notebook": "notebook ipython matplotlib-inline",
    "petsc": "petsc4py",
    "tables": "pandas polars",
}
"""Packages that petcontact does without, by the option of `scripts/setup` that installs them."""


def installed_by(extra: str) -> str:
    """Return the command that installs the packages of an extra, as it is typed in this folder.

    >>> "setup" in installed_by("cad") or installed_by("cad") == "pip install gmsh"
    True
    """
    setup = Path(__file__).resolve().parents[1] / "scripts" / "setup"
    if not setup.is_file():  # installed without the repository
        return f"pip install {EXTRAS[extra]}"
    here = setup.parents[1] == Path.cwd()
    option = "" if extra == "petsc" else f" --{extra}"
    return f"{'scripts/setup' if here else setup}{option}"


class MissingPackage(InputError, ImportError):
    """A package of an extra that is not installed.

    Parameters
    ----------
    what : str
        What needs it.
    package : str
        Its name.
    extra : str
        A key of `EXTRAS`.
    """

    def __init__(self, what: str, package: str, extra: str) -> None:
        super().__init__(f"{what} needs {package}, which is not installed: {installed_by(extra)}")
