"""Show a chapter of the manual, the list of chapters, or the places where words stand."""

from __future__ import annotations

import argparse
import difflib
import sys

from ..errors import InputError

WIDTH = 80
SHOWN = 6
"""Most places of one chapter that a search prints."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `petcontact help`."""
    parser.add_argument(
        "topic",
        nargs="*",
        help="a chapter; other words are searched for in all chapters. Without one the "
        "chapters are listed",
    )
    parser.add_argument(
        "--search", action="store_true", help="search for the words even if a chapter is called so"
    )


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Print; a chapter as Markdown where standard output is no terminal."""
    from ..manual import chapter, pages, topics

    words = " ".join(arguments.topic)
    if not words:
        print(
            "Chapters of the manual, each shown by `petcontact help CHAPTER`; `petcontact help "
            "WORD` searches them:\n"
        )
        for name, title in topics().items():
            print(f"  {name:<14}{title}")
        return 0
    if arguments.search or words not in pages():
        print(_found(words))
        return 0
    text = chapter(words)
    if not sys.stdout.isatty():
        print(text, end="")
        return 0
    from rich.console import Console
    from rich.markdown import Markdown

    Console().print(Markdown(text))
    return 0


def _found(words: str) -> str:
    """The places where words stand: chapter, number and text of the line, in WIDTH columns.

    Raises
    ------
    InputError
        If they stand nowhere.
    """
    from ..manual import places, topics

    found = places(words)
    if not found:
        near = difflib.get_close_matches(words, topics(), n=1)
        hint = f", did you mean {near[0]!r}?" if near else f"; chapters: {', '.join(topics())}"
        raise InputError(f"help: no chapter {words!r}, and no line of any with it{hint}")
    lines = []
    for name, each in found.items():
        lines.append(f"{name} ({len(each)} line{'s' if len(each) > 1 else ''})")
        lines += [
            f"{number:>6}  {_around(text, words, WIDTH - 8)}" for number, text in each[:SHOWN]
        ]
        lines += [f"        and {len(each) - SHOWN} more"] if len(each) > SHOWN else []
    return "\n".join([*lines, "", "A chapter is shown by `petcontact help CHAPTER`."])


def _around(text: str, words: str, width: int) -> str:
    """What of a line fits into a width, with the words in it."""
    if len(text) <= width:
        return text
    start = max(0, min(text.lower().find(words.lower()) - width // 3, len(text) - width))
    piece = text[start : start + width]
    return ("..." + piece[3:] if start else piece)[: width - 3] + (
        "..." if start + width < len(text) else piece[-3:]
    )
