"""The manual: Markdown, a chapter a file, and configs to start from; installed with the package."""

from __future__ import annotations

from importlib.resources import files

ORDER = (
    "tutorial", "config", "contact", "loads", "wear", "space", "operators", "methods", "options", "sweeps", "fields",
    "export", "python", "paper", "verification", "accuracy", "speed", "reliability", "gallery", "glossary", "extending",
    "changes",
)  # fmt: skip


def installed(name: str) -> str:
    """The text of a file of this folder."""
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def chapter(topic: str) -> str:
    """The text of a chapter, Markdown."""
    return installed(f"{topic}.md")


def topics() -> dict[str, str]:
    """Chapters in the order in which one would read them, with their titles."""
    return {name: chapter(name).splitlines()[0].lstrip("# ") for name in ORDER}
