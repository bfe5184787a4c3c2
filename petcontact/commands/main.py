"""The command line: `petcontact COMMAND`; `--words` are ours, `-longer_words` are PETSc's."""

from __future__ import annotations

import argparse
import atexit
import contextlib
import gc
import importlib
import math
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import NoReturn, cast

from .. import __version__
from ..runtime.failures import guarded
from ..runtime.hints import nearest
from ..runtime.memory import check_address_space
from ..runtime.mpi import shared
from ..runtime.petsc import failure_comm, is_launched
from ..runtime.ranks import communicator
from ..runtime.rendezvous import begin
from ..runtime.threads import cap_blas_threads
from .options import real
from .parsers import COMMANDS, READING, Paragraphs, Parser

OF_ALL_RANKS = {"solve", "sweep", "compare"}
"""Commands that ranks share; of all others the first rank runs one."""
SHORT = {"-o", "-n", "-h"}


def split_arguments(arguments: Sequence[str]) -> tuple[list[str], list[str]]:
    """Our arguments, and PETSc's: `-longer_words` with the value that follows, if one does.

    As in PETSc a word after an option is its value unless it begins with a dash (negative numbers
    are values). A file name is never taken for a value of a flag such as -ksp_monitor: names that
    end in .toml or .h5 are ours.
    """
    ours: list[str] = []
    theirs: list[str] = []
    words = list(arguments)
    while words:
        word = words.pop(0)
        if word == "--":
            ours += words
            break
        if not (
            word.startswith("-")
            and not word.startswith("--")
            and len(word) > 2
            and word[1].isalpha()
        ) or (word[:2] in SHORT and word[2:3] == "="):
            ours.append(word)
            continue
        theirs.append(word)
        if words and _is_value(words[0], word):
            theirs.append(words.pop(0))
    return ours, theirs


def _is_value(word: str, option: str) -> bool:
    if word.startswith("-"):
        return not math.isnan(real(word))
    return option == "-options_file" or ":" in word or not word.endswith((".toml", ".h5"))


def build_parser() -> Parser:
    """The parser of all commands; their modules are imported only for the command that runs."""
    parser = Parser(
        prog="petcontact",
        allow_abbrev=False,
        description="Boundary elements for frictional contact of elastic bodies, on PETSc.",
        epilog="Options with one dash and a longer name are PETSc's (-ksp_type gmres, "
        "-ksp_monitor, -log_view); -help lists those of the objects that a command builds. Exit "
        "status: 0 converged, 2 bad input, 3 not converged, 1 anything else, 128 + its number for "
        "a signal.",
    )
    parser.add_argument("--version", action="version", version=f"petcontact {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=Parser)
    for name, summary in COMMANDS.items():
        commands.add_parser(name, help=summary, add_help=False)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; returns the exit status."""
    cap_blas_threads()
    return guarded(lambda: _command(sys.argv[1:] if arguments is None else arguments))


def _command(arguments: Sequence[str]) -> int:
    """Run a command on all ranks of a launcher, which have to be given the same words."""
    ranks = communicator(None) if is_launched() else None
    if ranks is None or ranks.Get_size() == 1:
        name, parsed, theirs = _parsed(arguments)
        return int(_module(name).run(parsed, theirs))
    begin(ranks, lambda: lambda: {"command line": shlex.join(arguments)})
    name, parsed, theirs = shared(ranks, lambda: _parsed(arguments))
    if name in OF_ALL_RANKS:
        return int(_module(name).run(parsed, theirs))
    return cast(int, shared(ranks, lambda: _module(name).run(parsed, theirs)))


def _parsed(arguments: Sequence[str]) -> tuple[str, argparse.Namespace, list[str]]:
    """Return the name of the command, its arguments, and PETSc's; end with a line where they are
    wrong."""
    ours, theirs = split_arguments(arguments)
    name = ours[0] if ours else ""
    if name not in COMMANDS:
        parser = build_parser()
        if not name:
            parser.print_help()
            sys.exit(2)
        if name.startswith("-"):
            parser.parse_all(ours)
        lacking = {".toml": "solve", ".h5": "show"}.get(Path(name).suffix)
        whole = f", did you mean `petcontact {lacking} {name}`?" if lacking else ""
        parser.error(f"unknown command {name!r}{whole or nearest(name, [*COMMANDS])}")
    if name in OF_ALL_RANKS:
        check_address_space()  # before NumPy, of which the same limit breaks the import anywhere
    command = parser_of(name)[1]
    for word in theirs:
        if f"-{word}" in command.options and word != "-help":
            command.error(f"{word}: one dash is PETSc's, did you mean -{word}?")
    return name, command.parse_all(ours[1:]), theirs


def _module(name: str) -> ModuleType:
    folder = "reading." if name in READING else ""
    return importlib.import_module(f".{folder}{name}", __package__)


def parser_of(name: str) -> tuple[ModuleType, Parser]:
    """Return the module of a command and its parser."""
    module = _module(name)
    command = Parser(
        prog=f"petcontact {name}",
        allow_abbrev=False,
        description=module.__doc__,
        formatter_class=Paragraphs,
    )
    module.add_arguments(command)
    return module, command


def entry() -> NoReturn:
    """The console script."""
    # start-up makes 1e5 objects that live as long as the process: to look for rubbish among them
    # costs more than all the rubbish weighs, and at the end most
    gc.set_threshold(200_000, 20, 20)
    os.environ.setdefault(
        "PYDANTIC_DISABLE_PLUGINS", "__all__"
    )  # it would read the metadata of every installed package
    status = main()
    alone = sys.modules.keys().isdisjoint(("petsc4py.PETSc", "mpi4py.MPI"))
    if (not status and alone) or (status > 128 and failure_comm() is None):
        # all is written: to take the objects of all modules apart takes longer than to give their
        # memory back, and threads of what a signal broke off may work on
        with contextlib.suppress(OSError):
            sys.stdout.flush()
        atexit._run_exitfuncs()
        os._exit(status)
    gc.freeze()
    sys.exit(status)
