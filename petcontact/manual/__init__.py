"""The manual: Markdown, a chapter a file, installed with the package and shown by `petcontact help`."""

from __future__ import annotations

from importlib.resources import files

ORDER = ("tutorial", "config", "contact", "space", "methods", "options", "sweeps", "fields", "python", "paper",
         "verification", "accuracy", "speed", "reliability", "extending", "changes")  # fmt: skip


def chapter(topic: str) -> str:
    """The text of a chapter, Markdown."""
    return files(__package__).joinpath(f"{topic}.md").read_text(encoding="utf-8")


def topics() -> dict[str, str]:
    """Chapters in the order in which one would read them, with their titles."""
    return {name: chapter(name).splitlines()[0].lstrip("# ") for name in ORDER}
