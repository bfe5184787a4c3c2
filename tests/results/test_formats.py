"""Frozen files of formats 1 and 2: read as the version that wrote them described them, and written
in format 3."""

from __future__ import annotations

import re
from pathlib import Path

import h5py
import numpy as np
import pytest
from marks import some

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


@pytest.mark.parametrize("name", some(("format2_steps",), FROZEN))
def test_arrays_are_those_of_the_file_and_go_round_in_format_3(name, tmp_path):
    solution = read_result(DATA / f"{name}.h5")
    solution.save(tmp_path / "r.h5")
    with h5py.File(DATA / f"{name}.h5") as old, h5py.File(tmp_path / "r.h5") as new:
        assert new.attrs["format_version"] == 3 > old.attrs["format_version"]
        shared = [
            f"{group}/{key}" for group in ("boundary", "contact", "mesh") for key in old[group]
        ]
        assert len(shared) > 20
        for key in shared:
            stored = old[key][()]
            close = np.array_equal if stored.dtype.kind == "O" else np.allclose
            # where a format 1 file says u_t, ours computes it from u
            assert close(new[key][()], stored), key
        assert np.array_equal(new["history/rho"], old["history/rho"])
    again = read_result(tmp_path / "r.h5")
    assert again.verdict() == solution.verdict() and list(again.pairs) == list(solution.pairs)
