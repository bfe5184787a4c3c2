"""The commands and their parsers."""

from __future__ import annotations

import argparse
import difflib
import re
from collections.abc import Sequence
from typing import NoReturn

from ..runtime.other_words import SYNONYMS

COMMANDS = {
    "init": "write a commented starter config",
    "mesh": "surfaces of a CAD file (STEP, IGES, BREP), and its mesh as a .msh file",
    "draw": "draw a problem before it is solved: parts, supports, loads, what may touch",
    "solve": "solve one problem, print a verdict, write the result and figures",
    "show": "print the verdict of a result file again, or its numbers as JSON",
    "sweep": "compute independent cases over MPI ranks, and go on where a sweep was stopped",
    "report": "tables of a sweep as Markdown, CSV or one HTML page, beside the published ones",
    "compare": "methods and rules side by side: tables and figures over a list of rho_0 and h",
    "plot": "draw the figures of a result file",
    "export": "tables of a result as CSV, or all increments as one .vtkhdf file for ParaView",
    "field": "displacement and stress inside the body: .vtu for ParaView, and a figure",
    "fatigue": "fatigue parameters over a cycle of load steps, on and below the surface: table "
    "and figure",
    "completion": "what lets a shell complete commands and options",
    "schema": "JSON Schema of config files, for editors",
    "help": "chapters of the manual",
    "doctor": "check versions, MPI, BLAS threads, HDF5 and fonts of this installation",
}
READING = {"export", "fatigue", "field", "plot", "show"}
"""Commands in the folder `reading`, which read a result file."""


class Paragraphs(argparse.HelpFormatter):
    """Paragraphs of prose as wide as the terminal; lines that are indented stay as they are."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        blocks = [
            block
            if re.search("^ ", block, re.MULTILINE)
            else super(Paragraphs, self)._fill_text(block, width, indent)
            for block in text.strip().split("\n\n")
        ]
        return "\n\n".join(blocks)


class Parser(argparse.ArgumentParser):
    """One-line errors, and the nearest valid option for an unknown one."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"petcontact: {message} (see {self.prog} --help)\n")

    @property
    def options(self) -> list[str]:
        """The names of the options, with their dashes."""
        return [*self._option_string_actions]

    def parse_all(self, arguments: Sequence[str]) -> argparse.Namespace:
        """Parse everything or end with exit status 2."""
        parsed, unknown = self.parse_known_args(arguments)
        if unknown:
            name = unknown[0].split("=")[0]
            near = difflib.get_close_matches(name, self.options, n=1, cutoff=0.7)
            self.error(
                f"unknown {'option' if name.startswith('-') else 'argument'} {name}"
                + (f", did you mean {near[0]}?" if near else self._elsewhere(name))
            )
        return parsed

    def _elsewhere(self, name: str) -> str:
        """Where it is said what some options of other programs say, or an option that is a key."""
        from ..model.case import whole_key

        if name in ("-n", "-np", "--np", "--ranks", "--cpus", "--cores", "--threads"):
            return f"; ranks come from MPI: mpiexec -n 2 {self.prog} ..."
        key = whole_key(SYNONYMS.get(word := name.strip("-").replace("-", "_"), word))
        settable = name.startswith("-") and "--set" in self.options and "." in key
        return f"; --set {key}=VALUE gives it" if settable else ""
