"""Check this installation: versions, PETSc, MPI and its launcher, BLAS threads, HDF5, fonts, the
current folder."""

from __future__ import annotations

import argparse

from ..errors import InputError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """`petcontact doctor` has no options."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Print the findings; 0 if petcontact works here, 1 if something is broken."""
    from ..doctor.facts import gather, judge

    if petsc_words:
        raise InputError(f"{petsc_words[0]}: doctor takes no PETSc options")
    findings = list(judge(gather()))
    for finding in findings:
        mark = {"ok": "ok     ", "warning": "warning", "error": "ERROR  "}[finding.severity]
        print(f"{mark}  {finding.kind:<10}  {finding.text}")
        if finding.advice:
            print(f"{'':<21}-> {finding.advice}")
    return 1 if any(finding.severity == "error" for finding in findings) else 0
