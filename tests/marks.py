"""Members of a parametrised family that are slow: what others of the family imply, at a price."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def slow(*values: Any, id: str | None = None) -> Any:
    """One member, as `pytest.param`, which only ``scripts/test --slow`` runs."""
    return pytest.param(*values, marks=pytest.mark.slow, id=id)


def some(quick: Iterable[Any], of: Iterable[Any]) -> list[Any]:
    """All members, of which those that are not among the quick ones are slow."""
    return [value if value in quick else slow(value) for value in of]
