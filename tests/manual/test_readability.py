"""The chapters are read at once: bars of scripts/readability, by which they are written."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

from petcontact.manual import BOOKS

ROOT = Path(__file__).parents[2]
MANUAL = ROOT / "petcontact" / "manual"
SCRIPT = runpy.run_path(str(ROOT / "scripts" / "readability"))
BROKEN, SENTENCES, WORD = SCRIPT["broken"], SCRIPT["sentences"], SCRIPT["WORD"]
PAGES = [ROOT / "README.md", *sorted(MANUAL.rglob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_chapter_is_read_at_once(page):
    assert BROKEN(page.read_text()) == []


def test_the_books_of_users_are_short():
    """20 000 words at most in the three that are not evidence: of sentences, since the config
    reference is a table."""
    names = [name for book in ("Tutorial", "How-to", "Reference") for name in BOOKS[book]]
    texts = [(MANUAL / f"{name}.md").read_text() for name in names]
    words = [len(WORD.findall(each)) for text in texts for each in SENTENCES(text)]
    assert sum(words) <= 20_000
