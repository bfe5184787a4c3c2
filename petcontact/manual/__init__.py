"""The manual: Markdown, a chapter a file, and configs to start from; installed with the package.

A chapter is there as soon as its file is: BOOKS only says where it stands. Folders hold pages of a
chapter.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from importlib.resources import files
from importlib.resources.abc import Traversable

BOOKS = {
    "Tutorial": ("tutorial", "reading", "units", "cheatsheet", "installing", "gallery"),
    "How-to": (
        *("recipes", "choosing", "troubleshooting", "fields", "export", "sweeps", "axial"),
        *("loads", "wear", "fatigue", "corners", "extending"),
    ),
    "Reference": (
        *("config", "glossary", "contact", "space", "python", "methods", "options", "operators"),
    ),
    "Background": (
        *("background", "accuracy", "checks", "speed", "manynodes", "paper", "verification"),
        *("cases", "reliability", "changes"),
    ),
}
"""The four books, and their chapters in the order in which one would read them."""
SUFFIX = ".md"


def installed(name: str) -> str:
    """The text of a file of this folder."""
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def chapter(topic: str) -> str:
    """The text of a chapter, or of a page of one such as cases/b01_greco; Markdown."""
    return installed(f"{topic}{SUFFIX}")


def topics() -> dict[str, str]:
    """Chapters in the order of the books, others after them by name; with their titles."""
    found = sorted(_pages(files(__package__)))
    order = [name for chapters in BOOKS.values() for name in chapters if name in found]
    return {name: _title(name) for name in dict.fromkeys([*order, *found])}


def summary(topic: str) -> str:
    """The first sentence of a chapter, which says what is in it."""
    return chapter(topic).split("\n\n")[1].partition(". ")[0].rstrip(".\n")


def pages() -> dict[str, str]:
    """Chapters and the pages in folders beside them, FOLDER/NAME, with their titles."""
    found = dict(topics())
    for folder in files(__package__).iterdir():
        if folder.is_dir():
            found |= {
                f"{folder.name}/{name}": _title(f"{folder.name}/{name}")
                for name in sorted(_pages(folder))
            }
    return found


def vocabulary() -> list[str]:
    """Words and keys of five letters and more in the chapters, the most frequent first."""
    words = re.findall(r"\b[a-z_]{5,}\b", " ".join(map(chapter, topics())))
    return [word for word, _ in Counter(words).most_common()]


def places(words: str) -> dict[str, list[tuple[int, str]]]:
    """Lines of all pages that have these words, in any case, with their numbers; by page, that with
    most of them first.

    Where no line has a word that begins like them, those count that have them inside of one.

    Examples
    --------
    >>> number, line = places("von Mises stress")["fields"][0]
    """
    lines = {name: list(enumerate(chapter(name).splitlines(), 1)) for name in pages()}
    found: dict[str, list[tuple[int, str]]] = {}
    for pattern in (rf"(?<![^\W_]){re.escape(words)}", re.escape(words)):
        wanted = re.compile(pattern, re.IGNORECASE)
        found = {
            name: [(k, line.strip()) for k, line in each if wanted.search(line)]
            for name, each in lines.items()
        }
        if any(found.values()):
            break
    return dict(
        sorted(
            ((name, hits) for name, hits in found.items() if hits), key=lambda item: -len(item[1])
        )
    )


def _pages(folder: Traversable) -> Iterator[str]:
    return (
        path.name.removesuffix(SUFFIX) for path in folder.iterdir() if path.name.endswith(SUFFIX)
    )


def _title(name: str) -> str:
    return chapter(name).splitlines()[0].lstrip("# ")
