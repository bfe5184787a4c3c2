"""Frozen files of formats 1 and 2: read as the version that wrote them described them, and written
in format 3."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from petcontact.results.solution import read_result

DATA = Path(__file__).parents[1] / "data"
FROZEN = ("format1_plane", "format1_space", "format2_steps")


def without_cost(verdict):
    """And without the peaks of stress, which those versions did not have."""
    verdict = re.sub(r"  (largest .* stress:|stress has no bound).*\n( {6,}.*\n)*", "", verdict)
    return re.sub(r"  time \[s\].*", "", verdict, flags=re.DOTALL)


@pytest.mark.parametrize("name", FROZEN)
def test_verdicts_have_the_numbers_of_the_version_that_wrote_them(name):
    assert (
        without_cost(read_result(DATA / f"{name}.h5").verdict())
        == (DATA / f"{name}.txt").read_text()
    )
