"""Show a chapter of the manual, the list of chapters, a key of configs, or the places where words
stand."""

from __future__ import annotations

import argparse
import difflib
import os
import re
import sys
import textwrap

from ..errors import InputError
from .options import option, options
from .parsers import COMMANDS

WIDTH = 80
SHOWN = 6
"""Most places of one chapter that a search prints."""
OTHER_WORDS = {
    **dict.fromkeys(("3d", "three-dimensional", "three dimensions"), "space"),
    **dict.fromkeys(("axisymmetric", "axial symmetry"), "axial"),
    **dict.fromkeys(("mpa", "preload"), "choosing"),
    **dict.fromkeys(("bolt", "2d", "two-dimensional", "plane strain"), "choosing"),
    **dict.fromkeys(("windows", "wsl", "crash", "failed", "wrong sign"), "troubleshooting"),
    **dict.fromkeys(("cheat sheet", "commands", "keys"), "cheatsheet"),
    **dict.fromkeys(("first result", "verdict", "result"), "reading"),
    **dict.fromkeys(("hertz", "first steps", "beginner", "example"), "tutorial"),
    **dict.fromkeys(("how accurate", "error", "convergence"), "accuracy"),
    **dict.fromkeys(("roughness", "symmetry", "step", "cad"), "recipes"),
    **dict.fromkeys(("signorini", "lagrange", "penalty", "theory", "equations"), "background"),
    **dict.fromkeys(("paraview", "csv", "excel", "spreadsheet"), "export"),
}
"""Words that people look for, and the chapter that treats what they mean."""


add_arguments = options(
    option(
        "topic",
        nargs="*",
        help="a chapter, or a key of configs; other words are searched for in all chapters. "
        "Without one the chapters are listed",
    ),
    option(
        "--search", action="store_true", help="search for the words even if a chapter is called so"
    ),
)
"""The options of `petcontact help`."""


def run(arguments: argparse.Namespace, petsc_words: list[str]) -> int:
    """Print; a chapter as Markdown where standard output is no terminal."""
    from ..manual import BOOKS, chapter, pages, summary, topics

    words = " ".join(arguments.topic)
    if not words:
        print(
            "Chapters of the manual. `petcontact help CHAPTER` shows one, `petcontact help\n"
            "WORD` searches all of them, and `petcontact help KEY` explains a key of configs:\n"
        )
        first = {chapters[0]: book for book, chapters in BOOKS.items()}
        for name in topics():
            if name in first:
                print(first[name])
            print(f"  {name:<16}{summary(name)}")
        return 0
    if arguments.search or words not in pages():
        print(_found(words))
    elif sys.stdout.isatty():
        _shown(chapter(words))
    else:
        print(chapter(words), end="")
    return 0


def _shown(text: str) -> None:
    """A chapter on a terminal, by its pager; code keeps its lines, so that it can be copied."""
    from rich.console import Console, ConsoleOptions, RenderResult
    from rich.markdown import CodeBlock, Markdown
    from rich.text import Text

    class Code(CodeBlock):
        def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
            yield Text(str(self.text).rstrip(), style="cyan", no_wrap=True, overflow="ignore")

    class Page(Markdown):
        elements = {**Markdown.elements, "fence": Code, "code_block": Code}  # noqa: RUF012

    os.environ.setdefault("LESS", "FRX")  # as Git: no pager for what fits; colours
    console = Console()
    with console.pager(styles=True):
        console.print(Page(text), crop=False)


def _keys(word: str) -> list[str]:
    """What the reference says of a key of configs, a paragraph for each table that has it.

    Examples
    --------
    >>> _keys("poisson_ratio")[0]
    '[material] poisson_ratio: number; required'
    """
    from ..manual import chapter

    lines, table = [], ""
    for line in chapter("config").splitlines():
        if line.startswith("## "):
            table = line.removeprefix("## ").strip("`")
        elif line.startswith(f"| `{word.rpartition('.')[2]}` |"):
            cells = [cell.replace("\\|", "|").strip() for cell in re.split(r"(?<!\\)\|", line)]
            _, _, takes, default, where, meaning, _ = cells
            default = default if default in ("", "required") else f"default {default}"
            said = filter(None, [takes, default, "" if where == "all" else f"in {where}"])
            lines.append(f"{table} {word}: {'; '.join(said)}".replace("`", ""))
            lines += textwrap.wrap(meaning, WIDTH, initial_indent="    ", subsequent_indent="    ")
    return lines


def _found(words: str) -> str:
    """The places where words stand: chapter, number and text of the line, in WIDTH columns.

    Raises
    ------
    InputError
        If they stand nowhere.
    """
    from ..manual import places, summary, topics, vocabulary
    from ..runtime.other_words import SAID, SYNONYMS

    chapters, keys = places(words), _keys(SYNONYMS.get(words, words))
    best = OTHER_WORDS.get(words.lower())
    of_command = f"`petcontact {words} --help` lists its options" if words in COMMANDS else ""
    said = SAID.get(words.lower(), of_command)
    if words in SYNONYMS and keys:  # places of short words are parts of others
        return "\n".join(keys)
    if not (chapters or keys or best or said):
        near = difflib.get_close_matches(words.lower(), [*topics(), *vocabulary()], n=1, cutoff=0.8)
        hint = f", did you mean {near[0]!r}?" if near else f"; chapters: {', '.join(topics())}"
        raise InputError(f"help: no chapter {words!r}, and no line of any with it{hint}")
    lines = [line for some in ([said], keys) if any(some) for line in (*some, "")]
    lines += [f"see `petcontact help {best}`: {summary(best)}", ""] if best else []
    for name, numbered in chapters.items():
        lines.append(f"{name} ({len(numbered)} line{'s' if len(numbered) > 1 else ''})")
        lines += [
            f"{number:>6}  {_around(text, words, WIDTH - 8)}" for number, text in numbered[:SHOWN]
        ]
        lines += [f"        and {len(numbered) - SHOWN} more"] * (len(numbered) > SHOWN)
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
