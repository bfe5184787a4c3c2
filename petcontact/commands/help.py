"""Show a chapter of the manual, or the list of chapters."""

from __future__ import annotations

import argparse
import difflib
import sys

from ..errors import InputError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `petcontact help`."""
    parser.add_argument("topic", nargs="?", help="chapter; without one their names are listed")


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Print; as Markdown where standard output is no terminal."""
    from ..manual import chapter, topics

    if arguments.topic is None:
        print("Chapters of the manual, each shown by `petcontact help TOPIC`:\n")
        for name, title in topics().items():
            print(f"  {name:<14}{title}")
        return 0
    if arguments.topic not in topics():
        near = difflib.get_close_matches(arguments.topic, topics(), n=1)
        hint = f", did you mean {near[0]!r}?" if near else f"; topics: {', '.join(topics())}"
        raise InputError(f"help: no chapter {arguments.topic!r}{hint}")
    text = chapter(arguments.topic)
    if not sys.stdout.isatty():
        print(text, end="")
        return 0
    from rich.console import Console
    from rich.markdown import Markdown

    Console().print(Markdown(text))
    return 0
